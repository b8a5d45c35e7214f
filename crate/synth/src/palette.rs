//! Colours that go together: a seed picks one set for the whole room.

use glam::Vec3;

use crate::random::Random;

/// The colours of one room, linear RGB. Pairs are the darker and the lighter tone of one material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Palette {
    pub wall: Vec3,
    pub accent_wall: [Vec3; 2],
    pub floor: [Vec3; 2],
    pub wood: [Vec3; 2],
    pub sofa: [Vec3; 2],
    pub accents: [Vec3; 4],
    pub rug: [Vec3; 3],
}

/// wall, accent wall 2, floor 2, wood 2, sofa 2, accents 4, rug 3; sRGB.
type Codes = [u32; 16];

const SETS: [Codes; 6] = [
    // Sage and ochre
    [
        0xE9E4DA, 0x93AB9C, 0xA9BFAF, 0xA87B4F, 0xD6AE7E, 0xB98A58, 0xDDB886, 0x4F6673, 0x7C929E,
        0xD98E4A, 0xB5533C, 0x2F4858, 0xE3C16F, 0xEFE6D5, 0xA9443A, 0x2F4858,
    ],
    // Terracotta
    [
        0xF0E3D0, 0xC98A66, 0xD9A484, 0x7E5233, 0xB07A4C, 0x6E4529, 0x94613A, 0xA85C36, 0xCC8357,
        0x3F6B5E, 0xE0B354, 0x7A2E2E, 0xF2E8D8, 0xF1E4CC, 0x3F6B5E, 0xC9703F,
    ],
    // Blue and birch
    [
        0xE4E9EC, 0x5B7B9A, 0x7391AD, 0xB8956C, 0xDDC3A0, 0xD2BE9E, 0xEADCC4, 0xB7A386, 0xDDD0BB,
        0xE2725B, 0x2A4D69, 0xF2C14E, 0x76A08A, 0xE8E2D4, 0x2A4D69, 0xE2725B,
    ],
    // Green
    [
        0xEDEBDF, 0x5F7A65, 0x78937D, 0x8F6240, 0xC08D5E, 0x99653A, 0xC9935F, 0x5C8063, 0x88A98C,
        0xD4A03A, 0xC75D3A, 0xEADBC0, 0x3A4F5C, 0xEADFC8, 0x55705B, 0xD4A03A,
    ],
    // Plum
    [
        0xEDE6E6, 0x94667A, 0xA97E90, 0x96704F, 0xC6A27C, 0x5A4032, 0x7C5B48, 0x6C4F6A, 0x96798F,
        0xE3A857, 0x4F7C82, 0xD9738A, 0xF3E9DC, 0xE9DCD3, 0x6B4A63, 0xE3A857,
    ],
    // Charcoal and yellow
    [
        0xEFEDE8, 0x6A7076, 0x82888E, 0x9A7A58, 0xCBAA82, 0x8A5F3C, 0xB7865A, 0x4A4F56, 0x747A82,
        0xF0B429, 0xD64933, 0x2B7A78, 0xF4EBDD, 0xF0EADF, 0x4A4F56, 0xF0B429,
    ],
];

const BOOKS: [u32; 14] = [
    0xB23A30, 0x2E5E8C, 0xE0A93B, 0x3D7A57, 0x7B3F61, 0xE8E0CF, 0x24364B, 0xD9743B, 0x5D9AA6,
    0x8C2F39, 0xC9C24B, 0x5A4A7A, 0xEDEAE2, 0x30312F,
];

impl Palette {
    pub fn pick(random: &mut Random) -> Self {
        let c = random.pick(&SETS).map(srgb);
        Self {
            wall: c[0],
            accent_wall: [c[1], c[2]],
            floor: [c[3], c[4]],
            wood: [c[5], c[6]],
            sofa: [c[7], c[8]],
            accents: [c[9], c[10], c[11], c[12]],
            rug: [c[13], c[14], c[15]],
        }
    }
}

pub(crate) fn book(random: &mut Random) -> Vec3 {
    srgb(random.pick(&BOOKS))
}

/// Linear RGB of an sRGB colour written as 0xRRGGBB.
pub(crate) fn srgb(code: u32) -> Vec3 {
    let channel = |shift: u32| {
        let v = (code >> shift & 0xFF) as f32 / 255.0;
        if v <= 0.04045 {
            v / 12.92
        } else {
            libm::powf((v + 0.055) / 1.055, 2.4)
        }
    };
    Vec3::new(channel(16), channel(8), channel(0))
}

/// sRGB of a linear value, the inverse of [`srgb`] for one channel; clamps to 0 to 255.
pub(crate) fn to_srgb(linear: f32) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 {
        v * 12.92
    } else {
        1.055 * libm::powf(v, 1.0 / 2.4) - 0.055
    };
    (s * 255.0 + 0.5) as u8
}
