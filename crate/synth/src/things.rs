//! The small things that make a room lived in.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::palette::{book, srgb};
use crate::texture::{Look, Pattern};

/// Books lying on each other, from the place's origin upwards. Gives the height of the stack.
pub(crate) fn stack(b: &mut Builder, at: &Place, count: u32) -> f32 {
    let mut z = 0.0;
    for _ in 0..count {
        let thick = b.random.range(0.02, 0.045);
        let size = [thick, b.random.range(0.15, 0.19), b.random.range(0.2, 0.26)];
        let turn = b.random.range(-0.35, 0.35);
        let look = spine(b);
        // A standing book lies down: its x becomes up.
        let place = at
            .at(0.0, 0.0, z + 0.5 * thick)
            .turn(turn)
            .roll(-std::f32::consts::FRAC_PI_2);
        b.block(&place, size, 0.0, look);
        z += thick;
    }
    z
}

pub(crate) fn spine(b: &mut Builder) -> Look {
    let cover = book(&mut b.random);
    let band = if b.random.chance(0.5) {
        srgb(0xD9B45A)
    } else {
        srgb(0xEFE9DC)
    };
    Look::new(Pattern::Spine, [cover, band, srgb(0xE9E0CC)]).gloss(0.15)
}

pub(crate) fn mug(b: &mut Builder, at: &Place) {
    let tone = b.accent();
    let look = Look::new(Pattern::Speckle, [tone, tone * 0.4, srgb(0xF2EEE4)]).gloss(0.5);
    b.drum(&at.at(0.0, 0.0, 0.048), [0.036, 0.042], 0.096, 0.005, look);
    b.drum(
        &at.at(0.0, 0.0, 0.0965),
        [0.035, 0.035],
        0.002,
        0.0,
        Look::plain(srgb(0x3B2416)).gloss(0.6),
    );
    b.block(&at.at(0.05, 0.0, 0.05), [0.03, 0.012, 0.055], 0.005, look);
}

pub(crate) fn bowl(b: &mut Builder, at: &Place) {
    let look = Look::new(
        Pattern::Speckle,
        [srgb(0xE9E2D2), srgb(0x7B6A55), srgb(0xB59A74)],
    )
    .gloss(0.3);
    b.drum(&at.at(0.0, 0.0, 0.035), [0.06, 0.135], 0.07, 0.004, look);
    let fruit = [0xD8432F, 0xE9A02B, 0x9BB53C, 0xE0732B];
    for i in 0..7 {
        let ring = if i == 0 { 0.0 } else { 0.078 };
        let place = at
            .turn(i as f32 * 1.05)
            .at(ring, 0.0, if i == 0 { 0.125 } else { 0.088 });
        let tone = srgb(b.random.pick(&fruit));
        let radius = b.random.range(0.034, 0.042);
        b.ball(
            &place,
            radius,
            Look::new(Pattern::Leaf, [tone, tone * 0.8, tone]).gloss(0.35),
        );
    }
}

pub(crate) fn vase(b: &mut Builder, at: &Place, height: f32) {
    let tone = b.accent();
    let look = Look::new(Pattern::Speckle, [tone, tone * 0.5, srgb(0xF4EEE2)]).gloss(0.45);
    let r = 0.32 * height;
    b.drum(
        &at.at(0.0, 0.0, 0.3 * height),
        [0.7 * r, r],
        0.6 * height,
        0.02,
        look,
    );
    b.drum(
        &at.at(0.0, 0.0, 0.75 * height),
        [0.95 * r, 0.4 * r],
        0.34 * height,
        0.01,
        look,
    );
    b.drum(
        &at.at(0.0, 0.0, 0.95 * height),
        [0.4 * r, 0.5 * r],
        0.1 * height,
        0.004,
        look,
    );
}

/// A vase with round flowers.
pub(crate) fn flowers(b: &mut Builder, at: &Place) {
    vase(b, at, 0.22);
    let green = Look::plain(srgb(0x4F7A3A));
    for i in 0..7 {
        let lean = b.random.range(0.1, 0.5);
        let height = b.random.range(0.16, 0.26);
        let stem = at.at(0.0, 0.0, 0.21).turn(i as f32 * 0.9).lean(lean);
        b.rod(&stem, [0.0; 3], [0.0, 0.0, height], [0.005, 0.004], green);
        let tone = b.accent();
        let size = b.random.range(0.028, 0.042);
        b.ball(
            &stem.at(0.0, 0.0, height),
            size,
            Look::new(Pattern::Speckle, [tone, tone * 0.6, tone * 1.2]),
        );
    }
}

/// A pot plant: round leaves on leaning stems, or upright blades. `scale` 1 is 1.3 m high.
pub(crate) fn plant(b: &mut Builder, at: &Place, scale: f32) {
    let s = scale;
    let clay = [b.accent(), b.palette.rug[0]];
    let pot = Look::new(Pattern::Speckle, [clay[0], clay[1], clay[1] * 0.6]).gloss(0.2);
    b.drum(
        &at.at(0.0, 0.0, 0.17 * s),
        [0.13 * s, 0.18 * s],
        0.34 * s,
        0.012 * s,
        pot,
    );
    let soil = Look::new(
        Pattern::Speckle,
        [srgb(0x35261C), srgb(0x57412F), srgb(0x221811)],
    );
    b.drum(
        &at.at(0.0, 0.0, 0.338 * s),
        [0.155 * s, 0.155 * s],
        0.012 * s,
        0.0,
        soil,
    );
    let (dark, light) = b.random.pick(&[
        (0x2F5B33, 0x6FA04E),
        (0x27503F, 0x5E9873),
        (0x3F6A2C, 0x8CB356),
    ]);
    let leaf = Look::new(Pattern::Leaf, [srgb(dark), srgb(light), srgb(light)]).gloss(0.25);
    if b.random.chance(0.3) {
        for i in 0..13 {
            let height = b.random.range(0.45, 0.85) * s;
            let lean = b.random.range(0.03, 0.28);
            let blade = at
                .at(0.0, 0.0, 0.33 * s)
                .turn(i as f32 * 2.4)
                .at(0.0, -0.06 * s, 0.0)
                .lean(lean);
            b.rod(
                &blade,
                [0.0; 3],
                [0.0, 0.0, height],
                [0.028 * s, 0.006 * s],
                leaf,
            );
        }
        return;
    }
    let bark = Look::new(
        Pattern::Wood,
        [srgb(0x5B4632), srgb(0x7E6647), srgb(0x7E6647)],
    );
    for i in 0..6 {
        let lean = if i == 0 {
            0.04
        } else {
            b.random.range(0.16, 0.42)
        };
        let height = b.random.range(0.62, 0.98) * s;
        let stem = at.at(0.0, 0.0, 0.33 * s).turn(i as f32 * 1.26).lean(lean);
        b.rod(
            &stem,
            [0.0; 3],
            [0.0, 0.0, height],
            [0.011 * s, 0.006 * s],
            bark,
        );
        let count = 7;
        for j in 0..count {
            let up = height * (0.4 + 0.6 * j as f32 / (count - 1) as f32);
            let around = j as f32 * 2.4 + i as f32;
            let droop = b.random.range(0.25, 0.8);
            let size = b.random.range(0.07, 0.1) * s;
            let blade = stem
                .at(0.0, 0.0, up)
                .turn(around)
                .lean(droop)
                .at(0.0, -size * 1.1, 0.0);
            b.drum(&blade, [size, size * 0.94], 0.009 * s, 0.0, leaf);
        }
    }
}

/// A picture in a frame, hanging flat against y = 0 with its middle at the origin.
pub(crate) fn picture(b: &mut Builder, at: &Place, width: f32, height: f32) {
    let frame = b.random.pick(&[0x2B2A29, 0xF1EEE8, 0xB08A55]);
    let look = Look::plain(srgb(frame)).gloss(0.2);
    let rim = 0.028;
    for side in [-1.0, 1.0] {
        b.block(
            &at.at(side * 0.5 * (width - rim), -0.015, 0.0),
            [rim, 0.03, height],
            0.0,
            look,
        );
        b.block(
            &at.at(0.0, -0.015, side * 0.5 * (height - rim)),
            [width - 2.0 * rim, 0.03, rim],
            0.0,
            look,
        );
    }
    let tones = b.accents();
    let art = Look::new(Pattern::Art, tones).gloss(0.1);
    b.block(
        &at.at(0.0, -0.009, 0.0),
        [width - rim, 0.018, height - rim],
        0.0,
        art,
    );
}

pub(crate) fn clock(b: &mut Builder, at: &Place) {
    let face = at.at(0.0, -0.02, 0.0).lean(std::f32::consts::FRAC_PI_2);
    b.drum(
        &face,
        [0.16, 0.16],
        0.04,
        0.006,
        Look::plain(srgb(0x2C2E30)).gloss(0.4),
    );
    b.drum(
        &face.at(0.0, 0.0, 0.0205),
        [0.142, 0.142],
        0.003,
        0.0,
        Look::plain(srgb(0xF5F2EA)),
    );
    let hand = Look::plain(srgb(0x1E1F21));
    for (turn, length, width) in [(0.9, 0.075, 0.012), (-1.5, 0.115, 0.008)] {
        let place = face.turn(turn).at(0.0, 0.5 * length - 0.012, 0.0235);
        b.block(&place, [width, length, 0.003], 0.0, hand);
    }
}

pub(crate) fn cartons(b: &mut Builder, at: &Place) {
    let board = Look::new(
        Pattern::Cardboard,
        [srgb(0xB98B5E), srgb(0xD8C39A), srgb(0xB98B5E)],
    );
    let mut z = 0.0;
    for i in 0..2 {
        let size = [
            b.random.range(0.34, 0.44),
            b.random.range(0.28, 0.34),
            b.random.range(0.22, 0.3),
        ];
        let turn = b.random.range(-0.25, 0.25);
        b.block(
            &at.at(0.0, -0.02 * i as f32, z + 0.5 * size[2]).turn(turn),
            size,
            0.0,
            board,
        );
        z += size[2];
    }
}

/// A basket with a rolled blanket and a ball.
pub(crate) fn basket(b: &mut Builder, at: &Place) {
    let straw = Look::new(
        Pattern::Wicker,
        [srgb(0x9A6F42), srgb(0xD0A972), srgb(0xD0A972)],
    );
    b.drum(&at.at(0.0, 0.0, 0.16), [0.17, 0.21], 0.32, 0.02, straw);
    let tones = b.accents();
    let wool = b.cloth([tones[0] * 0.8, tones[0]]);
    b.ball(&at.at(-0.07, 0.03, 0.31), 0.1, wool);
    let ball = Look::new(Pattern::Stripes, [tones[1], Vec3::splat(0.8), tones[0]]).gloss(0.2);
    b.ball(&at.at(0.09, -0.04, 0.3), 0.085, ball);
}

/// A lamp with a shade; gives the point in the shade where the light is.
pub(crate) fn lamp(b: &mut Builder, at: &Place, height: f32) -> Vec3 {
    let metal = Look::plain(srgb(0x7A6242)).gloss(0.6);
    let foot = if height > 1.0 { 0.14 } else { 0.075 };
    let shade = if height > 1.0 { 0.21 } else { 0.13 };
    b.drum(
        &at.at(0.0, 0.0, 0.0125),
        [foot, foot * 0.96],
        0.025,
        0.004,
        metal,
    );
    b.rod(
        at,
        [0.0, 0.0, 0.02],
        [0.0, 0.0, height - 0.05],
        [0.013, 0.011],
        metal,
    );
    let cloth = Look::new(
        Pattern::Weave,
        [srgb(0xE8C99A), srgb(0xF6E3BF), srgb(0xF6E3BF)],
    )
    .glow(0.75);
    b.drum(
        &at.at(0.0, 0.0, height),
        [shade, 0.68 * shade],
        1.35 * shade,
        0.0,
        cloth,
    );
    if let Some(last) = b.solids.last_mut() {
        last.casts_shadow = false;
    }
    at.point([0.0, 0.0, height])
}
