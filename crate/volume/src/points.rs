//! A field that is known at single lattice points: how a network's distances come into the volume.

use crate::{
    Evidence, Volume, VolumeError,
    evidence::packed,
    field::{COLOR, SAMPLE},
    lattice::{BRICK_EDGE, BRICK_VOXELS, Brick},
};
use glam::IVec3;
use std::collections::BTreeMap;

/// Bricks written to the device at a time: bounds the copy on its way there.
const BRICKS_A_COPY: usize = 1024;

/// What is known at one lattice point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The lattice point: it lies at `place * voxel_size_m` in the canonical world.
    pub place: IVec3,
    /// Signed distance over the truncation distance, positive in free space; cut off at -1 and 1.
    pub distance: f32,
    /// sRGB, if it is known.
    pub color: Option<[u8; 3]>,
    /// Which views it rests on; the default where that is not known.
    pub evidence: Evidence,
}

impl Volume {
    /// Sets the field at `points`, each with weight 1. Every other point of the bricks that they lie in becomes unknown, so
    /// all points of a brick must come in one call. Of a point named twice the last one counts.
    ///
    /// # Errors
    /// More bricks than fit; nothing has changed then.
    pub fn set_points(&mut self, points: &[Point]) -> Result<(), VolumeError> {
        let mut of_brick: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
        for (index, point) in points.iter().enumerate() {
            let brick = point.place.div_euclid(IVec3::splat(BRICK_EDGE));
            // By z first, as exports go.
            of_brick
                .entry([brick.z, brick.y, brick.x])
                .or_default()
                .push(index);
        }
        let bricks: Vec<(Brick, Vec<usize>)> = of_brick
            .into_iter()
            .map(|([z, y, x], indices)| (IVec3::new(x, y, z), indices))
            .collect();
        let all: Vec<Brick> = bricks.iter().map(|(brick, _)| *brick).collect();
        self.reserve(&all)?;
        for batch in bricks.chunks(BRICKS_A_COPY) {
            let mut samples = vec![0.0; batch.len() * BRICK_VOXELS * SAMPLE];
            let mut colors = vec![0.0; batch.len() * BRICK_VOXELS * COLOR];
            for (row, (brick, indices)) in batch.iter().enumerate() {
                for &index in indices {
                    let point = &points[index];
                    let local = point.place - *brick * BRICK_EDGE;
                    let local = local.x + BRICK_EDGE * (local.y + BRICK_EDGE * local.z);
                    let at = row * BRICK_VOXELS + local as usize;
                    samples[at * SAMPLE] = point.distance.clamp(-1.0, 1.0);
                    samples[at * SAMPLE + 1] = 1.0;
                    samples[at * SAMPLE + 2] = packed(point.evidence);
                    if let Some([r, g, b]) = point.color {
                        let color = [r, g, b, 1].map(f32::from);
                        colors[at * COLOR..][..COLOR].copy_from_slice(&color);
                    }
                }
            }
            let batch: Vec<Brick> = batch.iter().map(|(brick, _)| *brick).collect();
            self.write(&batch, samples, colors);
        }
        self.mark_changed(&all);
        Ok(())
    }
}
