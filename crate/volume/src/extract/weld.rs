//! From the bricks' triangle soup to one indexed mesh: vertices on the same lattice edge become one.

use super::VERTEX;
use crate::lattice::{BRICK_EDGE, Brick};
use glam::IVec3;
use mesh::{Mesh, soup};
use std::collections::HashMap;

/// Collects bricks into a mesh.
#[derive(Default)]
pub(crate) struct Welder {
    mesh: Mesh,
    vertices: HashMap<(IVec3, i32), u32>,
}

impl Welder {
    /// Adds the soup of one brick.
    pub fn add(&mut self, brick: Brick, vertices: &[f32]) {
        for triangle in vertices.chunks_exact(3 * VERTEX) {
            let mut corners = [0; 3];
            for (corner, vertex) in corners.iter_mut().zip(triangle.chunks_exact(VERTEX)) {
                *corner = self.vertex(brick, vertex);
            }
            self.mesh.triangles.push(corners);
        }
    }

    fn vertex(&mut self, brick: Brick, vertex: &[f32]) -> u32 {
        let key = vertex[VERTEX - 1] as i32 % soup::KEYS as i32;
        let (axis, place) = (key % 3, key / 3);
        let place = IVec3::new(place % 9, place / 9 % 9, place / 81);
        let mesh = &mut self.mesh;
        *self
            .vertices
            .entry((brick * BRICK_EDGE + place, axis))
            .or_insert_with(|| {
                let mut numbers = [0.0; VERTEX];
                numbers.copy_from_slice(vertex);
                let (position, normal, color) = soup::decode(&numbers);
                mesh.positions.push(position);
                mesh.normals.push(normal);
                mesh.colors.push(color);
                mesh.positions.len() as u32 - 1
            })
    }

    /// The mesh of everything added.
    pub fn finish(self) -> Mesh {
        self.mesh
    }
}
