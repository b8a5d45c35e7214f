//! Marching cubes over bricks: triangles as the renderer draws them and as exports are welded from.
//!
//! A cell of a brick has its lowest corner in the brick; its other corners may lie in the next bricks. A cell gives
//! no face where a corner was not observed well enough, or where the field jumps: see [`SurfaceRule`]. The vertex on the edge from lattice point A to B (one step along an axis)
//! lies at `A + t (B - A)`, `t = S_A / (S_A - S_B)`: computed from A on every side, so that bricks join without cracks.

mod fused;
mod plain;
mod table;
pub(crate) mod weld;

use crate::{
    VolumeError,
    compute::Form,
    field::Field,
    lattice::{Brick, Lattice},
};
use burn::Tensor;
use std::ops::Range;
use table::Table;

/// Numbers of a vertex, in the layout of [`mesh::soup`].
pub(crate) const VERTEX: usize = mesh::soup::VERTEX_FLOATS;

/// [`mesh::soup::KEYS`] and [`mesh::soup::Evidence`]'s limits, as the kernels count.
const KEYS: f32 = mesh::soup::KEYS as f32;
const MOST_VIEWS: f32 = mesh::soup::Evidence::MOST_VIEWS as f32;
/// Steps of confidence in the field's unit.
const LEVELS: f32 = mesh::soup::Evidence::STEPS as f32 / crate::evidence::SURE;

/// Integers that describe one brick to the kernels: x, y, z of the brick, its first triangle, then the slots of the
/// 27 bricks around it (x fastest), and one to fill up.
const BRICK_RECORD: usize = 32;

/// Which cells may have a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceRule {
    /// Each corner needs more weight than this.
    pub least_weight: f32,
    /// The corners may differ by less than this, in truncation distances. A distance field changes by the cell's diagonal
    /// at most; from -1 to 1 in one cell it jumps between what lies behind an edge and what is seen past it.
    pub largest_jump: f32,
}

impl SurfaceRule {
    /// Every cell whose corners were all observed.
    pub const ANY: Self = Self {
        least_weight: 0.0,
        largest_jump: f32::INFINITY,
    };
}

/// The surface of some bricks.
pub struct BrickMeshes {
    /// `[vertices, 6]`: triangles as a soup, see [`mesh::soup`] for the six numbers. No row where there is no surface.
    pub vertices: Tensor<2>,
    /// Rows of each brick that was asked for, in that order; empty where it has no surface.
    pub ranges: Vec<(Brick, Range<usize>)>,
}

/// Makes the triangles of bricks.
pub(crate) struct Extractor {
    form: Form,
    rule: SurfaceRule,
    table: Table,
}

impl Extractor {
    pub fn new(form: Form, rule: SurfaceRule) -> Self {
        Self {
            form,
            rule,
            table: Table::new(),
        }
    }

    /// The surface in `bricks`.
    pub async fn extract(
        &self,
        field: &Field,
        lattice: &Lattice,
        bricks: &[Brick],
        voxel_size_m: f32,
    ) -> Result<BrickMeshes, VolumeError> {
        let records: Vec<i32> = bricks
            .iter()
            .flat_map(|&brick| {
                [brick.x, brick.y, brick.z, 0]
                    .into_iter()
                    .chain(lattice.neighbourhood(brick))
                    .chain([0])
            })
            .collect();
        let (table, rule) = (&self.table, self.rule);
        let (vertices, triangles) = match self.form {
            Form::Plain => plain::extract(field, table, rule, &records, voxel_size_m).await?,
            Form::Fused => fused::extract(field, table, rule, records, voxel_size_m).await?,
        };
        let mut end = 0;
        let ranges = bricks
            .iter()
            .zip(triangles)
            .map(|(&brick, count)| {
                let start = end;
                end += count as usize * 3;
                (brick, start..end)
            })
            .collect();
        Ok(BrickMeshes { vertices, ranges })
    }
}
