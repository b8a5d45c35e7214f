//! Pictures on the x-z face of a solid: paintings, the garden behind a window, a screen.

use glam::{Vec2, Vec3};

use crate::random::{hash, hash_unit, noise};
use crate::texture::Look;

pub(crate) fn art(p: Vec3, half: Vec3, look: &Look) -> Vec3 {
    let [a, b, c] = look.tones;
    let uv = Vec2::new(p.x / half.x, p.z / half.z);
    let canvas = 1.0 + 0.12 * (noise(p * 60.0, look.seed) - 0.5);
    let tone = match look.seed % 3 {
        0 => {
            // Overlapping discs on a light ground.
            let mut tone = Vec3::splat(0.78);
            for i in 0..6 {
                let at = |k| 1.5 * hash_unit(i, k, 7, look.seed) - 0.75;
                let size = 0.16 + 0.34 * hash_unit(i, 2, 7, look.seed);
                if (uv - Vec2::new(at(0), at(1))).length() < size {
                    tone = tone * 0.15 + [a, b, c][(i % 3) as usize] * 0.85;
                }
            }
            tone
        }
        1 => {
            // Hills in front of each other under a sun.
            let sky = Vec3::splat(0.8).lerp(c, 0.25 - 0.25 * uv.y);
            let sun = (uv - Vec2::new(0.35, 0.5)).length() < 0.2;
            let mut tone = if sun { c } else { sky };
            for i in 0..4 {
                let ridge = 0.25 - 0.35 * i as f32
                    + 0.5 * (noise(Vec3::new(uv.x * 1.7, i as f32, 0.5), look.seed) - 0.3);
                if uv.y < ridge {
                    tone = b.lerp(a, i as f32 / 3.0) * (0.65 + 0.1 * i as f32);
                }
            }
            tone
        }
        _ => {
            // Soft-edged fields of colour.
            let wave =
                uv.y + 0.12 * (noise(Vec3::new(uv.x * 3.0, uv.y * 3.0, 0.0), look.seed) - 0.5);
            let field = match wave {
                w if w > 0.25 => a,
                w if w > -0.15 => b,
                _ => c,
            };
            let margin = uv.abs().max_element() > 0.84;
            if margin { Vec3::splat(0.74) } else { field }
        }
    };
    tone * canvas
}

pub(crate) fn outside(p: Vec3, half: Vec3, seed: u32) -> Vec3 {
    let z = p.z / half.z;
    let wave = |x: f32, y: f32, k: f32| noise(Vec3::new(p.x * x, p.z * y, k), seed);
    let sky = Vec3::new(0.97, 0.97, 0.95).lerp(
        Vec3::new(0.52, 0.73, 0.98),
        (0.35 + 0.65 * z).clamp(0.0, 1.0),
    );
    let cloud = 1.5 * (0.65 * wave(1.8, 4.0, 0.0) + 0.35 * wave(5.0, 11.0, 2.0) - 0.45).max(0.0);
    let sky = sky.lerp(Vec3::ONE, cloud.min(1.0));
    // Two rows of trees; crowns are lumps of three sizes, and the far row is hazier.
    let crown = |x: f32, k: f32| {
        0.6 * wave(x, 0.0, k) + 0.3 * wave(3.0 * x, 3.0, k + 1.0) + 0.1 * wave(24.0, 24.0, k)
    };
    let leaves = 0.72 + 0.3 * wave(9.0, 9.0, 6.0) + 0.22 * wave(40.0, 40.0, 7.0);
    if z < -0.95 + 0.75 * crown(2.3, 10.0) {
        Vec3::new(0.30, 0.42, 0.17) * leaves
    } else if z < -0.62 + 0.9 * crown(1.3, 20.0) {
        Vec3::new(0.50, 0.61, 0.42) * (0.5 + 0.5 * leaves)
    } else {
        sky
    }
}

pub(crate) fn screen(p: Vec3, half: Vec3, look: &Look) -> Vec3 {
    let [back, ink, accent] = look.tones;
    let u = 0.5 + 0.5 * p.x / half.x;
    let z = 0.5 - 0.5 * p.z / half.z;
    if z < 0.07 {
        return accent * 0.5;
    }
    if u < 0.18 {
        return back.lerp(accent, 0.2);
    }
    let line = (z * 22.0).floor();
    let inside = (z * 22.0).fract() < 0.55;
    let indent = 0.2 + 0.05 * (hash(line as i32, 0, 0, look.seed) % 4) as f32;
    let end = indent + 0.12 + 0.5 * hash_unit(line as i32, 1, 0, look.seed);
    if inside && u > indent && u < end {
        let word = (u * 16.0).floor() as i32;
        return if hash(line as i32, word, 2, look.seed).is_multiple_of(3) {
            accent
        } else {
            ink
        };
    }
    back
}
