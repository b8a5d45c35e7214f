//! What stands about and is neither seat, table nor store.

use crate::builder::{Builder, Place};
use crate::texture::{Look, Pattern};
use crate::training::colors::{self, oklch};
use crate::training::pieces::wall_things::television;
use crate::training::pieces::{clutter, storage, tables::metal};

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
