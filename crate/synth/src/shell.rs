//! Floor, ceiling, walls, and the openings in them with all that belongs to a window and a door.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::palette::srgb;
use crate::texture::{Look, Pattern};

/// Walls, floor and ceiling are this thick.
pub(crate) const WALL_M: f32 = 0.16;

/// A rectangular hole in a wall: middle and size along the wall, height of its lower edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    pub x: f32,
    pub width: f32,
    pub sill: f32,
    pub height: f32,
}

pub(crate) fn floor_and_ceiling(b: &mut Builder, room: &Place, size: Vec3) {
    let [dark, light] = b.palette.floor;
    let planks = Look::new(Pattern::Planks, [dark, light, light]).gloss(0.22);
    let [x, y, z] = size.to_array();
    let area = [x + 2.0 * WALL_M, y + 2.0 * WALL_M, WALL_M];
    b.block(&room.at(0.0, 0.0, -0.5 * WALL_M), area, 0.0, planks);
    let white = Look::new(Pattern::Plaster, [srgb(0xF3F1EC); 3]);
    b.block(&room.at(0.0, 0.0, z + 0.5 * WALL_M), area, 0.0, white);
}

/// A wall whose inner face is y = 0 of `at`, with a skirting board.
pub(crate) fn wall(
    b: &mut Builder,
    at: &Place,
    length: f32,
    height: f32,
    hole: Option<Opening>,
    look: Look,
) {
    let look = look.seed(b.random.bits() >> 8);
    let end = 0.5 * length + WALL_M;
    let mut part = |x0: f32, x1: f32, z0: f32, z1: f32| {
        if x1 > x0 && z1 > z0 {
            let place = at.at(0.5 * (x0 + x1), 0.5 * WALL_M, 0.5 * (z0 + z1));
            b.block(&place, [x1 - x0, WALL_M, z1 - z0], 0.0, look);
        }
    };
    let skirts = match hole {
        None => {
            part(-end, end, 0.0, height);
            vec![(-0.5 * length, 0.5 * length)]
        }
        Some(hole) => {
            let (left, right) = (hole.x - 0.5 * hole.width, hole.x + 0.5 * hole.width);
            part(-end, left, 0.0, height);
            part(right, end, 0.0, height);
            part(left, right, 0.0, hole.sill);
            part(left, right, hole.sill + hole.height, height);
            if hole.sill > 0.0 {
                vec![(-0.5 * length, 0.5 * length)]
            } else {
                vec![(-0.5 * length, left - 0.07), (right + 0.07, 0.5 * length)]
            }
        }
    };
    let white = Look::plain(srgb(0xF2F0EB));
    for (x0, x1) in skirts {
        b.block(
            &at.at(0.5 * (x0 + x1), -0.007, 0.045),
            [x1 - x0, 0.014, 0.09],
            0.0,
            white,
        );
    }
}

/// Frame boards around a hole, standing out by 2 cm, below as well if it is a window.
pub(crate) fn casing(b: &mut Builder, at: &Place, hole: Opening, look: Look) {
    let wide = 0.07;
    let top = hole.sill + hole.height;
    for side in [-1.0, 1.0] {
        let place = at.at(
            hole.x + side * 0.5 * (hole.width + wide),
            -0.01,
            hole.sill + 0.5 * hole.height,
        );
        b.block(&place, [wide, 0.02, hole.height], 0.003, look);
    }
    let place = at.at(hole.x, -0.01, top + 0.5 * wide);
    b.block(&place, [hole.width + 2.0 * wide, 0.022, wide], 0.003, look);
}

/// Panes, bars, sill, radiator and curtains. The garden is a glowing picture on the pane.
pub(crate) fn window(b: &mut Builder, at: &Place, hole: Opening) {
    let white = Look::plain(srgb(0xF4F2EE)).gloss(0.2);
    casing(b, at, hole, white);
    let middle = at.at(hole.x, 0.0, hole.sill + 0.5 * hole.height);
    let garden = Look::new(Pattern::Outside, [Vec3::ONE; 3]).glow(1.0);
    let (w, h) = (hole.width, hole.height);
    b.block(&middle.at(0.0, 0.13, 0.0), [w, 0.06, h], 0.0, garden);
    let bar = 0.055;
    for side in [-1.0, 1.0] {
        b.block(
            &middle.at(side * 0.5 * (w - bar), 0.09, 0.0),
            [bar, 0.06, h],
            0.004,
            white,
        );
        b.block(
            &middle.at(0.0, 0.09, side * 0.5 * (h - bar)),
            [w, 0.06, bar],
            0.004,
            white,
        );
    }
    b.block(&middle.at(0.0, 0.085, 0.0), [0.08, 0.07, h], 0.004, white);
    b.block(
        &middle.at(0.0, 0.09, 0.2 * h),
        [w, 0.05, 0.035],
        0.004,
        white,
    );
    b.block(
        &at.at(hole.x, -0.03, hole.sill - 0.015),
        [w + 0.01, 0.24, 0.035],
        0.01,
        white,
    );
    radiator(b, &at.at(hole.x, -0.09, 0.12), 0.62 * w, 0.52);
    curtains(b, at, hole);
}

pub(crate) fn radiator(b: &mut Builder, at: &Place, width: f32, height: f32) {
    let paint = Look::plain(srgb(0xEFEDE8)).gloss(0.35);
    let ribs = (width / 0.075) as u32;
    for i in 0..ribs {
        let x = (i as f32 + 0.5 - 0.5 * ribs as f32) * 0.075;
        b.block(
            &at.at(x, 0.0, 0.5 * height),
            [0.055, 0.1, height],
            0.026,
            paint,
        );
    }
    for z in [0.07, height - 0.07] {
        b.rod(
            at,
            [-0.5 * width, 0.0, z],
            [0.5 * width, 0.0, z],
            [0.02, 0.02],
            paint,
        );
    }
}

pub(crate) fn curtains(b: &mut Builder, at: &Place, hole: Opening) {
    let top = hole.sill + hole.height + 0.16;
    let reach = 0.5 * hole.width + 0.49;
    let tone = b.accent();
    let cloth = b.cloth([tone * 0.82, tone.lerp(Vec3::ONE, 0.12)]);
    let rail = Look::plain(srgb(0x4A4038)).gloss(0.5);
    let y = -0.11;
    b.rod(
        at,
        [hole.x - reach, y, top],
        [hole.x + reach, y, top],
        [0.014, 0.014],
        rail,
    );
    for side in [-1.0, 1.0] {
        b.ball(&at.at(hole.x + side * reach, y, top), 0.03, rail);
        for fold in 0..8 {
            let x = hole.x + side * (reach - 0.07 - 0.052 * fold as f32);
            let deep = if fold % 2 == 0 { 0.018 } else { -0.018 };
            let thick = b.random.range(0.066, 0.078);
            let place = at.at(x, y + deep, 0.5 * top + 0.01);
            b.block(&place, [thick, thick, top - 0.03], 0.48 * thick, cloth);
        }
    }
}

/// A panelled door leaf in its hole.
pub(crate) fn door(b: &mut Builder, at: &Place, hole: Opening) {
    let white = Look::plain(srgb(0xEFEBE2)).gloss(0.25);
    let wood = if b.random.chance(0.5) {
        b.wood()
    } else {
        white
    };
    casing(b, at, hole, white);
    let leaf = at.at(hole.x, 0.06, 0.5 * hole.height);
    b.block(
        &leaf.at(0.0, 0.05, 0.0),
        [hole.width, 0.1, hole.height],
        0.0,
        wood,
    );
    for x in [-1.0, 1.0] {
        for (z, high) in [(-0.29, 0.3), (0.06, 0.28), (0.35, 0.19)] {
            let panel = leaf.at(x * 0.22 * hole.width, 0.0, z * hole.height);
            b.block(
                &panel,
                [0.32 * hole.width, 0.026, high * hole.height],
                0.01,
                wood,
            );
        }
    }
    let brass = Look::plain(srgb(0xB79A5A)).gloss(0.9);
    let handle = leaf.at(0.42 * hole.width, 0.0, -0.02);
    b.drum(
        &handle.at(0.0, -0.01, 0.0).lean(std::f32::consts::FRAC_PI_2),
        [0.026, 0.026],
        0.03,
        0.004,
        brass,
    );
    b.rod(
        &handle,
        [0.0, 0.0, 0.0],
        [0.0, -0.055, 0.0],
        [0.01, 0.01],
        brass,
    );
    b.rod(
        &handle,
        [0.012, -0.055, 0.0],
        [-0.11, -0.055, 0.0],
        [0.011, 0.009],
        brass,
    );
}
