//! Beds and sofas.

use crate::builder::{Builder, Place};
use crate::texture::{Look, Pattern};
use crate::training::colors::{self, oklch};
use crate::training::pieces::legs;

fn sheet(b: &mut Builder) -> Look {
    let base = if b.random.chance(0.5) {
        oklch(b.random.range(0.85, 0.96), 0.01, 0.2)
    } else {
        colors::tone(&mut b.random)
    };
    let pattern = b.random.pick(&[
        Pattern::Folds,
        Pattern::Folds,
        Pattern::Weave,
        Pattern::Checks,
        Pattern::Stripes,
        Pattern::Flowers,
        Pattern::Plain,
    ]);
    let other = colors::tone(&mut b.random);
    let second = if pattern == Pattern::Folds {
        base * 0.85
    } else {
        other
    };
    let scale = b.random.range(0.8, 2.0);
    Look::new(pattern, [base, second, other]).scale(scale)
}

/// A bed with its head at the wall; its length goes away from it.
pub(crate) fn bed(b: &mut Builder, at: &Place, width: f32) {
    let frame = b.wood();
    let long = b.random.range(1.95, 2.1);
    let (low, thick) = (b.random.range(0.08, 0.3), b.random.range(0.16, 0.28));
    let head = b.random.range(0.6, 1.2);
    let board = if b.random.chance(0.5) {
        b.cloth(b.palette.sofa)
    } else {
        frame
    };
    b.block(
        &at.at(0.0, -0.03, 0.5 * head),
        [width + 0.04, 0.06, head],
        0.02,
        board,
    );
    let middle = at.at(0.0, -0.06 - 0.5 * long, 0.0);
    legs(
        b,
        &middle,
        [0.5 * width - 0.06, 0.5 * long - 0.06],
        low + 0.02,
        0.06,
        frame,
    );
    b.block(
        &middle.at(0.0, 0.0, low + 0.05),
        [width, long, 0.12],
        0.01,
        frame,
    );
    let under = sheet(b);
    let top = low + 0.1 + thick;
    b.block(
        &middle.at(0.0, 0.0, top - 0.5 * thick),
        [width - 0.04, long - 0.04, thick],
        0.06,
        under,
    );
    let cover = sheet(b);
    let drawn = b.random.range(0.5, 0.78) * long;
    let puff = b.random.range(0.04, 0.12);
    let duvet = middle.at(0.0, -0.5 * (long - drawn) - 0.01, top + 0.25 * puff);
    b.block(&duvet, [width + 0.04, drawn, puff], 0.48 * puff, cover);
    for side in [-1.0, 1.0] {
        let drop = b.random.range(0.1, 0.3);
        let hang = duvet.at(side * (0.5 * width + 0.01), 0.0, -0.5 * drop);
        b.block(&hang, [0.05, drawn, drop], 0.022, cover);
    }
    // Lumps of a duvet that nobody smoothed.
    for _ in 0..b.random.below(5) {
        let (x, y) = (
            b.random.range(-0.35, 0.35) * width,
            b.random.range(-0.4, 0.4) * drawn,
        );
        let turn = b.random.range(0.0, 3.0);
        let fold = duvet.at(x, y, 0.4 * puff).turn(turn);
        let size = [b.random.range(0.3, 0.7), b.random.range(0.1, 0.25), 0.09];
        b.block(&fold, size, 0.043, cover);
    }
    let pillows = if width > 1.2 {
        2 + b.random.below(3)
    } else {
        1 + b.random.below(2)
    };
    for i in 0..pillows {
        let look = if b.random.chance(0.5) {
            under
        } else {
            sheet(b)
        };
        let x = width * ((i % 2) as f32 - 0.5) * if width > 1.2 { 0.48 } else { 0.1 };
        let lean = b.random.range(0.05, 0.7);
        let y = 0.5 * long - 0.24 - 0.2 * (i / 2) as f32;
        let turn = b.random.range(-0.15, 0.15);
        let pillow = middle
            .at(x, y, top + 0.09 + 0.12 * lean)
            .turn(turn)
            .lean(-lean);
        b.block(
            &pillow,
            [(0.46 * width).clamp(0.5, 0.75), 0.38, 0.15],
            0.07,
            look,
        );
    }
}

/// A sofa of boxes or cushions, armchair to corner; gives nothing, for its size is told.
pub(crate) fn sofa(b: &mut Builder, at: &Place, width: f32, depth: f32) {
    let cloth = b.cloth(b.palette.sofa);
    let seat = b.random.range(0.36, 0.46);
    let back = b.random.range(0.7, 0.95);
    let arm = b.random.range(0.08, 0.24);
    let arm_height = b.random.range(seat + 0.08, back - 0.05);
    let foot = b.random.pick(&[0.02, 0.08, 0.14]);
    let middle = at.at(0.0, -0.5 * depth, 0.0);
    let wood = b.wood();
    legs(
        b,
        &middle,
        [0.5 * width - 0.08, 0.5 * depth - 0.08],
        foot + 0.02,
        0.05,
        wood,
    );
    let round = b.random.range(0.015, 0.06);
    let base = seat - 0.14 - foot;
    b.block(
        &middle.at(0.0, 0.0, foot + 0.5 * base),
        [width, depth, base],
        0.4 * round,
        cloth,
    );
    let thick = b.random.range(0.14, 0.24);
    b.block(
        &at.at(0.0, -0.5 * thick, 0.5 * (foot + back)),
        [width, thick, back - foot],
        round,
        cloth,
    );
    let has_arms = b.random.chance(0.85);
    let inner = if has_arms { width - 2.0 * arm } else { width };
    for side in [-1.0, 1.0] {
        if has_arms {
            let x = side * 0.5 * (width - arm);
            b.block(
                &middle.at(x, 0.0, 0.5 * (foot + arm_height)),
                [arm, depth, arm_height - foot],
                round.min(0.45 * arm),
                cloth,
            );
        }
    }
    let seats = ((inner / 0.65) as u32).max(1);
    let each = inner / seats as f32;
    for i in 0..seats {
        let x = inner * ((i as f32 + 0.5) / seats as f32 - 0.5);
        let long = depth - thick;
        b.block(
            &at.at(x, -thick - 0.5 * long, seat - 0.07),
            [each - 0.006, long, 0.16],
            0.05,
            cloth,
        );
        let lean = b.random.range(0.12, 0.3);
        let cushion = at.at(x, -thick - 0.09, seat + 0.2).lean(-lean);
        b.block(&cushion, [each - 0.01, 0.16, 0.4], 0.07, cloth);
    }
    for _ in 0..b.random.below(2 + 2 * seats) {
        colors::vary(b);
        let look = sheet(b);
        let side = b.random.range(0.34, 0.5);
        let x = b.random.range(-0.5, 0.5) * (inner - side);
        let (yaw, lean) = (b.random.range(-0.4, 0.4), b.random.range(0.25, 0.6));
        let pillow = at
            .at(x, -thick - 0.24, seat + 0.02 + 0.48 * side)
            .turn(yaw)
            .lean(-lean);
        b.block(&pillow, [side, 0.13, side], 0.06, look);
    }
    if b.random.chance(0.25) {
        let look = sheet(b);
        let x = b.random.range(-0.35, 0.35) * inner;
        let top = at.at(x, -0.5 * thick, back + 0.008);
        b.block(&top, [0.6, thick + 0.03, 0.022], 0.01, look);
        b.block(
            &top.at(0.0, -0.5 * thick - 0.012, -0.16),
            [0.6, 0.03, 0.34],
            0.012,
            look,
        );
    }
}
