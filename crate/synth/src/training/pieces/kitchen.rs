//! Kitchens and baths.

use crate::builder::{Builder, Place};
use crate::texture::{Look, Pattern};
use crate::training::colors::{self, oklch};
use crate::training::pieces::{clutter, open_box, ring, tables::metal};

/// A row of kitchen units along a wall: counter, sink, hob, and cupboards above.
pub(crate) fn row(b: &mut Builder, at: &Place, width: f32, above: bool, full: f32) {
    let front = if b.random.chance(0.5) {
        Look::plain(colors::paint(&mut b.random)).gloss(b.random.range(0.1, 0.6))
    } else {
        b.wood()
    };
    let stone = colors::tone(&mut b.random);
    let counter = match b.random.below(4) {
        0 => b.wood(),
        1 => Look::new(
            Pattern::Marble,
            [oklch(0.85, 0.01, 0.2), stone, stone * 0.5],
        )
        .gloss(0.5),
        2 => Look::new(Pattern::Speckle, [stone, stone * 0.5, stone * 1.3]).gloss(0.4),
        _ => Look::plain(oklch(b.random.range(0.2, 0.9), 0.01, 0.2)).gloss(0.4),
    };
    let steel = metal(b);
    let (depth, height) = (0.6, b.random.range(0.86, 0.94));
    let units = ((width / 0.6) as u32).max(1);
    let each = width / units as f32;
    b.block(
        &at.at(0.0, -0.27, 0.05),
        [width, 0.5, 0.1],
        0.0,
        Look::plain(oklch(0.3, 0.01, 0.2)),
    );
    let sink = b.random.below(units);
    let hob = (sink + 1 + b.random.below(units.max(2) - 1)) % units;
    for i in 0..units {
        let x = width * ((i as f32 + 0.5) / units as f32 - 0.5);
        let unit = at.at(x, 0.0, 0.0);
        let sides = if i == sink {
            height - 0.25
        } else {
            height - 0.04
        };
        b.block(
            &unit.at(0.0, -0.29, 0.5 * (0.1 + sides)),
            [each, 0.56, sides - 0.1],
            0.0,
            front,
        );
        fronts(b, &unit, each, height, i == hob, front, steel);
        let board = |b: &mut Builder, x: f32, y: f32, size: [f32; 2]| {
            b.block(
                &unit.at(x, y, height - 0.02),
                [size[0], size[1], 0.04],
                0.0,
                counter,
            );
        };
        if i == sink && each > 0.5 {
            // A hole in the counter with a basin in it.
            let rim = 0.5 * (each - 0.42);
            board(b, -0.5 * (each - rim), -0.5 * depth, [rim, depth]);
            board(b, 0.5 * (each - rim), -0.5 * depth, [rim, depth]);
            board(b, 0.0, -0.075, [0.42, 0.15]);
            board(b, 0.0, -0.56, [0.42, 0.08]);
            open_box(
                b,
                &unit.at(0.0, -0.335, height - 0.2),
                [0.43, 0.38, 0.19],
                0.01,
                steel,
            );
            b.rod(
                &unit,
                [0.0, -0.08, height],
                [0.0, -0.08, height + 0.25],
                [0.013, 0.011],
                steel,
            );
            b.rod(
                &unit,
                [0.0, -0.08, height + 0.25],
                [0.0, -0.26, height + 0.2],
                [0.011, 0.01],
                steel,
            );
        } else {
            board(b, 0.0, -0.5 * depth, [each, depth]);
            let top = unit.at(0.0, -0.3, height);
            if i == hob {
                hob_top(b, &top);
            } else {
                clutter::cover(b, &top, [each - 0.05, depth - 0.15], full);
            }
        }
    }
    let panel = if b.random.chance(0.6) {
        let tile = colors::paint(&mut b.random);
        Some(Look::new(Pattern::Tiles, [tile, tile * 0.9, tile * 0.5]).gloss(0.5))
    } else {
        None
    };
    if let Some(look) = panel.filter(|_| above) {
        b.block(
            &at.at(0.0, -0.006, height + 0.28),
            [width, 0.012, 0.56],
            0.0,
            look,
        );
    }
    if above {
        upper(
            b,
            at,
            [width, each, height + 0.56],
            units,
            hob,
            [front, steel],
        );
    }
}

fn fronts(
    b: &mut Builder,
    unit: &Place,
    each: f32,
    height: f32,
    oven: bool,
    front: Look,
    steel: Look,
) {
    let face = |z: f32| unit.at(0.0, -0.58, z);
    if oven {
        let glass = Look::plain(oklch(0.18, 0.01, 0.6)).gloss(0.8);
        b.block(&face(0.48), [each - 0.01, 0.03, 0.58], 0.004, steel);
        b.block(
            &face(0.42).at(0.0, -0.012, 0.0),
            [each - 0.14, 0.012, 0.34],
            0.0,
            glass,
        );
        b.rod(
            &face(0.66),
            [-0.2, -0.045, 0.0],
            [0.2, -0.045, 0.0],
            [0.009, 0.009],
            steel,
        );
        return;
    }
    let drawers = b.random.chance(0.4);
    let rows = if drawers { 3 } else { 1 };
    let tall = (height - 0.16) / rows as f32;
    for row in 0..rows {
        let leaf = face(0.11 + tall * (row as f32 + 0.5));
        b.block(&leaf, [each - 0.006, 0.02, tall - 0.006], 0.002, front);
        let grip = if drawers {
            leaf.at(0.0, -0.025, 0.3 * tall)
        } else {
            leaf.at(0.4 * each, -0.025, 0.35 * tall)
        };
        let size = if drawers {
            [0.14, 0.02, 0.01]
        } else {
            [0.01, 0.02, 0.14]
        };
        b.block(&grip, size, 0.003, steel);
    }
}

fn hob_top(b: &mut Builder, top: &Place) {
    let glass = Look::plain(oklch(0.16, 0.005, 0.6)).gloss(0.8);
    b.block(&top.at(0.0, 0.0, 0.003), [0.56, 0.5, 0.006], 0.0, glass);
    let plate = Look::plain(oklch(0.3, 0.01, 0.2));
    for (x, y) in [(-0.14, -0.12), (0.14, -0.12), (-0.14, 0.12), (0.14, 0.12)] {
        b.drum(&top.at(x, y, 0.007), [0.09, 0.09], 0.006, 0.0, plate);
        if b.random.chance(0.4) {
            clutter::pot(b, &top.at(x, y, 0.01));
        }
    }
}

fn upper(
    b: &mut Builder,
    at: &Place,
    [width, each, low]: [f32; 3],
    units: u32,
    hob: u32,
    [front, steel]: [Look; 2],
) {
    let tall = b.random.range(0.5, 0.75);
    for i in 0..units {
        let x = width * ((i as f32 + 0.5) / units as f32 - 0.5);
        let unit = at.at(x, 0.0, low);
        if i == hob {
            // The hood, a cut cone with a pipe.
            b.block(
                &unit.at(0.0, -0.22, 0.09),
                [each - 0.02, 0.44, 0.08],
                0.004,
                steel,
            );
            b.block(
                &unit.at(0.0, -0.14, 0.5 * tall),
                [0.28, 0.26, tall],
                0.004,
                steel,
            );
        } else if b.random.chance(0.15) {
            b.block(&unit.at(0.0, -0.15, 0.01), [each, 0.3, 0.02], 0.0, front);
            clutter::cover(b, &unit.at(0.0, -0.15, 0.02), [each - 0.04, 0.26], 0.9);
        } else {
            b.block(
                &unit.at(0.0, -0.16, 0.5 * tall),
                [each, 0.32, tall],
                0.0,
                front,
            );
            b.block(
                &unit.at(0.0, -0.33, 0.5 * tall),
                [each - 0.006, 0.02, tall - 0.006],
                0.002,
                front,
            );
            b.block(
                &unit.at(0.4 * each, -0.35, 0.12),
                [0.01, 0.02, 0.12],
                0.003,
                steel,
            );
        }
    }
}

/// A tall fridge.
pub(crate) fn fridge(b: &mut Builder, at: &Place, height: f32) {
    let steel = metal(b);
    let look = b
        .random
        .pick(&[Look::plain(oklch(0.93, 0.005, 0.2)).gloss(0.4), steel]);
    let cut = height * b.random.range(0.3, 0.65);
    b.block(
        &at.at(0.0, -0.31, 0.5 * height),
        [0.6, 0.6, height],
        0.01,
        look,
    );
    for (low, high) in [(0.03, cut), (cut, height)] {
        let door = at.at(0.0, -0.63, 0.5 * (low + high));
        b.block(&door, [0.59, 0.04, high - low - 0.01], 0.01, look);
        b.rod(
            &door,
            [0.25, -0.05, -0.12],
            [0.25, -0.05, 0.12],
            [0.01, 0.01],
            steel,
        );
    }
    let notes = b.random.below(5);
    for _ in 0..notes {
        let (x, z) = (
            b.random.range(-0.2, 0.15),
            b.random.range(0.9, height - 0.2),
        );
        let sheet = clutter::print(b);
        b.block(&at.at(x, -0.651, z), [0.12, 0.003, 0.16], 0.0, sheet);
    }
}

/// A washing machine.
pub(crate) fn washer(b: &mut Builder, at: &Place) {
    let white = Look::plain(oklch(0.94, 0.004, 0.2)).gloss(0.35);
    let dark = Look::plain(oklch(0.25, 0.01, 0.6)).gloss(0.7);
    b.block(&at.at(0.0, -0.3, 0.42), [0.6, 0.58, 0.84], 0.012, white);
    let face = at.at(0.0, -0.59, 0.42).lean(std::f32::consts::FRAC_PI_2);
    let steel = metal(b);
    b.drum(&face, [0.2, 0.19], 0.03, 0.006, steel);
    b.drum(&face.at(0.0, 0.0, 0.015), [0.155, 0.13], 0.02, 0.006, dark);
    b.block(&at.at(0.1, -0.592, 0.77), [0.24, 0.008, 0.06], 0.0, dark);
    clutter::cover(b, &at.at(0.0, -0.3, 0.84), [0.5, 0.5], 0.4);
}

/// A wash basin on a wall, with a mirror.
pub(crate) fn basin(b: &mut Builder, at: &Place) {
    let china = Look::plain(oklch(0.95, 0.004, 0.2)).gloss(0.7);
    let steel = metal(b);
    open_box(b, &at.at(0.0, -0.24, 0.7), [0.58, 0.44, 0.15], 0.04, china);
    b.drum(&at.at(0.0, -0.2, 0.35), [0.09, 0.11], 0.7, 0.01, china);
    b.rod(
        at,
        [0.0, -0.05, 0.85],
        [0.0, -0.17, 0.95],
        [0.014, 0.012],
        steel,
    );
    let cloudy = Look::new(Pattern::Concrete, [oklch(0.7, 0.012, 0.55); 3])
        .gloss(0.9)
        .scale(4.0);
    b.block(&at.at(0.0, -0.01, 1.5), [0.6, 0.02, 0.75], 0.0, cloudy);
}

/// A toilet.
pub(crate) fn toilet(b: &mut Builder, at: &Place) {
    let china = Look::plain(oklch(0.95, 0.004, 0.2)).gloss(0.7);
    b.block(&at.at(0.0, -0.09, 0.6), [0.38, 0.17, 0.38], 0.03, china);
    b.drum(&at.at(0.0, -0.4, 0.2), [0.12, 0.18], 0.38, 0.02, china);
    b.drum(&at.at(0.0, -0.42, 0.41), [0.2, 0.2], 0.035, 0.014, china);
    b.block(&at.at(0.0, -0.26, 0.41), [0.36, 0.26, 0.035], 0.014, china);
}

/// A bath tub along a wall, hollow.
pub(crate) fn tub(b: &mut Builder, at: &Place, width: f32) {
    let china = Look::plain(oklch(0.95, 0.004, 0.2)).gloss(0.6);
    open_box(b, &at.at(0.0, -0.36, 0.0), [width, 0.72, 0.56], 0.06, china);
    b.block(
        &at.at(0.0, -0.36, 0.12),
        [width - 0.1, 0.62, 0.12],
        0.04,
        china,
    );
    let steel = metal(b);
    b.rod(
        at,
        [-0.4 * width, -0.02, 0.75],
        [-0.4 * width, -0.16, 0.72],
        [0.015, 0.014],
        steel,
    );
    if b.random.chance(0.4) {
        let look = b.cloth(b.palette.sofa);
        b.block(
            &at.at(0.2 * width, -0.72, 0.42),
            [0.4, 0.02, 0.35],
            0.008,
            look,
        );
    }
    ring(
        b,
        &at.at(0.5 * width - 0.2, -0.95, 0.0),
        [0.14, 0.17],
        0.4,
        0.008,
        china,
    );
}
