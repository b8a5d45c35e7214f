//! Which furniture comes into which room, and where it stands.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::room::Light;
use crate::training::colors::{self, weighted};
use crate::training::pieces::{fixtures, floor_things, lamps, tables, wall_things};
use crate::training::place::put;
use crate::training::plan::{Area, Filling, Plan, Use};
use crate::training::site::{Site, footprint};
use crate::training::wishes::wishes;

/// How full a room is and how its lamps shine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mood {
    /// 0 is bare, 1 is crammed.
    pub full: f32,
    /// Strength of lamps that are on.
    pub lamps: f32,
    pub tint: Vec3,
}

/// Furnishes one room; gives the lights of its lamps.
pub(crate) fn furnish(b: &mut Builder, plan: &Plan, index: usize, mood: Mood) -> Vec<Light> {
    let mut site = Site::new(plan, index);
    let mut lights = Vec::new();
    keep_ways_free(&mut site);
    leaves(b, &mut site);
    let area = site.space.floor_m2();
    let usage = site.space.usage;
    let bare = usage == Use::Bare;
    let wanted = if bare {
        2.0
    } else {
        4.0 + area * b.random.range(0.4, 0.9) * (0.4 + mood.full)
    };
    let limit = 0.28 + 0.32 * mood.full;
    let kinds = wishes(usage);
    // What makes the room what it is comes first.
    let first = kinds.first().map(|kind| kind.0);
    let mut had = Vec::new();
    for i in 0..(wanted as u32).min(34) {
        if site.covered() > limit {
            break;
        }
        let piece = if i == 0 {
            first
        } else {
            weighted(&mut b.random, kinds)
        };
        let piece = piece.filter(|piece| !(piece.comes_once() && had.contains(piece)));
        if let Some(piece) = piece {
            had.push(piece);
            colors::vary(b);
            put(b, &mut site, piece, mood, &mut lights);
        }
    }
    let hung =
        (site.walls.iter().map(|wall| wall.length).sum::<f32>() * 0.3 * (0.2 + mood.full)) as u32;
    for _ in 0..hung {
        let size = [b.random.range(0.3, 1.7), b.random.range(0.3, 1.0)];
        let middle = b.random.range(1.3, 1.8);
        if let Some(at) = site.on_wall(&mut b.random, size, middle) {
            wall_things::on_wall(b, &at, size);
        }
    }
    switches(b, &mut site);
    if b.random.chance(0.4) && !bare {
        let size = [b.random.range(0.8, 2.8), b.random.range(0.6, 2.0)];
        let turn = if b.random.chance(0.7) {
            0.0
        } else {
            b.random.range(-0.5, 0.5)
        };
        if let Some(at) = site.on_floor(&mut b.random, [0.4, 0.3], turn, 0.1) {
            fixtures::rug(b, &at, size);
        }
    }
    let strewn = (area * b.random.range(0.0, 0.7) * mood.full) as u32;
    for _ in 0..strewn {
        let turn = b.random.range(0.0, TAU);
        if let Some(at) = site.on_floor(&mut b.random, [0.45, 0.45], turn, 0.05) {
            floor_things::on_floor(b, &at);
        }
    }
    ceiling_lights(b, &site, mood, &mut lights);
    lights
}

/// Ways through passages stay open on both sides.
fn keep_ways_free(site: &mut Site) {
    for wall in site.walls.clone() {
        for (hole, filling) in &wall.holes {
            if *filling == Filling::Passage {
                let reach = 0.5 * hole.width.min(1.6);
                let way = footprint(&wall.place, [hole.x - reach, hole.x + reach], [-1.1, 0.0]);
                site.keep_free(way, 0.0);
            }
        }
    }
}

/// Open door leaves in narrow passages.
fn leaves(b: &mut Builder, site: &mut Site) {
    for wall in site.walls.clone() {
        for (hole, filling) in &wall.holes {
            let swings = *filling == Filling::Passage && hole.width < 1.0 && b.random.chance(0.25);
            if !swings {
                continue;
            }
            colors::vary(b);
            let look = b.wood();
            let side = b.random.pick(&[-1.0, 1.0]);
            let angle = b.random.range(1.5, 2.2);
            let hinge = wall
                .place
                .at(hole.x + side * 0.5 * hole.width, -0.03, 0.0)
                .turn(side * angle);
            let leaf = hinge.at(-side * 0.5 * hole.width, 0.0, 0.5 * hole.height);
            b.block(&leaf, [hole.width, 0.04, hole.height - 0.01], 0.002, look);
            let steel = tables::metal(b);
            for y in [-0.05, 0.05] {
                let grip = leaf.at(-side * 0.42 * hole.width, y, -0.02);
                b.block(&grip, [0.12, 0.018, 0.022], 0.006, steel);
            }
            let far = hinge.point([-side * hole.width, 0.0, 0.0]).truncate();
            let near = hinge.origin.truncate();
            site.take(Area::around([far, near]).grown(0.06));
        }
    }
}

/// Switches and sockets.
fn switches(b: &mut Builder, site: &mut Site) {
    let white = crate::texture::Look::plain(colors::oklch(0.94, 0.006, 0.2)).gloss(0.3);
    for _ in 0..b.random.below(5) {
        let height = b.random.pick(&[0.3, 0.3, 1.1]);
        if let Some(at) = site.on_wall(&mut b.random, [0.1, 0.1], height) {
            b.block(&at.at(0.0, -0.005, 0.0), [0.08, 0.01, 0.08], 0.002, white);
            b.block(&at.at(0.0, -0.011, 0.0), [0.05, 0.004, 0.05], 0.001, white);
        }
    }
}

fn ceiling_lights(b: &mut Builder, site: &Site, mood: Mood, lights: &mut Vec<Light>) {
    let on = if b.random.chance(0.85) {
        mood.lamps
    } else {
        0.0
    };
    for area in &site.space.areas {
        let size = area.size();
        let count = if size.x * size.y > 16.0 { 2 } else { 1 };
        for i in 0..count {
            let mut p = 0.5 * (area.low + area.high);
            let axis = if size.x > size.y { 0 } else { 1 };
            p[axis] += size[axis] * ((i as f32 + 0.5) / count as f32 - 0.5);
            let turn = b.random.below(2);
            let at = Place {
                origin: p.extend(site.space.height),
                axes: glam::Mat3::IDENTITY,
            }
            .quarter(turn);
            let light = lamps::ceiling_lamp(b, &at, on, mood.tint);
            if on > 0.0 {
                lights.push(light);
            }
        }
    }
}
