//! The walls around rooms, and the openings between them.

use glam::{Mat3, Vec2, Vec3};

use crate::builder::Place;
use crate::shell::Opening;
use crate::training::plan::{Filling, HALF_WALL_M, Space, Wall};

/// An opening between two rooms.
pub(crate) struct Joint {
    pub spaces: [usize; 2],
    pub middle: Vec2,
    /// From the first room to the second.
    pub through: Vec2,
    pub width: f32,
    pub height: f32,
}

impl Joint {
    /// Cuts the opening into a wall that it runs through.
    pub fn cut(&self, wall: &mut Wall, top: f32) {
        if !self.spaces.contains(&wall.space) {
            return;
        }
        let local = wall.place.axes.transpose() * (self.middle.extend(0.0) - wall.place.origin);
        let along = wall.place.axes.y_axis.truncate().dot(self.through).abs() > 0.9;
        let fits = local.x.abs() + 0.5 * self.width < 0.5 * wall.length + 0.01;
        if along && fits && (local.y - HALF_WALL_M).abs() < 0.02 {
            let (x, height) = (local.x, self.height.min(top));
            let opening = Opening {
                x,
                width: self.width,
                sill: 0.0,
                height,
            };
            wall.holes.push((opening, Filling::Passage));
        }
    }
}

/// The walls around a room: every side of its areas less what touches another of its areas.
pub(crate) fn walls_of(spaces: &[Space], index: usize) -> Vec<Wall> {
    let space = &spaces[index];
    let mut walls = Vec::new();
    // Outward directions by quarters: 0 is +y, then -x, -y, +x.
    for quarter in 0..4u32 {
        let frame = Place {
            origin: Vec3::ZERO,
            axes: Mat3::IDENTITY,
        }
        .quarter(quarter);
        let (along, out) = (frame.axes.x_axis.truncate(), frame.axes.y_axis.truncate());
        let mut lines: Vec<(f32, f32, f32)> = Vec::new();
        for area in &space.areas {
            let ends = [area.low, area.high];
            let edge = ends.iter().map(|p| p.dot(out)).fold(f32::MIN, f32::max);
            let from = ends.iter().map(|p| p.dot(along)).fold(f32::MAX, f32::min);
            let to = ends.iter().map(|p| p.dot(along)).fold(f32::MIN, f32::max);
            let mut cuts = vec![from, to];
            cuts.extend(
                space
                    .areas
                    .iter()
                    .flat_map(|other| [other.low.dot(along), other.high.dot(along)])
                    .filter(|cut| *cut > from && *cut < to),
            );
            cuts.sort_by(f32::total_cmp);
            for pair in cuts.windows(2) {
                let middle = along * (0.5 * (pair[0] + pair[1])) + out * (edge + 0.01);
                if pair[1] - pair[0] > 1e-3 && !space.holds(middle) {
                    lines.push((edge, pair[0], pair[1]));
                }
            }
        }
        lines.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut merged: Vec<(f32, f32, f32)> = Vec::new();
        for line in lines {
            match merged.last_mut() {
                Some(last) if (last.0 - line.0).abs() < 1e-3 && (last.2 - line.1).abs() < 1e-3 => {
                    last.2 = line.2;
                }
                _ => merged.push(line),
            }
        }
        for (edge, from, to) in merged {
            let middle = along * (0.5 * (from + to)) + out * edge;
            let convex =
                [from - 0.02, to + 0.02].map(|at| !space.holds(along * at + out * (edge - 0.02)));
            walls.push(Wall {
                space: index,
                place: Place {
                    origin: middle.extend(0.0),
                    ..frame
                },
                length: to - from,
                height: space.height,
                convex,
                holes: Vec::new(),
            });
        }
    }
    walls
}
