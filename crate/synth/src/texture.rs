//! What surfaces look like: patterns computed from the place on the solid, so that nothing is flat and nothing is stored.
//!
//! Detail finer than a pixel is faded out by the pixel's footprint instead of being sampled many times.

use glam::{Vec2, Vec3};

use crate::material;
use crate::picture::{art, outside, screen};
use crate::random::{hash, hash_unit, noise};

/// A pattern over three tones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pattern {
    /// Even paint with a little unevenness.
    Plain,
    /// Wall paint, coarser than [`Pattern::Plain`].
    Plaster,
    /// Wallpaper: small diamonds of tone 1 on tone 0.
    Wallpaper,
    /// Floor boards along x, tones 0 to 1.
    Planks,
    /// Grain along the longest side, tones 0 to 1.
    Wood,
    /// Cloth of tone 0 with threads of tone 1.
    Weave,
    /// Crossing bands of tone 1 and thin lines of tone 2.
    Checks,
    /// Bands of tones 1 and 2 on tone 0.
    Stripes,
    /// Border and diamonds, all three tones.
    Rug,
    /// A picture on the x-z face; the seed picks one of three kinds.
    Art,
    /// A book: bands of tone 1, pages of tone 2 on top.
    Spine,
    /// Brown board of tone 0 with a strip of tape of tone 1.
    Cardboard,
    /// Plaited bands of tones 0 and 1.
    Wicker,
    /// Tone 0 with speckles of tones 1 and 2.
    Speckle,
    /// Tone 0 to 1 with a bright middle.
    Leaf,
    /// Garden under a sky, on the x-z face.
    Outside,
    /// Lines of text on a screen, on the x-z face.
    Screen,
    /// One even tone.
    Blank,
    /// Square tiles of tones 0 to 1 with joints of tone 2; the seed says how they are laid.
    Tiles,
    /// Bricks of tones 0 to 1 with mortar of tone 2.
    Bricks,
    /// Squares of strips that lie across each other, tones 0 to 1.
    Parquet,
    /// Boards along z with grooves, tones 0 to 1.
    Panels,
    /// Loops of tones 0 and 1 with flecks of tone 2.
    Carpet,
    /// Veins of tones 1 and 2 in tone 0.
    Marble,
    /// Clouds and pores in tone 0.
    Concrete,
    /// Chips of all tones in tone 0.
    Terrazzo,
    /// A printed sheet: a picture, a title, lines of text.
    Poster,
    /// Land of tones 1 and 2 in a sea of tone 0.
    Map,
    /// Something like a photograph, in all tones.
    Photo,
    /// Wallpaper with leaves and flowers of tones 1 and 2.
    Flowers,
    /// Upright stripes of tones 0 and 1.
    Bands,
    /// Creased skin of tone 0.
    Leather,
    /// Fine scratches along x in tone 0.
    Metal,
    /// Spines of many books side by side along x.
    Books,
    /// Cloth of tones 0 and 1 with soft folds along z.
    Folds,
}

/// What a solid looks like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub pattern: Pattern,
    /// Linear RGB, 0 to 1.
    pub tones: [Vec3; 3],
    /// Strength of the highlight, 0 to 1.
    pub gloss: f32,
    /// Share of the colour that is given off without any light.
    pub glow: f32,
    pub seed: u32,
    /// How much larger than life the pattern is.
    pub scale: f32,
    /// Place on the pattern of the solid's middle, in metres: parts of one wall share a pattern.
    pub shift: Vec3,
}

impl Look {
    pub fn new(pattern: Pattern, tones: [Vec3; 3]) -> Self {
        Self {
            pattern,
            tones,
            gloss: 0.0,
            glow: 0.0,
            seed: 0,
            scale: 1.0,
            shift: Vec3::ZERO,
        }
    }

    pub fn plain(tone: Vec3) -> Self {
        Self::new(Pattern::Plain, [tone; 3])
    }

    pub fn gloss(self, gloss: f32) -> Self {
        Self { gloss, ..self }
    }

    pub fn glow(self, glow: f32) -> Self {
        Self { glow, ..self }
    }

    pub fn scale(self, scale: f32) -> Self {
        Self { scale, ..self }
    }

    pub fn shift(self, shift: Vec3) -> Self {
        Self { shift, ..self }
    }

    pub fn seed(self, seed: u32) -> Self {
        Self { seed, ..self }
    }

    /// Linear RGB at `p` of a solid of half size `half`, both in its own axes, in metres; `pixel_m` is the width of a
    /// pixel there.
    pub fn colour(&self, p: Vec3, normal: Vec3, half: Vec3, pixel_m: f32) -> Vec3 {
        let [a, b, c] = self.tones;
        let seed = self.seed;
        let (p, half, pixel_m) = (
            (p + self.shift) / self.scale,
            half / self.scale,
            pixel_m / self.scale,
        );
        let fine = |period: f32| (1.0 - pixel_m / period).max(0.0);
        let uneven = |amount: f32, scale: f32| 1.0 + amount * (noise(p * scale, seed) - 0.5);
        let flat = unfold(p, normal);
        match self.pattern {
            Pattern::Plain => a * uneven(0.08, 14.0),
            Pattern::Plaster => a * uneven(0.09, 2.2) * uneven(0.06 * fine(0.04), 45.0),
            Pattern::Wallpaper => {
                let cell = flat / Vec2::new(0.16, 0.26);
                let d = (cell.fract_gl() - 0.5).abs();
                let band = (d.x + d.y - 0.36).abs();
                let line = stroke(band * 0.16, 0.014, pixel_m)
                    + stroke(d.length() * 0.16 - 0.012, 0.02, pixel_m);
                a.lerp(b, line.min(1.0)) * uneven(0.05, 3.0)
            }
            Pattern::Planks => planks(p, pixel_m, self),
            Pattern::Wood => {
                let q = along_longest(p, half);
                let bend = noise(q * Vec3::new(1.6, 7.0, 7.0), seed);
                let grain = noise(q * Vec3::new(2.0, 55.0, 55.0) + bend * 3.0, seed + 1);
                a.lerp(b, 0.55 * bend + 0.45 * (0.5 + (grain - 0.5) * fine(0.02)))
            }
            Pattern::Weave => {
                let thread = noise(p * 170.0, seed) - 0.5;
                let patch = noise(p * 28.0, seed) - 0.5;
                a.lerp(
                    b,
                    0.45 + 0.8 * thread * fine(0.012) + 0.22 * patch * fine(0.07),
                ) * uneven(0.07, 5.0)
            }
            Pattern::Checks => {
                let d = (flat / 0.12).fract_gl();
                let band = |v: f32| stroke((v - 0.3).abs() * 0.12, 0.05, pixel_m);
                let thin = |v: f32| stroke((v - 0.8).abs() * 0.12, 0.012, pixel_m);
                let cloth = a.lerp(b, 0.5 * band(d.x) + 0.5 * band(d.y));
                cloth.lerp(c, 0.7 * (thin(d.x) + thin(d.y)).min(1.0))
                    * uneven(0.12 * fine(0.02), 120.0)
            }
            Pattern::Stripes => {
                let v = (flat.x / 0.14).rem_euclid(1.0);
                let wide = stroke((v - 0.35).abs() * 0.14, 0.05, pixel_m);
                let thin = stroke((v - 0.8).abs() * 0.14, 0.014, pixel_m);
                a.lerp(b, wide).lerp(c, thin) * uneven(0.1 * fine(0.02), 120.0)
            }
            Pattern::Rug => rug(p, half, pixel_m, self),
            Pattern::Art => art(p, half, self),
            Pattern::Spine => {
                if normal.z.abs() > 0.7 || normal.y > 0.7 {
                    return c * (1.0 - 0.15 * noise(Vec3::new(p.x * 900.0, p.y * 5.0, 0.0), seed));
                }
                let z = p.z / half.z;
                let band = stroke((z.abs() - 0.72).abs() * half.z, 0.012, pixel_m);
                let title = if z.abs() < 0.45 && p.x.abs() < 0.5 * half.x {
                    0.75
                } else {
                    0.0
                };
                let letters = noise(Vec3::new(p.z * 160.0, p.x * 60.0, 3.0), seed);
                a.lerp(b, band.max(title * letters * fine(0.02))) * uneven(0.1, 20.0)
            }
            Pattern::Cardboard => {
                let tape = stroke(p.x, 0.055, pixel_m)
                    * if normal.z.abs() > 0.5 || p.z > 0.4 * half.z {
                        1.0
                    } else {
                        0.0
                    };
                a.lerp(b, 0.8 * tape) * uneven(0.12, 9.0) * uneven(0.06 * fine(0.02), 90.0)
            }
            Pattern::Wicker => {
                let cell = flat / Vec2::new(0.035, 0.018);
                let id = cell.floor();
                let over = (id.x + id.y).rem_euclid(2.0);
                let round = (cell.fract_gl() - 0.5).abs().max_element();
                a.lerp(b, 0.5 + (over - 0.5) * 0.8 * fine(0.035))
                    * (1.0 - 0.5 * round * fine(0.02))
                    * uneven(0.2, 12.0)
            }
            Pattern::Speckle => {
                let v = noise(p * 70.0, seed);
                let speck = ((v - 0.62) * 8.0).clamp(0.0, 1.0) * fine(0.03);
                let tone = if noise(p * 25.0, seed + 1) > 0.5 {
                    b
                } else {
                    c
                };
                a.lerp(tone, speck) * uneven(0.06, 8.0)
            }
            Pattern::Leaf => {
                let vein = (1.0 - p.x.abs() / (0.25 * half.x)).max(0.0);
                a.lerp(b, 0.7 * noise(p * 22.0, seed) + 0.5 * vein)
            }
            Pattern::Outside => outside(p, half, seed),
            Pattern::Screen => screen(p, half, self),
            _ => material::colour(self, p, normal, half, pixel_m),
        }
    }
}

/// The two coordinates along the face that `normal` belongs to.
pub(crate) fn unfold(p: Vec3, normal: Vec3) -> Vec2 {
    let n = normal.abs();
    if n.z >= n.x && n.z >= n.y {
        Vec2::new(p.x, p.y)
    } else if n.y >= n.x {
        Vec2::new(p.x, p.z)
    } else {
        Vec2::new(p.y, p.z)
    }
}

/// Share of a pixel that a line of `width` covers when its middle is `away`.
pub(crate) fn stroke(away: f32, width: f32, pixel_m: f32) -> f32 {
    let pixel = pixel_m.max(1e-4);
    ((0.5 * width - away.abs()) / pixel + 0.5).clamp(0.0, 1.0) * (width / pixel).min(1.0)
}

fn along_longest(p: Vec3, half: Vec3) -> Vec3 {
    match half.max_position() {
        0 => p,
        1 => Vec3::new(p.y, p.x, p.z),
        _ => Vec3::new(p.z, p.x, p.y),
    }
}

fn planks(p: Vec3, pixel_m: f32, look: &Look) -> Vec3 {
    const WIDTH_M: f32 = 0.15;
    const LENGTH_M: f32 = 1.25;
    let row = (p.y / WIDTH_M).floor();
    let shift = hash_unit(row as i32, 0, 0, look.seed) * LENGTH_M;
    let piece = ((p.x + shift) / LENGTH_M).floor();
    let tone = hash_unit(row as i32, piece as i32, 1, look.seed);
    let board = hash(row as i32, piece as i32, 2, look.seed) & 0xFF;
    let q = Vec3::new(p.x, p.y, board as f32 * 0.37);
    let bend = noise(q * Vec3::new(1.8, 11.0, 9.0), look.seed);
    let grain = noise(q * Vec3::new(2.6, 80.0, 9.0) + bend * 2.5, look.seed + 1) - 0.5;
    let fine = (1.0 - pixel_m / 0.03).max(0.0);
    let beside = p.y - row * WIDTH_M;
    let before = p.x + shift - piece * LENGTH_M;
    let joint = stroke(beside.min(WIDTH_M - beside), 0.005, pixel_m).max(stroke(
        before.min(LENGTH_M - before),
        0.005,
        pixel_m,
    ));
    let wood = look.tones[0].lerp(
        look.tones[1],
        0.55 * tone + 0.3 * bend + 0.35 * grain * fine,
    );
    wood * (1.0 - 0.65 * joint)
}

fn rug(p: Vec3, half: Vec3, pixel_m: f32, look: &Look) -> Vec3 {
    let [a, b, c] = look.tones;
    let edge = (half.x - p.x.abs()).min(half.y - p.y.abs());
    let thread = 1.0 + 0.22 * (noise(p * 110.0, look.seed) - 0.5) * (1.0 - pixel_m / 0.02).max(0.0);
    let worn = 1.0 + 0.16 * (noise(p * 4.0, look.seed) - 0.5);
    let tone = if edge < 0.05 {
        b
    } else if edge < 0.075 {
        a
    } else if edge < 0.2 {
        // A row of triangles runs along the border.
        let along = if half.x - p.x.abs() < half.y - p.y.abs() {
            p.y
        } else {
            p.x
        };
        let zig = ((along / 0.13).rem_euclid(1.0) - 0.5).abs() * 2.0;
        if zig > (edge - 0.075) / 0.125 { c } else { b }
    } else if edge < 0.225 {
        a
    } else {
        let cell = Vec2::new(p.x / 0.42, p.y / 0.32);
        let d = (cell.fract_gl() - 0.5).abs();
        let ring = 2.0 * (d.x + d.y);
        let kind = (cell.floor().x + cell.floor().y).rem_euclid(2.0) < 1.0;
        match ring {
            r if r < 0.22 => a,
            r if r < 0.42 => {
                if kind {
                    c
                } else {
                    b
                }
            }
            r if r < 0.52 => a,
            r if r < 0.94 => b.lerp(c, if kind { 0.12 } else { 0.4 }),
            _ => a.lerp(b, 0.3),
        }
    };
    tone * thread * worn
}
