//! What one sits on.

use glam::Vec3;

use crate::builder::{Builder, Place};
use crate::palette::srgb;
use crate::texture::{Look, Pattern};

/// A sofa with its back against y = 0; one seat makes it an armchair. `width` in metres.
pub(crate) fn sofa(b: &mut Builder, at: &Place, width: f32, seats: u32, tones: [Vec3; 2]) {
    let cloth = b.cloth(tones);
    let light = b.cloth([tones[0].lerp(tones[1], 0.4), tones[1] * 1.08]);
    let wood = b.wood();
    for (x, y) in [(-1.0, -0.1), (1.0, -0.1), (-1.0, -0.84), (1.0, -0.84)] {
        let foot = at.at(x * (0.5 * width - 0.1), y, 0.05);
        b.drum(&foot, [0.018, 0.028], 0.1, 0.0, wood);
    }
    b.block(&at.at(0.0, -0.47, 0.2), [width, 0.88, 0.21], 0.03, cloth);
    b.block(
        &at.at(0.0, -0.13, 0.5).lean(-0.06),
        [width - 0.1, 0.2, 0.66],
        0.07,
        cloth,
    );
    let inner = width - 0.36;
    let each = inner / seats as f32;
    for side in [-1.0, 1.0] {
        b.block(
            &at.at(side * (0.5 * width - 0.1), -0.47, 0.36),
            [0.2, 0.9, 0.5],
            0.07,
            cloth,
        );
    }
    for seat in 0..seats {
        let x = -0.5 * inner + (seat as f32 + 0.5) * each;
        b.block(
            &at.at(x, -0.58, 0.38),
            [each - 0.008, 0.68, 0.18],
            0.06,
            light,
        );
        let back = at.at(x, -0.3, 0.63).lean(-0.22);
        b.block(&back, [each - 0.012, 0.19, 0.42], 0.085, light);
    }
    pillows(b, at, inner, seats);
    if seats > 1 {
        throw(b, &at.at(0.5 * width - 0.1, -0.55, 0.61));
    }
}

fn pillows(b: &mut Builder, at: &Place, inner: f32, seats: u32) {
    let spots: &[f32] = if seats > 1 {
        &[-0.4, -0.24, 0.36]
    } else {
        &[0.0]
    };
    for (i, spot) in spots.iter().enumerate() {
        let [ground, band, _] = b.accents();
        let tones = [ground, band, b.palette.rug[0]];
        let pattern = b
            .random
            .pick(&[Pattern::Checks, Pattern::Stripes, Pattern::Weave]);
        let yaw = b.random.range(-0.3, 0.3);
        let size = b.random.range(0.38, 0.44);
        let place = at.at(
            spot * inner,
            -0.47 - 0.05 * (i % 2) as f32,
            0.46 + 0.47 * size,
        );
        b.block(
            &place.turn(yaw).lean(-0.4),
            [size, 0.15, size],
            0.07,
            Look::new(pattern, tones),
        );
    }
}

/// A blanket over an arm rest of the sofa.
fn throw(b: &mut Builder, top: &Place) {
    let look = Look::new(Pattern::Checks, [b.palette.rug[0], b.accent(), b.accent()]);
    b.block(&top.at(0.0, 0.0, 0.006), [0.235, 0.46, 0.03], 0.014, look);
    b.block(&top.at(0.11, 0.0, -0.17), [0.03, 0.46, 0.36], 0.014, look);
    b.block(&top.at(-0.11, 0.0, -0.06), [0.03, 0.46, 0.14], 0.014, look);
}

/// A wooden chair that looks to -y, its seat's middle over the origin.
pub(crate) fn chair(b: &mut Builder, at: &Place) {
    let wood = b.wood();
    let tone = b.accent();
    for x in [-1.0, 1.0] {
        b.rod(
            at,
            [x * 0.17, -0.16, 0.44],
            [x * 0.21, -0.2, 0.0],
            [0.02, 0.013],
            wood,
        );
        b.rod(
            at,
            [x * 0.17, 0.16, 0.44],
            [x * 0.2, 0.22, 0.0],
            [0.02, 0.013],
            wood,
        );
        b.rod(
            at,
            [x * 0.18, 0.17, 0.44],
            [x * 0.19, 0.25, 0.86],
            [0.019, 0.015],
            wood,
        );
    }
    b.block(&at.at(0.0, 0.0, 0.45), [0.44, 0.43, 0.03], 0.012, wood);
    for (y, z) in [(0.2, 0.58), (0.22, 0.69), (0.24, 0.81)] {
        b.block(
            &at.at(0.0, y, z).lean(-0.18),
            [0.38, 0.018, 0.065],
            0.008,
            wood,
        );
    }
    let cushion = b.cloth([tone * 0.8, tone]);
    b.block(&at.at(0.0, -0.01, 0.48), [0.38, 0.37, 0.05], 0.024, cushion);
}

/// An office chair on a star of five feet, looking to -y.
pub(crate) fn office_chair(b: &mut Builder, at: &Place) {
    let metal = Look::plain(srgb(0x3A3D40)).gloss(0.4);
    let tone = b.accent();
    let cloth = b.cloth([tone * 0.75, tone]);
    for foot in 0..5 {
        let arm = at.turn(foot as f32 * std::f32::consts::TAU / 5.0);
        b.rod(
            &arm,
            [0.0, 0.0, 0.1],
            [0.0, 0.29, 0.07],
            [0.025, 0.016],
            metal,
        );
        b.ball(&arm.at(0.0, 0.29, 0.031), 0.031, metal);
    }
    b.rod(at, [0.0, 0.0, 0.08], [0.0, 0.0, 0.43], [0.03, 0.022], metal);
    b.block(&at.at(0.0, 0.0, 0.465), [0.48, 0.47, 0.09], 0.04, cloth);
    b.rod(at, [0.0, 0.2, 0.44], [0.0, 0.27, 0.68], [0.02, 0.02], metal);
    b.block(
        &at.at(0.0, 0.25, 0.76).lean(-0.12),
        [0.43, 0.07, 0.44],
        0.033,
        cloth,
    );
}

/// A round stool of cloth.
pub(crate) fn pouf(b: &mut Builder, at: &Place) {
    let tones = [b.accent(), b.palette.rug[0], b.palette.sofa[1]];
    let look = Look::new(Pattern::Stripes, tones);
    b.drum(&at.at(0.0, 0.0, 0.19), [0.25, 0.25], 0.38, 0.09, look);
}
