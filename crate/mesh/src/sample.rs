//! Points spread evenly over a surface, the same ones on every machine for the same seed.

use crate::Mesh;
use glam::Vec3;

/// `count` points drawn uniformly by area, with repetition; none when the mesh has no area.
///
/// Each point takes three numbers u, v, w from [`Uniform`]: u picks the triangle by the running sum of areas, then
/// a + (b - a) (1 - w) sqrt(v) + (c - a) w sqrt(v) is uniform within it (Osada et al. 2002, section 3.1). Only sums,
/// products and square roots are used, which IEEE 754 rounds the same everywhere.
pub fn surface(mesh: &Mesh, count: usize, seed: u64) -> Vec<Vec3> {
    let mut total = 0.0;
    let running_area: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|&triangle| {
            total += mesh.triangle_area(triangle);
            total
        })
        .collect();
    if total <= 0.0 {
        return Vec::new();
    }
    let mut uniform = Uniform::new(seed);
    (0..count)
        .map(|_| {
            let at = uniform.next() * total;
            let chosen = running_area.partition_point(|&area| area <= at);
            let chosen = chosen.min(mesh.triangles.len() - 1);
            let [a, b, c] = mesh.corners(mesh.triangles[chosen]).map(Vec3::as_dvec3);
            let (root, w) = (uniform.next().sqrt(), uniform.next());
            (a + (b - a) * (root * (1.0 - w)) + (c - a) * (root * w)).as_vec3()
        })
        .collect()
}

/// Numbers uniform in [0, 1): the top 53 bits of SplitMix64 (Steele, Lea, Flood 2014), times 2^-53.
pub struct Uniform {
    state: u64,
}

impl Uniform {
    /// A generator whose whole sequence follows from `seed`.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next number.
    #[expect(
        clippy::should_implement_trait,
        reason = "an endless sequence needs no Option"
    )]
    pub fn next(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
