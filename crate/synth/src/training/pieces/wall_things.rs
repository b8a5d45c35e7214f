//! What hangs on walls.

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
pub(crate) fn television(b: &mut Builder, at: &Place, width: f32) {
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
