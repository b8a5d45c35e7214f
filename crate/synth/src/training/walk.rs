//! The way of someone who scans by hand: from spot to spot, looking at what has not been seen, sometimes sideways,
//! sometimes ahead, sometimes back.

use std::collections::HashSet;
use std::f32::consts::TAU;

use glam::{IVec3, Mat3, Vec2, Vec3};
use scan::Camera;

use crate::path::View;
use crate::random::{Random, noise};
use crate::training::plan::HALF_WALL_M;
use crate::training::room::TrainingRoom;

/// Nothing comes closer to the camera than this.
pub(crate) const CLEAR_M: f32 = 0.3;
const SEEN_CELL_M: f32 = 0.3;
/// So near to a goal is there.
const THERE_M: f32 = 0.01;
/// Share of a picture that the next one shows as well.
const ENOUGH_AGAIN: f32 = 0.68;
/// Rays of a quick look, across and down.
const GRID: [usize; 2] = [12, 9];

/// A walk of `frames` views, or nothing if the rooms are too cramped for one.
pub(crate) fn walk(
    room: &TrainingRoom,
    r: &mut Random,
    frames: usize,
    camera: Camera,
) -> Option<Vec<View>> {
    let mut walker = Walker::start(room, r, camera)?;
    let mut views = Vec::with_capacity(frames);
    let stride = 0.03 * libm::powf(8.0, r.unit());
    let shake = r.range(0.002, 0.02);
    let sway = r.bits();
    let across = libm::atanf((0.5 * f64::from(camera.width) / camera.fx) as f32);
    let turn_limit = r.range(0.05, 0.2).min(0.4 * across);
    while views.len() < frames {
        walker.choose_way(r);
        walker.choose_look(r);
        let step = (stride * r.range(0.5, 1.6)).min(0.3);
        // Nobody walks on for ever without a new idea.
        let way = (walker.goal - walker.at).clamp_length_max(14.0 * step);
        walker.goal = walker.at + way;
        // Who walks fast turns slowly.
        let limit = turn_limit * (1.0 - 2.0 * step);
        let length = way.length().max(1e-3);
        let ahead = way / length;
        let mut left = length;
        for i in 1.. {
            if views.len() == frames || i > 1 && left < THERE_M {
                break;
            }
            let view = walker.advance(ahead, step.min(left), limit, |walker| {
                walker.view(views.len() as f32, shake, sway)
            });
            left = (walker.goal - walker.at).dot(ahead);
            walker.remember(&view);
            views.push(view);
            if i % 5 == 0 && walker.is_looking_there() {
                walker.choose_look(r);
            }
        }
        // Where no way was found at least the eyes move on.
        walker.stuck = if length < 0.02 { walker.stuck + 1 } else { 0 };
        if walker.stuck > 6 {
            return None;
        }
    }
    Some(views)
}

struct Walker<'a> {
    room: &'a TrainingRoom,
    camera: Camera,
    at: Vec3,
    goal: Vec3,
    /// Unit vector ahead.
    ahead: Vec3,
    /// What is looked at.
    mark: Vec3,
    spin: f32,
    stuck: usize,
    seen: HashSet<IVec3>,
    /// Some of what the last picture shows.
    last: Vec<Vec3>,
}

impl<'a> Walker<'a> {
    fn start(room: &'a TrainingRoom, r: &mut Random, camera: Camera) -> Option<Self> {
        let at = (0..200)
            .map(|_| somewhere(room, r))
            .find(|p| is_clear(room, *p))?;
        let (sin, cos) = libm::sincosf(r.range(0.0, TAU));
        let ahead = Vec3::new(cos, sin, -0.3).normalize();
        let mut walker = Self {
            room,
            camera,
            at,
            goal: at,
            ahead,
            mark: at + ahead,
            spin: 0.0,
            stuck: 0,
            seen: HashSet::new(),
            last: Vec::new(),
        };
        walker.choose_look(r);
        walker.ahead = (walker.mark - at).normalize_or(ahead);
        Some(walker)
    }

    /// A goal that can be reached in a straight line.
    fn choose_way(&mut self, r: &mut Random) {
        self.goal = self.at;
        for _ in 0..40 {
            let gates = &self.room.plan.gates;
            let wanted = match r.below(10) {
                0..=5 => {
                    let (sin, cos) = libm::sincosf(r.range(0.0, TAU));
                    let height = (self.at.z + r.range(-0.35, 0.35)).clamp(1.0, 1.95);
                    (self.at.truncate() + Vec2::new(cos, sin) * r.range(0.25, 2.2)).extend(height)
                }
                6 | 7 if !gates.is_empty() => {
                    let (middle, through) = r.pick(gates);
                    let beside = middle + through * r.pick(&[-0.9, 0.0, 0.9]);
                    beside.extend(r.range(1.2, 1.6))
                }
                _ => somewhere(self.room, r),
            };
            if self.is_way_clear(wanted) {
                self.goal = wanted;
                return;
            }
        }
    }

    fn is_way_clear(&self, to: Vec3) -> bool {
        let inside = self.room.is_inside(to) || {
            let near = |gate: &(Vec2, Vec2)| (gate.0 - to.truncate()).length() < HALF_WALL_M;
            self.room.plan.gates.iter().any(near)
        };
        let way = to - self.at;
        let steps = (way.length() / 0.08).ceil().max(1.0);
        inside
            && (1..=steps as usize)
                .all(|i| self.room.distance(self.at + way * (i as f32 / steps)) > CLEAR_M + 0.02)
    }

    /// Something to look at: of a few directions the one that shows most that is new.
    fn choose_look(&mut self, r: &mut Random) {
        let mut best = (-1.0, self.mark);
        for _ in 0..10 {
            let (sin, cos) = libm::sincosf(r.range(0.0, TAU));
            let tilt = -0.22 + 0.42 * (r.unit() + r.unit() + r.unit() - 1.5);
            let (dive, level) = libm::sincosf(tilt.clamp(-1.15, 0.55));
            let dir = Vec3::new(cos * level, sin * level, dive);
            let Some(hit) = self.room.scene.cast(self.goal, dir, 9.0) else {
                continue;
            };
            let mark = self.goal + dir * hit.t;
            let look = (mark - self.at).normalize_or(dir);
            let score = self.worth(look) * r.range(0.6, 1.0);
            if score > best.0 {
                best = (score, mark);
            }
        }
        self.mark = best.1;
    }

    /// How much a view is worth: cells not seen yet, less where all is near or of one even colour.
    fn worth(&self, ahead: Vec3) -> f32 {
        let view = self.look_along(self.goal, ahead, 0.0);
        let mut fresh = 0.0;
        let mut near = 0.0;
        let mut counts: Vec<(u32, f32)> = Vec::new();
        let share = 1.0 / (GRID[0] * GRID[1]) as f32;
        for (at, solid, depth) in quick_look(self.room, &view) {
            if !self.seen.contains(&cell(at)) {
                fresh += share;
            }
            if depth < 0.6 {
                near += share;
            }
            match counts.iter_mut().find(|count| count.0 == solid) {
                Some(count) => count.1 += share,
                None => counts.push((solid, share)),
            }
        }
        let even = counts.iter().map(|count| count.1).fold(0.0, f32::max);
        0.3 + fresh + 0.06 * counts.len().min(12) as f32 - 0.8 * near - 2.0 * (even - 0.5).max(0.0)
    }

    /// Walks `step` metres and turns, less of both where the picture would show too little of the last one.
    fn advance(&mut self, way: Vec3, step: f32, limit: f32, view: impl Fn(&Self) -> View) -> View {
        let (at, ahead, spin) = (self.at, self.ahead, self.spin);
        let mut share = 1.0;
        loop {
            (self.at, self.ahead, self.spin) = (at + way * (step * share), ahead, spin);
            self.turn(limit * share);
            let next = view(self);
            if share < 0.2 || self.shown_again(&next) > ENOUGH_AGAIN {
                return next;
            }
            share *= 0.6;
        }
    }

    /// Share of the last picture that `view` shows as well.
    fn shown_again(&self, view: &View) -> f32 {
        let [width, height] = [view.camera.width, view.camera.height].map(f64::from);
        let shown = |p: &&Vec3| {
            let way = **p - view.position_m;
            let local = view.rotation.transpose() * way;
            let inside = view.camera.project(local.as_dvec3()).is_some_and(|pixel| {
                pixel.min_element() >= 0.0 && pixel.x < width && pixel.y < height
            });
            let away = way.length();
            let free = || {
                let before = self
                    .room
                    .scene
                    .cast(view.position_m, way / away, 0.97 * away);
                before.is_none()
            };
            inside && free()
        };
        match self.last.len() {
            0 => 1.0,
            count => self.last.iter().filter(shown).count() as f32 / count as f32,
        }
    }

    /// Turns towards the mark by at most `limit` radians, getting faster and slower smoothly.
    fn turn(&mut self, limit: f32) {
        let wanted = (self.mark - self.at).normalize_or(self.ahead);
        let angle = self.ahead.angle_between(wanted);
        let speed = (0.45 * angle).min(limit).min(self.spin + 0.4 * limit);
        self.spin = speed;
        if angle > 1e-3 {
            let side = (wanted - self.ahead * wanted.dot(self.ahead)).normalize_or(Vec3::Z);
            let (sin, cos) = libm::sincosf(speed.min(angle));
            self.ahead = (self.ahead * cos + side * sin).normalize();
        }
        // Nobody looks straight down or up.
        self.ahead.z = self.ahead.z.clamp(-0.93, 0.7);
        self.ahead = self.ahead.normalize();
    }

    fn is_looking_there(&self) -> bool {
        let wanted = (self.mark - self.at).normalize_or(self.ahead);
        self.ahead.dot(wanted) > 0.995
    }

    fn view(&self, time: f32, shake: f32, seed: u32) -> View {
        let wave = |speed: f32, k: u32| {
            2.0 * noise(Vec3::new(time * speed, 0.5, 0.5), seed.wrapping_add(k)) - 1.0
        };
        let drift = Vec3::new(wave(0.4, 1), wave(0.4, 2), wave(0.4, 3)) * shake;
        let tremble = Vec3::new(wave(0.9, 4), wave(0.9, 5), wave(0.9, 6)) * (2.0 * shake);
        let ahead = (self.ahead + tremble).normalize();
        let at = self.at + drift.clamp_length_max(0.018);
        self.look_along(at, ahead, 0.09 * wave(0.15, 7))
    }

    fn look_along(&self, at: Vec3, ahead: Vec3, roll: f32) -> View {
        let right = ahead.cross(Vec3::Z).normalize_or(Vec3::X);
        let (sin, cos) = libm::sincosf(roll);
        let right = (right * cos + right.cross(ahead) * sin).normalize();
        View {
            camera: self.camera,
            rotation: Mat3::from_cols(right, ahead.cross(right), ahead),
            position_m: at,
        }
    }

    fn remember(&mut self, view: &View) {
        self.last = quick_look(self.room, view).map(|look| look.0).collect();
        self.seen.extend(self.last.iter().map(|at| cell(*at)));
    }
}

fn cell(at: Vec3) -> IVec3 {
    (at / SEEN_CELL_M).floor().as_ivec3()
}

/// What a coarse grid of rays meets: place, solid and depth.
fn quick_look(room: &TrainingRoom, view: &View) -> impl Iterator<Item = (Vec3, u32, f32)> {
    let [across, down] = GRID;
    (0..across * down).filter_map(move |i| {
        let u = ((i % across) as f32 + 0.5) / across as f32 * view.camera.width as f32 - 0.5;
        let v = ((i / across) as f32 + 0.5) / down as f32 * view.camera.height as f32 - 0.5;
        let ray = view.ray(u, v);
        let length = ray.length();
        let hit = room.scene.cast(view.position_m, ray / length, 100.0)?;
        Some((
            view.position_m + ray * (hit.t / length),
            hit.solid,
            hit.t / length,
        ))
    })
}

/// A random place in a room at the height of a hand or an eye.
fn somewhere(room: &TrainingRoom, r: &mut Random) -> Vec3 {
    let spaces = &room.plan.spaces;
    let space = &spaces[r.below(spaces.len() as u32) as usize];
    let area = r.pick(&space.areas);
    let p = area.low + area.size() * Vec2::new(r.unit(), r.unit());
    p.extend(r.range(1.05, 1.85).min(space.height - CLEAR_M - 0.1))
}

fn is_clear(room: &TrainingRoom, p: Vec3) -> bool {
    room.is_inside(p) && room.distance(p) > CLEAR_M + 0.1
}
