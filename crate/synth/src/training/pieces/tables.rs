//! Tables, desks and what one sits on at them.

use crate::builder::{Builder, Place};
use crate::seating;
use crate::texture::{Look, Pattern};
use crate::training::colors;
use crate::training::pieces::{clutter, legs};

fn top_look(b: &mut Builder) -> Look {
    match b.random.below(6) {
        0 => Look::new(
            Pattern::Marble,
            [
                colors::paint(&mut b.random),
                colors::tone(&mut b.random),
                colors::tone(&mut b.random),
            ],
        )
        .gloss(0.5),
        1 => Look::plain(colors::tone(&mut b.random)).gloss(0.5),
        2 => Look::plain(colors::paint(&mut b.random)).gloss(0.3),
        _ => b.wood(),
    }
}

/// A table of `width` by `depth` around the origin, sometimes with a cloth, with things on it.
pub(crate) fn table(b: &mut Builder, at: &Place, size: [f32; 3], full: f32) {
    let [width, depth, height] = size;
    let look = top_look(b);
    let frame = if b.random.chance(0.5) { look } else { metal(b) };
    let thick = b.random.range(0.018, 0.05);
    let round = (width - depth).abs() < 0.12 && b.random.chance(0.6);
    let board = at.at(0.0, 0.0, height - 0.5 * thick);
    if round {
        let radius = 0.5 * width;
        b.drum(&board, [radius, radius], thick, 0.3 * thick, look);
        if b.random.chance(0.5) {
            b.rod(
                at,
                [0.0, 0.0, height - thick],
                [0.0, 0.0, 0.03],
                [0.05, 0.06],
                frame,
            );
            b.drum(
                &at.at(0.0, 0.0, 0.015),
                [0.55 * radius, 0.5 * radius],
                0.03,
                0.008,
                frame,
            );
        } else {
            legs(
                b,
                at,
                [0.55 * radius, 0.55 * radius],
                height - thick,
                0.045,
                frame,
            );
        }
    } else {
        b.block(&board, [width, depth, thick], 0.2 * thick, look);
        let half = [0.5 * width - 0.06, 0.5 * depth - 0.06];
        let stout = b.random.range(0.03, 0.09);
        legs(b, at, half, height - thick, stout, frame);
        if b.random.chance(0.5) {
            let apron = height - thick - 0.04;
            for side in [-1.0, 1.0] {
                b.block(
                    &at.at(0.0, side * half[1], apron),
                    [width - 0.14, 0.02, 0.08],
                    0.0,
                    frame,
                );
                b.block(
                    &at.at(side * half[0], 0.0, apron),
                    [0.02, depth - 0.14, 0.08],
                    0.0,
                    frame,
                );
            }
        }
    }
    let on = at.at(0.0, 0.0, height);
    if b.random.chance(0.15) && !round {
        let cloth = b.cloth(b.palette.sofa);
        b.block(
            &on.at(0.0, 0.0, 0.0015),
            [width + 0.02, depth + 0.02, 0.004],
            0.0,
            cloth,
        );
        for side in [-1.0, 1.0] {
            let drop = b.random.range(0.1, 0.25);
            let hang = on.at(0.0, side * (0.5 * depth + 0.01), -0.5 * drop);
            b.block(&hang, [width + 0.02, 0.005, drop], 0.0, cloth);
        }
    }
    let spread = if round { 0.6 } else { 0.9 };
    clutter::cover(
        b,
        &on.at(0.0, 0.0, 0.003),
        [spread * width, spread * depth],
        full,
    );
}

pub(crate) fn metal(b: &mut Builder) -> Look {
    let light = b.random.range(0.15, 0.8);
    Look::new(Pattern::Metal, [colors::oklch(light, 0.01, 0.6); 3]).gloss(0.6)
}

/// Any chair, looking to -y.
pub(crate) fn chair(b: &mut Builder, at: &Place) {
    colors::vary(b);
    match b.random.below(6) {
        0 => seating::chair(b, at),
        1 => seating::office_chair(b, at),
        2 => stool(b, at),
        _ => light_chair(b, at),
    }
}

/// Thin legs, a seat, a back of one board, bars or a shell.
fn light_chair(b: &mut Builder, at: &Place) {
    let frame = if b.random.chance(0.5) {
        metal(b)
    } else {
        b.wood()
    };
    let shell = match b.random.below(3) {
        0 => frame,
        1 => b.cloth(b.palette.sofa),
        _ => Look::plain(colors::tone(&mut b.random)).gloss(0.3),
    };
    let (w, d) = (b.random.range(0.38, 0.48), b.random.range(0.38, 0.46));
    let seat = b.random.range(0.43, 0.48);
    let back = b.random.range(0.74, 1.05);
    let thin = b.random.range(0.016, 0.034);
    legs(
        b,
        at,
        [0.5 * w - 0.03, 0.5 * d - 0.03],
        seat - 0.01,
        thin,
        frame,
    );
    let thick = b.random.range(0.02, 0.07);
    b.block(&at.at(0.0, 0.0, seat), [w, d, thick], 0.45 * thick, shell);
    let lean = b.random.range(0.05, 0.2);
    let upright = at.at(0.0, 0.5 * d - 0.03, seat).lean(-lean);
    let tall = back - seat;
    if b.random.chance(0.5) {
        for x in [-1.0, 1.0] {
            let x = x * (0.5 * w - 0.03);
            b.rod(
                &upright,
                [x, 0.0, 0.0],
                [x, 0.0, tall],
                [0.5 * thin, 0.4 * thin],
                frame,
            );
        }
        let bars = 1 + b.random.below(5);
        for i in 0..bars {
            if b.random.chance(0.5) {
                let z = tall * (0.35 + 0.6 * i as f32 / bars as f32);
                b.block(
                    &upright.at(0.0, 0.0, z),
                    [w - 0.05, 0.015, 0.05],
                    0.005,
                    shell,
                );
            } else {
                let x = (w - 0.1) * ((i as f32 + 0.5) / bars as f32 - 0.5);
                b.rod(
                    &upright,
                    [x, 0.0, 0.0],
                    [x, 0.0, tall],
                    [0.009, 0.009],
                    frame,
                );
            }
        }
        b.block(
            &upright.at(0.0, 0.0, tall),
            [w - 0.02, 0.02, 0.05],
            0.008,
            shell,
        );
    } else {
        let high = tall * b.random.range(0.5, 0.95);
        let board = upright.at(0.0, 0.0, tall - 0.5 * high);
        b.block(&board, [w - 0.02, thick, high], 0.45 * thick, shell);
        for x in [-1.0, 1.0] {
            let x = x * (0.5 * w - 0.06);
            b.rod(
                &upright,
                [x, 0.0, 0.0],
                [x, 0.0, tall - 0.1],
                [0.012, 0.01],
                frame,
            );
        }
    }
    if b.random.chance(0.2) {
        for x in [-1.0, 1.0] {
            let arm = at.at(x * (0.5 * w + 0.01), 0.0, seat + 0.2);
            b.block(&arm, [0.04, d - 0.06, 0.025], 0.01, frame);
            b.rod(
                at,
                [x * 0.5 * w, -0.12, seat],
                [x * 0.5 * w, -0.14, seat + 0.2],
                [0.012, 0.012],
                frame,
            );
        }
    }
}

/// A stool: round or square, low or as high as a bar.
pub(crate) fn stool(b: &mut Builder, at: &Place) {
    let height = b.random.pick(&[0.42, 0.46, 0.65, 0.75]);
    let look = if b.random.chance(0.5) {
        b.wood()
    } else {
        metal(b)
    };
    let side = b.random.range(0.28, 0.38);
    if b.random.chance(0.5) {
        b.drum(
            &at.at(0.0, 0.0, height - 0.02),
            [0.5 * side, 0.5 * side],
            0.04,
            0.012,
            look,
        );
    } else {
        b.block(
            &at.at(0.0, 0.0, height - 0.02),
            [side, side, 0.04],
            0.01,
            look,
        );
    }
    let half = 0.32 * side;
    legs(b, at, [half, half], height - 0.03, 0.03, look);
    if height > 0.6 {
        for y in [-1.0, 1.0] {
            b.rod(
                at,
                [-half, y * half, 0.25],
                [half, y * half, 0.25],
                [0.01, 0.01],
                look,
            );
        }
    }
}

/// A desk at a wall with a chair before it.
pub(crate) fn workplace(b: &mut Builder, at: &Place, width: f32, full: f32) {
    let depth = b.random.range(0.55, 0.8);
    let height = b.random.range(0.71, 0.76);
    if b.random.chance(0.3) {
        crate::furniture::desk(b, at, width.min(1.5));
    } else {
        let middle = at.at(0.0, -0.5 * depth, 0.0);
        let look = top_look(b);
        let frame = if b.random.chance(0.4) { look } else { metal(b) };
        b.block(
            &middle.at(0.0, 0.0, height - 0.014),
            [width, depth, 0.028],
            0.004,
            look,
        );
        legs(
            b,
            &middle,
            [0.5 * width - 0.05, 0.5 * depth - 0.05],
            height - 0.028,
            0.045,
            frame,
        );
        let screens = 1 + b.random.below(2);
        for i in 0..screens {
            let x = (i as f32 - 0.5 * (screens - 1) as f32) * 0.6;
            let turn = -0.2 * x + b.random.range(-0.1, 0.1);
            clutter::monitor(b, &middle.at(x, 0.5 * depth - 0.18, height).turn(turn));
        }
        let front = middle.at(0.0, -0.12, height);
        clutter::cover(b, &front, [width - 0.1, depth - 0.3], full);
    }
    let turn = b.random.range(-0.7, 0.7);
    let seat = at.at(
        b.random.range(-0.15, 0.15),
        -depth - b.random.range(0.1, 0.35),
        0.0,
    );
    let seat = seat.turn(std::f32::consts::PI + turn);
    if b.random.chance(0.6) {
        seating::office_chair(b, &seat);
    } else {
        chair(b, &seat);
    }
}
