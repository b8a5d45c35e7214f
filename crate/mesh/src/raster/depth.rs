//! Depth maps of a mesh, as the metrics compare them.

use super::{Cull, front};
use crate::Mesh;
use crate::camera::Pinhole;
use glam::Affine3A;

/// The z-depth of `mesh` in metres at every pixel centre, row-major `[height, width]`; 0 where nothing is seen.
/// Surfaces nearer than `near_m` are cut away. The mesh must be valid ([`Mesh::validate`]).
pub fn depth(
    mesh: &Mesh,
    camera: &Pinhole,
    camera_from_world: &Affine3A,
    cull: Cull,
    near_m: f32,
) -> Vec<f32> {
    let mut map = front::draw(mesh, camera, camera_from_world, cull, near_m);
    for value in &mut map {
        *value = if *value > 0.0 { 1.0 / *value } else { 0.0 };
    }
    map
}
