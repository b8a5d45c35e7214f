//! Lamps; each gives its light.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::random::Random;
use crate::room::Light;
use crate::texture::{Look, Pattern};
use crate::training::colors::oklch;
use crate::training::pieces::tables::metal;

/// Colour of a lamp from candle-warm to a cold tube, around 1.
pub(crate) fn warmth(r: &mut Random) -> Vec3 {
    let warm = Vec3::new(1.35, 0.98, 0.60);
    let cold = Vec3::new(0.93, 1.0, 1.08);
    warm.lerp(cold, r.unit())
}

fn light(center: Vec3, spread: f32, power: Vec3) -> Light {
    Light {
        center,
        spread: [Vec3::X * spread, Vec3::Y * spread],
        facing: Vec3::ZERO,
        power,
    }
}

/// The last `count` solids let light through.
fn shine_through(b: &mut Builder, count: usize) {
    for solid in b.solids.iter_mut().rev().take(count) {
        solid.casts_shadow = false;
    }
}

fn shade_look(b: &mut Builder, on: f32, tint: Vec3) -> Look {
    let paper = oklch(b.random.range(0.75, 0.95), b.random.range(0.0, 0.06), 0.2);
    let pattern = b
        .random
        .pick(&[Pattern::Weave, Pattern::Plain, Pattern::Blank]);
    Look::new(pattern, [paper * tint, paper * tint * 0.95, paper]).glow(1.6 * on)
}

/// Something that hangs from or sits at the ceiling; `at` is on the ceiling. `on` is its strength, 0 if it is off.
pub(crate) fn ceiling_lamp(b: &mut Builder, at: &Place, on: f32, tint: Vec3) -> Light {
    let power = tint * (2.6 * on);
    let frame = metal(b);
    let mut glow = shade_look(b, on, tint);
    glow.gloss = 0.2;
    match b.random.below(5) {
        0 => {
            b.drum(&at.at(0.0, 0.0, -0.04), [0.17, 0.2], 0.08, 0.02, glow);
            shine_through(b, 1);
            light(at.point([0.0, 0.0, -0.11]), 0.15, power)
        }
        1 => {
            // A long box with a tube.
            let long = b.random.range(0.6, 1.3);
            b.block(&at.at(0.0, 0.0, -0.04), [long, 0.12, 0.06], 0.01, glow);
            shine_through(b, 1);
            Light {
                center: at.point([0.0, 0.0, -0.09]),
                spread: [at.axes.x_axis * 0.5 * long, at.axes.y_axis * 0.05],
                facing: -Vec3::Z,
                power: power * 1.4,
            }
        }
        2 => {
            let drop = b.random.range(0.4, 0.8).min(at.origin.z - 2.2).max(0.05);
            b.rod(at, [0.0; 3], [0.0, 0.0, -drop], [0.004, 0.004], frame);
            let radius = b.random.range(0.1, 0.2);
            b.ball(&at.at(0.0, 0.0, -drop - radius), radius, glow);
            shine_through(b, 2);
            light(at.point([0.0, 0.0, -drop - radius]), 0.7 * radius, power)
        }
        3 => {
            // A metal shade, open below: light goes down only.
            let drop = b.random.range(0.5, 0.9).min(at.origin.z - 2.1).max(0.05);
            b.rod(at, [0.0; 3], [0.0, 0.0, -drop], [0.004, 0.004], frame);
            let wide = b.random.range(0.14, 0.26);
            let shade = at.at(0.0, 0.0, -drop - 0.1);
            b.drum(&shade, [wide, 0.05], 0.2, 0.004, frame);
            b.ball(&shade.at(0.0, 0.0, -0.08), 0.05, glow);
            shine_through(b, 2);
            Light {
                facing: -Vec3::Z,
                ..light(shade.point([0.0, 0.0, -0.14]), 0.02, power * 1.2)
            }
        }
        _ => {
            // Three spots on a bar.
            b.block(&at.at(0.0, 0.0, -0.02), [0.7, 0.05, 0.03], 0.004, frame);
            for i in 0..3 {
                let lean = b.random.range(-0.6, 0.6);
                let spot = at.at(0.28 * (i as f32 - 1.0), 0.0, -0.08).lean(lean);
                b.drum(&spot, [0.04, 0.03], 0.1, 0.004, frame);
                b.drum(
                    &spot.at(0.0, 0.0, -0.05),
                    [0.034, 0.034],
                    0.008,
                    0.0,
                    glow.glow(2.5 * on),
                );
            }
            shine_through(b, 6);
            light(at.point([0.0, 0.0, -0.17]), 0.02, power)
        }
    }
}

/// A lamp on the floor or a table, `height` high.
pub(crate) fn standing_lamp(
    b: &mut Builder,
    at: &Place,
    height: f32,
    on: f32,
    tint: Vec3,
) -> Light {
    let frame = if b.random.chance(0.3) {
        b.wood()
    } else {
        metal(b)
    };
    let tall = height > 0.9;
    let wide = if tall {
        b.random.range(0.13, 0.26)
    } else {
        b.random.range(0.07, 0.15)
    };
    let high = wide * b.random.range(0.9, 1.6);
    let stem = height - 0.5 * high;
    let foot = 0.5 * wide + 0.03;
    if tall && b.random.chance(0.3) {
        for i in 0..3 {
            let leg = at.turn(i as f32 * 2.094);
            b.rod(
                &leg,
                [0.0, -0.02, stem],
                [0.0, -0.26, 0.0],
                [0.012, 0.014],
                frame,
            );
        }
    } else if !tall && b.random.chance(0.4) {
        b.drum(
            &at.at(0.0, 0.0, 0.5 * stem),
            [0.7 * wide, 0.3 * wide],
            stem,
            0.01,
            frame,
        );
    } else {
        b.drum(&at.at(0.0, 0.0, 0.0125), [foot, foot], 0.025, 0.004, frame);
        b.rod(
            at,
            [0.0, 0.0, 0.02],
            [0.0, 0.0, stem],
            [0.011, 0.011],
            frame,
        );
    }
    let look = shade_look(b, on, tint);
    let top = wide * b.random.range(0.5, 1.0);
    let shade = at.at(0.0, 0.0, height - 0.5 * high);
    if b.random.chance(0.25) {
        b.ball(&shade, 0.5 * high, look);
    } else {
        b.drum(&shade, [wide, top], high, 0.0, look);
    }
    shine_through(b, 2);
    light(
        shade.origin,
        0.6 * top,
        tint * on * if tall { 1.4 } else { 0.7 },
    )
}

/// A shade of a household's light, warmer by a little.
pub(crate) fn warmth_like(tint: Vec3) -> Vec3 {
    tint.lerp(Vec3::new(1.35, 0.98, 0.60), 0.4)
}
