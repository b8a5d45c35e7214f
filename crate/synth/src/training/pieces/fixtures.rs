//! What hangs on walls or stands about and is neither seat, table nor store.

use crate::builder::{Builder, Place};
use crate::texture::{Look, Pattern};
use crate::things;
use crate::training::colors::{self, oklch};
use crate::training::pieces::{clutter, storage, tables::metal};

/// Something flat on a wall, within `width` and `height`; `at` is the middle of its back.
pub(crate) fn on_wall(b: &mut Builder, at: &Place, [width, height]: [f32; 2]) {
    colors::vary(b);
    match b.random.below(9) {
        0 => television(b, at, width.min(1.4)),
        1 => {
            // A board to write on.
            let frame = metal(b);
            let (w, h) = (width.min(1.8), height.min(1.1));
            let white = Look::plain(oklch(0.95, 0.004, 0.5)).gloss(0.5);
            b.block(&at.at(0.0, -0.008, 0.0), [w, 0.016, h], 0.003, frame);
            b.block(
                &at.at(0.0, -0.017, 0.0),
                [w - 0.05, 0.004, h - 0.05],
                0.0,
                white,
            );
            if b.random.chance(0.6) {
                let notes = Look::new(
                    Pattern::Screen,
                    [white.tones[0], oklch(0.3, 0.1, 0.7), oklch(0.5, 0.18, 0.07)],
                );
                b.block(
                    &at.at(-0.1 * w, -0.0195, 0.05 * h),
                    [0.6 * w, 0.002, 0.7 * h],
                    0.0,
                    notes,
                );
            }
        }
        2 => things::clock(b, at),
        3 => storage::wall_board(b, &at.at(0.0, 0.0, -0.2), width.min(1.2)),
        4 => {
            // Sheets side by side, pinned.
            for i in 0..1 + b.random.below(5) {
                let (w, h) = b
                    .random
                    .pick(&[(0.21, 0.3), (0.3, 0.42), (0.42, 0.6), (0.15, 0.1)]);
                let x = b.random.range(-0.4, 0.4) * width;
                let z = b.random.range(-0.3, 0.3) * height;
                let look = clutter::print(b);
                let tilt = b.random.range(-0.04, 0.04);
                b.block(
                    &at.at(x, -0.002 - 0.002 * i as f32, z).roll(tilt),
                    [w, 0.002, h],
                    0.0,
                    look,
                );
            }
        }
        5 => mirror(b, at, [width.min(0.8), height.min(1.1)]),
        6 => hooks(b, at, width.min(0.9)),
        _ => framed(b, at, [width, height]),
    }
}

/// One to three framed prints.
fn framed(b: &mut Builder, at: &Place, [width, height]: [f32; 2]) {
    let count = if width > 1.2 {
        1 + b.random.below(3)
    } else {
        1
    };
    let each = width / count as f32;
    let w = b.random.range(0.4, 0.9) * each;
    let h = (w * b.random.range(0.6, 1.5)).min(height);
    for i in 0..count {
        let x = each * (i as f32 + 0.5) - 0.5 * width;
        let rim = b.random.range(0.01, 0.05);
        let frame = if b.random.chance(0.5) {
            b.wood()
        } else {
            metal(b)
        };
        let look = clutter::print(b);
        let place = at.at(x, 0.0, 0.0);
        b.block(&place.at(0.0, -0.01, 0.0), [w, 0.02, h], 0.003, frame);
        let inner = [w - 2.0 * rim, 0.004, h - 2.0 * rim];
        if b.random.chance(0.4) {
            let mount = Look::plain(oklch(0.95, 0.008, 0.2));
            b.block(&place.at(0.0, -0.02, 0.0), inner, 0.0, mount);
            b.block(
                &place.at(0.0, -0.022, 0.0),
                [0.7 * inner[0], 0.004, 0.7 * inner[2]],
                0.0,
                look,
            );
        } else {
            b.block(&place.at(0.0, -0.0205, 0.0), inner, 0.0, look);
        }
    }
}

fn mirror(b: &mut Builder, at: &Place, [width, height]: [f32; 2]) {
    let frame = if b.random.chance(0.5) {
        b.wood()
    } else {
        metal(b)
    };
    let glass = Look::new(
        Pattern::Concrete,
        [oklch(b.random.range(0.45, 0.75), 0.012, 0.55); 3],
    )
    .gloss(1.0)
    .scale(5.0);
    b.block(
        &at.at(0.0, -0.012, 0.0),
        [width, 0.024, height],
        0.004,
        frame,
    );
    b.block(
        &at.at(0.0, -0.023, 0.0),
        [width - 0.06, 0.004, height - 0.06],
        0.0,
        glass,
    );
}

/// A row of hooks with coats on some.
fn hooks(b: &mut Builder, at: &Place, width: f32) {
    let board = b.wood();
    let steel = metal(b);
    b.block(&at.at(0.0, -0.01, 0.2), [width, 0.02, 0.09], 0.003, board);
    let count = (width / 0.16) as u32;
    for i in 0..count {
        let x = width * ((i as f32 + 0.5) / count as f32 - 0.5);
        b.rod(
            at,
            [x, -0.02, 0.19],
            [x, -0.08, 0.21],
            [0.006, 0.006],
            steel,
        );
        if b.random.chance(0.5) {
            let tone = colors::tone(&mut b.random);
            let cloth = Look::new(Pattern::Folds, [tone, tone * 0.7, tone]);
            let (w, long) = (b.random.range(0.2, 0.4), b.random.range(0.4, 0.95));
            b.block(
                &at.at(x, -0.09, 0.2 - 0.5 * long),
                [w, 0.1, long],
                0.045,
                cloth,
            );
            for side in [-1.0, 1.0] {
                let sleeve = at.at(x, -0.09, 0.12);
                b.rod(
                    &sleeve,
                    [side * 0.4 * w, 0.0, 0.0],
                    [side * 0.55 * w, -0.02, -0.55 * long],
                    [0.05, 0.04],
                    cloth,
                );
            }
        }
    }
}

/// A flat screen on a wall.
fn television(b: &mut Builder, at: &Place, width: f32) {
    let dark = Look::plain(oklch(0.16, 0.005, 0.6)).gloss(0.7);
    let face = if b.random.chance(0.6) {
        dark
    } else {
        clutter::print(b).glow(0.8)
    };
    b.block(
        &at.at(0.0, -0.03, 0.0),
        [width, 0.06, 0.57 * width],
        0.006,
        dark,
    );
    b.block(
        &at.at(0.0, -0.061, 0.0),
        [width - 0.02, 0.003, 0.55 * width],
        0.0,
        face,
    );
}

/// A low board with a television on it.
pub(crate) fn media(b: &mut Builder, at: &Place, width: f32, full: f32) {
    let height = b.random.range(0.35, 0.55);
    storage::cupboard(b, at, [width, 0.4, height], 0.3 * full);
    let screen = at.at(0.0, -0.14, height + 0.02 + 0.29 * 0.6 * width);
    television(b, &screen, 0.6 * width);
}

/// A column from floor to ceiling.
pub(crate) fn column(b: &mut Builder, at: &Place, height: f32) {
    let look = colors::wall(&mut b.random, false);
    let thick = b.random.range(0.18, 0.45);
    let middle = at.at(0.0, 0.0, 0.5 * height);
    if b.random.chance(0.5) {
        b.drum(&middle, [0.5 * thick, 0.5 * thick], height, 0.0, look);
        b.drum(
            &at.at(0.0, 0.0, 0.04),
            [0.65 * thick, 0.6 * thick],
            0.08,
            0.01,
            look,
        );
    } else {
        b.block(&middle, [thick, thick, height], 0.004, look);
    }
}

/// A rack for drying clothes: many thin bars.
pub(crate) fn drying_rack(b: &mut Builder, at: &Place) {
    let look = metal(b);
    let (long, high) = (1.1, 0.95);
    for x in [-0.5, 0.5] {
        b.rod(
            at,
            [x * long, -0.28, 0.0],
            [x * long, 0.24, high],
            [0.009, 0.009],
            look,
        );
        b.rod(
            at,
            [x * long, 0.28, 0.0],
            [x * long, -0.24, high],
            [0.009, 0.009],
            look,
        );
    }
    for i in 0..9 {
        let y = -0.28 + 0.07 * i as f32;
        b.rod(
            at,
            [-0.5 * long, y, high],
            [0.5 * long, y, high],
            [0.004, 0.004],
            look,
        );
        if b.random.chance(0.35) {
            let tone = colors::tone(&mut b.random);
            let cloth = Look::new(Pattern::Folds, [tone, tone * 0.85, tone]);
            let (w, drop) = (b.random.range(0.15, 0.5), b.random.range(0.2, 0.6));
            let x = b.random.range(-0.28, 0.28);
            b.block(
                &at.at(x, y, high - 0.5 * drop + 0.005),
                [w, 0.012, drop],
                0.005,
                cloth,
            );
        }
    }
}

/// An easel, a ladder, a guitar or a bicycle: thin things that lean or stand.
pub(crate) fn thin_thing(b: &mut Builder, at: &Place) {
    let wood = b.wood();
    let steel = metal(b);
    match b.random.below(4) {
        0 => {
            for x in [-1.0, 1.0] {
                b.rod(
                    at,
                    [x * 0.22, -0.3, 0.0],
                    [x * 0.16, 0.0, 1.7],
                    [0.02, 0.02],
                    wood,
                );
                b.rod(
                    at,
                    [x * 0.22, 0.3, 0.0],
                    [x * 0.16, 0.02, 1.7],
                    [0.014, 0.014],
                    wood,
                );
            }
            for i in 1..6 {
                let share = i as f32 / 6.0;
                let y = -0.3 * (1.0 - share);
                b.block(&at.at(0.0, y, 1.7 * share), [0.4, 0.08, 0.022], 0.003, wood);
            }
        }
        1 => {
            // An easel with a canvas.
            for x in [-1.0, 1.0] {
                b.rod(
                    at,
                    [x * 0.32, -0.2, 0.0],
                    [0.0, 0.05, 1.7],
                    [0.014, 0.012],
                    wood,
                );
            }
            b.rod(at, [0.0, 0.4, 0.0], [0.0, 0.05, 1.6], [0.014, 0.012], wood);
            let look = clutter::print(b);
            b.block(
                &at.at(0.0, -0.11, 1.1).lean(-0.14),
                [0.6, 0.02, 0.75],
                0.0,
                look,
            );
            b.block(&at.at(0.0, -0.17, 0.71), [0.6, 0.06, 0.02], 0.0, wood);
        }
        2 => bicycle(b, at, steel),
        _ => {
            // A stand for coats.
            b.rod(at, [0.0, 0.0, 0.0], [0.0, 0.0, 1.75], [0.025, 0.018], wood);
            for i in 0..4 {
                let arm = at.turn(i as f32 * 1.571 + 0.3);
                b.rod(
                    &arm,
                    [0.0, 0.0, 0.1],
                    [0.0, -0.28, 0.0],
                    [0.018, 0.014],
                    wood,
                );
                b.rod(
                    &arm,
                    [0.0, 0.0, 1.6],
                    [0.0, -0.16, 1.72],
                    [0.012, 0.009],
                    wood,
                );
                if b.random.chance(0.5) {
                    let tone = colors::tone(&mut b.random);
                    let cloth = Look::new(Pattern::Folds, [tone, tone * 0.7, tone]);
                    let long = b.random.range(0.5, 0.95);
                    b.block(
                        &arm.at(0.0, -0.15, 1.68 - 0.5 * long),
                        [0.34, 0.14, long],
                        0.06,
                        cloth,
                    );
                }
            }
        }
    }
}

/// A bicycle along x.
fn bicycle(b: &mut Builder, at: &Place, steel: Look) {
    let paint = Look::plain(colors::tone(&mut b.random)).gloss(0.6);
    let tyre = Look::plain(oklch(0.2, 0.005, 0.2));
    let radius = 0.33;
    let count = 18;
    for x in [-0.52, 0.52] {
        let hub = at.at(x, 0.0, radius);
        let spot = |i: u32, r: f32| {
            let (sin, cos) = libm::sincosf(std::f32::consts::TAU * i as f32 / count as f32);
            [r * cos, 0.0, r * sin]
        };
        for i in 0..count {
            b.rod(
                &hub,
                spot(i, radius - 0.02),
                spot(i + 1, radius - 0.02),
                [0.02, 0.02],
                tyre,
            );
            b.rod(
                &hub,
                [0.0; 3],
                spot(i, radius - 0.03),
                [0.002, 0.002],
                steel,
            );
        }
    }
    let mut tube = |from: [f32; 2], to: [f32; 2], thick: f32, look: Look| {
        b.rod(
            at,
            [from[0], 0.0, from[1]],
            [to[0], 0.0, to[1]],
            [thick, thick],
            look,
        );
    };
    let (rear, crank, seat, head) = ([-0.52, 0.33], [-0.06, 0.3], [-0.2, 0.78], [0.36, 0.8]);
    tube(rear, crank, 0.012, paint);
    tube(rear, seat, 0.01, paint);
    tube(crank, seat, 0.017, paint);
    tube(crank, head, 0.019, paint);
    tube(seat, head, 0.017, paint);
    tube([0.52, 0.33], [0.34, 0.95], 0.015, paint);
    tube(seat, [-0.23, 0.92], 0.013, steel);
    b.rod(
        at,
        [0.36, -0.28, 0.97],
        [0.36, 0.28, 0.97],
        [0.013, 0.013],
        steel,
    );
    b.block(&at.at(-0.24, 0.0, 0.95), [0.25, 0.14, 0.05], 0.02, tyre);
}

/// A rug that lies flat.
pub(crate) fn rug(b: &mut Builder, at: &Place, [width, depth]: [f32; 2]) {
    colors::vary(b);
    let tones = b.palette.rug;
    let pattern = b.random.pick(&[
        Pattern::Rug,
        Pattern::Rug,
        Pattern::Carpet,
        Pattern::Checks,
        Pattern::Stripes,
        Pattern::Weave,
    ]);
    let look = Look::new(pattern, tones).scale(b.random.range(0.8, 2.0));
    if b.random.chance(0.25) {
        let side = width.min(depth);
        b.drum(
            &at.at(0.0, 0.0, 0.006),
            [0.5 * side, 0.5 * side],
            0.014,
            0.004,
            look,
        );
    } else {
        b.block(&at.at(0.0, 0.0, 0.006), [width, depth, 0.014], 0.004, look);
    }
}
