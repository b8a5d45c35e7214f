//! Triangle soup: the one vertex format that marching cubes writes, both painters read and exports are welded from.
//!
//! Three vertices in a row are a triangle, counter-clockwise seen from free space. A vertex is six f32, because a storage
//! buffer of f32 is what a compute kernel on every WebGPU device can write: position x, y, z (metres, canonical world,
//! Z up), packed normal, packed colour, edge key. Normal and colour ride in integer-valued f32 below 2^24, which f32
//! holds exactly. The key, `(x + 9 (y + 9 z)) * 3 + axis`, names the lattice edge of the brick that the vertex lies on.

use glam::{Vec2, Vec3};

/// Bytes from one vertex to the next.
pub const VERTEX_STRIDE_BYTES: u64 = 24;

/// f32 values of one vertex.
pub const VERTEX_FLOATS: usize = 6;

/// Packed colour of a surface that no colour image saw: a light grey.
pub const NO_COLOR: f32 = 200.0 * 65536.0 + 200.0 * 256.0 + 200.0;

/// Largest value of one octahedral coordinate: 12 bits.
const OCTAHEDRAL_MAX: f32 = 4095.0;

/// Packs a vertex; the edge key is 0. The inverse of [`decode`] up to the normal's 12 bits.
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
    fn positions_and_colours_are_exact() {
        let p = Vec3::new(-1.25, 3.5, 0.125);
        for rgb in [[0, 0, 0], [255, 255, 255], [1, 2, 3], [255, 0, 128]] {
            let vertex = encode(p, Vec3::X, rgb);
            assert_eq!(decode(&vertex).0, p);
            assert_eq!(decode(&vertex).2, rgb);
        }
    }
}
