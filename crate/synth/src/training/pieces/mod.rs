//! Furniture and things of the rooms to learn from. What stands at a wall has its back against y = 0 and reaches
//! towards -y; what stands free is around its origin; what lies on something starts at z = 0 of its place.

pub(crate) mod clutter;
pub(crate) mod fixtures;
pub(crate) mod floor_things;
pub(crate) mod kitchen;
pub(crate) mod lamps;
pub(crate) mod sleep;
pub(crate) mod storage;
pub(crate) mod tables;
pub(crate) mod wall_things;

use crate::builder::{Builder, Place};
use crate::texture::Look;

/// Four legs from `top` to the floor; `splay` spreads their feet.
pub(crate) fn legs(b: &mut Builder, at: &Place, half: [f32; 2], top: f32, thick: f32, look: Look) {
    let splay = if b.random.chance(0.4) {
        b.random.range(0.0, 0.08)
    } else {
        0.0
    };
    let round = b.random.chance(0.5);
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let (x, y) = (x * half[0], y * half[1]);
        if round || splay > 0.0 {
            let foot = [x + splay * x.signum(), y + splay * y.signum(), 0.0];
            b.rod(at, [x, y, top], foot, [0.5 * thick, 0.35 * thick], look);
        } else {
            b.block(&at.at(x, y, 0.5 * top), [thick, thick, top], 0.003, look);
        }
    }
}

/// A hollow round wall of upright staves between two radii.
pub(crate) fn ring(
    b: &mut Builder,
    at: &Place,
    radii: [f32; 2],
    height: f32,
    thick: f32,
    look: Look,
) {
    let count = ((std::f32::consts::TAU * radii[0].max(radii[1]) / 0.05) as u32).clamp(10, 22);
    let step = std::f32::consts::TAU / count as f32;
    let wide = 2.0 * radii[0].max(radii[1]) * libm::tanf(0.5 * step) + 0.5 * thick;
    let slope = libm::atan2f(radii[1] - radii[0], height);
    for i in 0..count {
        let stave = at
            .turn(step * i as f32)
            .at(0.0, -0.5 * (radii[0] + radii[1]), 0.5 * height);
        b.block(&stave.lean(slope), [wide, thick, height], 0.0, look);
    }
}

/// A hollow box, open at the top, with its bottom at z = 0.
pub(crate) fn open_box(b: &mut Builder, at: &Place, size: [f32; 3], thick: f32, look: Look) {
    let [x, y, z] = size;
    b.block(&at.at(0.0, 0.0, 0.5 * thick), [x, y, thick], 0.0, look);
    for side in [-1.0, 1.0] {
        b.block(
            &at.at(side * 0.5 * (x - thick), 0.0, 0.5 * z),
            [thick, y, z],
            0.0,
            look,
        );
        b.block(
            &at.at(0.0, side * 0.5 * (y - thick), 0.5 * z),
            [x, thick, z],
            0.0,
            look,
        );
    }
}
