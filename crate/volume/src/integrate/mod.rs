//! Integration of a depth image: the running weighted average of projective signed distances
//! (Curless and Levoy 1996), voxel by voxel of the bricks that the image may change.
//!
//! For lattice point `p` with camera coordinates `(x, y, z)`, pixel `(u, v)` nearest to its projection and depth
//! `d = D(u, v)`: `sdf = d - z`. Skipped where `p` is outside the image, nothing was measured, `d` is beyond the maximum
//! depth or `sdf < -truncation`. Otherwise with `s = min(1, sdf / truncation)` and weight `w`, 1 or
//! `1 / max(z, 0.5 m)^2`:
//! `S <- (S W + s w) / (W + w)`, `W <- W + w`; colour likewise, with a weight of its own, where `|sdf| <= truncation`.

mod fused;
mod plain;

use crate::{
    DepthView, VolumeError,
    compute::Form,
    field::Field,
    lattice::{Brick, Lattice},
};
use burn::{
    Tensor,
    tensor::{DType, TensorData},
};
use glam::Affine3A;
use mesh::camera::Pinhole;

/// Integers that describe one brick to the kernels: slot, then x, y, z of the brick.
const BRICK_RECORD: usize = 4;

/// Nearer than this a measurement weighs no more.
const NEAR_M: f32 = 0.5;

/// What integration goes by.
#[derive(Clone, Copy)]
pub(crate) struct Rule {
    pub voxel_size_m: f32,
    pub truncation_m: f32,
    pub max_depth_m: f32,
    /// Weight `1 / max(z, 0.5 m)^2` instead of 1.
    pub weigh_by_depth: bool,
}

/// The numbers of one image, in the order in which both forms read them.
struct Camera {
    camera_from_world: Affine3A,
    depth: Pinhole,
    color: Option<Pinhole>,
    rule: Rule,
}

impl Camera {
    /// 9 of the rotation by rows, 3 of the translation, 6 of each camera (fx, fy, cx, cy, width, height), 3 lengths.
    fn numbers(&self) -> Vec<f32> {
        let rotation = self.camera_from_world.matrix3.transpose().to_cols_array();
        let mut numbers = rotation.to_vec();
        numbers.extend(self.camera_from_world.translation.to_array());
        for camera in [self.depth, self.color.unwrap_or(self.depth)] {
            let (width, height) = (camera.width as f32, camera.height as f32);
            numbers.extend([camera.fx, camera.fy, camera.cx, camera.cy, width, height]);
        }
        let Rule {
            voxel_size_m,
            truncation_m,
            max_depth_m,
            ..
        } = self.rule;
        numbers.extend([voxel_size_m, truncation_m, max_depth_m]);
        numbers
    }
}

/// Changes the voxels of `bricks`, all of them allocated, by what `view` saw.
pub(crate) fn integrate(
    form: Form,
    field: &mut Field,
    lattice: &Lattice,
    bricks: &[Brick],
    view: &DepthView<'_>,
    rule: Rule,
) -> Result<(), VolumeError> {
    if bricks.is_empty() {
        return Ok(());
    }
    let device = field.device().clone();
    let with_color = view.color.filter(|_| field.has_color());
    let camera = Camera {
        camera_from_world: view.world_from_camera.inverse(),
        depth: view.depth_camera,
        color: with_color.map(|(_, camera)| camera),
        rule,
    };
    let depth = TensorData::new(view.depth_m.to_vec(), [view.depth_m.len()]);
    let depth = Tensor::<1>::from_data(depth, (&device, DType::F32));
    let image = with_color.map(|(rgb, _)| {
        let packed: Vec<f32> = rgb.chunks_exact(3).map(pack_rgb).collect();
        let count = packed.len();
        Tensor::<1>::from_data(TensorData::new(packed, [count]), (&device, DType::F32))
    });
    let records: Vec<i32> = bricks
        .iter()
        .flat_map(|&brick| [lattice.slot(brick), brick.x, brick.y, brick.z])
        .collect();
    match form {
        Form::Plain => {
            plain::integrate(field, records, &camera, depth, image);
            Ok(())
        }
        Form::Fused => fused::integrate(field, records, &camera, depth, image),
    }
}

/// Three bytes in one float, exactly: it holds every integer below 2^24.
fn pack_rgb(rgb: &[u8]) -> f32 {
    (u32::from(rgb[0]) << 16 | u32::from(rgb[1]) << 8 | u32::from(rgb[2])) as f32
}
