//! Walls, floors, ceilings, and what fills the holes in the walls.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::room::Light;
use crate::shell::{Opening, casing, curtains, door, radiator};
use crate::texture::{Look, Pattern};
use crate::training::colors::{self, oklch};
use crate::training::plan::{Filling, HALF_WALL_M, Plan, Space, Use, Wall};

const SLAB_M: f32 = 0.12;

/// How light it is outside: 0 at night to 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Daylight {
    pub level: f32,
    /// Linear RGB of the light that comes in, around 1.
    pub tint: Vec3,
}

/// Builds the shell of all rooms; gives the lights of the windows.
pub(crate) fn build(b: &mut Builder, plan: &Plan, day: Daylight) -> Vec<Light> {
    let mut lights = Vec::new();
    for (index, space) in plan.spaces.iter().enumerate() {
        let wet = matches!(space.usage, Use::Kitchen | Use::Bath);
        slabs(b, space, wet);
        let usual = colors::wall(&mut b.random, wet);
        let accent = colors::wall(&mut b.random, wet);
        let skirting = Skirting::pick(b);
        for wall in plan.walls.iter().filter(|wall| wall.space == index) {
            let look = if b.random.chance(0.8) { usual } else { accent };
            raise(b, wall, look);
            skirting.lay(b, wall);
            for &(hole, filling) in &wall.holes {
                match filling {
                    Filling::Window => lights.push(glaze(b, wall, hole, day)),
                    Filling::Door => door(b, &wall.place, hole),
                    Filling::Passage if hole.width < 1.0 && b.random.chance(0.7) => {
                        let look = Look::plain(oklch(0.93, 0.01, 0.2)).gloss(0.2);
                        casing(b, &wall.place, hole, look);
                    }
                    Filling::Passage => {}
                }
            }
        }
        beams(b, space);
    }
    lights
}

fn slabs(b: &mut Builder, space: &Space, wet: bool) {
    let bounds = space.bounds();
    let middle = (0.5 * (bounds.low + bounds.high)).extend(0.0);
    let at = Place {
        origin: middle,
        axes: glam::Mat3::IDENTITY,
    };
    let turned = b.random.below(2);
    let at = at.quarter(turned);
    let size = bounds.size() + 2.0 * HALF_WALL_M;
    let size = if turned == 1 {
        glam::Vec2::new(size.y, size.x)
    } else {
        size
    };
    let floor = colors::floor(&mut b.random, wet);
    b.block(
        &at.at(0.0, 0.0, -0.5 * SLAB_M),
        [size.x, size.y, SLAB_M],
        0.0,
        floor,
    );
    let ceiling = colors::ceiling(&mut b.random);
    let up = at.at(0.0, 0.0, space.height + 0.5 * SLAB_M);
    b.block(&up, [size.x, size.y, SLAB_M], 0.0, ceiling);
}

/// The wall in upright strips between holes, all with one pattern.
fn raise(b: &mut Builder, wall: &Wall, look: Look) {
    let look = look.seed((b.random.bits() >> 8).max(1));
    let ends = [0, 1].map(|i| 0.5 * wall.length + if wall.convex[i] { HALF_WALL_M } else { 0.0 });
    let mut part = |x0: f32, x1: f32, z0: f32, z1: f32| {
        if x1 - x0 > 1e-4 && z1 - z0 > 1e-4 {
            let middle = Vec3::new(0.5 * (x0 + x1), 0.5 * HALF_WALL_M, 0.5 * (z0 + z1));
            let place = wall.place.at(middle.x, middle.y, middle.z);
            b.block(
                &place,
                [x1 - x0, HALF_WALL_M, z1 - z0],
                0.0,
                look.shift(middle),
            );
        }
    };
    let mut holes: Vec<_> = wall.holes.iter().map(|hole| hole.0).collect();
    holes.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut from = -ends[0];
    for hole in holes {
        let (left, right) = (hole.x - 0.5 * hole.width, hole.x + 0.5 * hole.width);
        part(from, left, 0.0, wall.height);
        part(left, right, 0.0, hole.sill);
        part(left, right, hole.sill + hole.height, wall.height);
        from = right;
    }
    part(from, ends[1], 0.0, wall.height);
}

struct Skirting {
    height: f32,
    look: Look,
}

impl Skirting {
    fn pick(b: &mut Builder) -> Self {
        let look = match b.random.below(4) {
            0 => b.wood(),
            1 => Look::plain(colors::tone(&mut b.random)),
            _ => Look::plain(oklch(0.94, 0.008, 0.2)).gloss(0.15),
        };
        let height = if b.random.chance(0.2) {
            0.0
        } else {
            b.random.range(0.04, 0.14)
        };
        Self { height, look }
    }

    fn lay(&self, b: &mut Builder, wall: &Wall) {
        if self.height == 0.0 {
            return;
        }
        let mut gaps: Vec<_> = wall
            .holes
            .iter()
            .filter(|hole| hole.0.sill < self.height)
            .map(|hole| {
                (
                    hole.0.x - 0.5 * hole.0.width - 0.07,
                    hole.0.x + 0.5 * hole.0.width + 0.07,
                )
            })
            .collect();
        gaps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut from = -0.5 * wall.length;
        gaps.push((0.5 * wall.length, 0.0));
        for (left, right) in gaps {
            if left - from > 0.02 {
                let place = wall
                    .place
                    .at(0.5 * (from + left), -0.006, 0.5 * self.height);
                b.block(&place, [left - from, 0.012, self.height], 0.0, self.look);
            }
            from = right;
        }
    }
}

/// Pane, frame, sill and what hangs before a window; gives its light.
fn glaze(b: &mut Builder, wall: &Wall, hole: Opening, day: Daylight) -> Light {
    let frame = match b.random.below(4) {
        0 => b.wood(),
        1 => Look::plain(oklch(b.random.range(0.2, 0.4), 0.01, 0.6)).gloss(0.3),
        _ => Look::plain(oklch(0.95, 0.005, 0.2)).gloss(0.2),
    };
    let at = &wall.place;
    if b.random.chance(0.5) {
        casing(b, at, hole, frame);
    }
    let middle = at.at(hole.x, 0.0, hole.sill + 0.5 * hole.height);
    let (w, h) = (hole.width, hole.height);
    // Outside it is much brighter than in the room by day, and black at night.
    let glow = (day.level * b.random.range(1.5, 14.0)).max(0.015);
    let view = match b.random.below(4) {
        _ if day.level < 0.08 => Pattern::Blank,
        0 => Pattern::Photo,
        1 => Pattern::Blank,
        _ => Pattern::Outside,
    };
    let garden = Look::new(view, [day.tint; 3]).glow(glow).gloss(0.5);
    b.block(
        &middle.at(0.0, HALF_WALL_M + 0.02, 0.0),
        [w, 0.06, h],
        0.0,
        garden,
    );
    let bar = b.random.range(0.03, 0.07);
    for side in [-1.0, 1.0] {
        let upright = middle.at(side * 0.5 * (w - bar), HALF_WALL_M - 0.02, 0.0);
        b.block(&upright, [bar, 0.06, h], 0.004, frame);
        let level = middle.at(0.0, HALF_WALL_M - 0.02, side * 0.5 * (h - bar));
        b.block(&level, [w, 0.06, bar], 0.004, frame);
    }
    let panes = [1 + (w / 0.9) as u32, 1 + b.random.below(3)];
    for i in 1..panes[0] {
        let x = w * (i as f32 / panes[0] as f32 - 0.5);
        b.block(
            &middle.at(x, HALF_WALL_M - 0.02, 0.0),
            [0.06, 0.05, h],
            0.004,
            frame,
        );
    }
    for i in 1..panes[1] {
        let z = h * (i as f32 / panes[1] as f32 - 0.5);
        b.block(
            &middle.at(0.0, HALF_WALL_M - 0.015, z),
            [w, 0.03, 0.03],
            0.004,
            frame,
        );
    }
    if hole.sill > 0.3 {
        let depth = HALF_WALL_M + b.random.range(0.02, 0.12);
        let sill = at.at(hole.x, HALF_WALL_M - 0.5 * depth, hole.sill - 0.015);
        b.block(&sill, [w + 0.02, depth, 0.03], 0.008, frame);
    }
    if hole.sill > 0.6 && b.random.chance(0.6) {
        radiator(b, &at.at(hole.x, -0.09, 0.12), 0.7 * w, hole.sill - 0.25);
    }
    let reach = 0.5 * wall.length - hole.x.abs() - 0.5 * w;
    let fits = hole.sill + h + 0.2 < wall.height && reach > 0.5;
    let mut open = 1.0;
    match b.random.below(4) {
        0 | 1 if fits => {
            crate::training::colors::vary(b);
            curtains(b, at, hole);
        }
        2 => open = blinds(b, &middle, w, h),
        _ => {}
    }
    Light {
        center: middle.point([0.0, -0.03, 0.0]),
        spread: [at.axes.x_axis * 0.42 * w, at.axes.z_axis * 0.42 * h],
        facing: -at.axes.y_axis,
        power: day.tint * (3.2 * w * h * day.level * open),
    }
}

/// Slats before the pane; gives the share of light that they let in.
fn blinds(b: &mut Builder, middle: &Place, w: f32, h: f32) -> f32 {
    let drop = h * b.random.range(0.25, 1.0);
    let tilt = b.random.range(-1.1, 1.1);
    let look = Look::plain(oklch(
        b.random.range(0.75, 0.95),
        b.random.range(0.0, 0.04),
        0.2,
    ));
    let step = 0.055;
    for i in 0..(drop / step) as u32 {
        let slat = middle.at(0.0, 0.035, 0.5 * h - 0.03 - step * i as f32);
        b.block(&slat.lean(tilt), [w - 0.02, 0.045, 0.003], 0.0, look);
        if let Some(last) = b.solids.last_mut() {
            last.casts_shadow = false;
        }
    }
    1.0 - 0.5 * drop / h
}

/// Beams under some ceilings.
fn beams(b: &mut Builder, space: &Space) {
    if !b.random.chance(0.1) {
        return;
    }
    let look = b.wood();
    let bounds = space.bounds();
    let size = bounds.size();
    let middle = (0.5 * (bounds.low + bounds.high)).extend(space.height);
    let count = (size.y / 0.9) as u32;
    let thick = b.random.range(0.08, 0.16);
    for i in 1..=count {
        let y = size.y * (i as f32 / (count + 1) as f32 - 0.5);
        let at = Place {
            origin: middle,
            axes: glam::Mat3::IDENTITY,
        }
        .at(0.0, y, -0.5 * thick);
        b.block(&at, [size.x, 0.8 * thick, thick], 0.006, look);
    }
}
