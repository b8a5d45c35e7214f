//! Larger things that stand or lie on the floor.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::palette::srgb;
use crate::texture::{Look, Pattern};
use crate::training::colors::{self, oklch};
use crate::training::pieces::clutter::{cover, toy};
use crate::training::pieces::{open_box, ring};
use crate::{seating, things};

/// Something larger that stands or lies on the floor, within half a metre.
pub(crate) fn on_floor(b: &mut Builder, at: &Place) {
    colors::vary(b);
    match b.random.below(15) {
        0 => things::cartons(b, at),
        1 => things::basket(b, at),
        2 => seating::pouf(b, at),
        3 => shoes(b, at),
        4 => bag(b, at),
        5 => {
            let look = Look::new(
                Pattern::Cardboard,
                [srgb(0xB98B5E), srgb(0xD8C39A), srgb(0xB98B5E)],
            );
            let size = [
                b.random.range(0.25, 0.5),
                b.random.range(0.25, 0.4),
                b.random.range(0.18, 0.4),
            ];
            open_box(b, at, size, 0.008, look);
            cover(
                b,
                &at.at(0.0, 0.0, 0.01),
                [0.7 * size[0], 0.7 * size[1]],
                0.7,
            );
        }
        6 => {
            let look = Look::plain(colors::tone(&mut b.random)).gloss(0.3);
            let (low, high) = (b.random.range(0.1, 0.15), b.random.range(0.12, 0.19));
            let height = b.random.range(0.22, 0.4);
            ring(b, at, [low, high], height, 0.006, look);
            b.drum(&at.at(0.0, 0.0, 0.01), [low, low], 0.02, 0.0, look);
        }
        7 => {
            let tones = b.accents();
            let look =
                Look::new(Pattern::Stripes, [tones[1], Vec3::splat(0.8), tones[0]]).gloss(0.3);
            let radius = b.random.range(0.07, 0.16);
            b.ball(&at.at(0.0, 0.0, radius), radius, look);
        }
        8 => clothes(b, at),
        9 => suitcase(b, at),
        10 => cover(b, at, [0.7, 0.6], 0.6),
        11 => things::plant(b, at, b.palette.rug[1].y.clamp(0.3, 0.8)),
        12 => toy(b, at),
        13 => cable(b, at),
        _ => {
            let count = 3 + b.random.below(8);
            things::stack(b, at, count);
        }
    }
}

fn shoes(b: &mut Builder, at: &Place) {
    let look = Look::new(Pattern::Leather, [colors::tone(&mut b.random) * 0.6; 3]).gloss(0.3);
    let sole = Look::plain(oklch(b.random.range(0.2, 0.95), 0.01, 0.2));
    for side in [-1.0, 1.0] {
        let turn = b.random.range(-0.4, 0.4);
        let shoe = at
            .at(side * 0.07, b.random.range(-0.05, 0.05), 0.0)
            .turn(turn);
        b.block(&shoe.at(0.0, 0.0, 0.015), [0.095, 0.28, 0.03], 0.012, sole);
        b.block(&shoe.at(0.0, -0.04, 0.055), [0.09, 0.19, 0.06], 0.028, look);
        b.block(&shoe.at(0.0, 0.07, 0.075), [0.085, 0.13, 0.1], 0.03, look);
    }
}

fn bag(b: &mut Builder, at: &Place) {
    let look = b.cloth(b.palette.sofa);
    let size = [
        b.random.range(0.28, 0.4),
        b.random.range(0.14, 0.2),
        b.random.range(0.35, 0.5),
    ];
    let lean = b.random.range(-0.1, 0.3);
    let body = at.at(0.0, 0.0, 0.5 * size[2]).lean(lean);
    b.block(&body, size, 0.4 * size[1], look);
    b.block(
        &body.at(0.0, -0.5 * size[1], -0.1),
        [0.7 * size[0], 0.08, 0.18],
        0.035,
        look,
    );
    for side in [-1.0, 1.0] {
        let x = side * 0.22 * size[0];
        b.rod(
            &body,
            [x, 0.08, 0.45 * size[2]],
            [x, 0.12, -0.3 * size[2]],
            [0.018, 0.015],
            look,
        );
    }
}

fn suitcase(b: &mut Builder, at: &Place) {
    let look = Look::new(Pattern::Bands, [colors::tone(&mut b.random); 3])
        .gloss(0.4)
        .scale(0.3);
    let dark = Look::plain(Vec3::splat(0.03));
    let height = b.random.range(0.5, 0.7);
    b.block(
        &at.at(0.0, 0.0, 0.04 + 0.5 * height),
        [0.4, 0.24, height],
        0.03,
        look,
    );
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        b.ball(&at.at(x * 0.16, y * 0.09, 0.025), 0.025, dark);
    }
    for x in [-0.1, 0.1] {
        b.rod(
            at,
            [x, 0.08, height],
            [x, 0.08, height + 0.35],
            [0.007, 0.007],
            dark,
        );
    }
    b.block(
        &at.at(0.0, 0.08, height + 0.35),
        [0.23, 0.03, 0.025],
        0.008,
        dark,
    );
}

/// A heap of clothes.
fn clothes(b: &mut Builder, at: &Place) {
    for i in 0..3 + b.random.below(4) {
        let tone = colors::tone(&mut b.random);
        let look = Look::new(Pattern::Folds, [tone, tone * 0.8, tone]);
        let (x, y) = (b.random.range(-0.16, 0.16), b.random.range(-0.16, 0.16));
        let (turn, lean) = (b.random.range(0.0, 3.1), b.random.range(-0.3, 0.3));
        let size = [
            b.random.range(0.2, 0.42),
            b.random.range(0.15, 0.3),
            b.random.range(0.06, 0.12),
        ];
        b.block(
            &at.at(x, y, 0.05 + 0.03 * i as f32).turn(turn).lean(lean),
            size,
            0.48 * size[2],
            look,
        );
    }
}

/// A cable along the floor.
fn cable(b: &mut Builder, at: &Place) {
    let look = Look::plain(oklch(b.random.pick(&[0.15, 0.9, 0.6]), 0.01, 0.2));
    let mut from = [-0.4, 0.0, 0.006];
    for i in 1..=7 {
        let to = [-0.4 + 0.13 * i as f32, b.random.range(-0.2, 0.2), 0.006];
        b.rod(at, from, to, [0.005, 0.005], look);
        from = to;
    }
    b.block(&at.at(0.5, 0.0, 0.02), [0.25, 0.05, 0.04], 0.008, look);
}
