//! Colours and finishes for rooms to learn from, from blank paint to loud patterns.

use glam::Vec3;

use crate::builder::Builder;
use crate::palette::Palette;
use crate::random::Random;
use crate::texture::{Look, Pattern};

/// Linear RGB of a colour in Oklch (Ottosson 2020): lightness 0 to 1, chroma 0 to 0.3, hue in turns.
pub(crate) fn oklch(lightness: f32, chroma: f32, hue: f32) -> Vec3 {
    let (sin, cos) = libm::sincosf(hue * std::f32::consts::TAU);
    let (a, b) = (chroma * cos, chroma * sin);
    let cube = |v: f32| v * v * v;
    let l = cube(lightness + 0.396_337_78 * a + 0.215_803_76 * b);
    let m = cube(lightness - 0.105_561_346 * a - 0.063_854_17 * b);
    let s = cube(lightness - 0.089_484_18 * a - 1.291_485_5 * b);
    Vec3::new(
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_38 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    )
    .clamp(Vec3::splat(0.012), Vec3::splat(0.93))
}

/// Darker and lighter tone of a wood, from bleached birch to wenge.
pub(crate) fn wood(r: &mut Random) -> [Vec3; 2] {
    let light = r.range(0.36, 0.86);
    let chroma = r.range(0.03, 0.11) * (1.2 - 0.6 * light);
    let hue = r.range(0.13, 0.22);
    [
        oklch(light - r.range(0.05, 0.12), chroma, hue),
        oklch(light, chroma, hue + 0.01),
    ]
}

/// Any colour that cloth or paint may have: mostly quiet ones.
pub(crate) fn tone(r: &mut Random) -> Vec3 {
    let chroma = match r.below(20) {
        0..=9 => r.range(0.0, 0.025),
        10..=16 => r.range(0.025, 0.08),
        _ => r.range(0.08, 0.17),
    };
    // Reds, yellows and blues are commoner in rooms than greens and purples.
    let hue = r.pick(&[0.08, 0.15, 0.2, 0.25, 0.4, 0.6, 0.68, 0.95]) + r.range(-0.05, 0.05);
    oklch(r.range(0.22, 0.9), chroma, hue)
}

fn pair(r: &mut Random) -> [Vec3; 2] {
    let base = tone(r);
    [base * r.range(0.6, 0.85), base * r.range(1.0, 1.2)]
}

/// Wall paint: mostly off-white.
pub(crate) fn paint(r: &mut Random) -> Vec3 {
    if r.chance(0.6) {
        oklch(
            r.range(0.86, 0.96),
            r.range(0.0, 0.025),
            r.range(0.12, 0.35),
        )
    } else {
        oklch(r.range(0.5, 0.9), r.range(0.0, 0.06), r.unit())
    }
}

/// Colours for a whole dwelling.
pub(crate) fn palette(r: &mut Random) -> Palette {
    let accents = [tone(r), tone(r), tone(r), tone(r)];
    Palette {
        wall: paint(r),
        accent_wall: [paint(r), tone(r)],
        floor: wood(r),
        wood: wood(r),
        sofa: pair(r),
        accents,
        rug: [tone(r), tone(r), tone(r)],
    }
}

/// Other wood, cloth and accents for the next piece; half of what stands in a room is of one make.
pub(crate) fn vary(b: &mut Builder) {
    let r = &mut b.random;
    if r.chance(0.5) {
        b.palette.wood = wood(r);
        b.grain = Pattern::Wood;
        if r.chance(0.4) {
            // Painted.
            let paint = if r.chance(0.5) {
                oklch(r.range(0.85, 0.95), 0.01, 0.2)
            } else {
                tone(r)
            };
            b.palette.wood = [paint, paint];
            b.grain = r.pick(&[Pattern::Plain, Pattern::Blank]);
        }
    }
    if r.chance(0.5) {
        b.palette.sofa = pair(r);
        b.weave = r.pick(&[
            Pattern::Weave,
            Pattern::Weave,
            Pattern::Carpet,
            Pattern::Leather,
            Pattern::Plain,
            Pattern::Checks,
            Pattern::Stripes,
            Pattern::Folds,
        ]);
    }
    if r.chance(0.6) {
        b.palette.accents = [tone(r), tone(r), tone(r), tone(r)];
        b.palette.rug = [tone(r), tone(r), tone(r)];
    }
}

/// One of `choices` by weight.
pub(crate) fn weighted<T: Copy>(r: &mut Random, choices: &[(T, u32)]) -> Option<T> {
    let total: u32 = choices.iter().map(|choice| choice.1).sum();
    let mut left = r.below(total.max(1));
    choices.iter().find_map(|&(value, weight)| {
        if left < weight {
            return Some(value);
        }
        left -= weight;
        None
    })
}

/// Near and far tone around `base`.
fn around(r: &mut Random, base: Vec3, spread: f32) -> [Vec3; 2] {
    [
        base * r.range(1.0 - spread, 1.0),
        base * r.range(1.0, 1.0 + 0.6 * spread),
    ]
}

/// What a wall is covered with; `wet` in kitchens and baths.
pub(crate) fn wall(r: &mut Random, wet: bool) -> Look {
    let kinds = [
        (Pattern::Blank, 14),
        (Pattern::Plain, 8),
        (Pattern::Plaster, 30),
        (Pattern::Wallpaper, 7),
        (Pattern::Flowers, 7),
        (Pattern::Bands, 6),
        (Pattern::Bricks, 7),
        (Pattern::Panels, 6),
        (Pattern::Concrete, 8),
        (Pattern::Tiles, if wet { 60 } else { 3 }),
    ];
    let kind = weighted(r, &kinds).unwrap_or(Pattern::Plaster);
    let base = paint(r);
    let look = match kind {
        Pattern::Bricks => {
            let brick = match r.below(3) {
                0 => oklch(r.range(0.78, 0.92), 0.01, 0.2),
                _ => oklch(
                    r.range(0.42, 0.62),
                    r.range(0.06, 0.12),
                    r.range(0.08, 0.15),
                ),
            };
            let [a, b] = around(r, brick, 0.35);
            Look::new(kind, [a, b, oklch(r.range(0.6, 0.85), 0.015, 0.2)])
        }
        Pattern::Panels => {
            let [dark, light] = if r.chance(0.5) {
                wood(r)
            } else {
                around(r, base, 0.1)
            };
            Look::new(kind, [dark, light, light]).gloss(0.1)
        }
        Pattern::Concrete => Look::new(kind, [oklch(r.range(0.55, 0.85), 0.008, r.unit()); 3]),
        Pattern::Tiles => tiles(r, base),
        _ => {
            let other = base.lerp(tone(r), r.range(0.1, 0.6));
            Look::new(kind, [base, other, tone(r)])
        }
    };
    let scale = r.range(0.7, 1.5);
    look.scale(scale)
}

fn tiles(r: &mut Random, base: Vec3) -> Look {
    let spread = r.range(0.02, 0.3);
    let [a, mut b] = around(r, base, spread);
    if r.chance(0.2) {
        b = tone(r);
    }
    let joint = if r.chance(0.6) {
        base * 0.7
    } else {
        oklch(r.range(0.3, 0.9), 0.01, 0.2)
    };
    Look::new(Pattern::Tiles, [a, b, joint]).gloss(r.range(0.1, 0.6))
}

/// What a floor is covered with.
pub(crate) fn floor(r: &mut Random, wet: bool) -> Look {
    let kinds = [
        (Pattern::Planks, 30),
        (Pattern::Parquet, 12),
        (Pattern::Tiles, if wet { 50 } else { 12 }),
        (Pattern::Carpet, if wet { 2 } else { 20 }),
        (Pattern::Concrete, 8),
        (Pattern::Marble, 5),
        (Pattern::Terrazzo, 6),
        (Pattern::Plain, 5),
    ];
    let kind = weighted(r, &kinds).unwrap_or(Pattern::Planks);
    let scale = r.range(0.7, 1.7);
    let base = oklch(r.range(0.4, 0.85), r.range(0.0, 0.05), r.range(0.1, 0.3));
    let look = match kind {
        Pattern::Planks | Pattern::Parquet => {
            let [dark, light] = wood(r);
            Look::new(kind, [dark * r.range(0.7, 1.0), light, light]).gloss(r.range(0.05, 0.4))
        }
        Pattern::Tiles => tiles(r, base).scale(1.5),
        Pattern::Carpet => {
            let pile = oklch(r.range(0.3, 0.8), r.range(0.0, 0.05), r.unit());
            Look::new(
                kind,
                [pile * r.range(0.7, 0.9), pile, tone(r).lerp(pile, 0.5)],
            )
        }
        Pattern::Marble => {
            Look::new(kind, [base, base * r.range(0.3, 0.7), tone(r)]).gloss(r.range(0.2, 0.6))
        }
        Pattern::Terrazzo => Look::new(kind, [base, base * 0.45, tone(r)]).gloss(0.3),
        Pattern::Concrete => Look::new(kind, [base; 3]).gloss(r.range(0.0, 0.3)),
        _ => Look::new(kind, [base; 3]).gloss(r.range(0.0, 0.4)),
    };
    look.scale(scale * look.scale)
}

/// What a ceiling is made of: white paint, boards, or the plates of an office.
pub(crate) fn ceiling(r: &mut Random) -> Look {
    let white = oklch(r.range(0.88, 0.97), r.range(0.0, 0.02), 0.25);
    match r.below(12) {
        0 => {
            let [dark, light] = wood(r);
            Look::new(Pattern::Panels, [dark, light, light])
        }
        1 => Look::new(Pattern::Tiles, [white, white * 0.95, white * 0.6]).scale(3.0),
        2 => Look::new(Pattern::Concrete, [white * r.range(0.5, 0.9); 3]),
        3 => Look::new(Pattern::Plaster, [paint(r); 3]),
        4..=6 => Look::new(Pattern::Blank, [white; 3]),
        _ => Look::new(Pattern::Plaster, [white; 3]),
    }
}
