//! Small things that stand and lie on furniture.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::palette::srgb;
use crate::texture::{Look, Pattern};
use crate::things;
use crate::training::colors::{self, oklch};
use crate::training::pieces::{ring, tables::metal};

/// Something printed: a poster, a map, a photograph.
pub(crate) fn print(b: &mut Builder) -> Look {
    let r = &mut b.random;
    let pattern = r.pick(&[
        Pattern::Poster,
        Pattern::Poster,
        Pattern::Photo,
        Pattern::Photo,
        Pattern::Map,
        Pattern::Art,
    ]);
    let tones = match pattern {
        Pattern::Poster => [
            oklch(r.range(0.75, 0.97), 0.02, r.unit()),
            oklch(r.range(0.1, 0.4), 0.03, r.unit()),
            colors::tone(r),
        ],
        _ => [colors::tone(r), colors::tone(r), colors::tone(r)],
    };
    Look::new(pattern, tones).seed(1 + (r.bits() >> 9))
}

/// Covers the middle of a flat top of `size` with small things, as densely as `full` (0 to 1) says.
pub(crate) fn cover(b: &mut Builder, at: &Place, [width, depth]: [f32; 2], full: f32) {
    let mut x = -0.5 * width;
    while x < 0.5 * width - 0.06 {
        let cell = b.random.range(0.12, 0.34).min(0.5 * width - x);
        let rows = if depth > 0.4 { 2 } else { 1 };
        for row in 0..rows {
            if !b.random.chance(full) {
                continue;
            }
            let deep = depth / rows as f32;
            let y = depth * ((row as f32 + 0.5) / rows as f32 - 0.5);
            let side = (cell - 0.02).min(deep - 0.02);
            let slack = 0.5 * (deep - side).max(0.0);
            let dy = b.random.range(-slack, slack + 1e-3);
            small(b, &at.at(x + 0.5 * cell, y + dy, 0.0), side);
        }
        x += cell;
    }
}

/// One thing that fits on a square of side `side`.
fn small(b: &mut Builder, at: &Place, side: f32) {
    let turn = b.random.range(-0.8, 0.8);
    let at = &at.turn(turn);
    if side < 0.1 {
        match b.random.below(5) {
            0 => bottle(b, at),
            1 => candle(b, at),
            2 => can(b, at),
            3 => things::mug(b, at),
            _ => packet(b, at, 0.75 * side),
        }
        return;
    }
    match b.random.below(if side > 0.2 { 18 } else { 11 }) {
        0 => things::mug(b, at),
        1 => bottle(b, at),
        2 => can(b, at),
        3 => {
            things::stack(b, at, 2);
        }
        4 => things::vase(b, at, b.palette.rug[0].x.clamp(0.12, 0.3)),
        5 => candle(b, at),
        6 => glass(b, at),
        7 | 8 => packet(b, at, 0.6 * side),
        9 => toy(b, at),
        10 => pot(b, at),
        11 => {
            let count = 2 + b.random.below(5);
            things::stack(b, at, count);
        }
        12 => bowl(b, at),
        13 => laptop(b, at),
        14 => papers(b, at),
        15 => things::plant(b, at, 0.7 * side.min(0.45)),
        16 => things::picture(b, &at.at(0.0, 0.02, 0.11).lean(-0.2), 0.16, 0.21),
        _ => things::flowers(b, at),
    }
}

fn bottle(b: &mut Builder, at: &Place) {
    let tone = colors::tone(&mut b.random);
    let look = Look::plain(tone * 0.6).gloss(0.8);
    let (radius, height) = (b.random.range(0.022, 0.042), b.random.range(0.12, 0.3));
    b.drum(
        &at.at(0.0, 0.0, 0.33 * height),
        [radius, radius],
        0.66 * height,
        0.004,
        look,
    );
    b.drum(
        &at.at(0.0, 0.0, 0.75 * height),
        [radius, 0.35 * radius],
        0.2 * height,
        0.002,
        look,
    );
    b.drum(
        &at.at(0.0, 0.0, 0.92 * height),
        [0.35 * radius, 0.38 * radius],
        0.16 * height,
        0.001,
        look,
    );
    if b.random.chance(0.6) {
        let label = print(b);
        let wrap = label.seed(label.seed * 3);
        b.drum(
            &at.at(0.0, 0.0, 0.3 * height),
            [radius + 0.001, radius + 0.001],
            0.3 * height,
            0.0,
            wrap,
        );
    }
}

fn can(b: &mut Builder, at: &Place) {
    let look = print(b).gloss(0.4);
    let (radius, height) = (b.random.range(0.03, 0.055), b.random.range(0.07, 0.15));
    b.drum(
        &at.at(0.0, 0.0, 0.5 * height),
        [radius, radius],
        height,
        0.003,
        look,
    );
}

fn candle(b: &mut Builder, at: &Place) {
    let look = Look::plain(colors::tone(&mut b.random));
    let (radius, height) = (b.random.range(0.012, 0.035), b.random.range(0.06, 0.22));
    b.drum(
        &at.at(0.0, 0.0, 0.5 * height),
        [radius, radius],
        height,
        0.002,
        look,
    );
}

fn glass(b: &mut Builder, at: &Place) {
    let look = Look::plain(oklch(b.random.range(0.6, 0.85), 0.02, 0.6)).gloss(0.9);
    ring(b, at, [0.028, 0.038], 0.11, 0.003, look);
    b.drum(&at.at(0.0, 0.0, 0.005), [0.03, 0.03], 0.01, 0.0, look);
}

/// A printed box of goods.
fn packet(b: &mut Builder, at: &Place, side: f32) {
    let look = print(b).gloss(0.2);
    let size = [
        side,
        side * b.random.range(0.3, 0.9),
        b.random.range(0.05, 0.3),
    ];
    b.block(&at.at(0.0, 0.0, 0.5 * size[2]), size, 0.002, look);
}

/// A toy animal.
pub(crate) fn toy(b: &mut Builder, at: &Place) {
    let look = b.cloth([b.palette.accents[0], b.palette.accents[1]]);
    let s = b.random.range(0.05, 0.09);
    b.ball(&at.at(0.0, 0.0, 0.9 * s), 0.9 * s, look);
    b.ball(&at.at(0.0, -0.2 * s, 2.3 * s), 0.7 * s, look);
    for side in [-1.0, 1.0] {
        b.ball(&at.at(side * 0.5 * s, 0.0, 2.95 * s), 0.28 * s, look);
        b.rod(
            at,
            [side * 0.6 * s, -0.3 * s, s],
            [side * 1.2 * s, -s, 0.4 * s],
            [0.3 * s, 0.3 * s],
            look,
        );
        b.rod(
            at,
            [side * 0.4 * s, -0.4 * s, 0.3 * s],
            [side * 0.6 * s, -1.5 * s, 0.25 * s],
            [0.3 * s, 0.25 * s],
            look,
        );
    }
}

/// A cooking pot with its lid.
pub(crate) fn pot(b: &mut Builder, at: &Place) {
    let steel = metal(b);
    let (radius, height) = (b.random.range(0.06, 0.11), b.random.range(0.06, 0.15));
    b.drum(
        &at.at(0.0, 0.0, 0.5 * height),
        [radius, radius],
        height,
        0.004,
        steel,
    );
    b.drum(
        &at.at(0.0, 0.0, height + 0.008),
        [radius, 0.5 * radius],
        0.016,
        0.0,
        steel,
    );
    b.ball(&at.at(0.0, 0.0, height + 0.022), 0.012, steel);
    b.rod(
        at,
        [radius, 0.0, 0.8 * height],
        [radius + 0.1, 0.0, 0.8 * height],
        [0.008, 0.008],
        steel,
    );
}

/// A hollow bowl, sometimes with fruit in it.
fn bowl(b: &mut Builder, at: &Place) {
    let tone = colors::tone(&mut b.random);
    let look = Look::new(Pattern::Speckle, [tone, tone * 0.6, tone * 1.2]).gloss(0.5);
    let radius = b.random.range(0.08, 0.13);
    b.drum(
        &at.at(0.0, 0.0, 0.008),
        [0.5 * radius, 0.55 * radius],
        0.016,
        0.0,
        look,
    );
    ring(b, at, [0.5 * radius, radius], 0.07, 0.006, look);
    for i in 0..b.random.below(6) {
        let fruit = Look::new(Pattern::Leaf, [colors::tone(&mut b.random); 3]).gloss(0.3);
        let place = at.turn(i as f32 * 1.9).at(0.4 * radius, 0.0, 0.05);
        b.ball(&place, 0.033, fruit);
    }
}

fn laptop(b: &mut Builder, at: &Place) {
    let shell = metal(b);
    let keys = Look::new(
        Pattern::Wicker,
        [Vec3::splat(0.02), Vec3::splat(0.06), Vec3::splat(0.06)],
    );
    b.block(&at.at(0.0, 0.0, 0.008), [0.32, 0.22, 0.016], 0.004, shell);
    b.block(&at.at(0.0, 0.02, 0.0165), [0.28, 0.11, 0.002], 0.0, keys);
    let lean = b.random.range(0.1, 0.6);
    let lid = at.at(0.0, 0.11, 0.014).lean(-lean);
    b.block(&lid.at(0.0, 0.0, 0.11), [0.32, 0.008, 0.22], 0.003, shell);
    let face = screen(b);
    b.block(&lid.at(0.0, -0.005, 0.112), [0.3, 0.002, 0.195], 0.0, face);
}

/// A screen, on or off.
fn screen(b: &mut Builder) -> Look {
    if b.random.chance(0.4) {
        return Look::plain(srgb(0x101214)).gloss(0.8);
    }
    if b.random.chance(0.5) {
        return print(b).glow(0.7).gloss(0.3);
    }
    let r = &mut b.random;
    let back = if r.chance(0.5) {
        oklch(0.2, 0.03, r.unit())
    } else {
        oklch(0.95, 0.01, 0.5)
    };
    let ink = Vec3::splat(0.75 - 0.7 * back.y.min(1.0));
    Look::new(Pattern::Screen, [back, ink, colors::tone(r)])
        .glow(0.8)
        .gloss(0.3)
}

pub(crate) fn monitor(b: &mut Builder, at: &Place) {
    let dark = Look::plain(oklch(b.random.range(0.15, 0.4), 0.01, 0.6)).gloss(0.3);
    let (w, h) = (b.random.range(0.46, 0.72), b.random.range(0.28, 0.38));
    b.block(&at.at(0.0, 0.0, 0.008), [0.22, 0.17, 0.016], 0.004, dark);
    b.rod(
        at,
        [0.0, 0.02, 0.01],
        [0.0, 0.02, 0.2],
        [0.018, 0.018],
        dark,
    );
    b.block(&at.at(0.0, 0.0, 0.13 + 0.5 * h), [w, 0.03, h], 0.006, dark);
    let face = screen(b);
    b.block(
        &at.at(0.0, -0.0155, 0.135 + 0.5 * h),
        [w - 0.024, 0.003, h - 0.03],
        0.0,
        face,
    );
}

fn papers(b: &mut Builder, at: &Place) {
    for i in 0..1 + b.random.below(4) {
        let look = print(b);
        let (x, y, turn) = (
            b.random.range(-0.05, 0.05),
            b.random.range(-0.05, 0.05),
            b.random.range(-0.6, 0.6),
        );
        b.block(
            &at.at(x, y, 0.001 + 0.002 * i as f32).turn(turn),
            [0.21, 0.29, 0.002],
            0.0,
            look,
        );
    }
}
