//! Triangle soup: the one vertex format that marching cubes writes, both painters read and exports are welded from.
//!
//! Three vertices in a row are a triangle, counter-clockwise seen from free space. A vertex is six f32, because a storage
//! buffer of f32 is what a compute kernel on every WebGPU device can write: position x, y, z (metres, canonical world,
//! Z up), packed normal, packed colour, edge key. The last three are integer-valued f32 below 2^24, which f32 holds
//! exactly. The lower 12 bits of the key, `(x + 9 (y + 9 z)) * 3 + axis`, name the lattice edge of the brick that the vertex
//! lies on; the upper 12 are its [`Evidence`].

use glam::{Vec2, Vec3};

/// Bytes from one vertex to the next.
pub const VERTEX_STRIDE_BYTES: u64 = 24;

/// f32 values of one vertex.
pub const VERTEX_FLOATS: usize = 6;

/// Packed colour of a surface that no colour image saw: a light grey.
pub const NO_COLOR: f32 = 200.0 * 65536.0 + 200.0 * 256.0 + 200.0;

/// Largest value of one octahedral coordinate: 12 bits.
const OCTAHEDRAL_MAX: f32 = 4095.0;

/// The key's part that names the edge is below this; the rest is this times the packed [`Evidence`].
pub const KEYS: u32 = 4096;

/// What a vertex rests on: how many views, and how sure they are. 6 bits each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evidence {
    views: u8,
    level: u8,
}

impl Evidence {
    /// Views that are told apart; more count as this many.
    pub const MOST_VIEWS: u8 = 63;
    /// Steps from confidence 0 to 1.
    pub const STEPS: u8 = 62;

    /// From a number of views, 0 for unknown, and their mean confidence from 0 to 1, where there is one.
    pub fn new(views: usize, confidence: Option<f32>) -> Self {
        let step = |c: f32| 1 + (c.clamp(0.0, 1.0) * f32::from(Self::STEPS) + 0.5).floor() as u8;
        Self {
            views: views.min(usize::from(Self::MOST_VIEWS)) as u8,
            level: confidence.map_or(0, step),
        }
    }

    /// What a vertex says.
    pub fn of(vertex: &[f32; VERTEX_FLOATS]) -> Self {
        Self::unpacked(vertex[5] as u32 / KEYS)
    }

    /// As [`Evidence::packed`] gave it.
    pub fn unpacked(packed: u32) -> Self {
        Self {
            views: (packed >> 6 & 63) as u8,
            level: (packed & 63) as u8,
        }
    }

    /// `views * 64 + level`, where level 0 is no confidence and levels 1 to 63 run from 0 to 1.
    pub fn packed(self) -> u32 {
        u32::from(self.views) << 6 | u32::from(self.level)
    }

    /// Views; 0 where that is not known, [`Evidence::MOST_VIEWS`] for that many or more.
    pub fn views(self) -> usize {
        usize::from(self.views)
    }

    /// Mean confidence, 0 to 1, of what was measured; `None` where measurements have none.
    pub fn confidence(self) -> Option<f32> {
        let step = self.level.checked_sub(1)?;
        Some(f32::from(step) / f32::from(Self::STEPS))
    }
}

/// Packs a vertex; edge key and evidence are 0. The inverse of [`decode`] up to the normal's 12 bits.
pub fn encode(position_m: Vec3, normal: Vec3, rgb: [u8; 3]) -> [f32; VERTEX_FLOATS] {
    let [r, g, b] = rgb.map(f32::from);
    let colour = r * 65536.0 + g * 256.0 + b;
    [
        position_m.x,
        position_m.y,
        position_m.z,
        encode_normal(normal),
        colour,
        0.0,
    ]
}

/// Unpacks a vertex into position (metres), unit normal and sRGB colour.
pub fn decode(vertex: &[f32; VERTEX_FLOATS]) -> (Vec3, Vec3, [u8; 3]) {
    let colour = vertex[4] as u32;
    (
        Vec3::new(vertex[0], vertex[1], vertex[2]),
        decode_normal(vertex[3]),
        [(colour >> 16) as u8, (colour >> 8) as u8, colour as u8],
    )
}

/// Octahedral map (Meyer et al. 2010, "On Floating-Point Normal Vectors"): project on |n|_1 = 1,
/// fold the lower half over the diagonals, 12 bits a coordinate. Zero normals read back as +Z.
fn encode_normal(normal: Vec3) -> f32 {
    let length = normal.abs().element_sum();
    let n = if length > 0.0 {
        normal / length
    } else {
        Vec3::Z
    };
    let folded = if n.z < 0.0 {
        fold(n.truncate())
    } else {
        n.truncate()
    };
    let step = ((folded * 0.5 + 0.5) * OCTAHEDRAL_MAX).round();
    step.x * (OCTAHEDRAL_MAX + 1.0) + step.y
}

fn decode_normal(packed: f32) -> Vec3 {
    let u = (packed / (OCTAHEDRAL_MAX + 1.0)).floor();
    let v = packed - u * (OCTAHEDRAL_MAX + 1.0);
    let p = Vec2::new(u, v) / OCTAHEDRAL_MAX * 2.0 - 1.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z < 0.0 { fold(p) } else { p };
    p.extend(z).normalize_or(Vec3::Z)
}

fn fold(p: Vec2) -> Vec2 {
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_survive_within_the_twelve_bits() {
        let mut worst_degrees = 0.0f32;
        for i in 0..2000 {
            // A Fibonacci sphere: even cover, both hemispheres.
            let z = 1.0 - (2 * i + 1) as f32 / 2000.0;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let ring = (1.0 - z * z).sqrt();
            let n = Vec3::new(ring * cos, ring * sin, z);
            let (_, back, _) = decode(&encode(Vec3::ZERO, n, [0; 3]));
            worst_degrees = worst_degrees.max(n.angle_between(back).to_degrees());
        }
        assert!(worst_degrees < 0.06, "worst error {worst_degrees} degrees");
    }

    #[test]
    fn axes_poles_and_zero_are_where_the_format_says() {
        let packed = |n| encode(Vec3::ZERO, n, [0; 3])[3];
        // u * 4096 + v with u, v = 2048 (half rounds away from zero), 4095, 0.
        assert_eq!(packed(Vec3::Z), 2048.0 * 4096.0 + 2048.0);
        assert_eq!(packed(Vec3::ZERO), packed(Vec3::Z));
        assert_eq!(packed(Vec3::X), 4095.0 * 4096.0 + 2048.0);
        assert_eq!(packed(-Vec3::Y), 2048.0 * 4096.0);
        // sgn(0) = +1: the south pole folds to the (+, +) corner.
        assert_eq!(packed(-Vec3::Z), 4095.0 * 4096.0 + 4095.0);
    }

    #[test]
    fn evidence_fits_above_the_longest_key() {
        let last_key = (8 + 9 * (8 + 9 * 8)) * 3 + 2;
        assert!(last_key < KEYS);
        for (views, confidence) in [(1, None), (3, Some(0.0)), (63, Some(1.0)), (20, Some(0.5))] {
            let evidence = Evidence::new(views, confidence);
            let mut vertex = encode(Vec3::ZERO, Vec3::Z, [9; 3]);
            vertex[5] = (evidence.packed() * KEYS + last_key) as f32;
            assert_eq!(vertex[5] as u32 % KEYS, last_key);
            assert_eq!(Evidence::of(&vertex), evidence);
            assert_eq!(evidence.views(), views);
            assert_eq!(evidence.confidence(), confidence);
        }
        assert_eq!(Evidence::new(5000, None).views(), 63);
    }

    #[test]
    fn positions_and_colours_are_exact() {
        let p = Vec3::new(-1.25, 3.5, 0.125);
        for rgb in [[0, 0, 0], [255, 255, 255], [1, 2, 3], [255, 0, 128]] {
            let vertex = encode(p, Vec3::X, rgb);
            assert_eq!(decode(&vertex).0, p);
            assert_eq!(decode(&vertex).2, rgb);
        }
    }
}
