//! Integration of a depth image: the running weighted average of projective signed distances
//! (Curless and Levoy 1996), voxel by voxel of the bricks that the image may change.
//!
//! For lattice point `p` with camera coordinates `(x, y, z)`, pixel `(u, v)` nearest to its projection and depth
//! `d = D(u, v)`: `sdf = d - z`. Skipped where `p` is outside the image, nothing was measured, `d` is beyond the maximum
//! depth or `sdf < -truncation`. Otherwise with `s = min(1, sdf / truncation)` and weight `w`, 1 or
//! `1 / max(z, 0.5 m)^2`, times the pixel's confidence where the image has one:
//! `S <- (S W + s w) / (W + w)`, `W <- W + w`; colour likewise, with a weight of its own, where `|sdf| <= truncation`. There
//! the frame counts as evidence, too, with its confidence ([`crate::evidence`]).

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
    tensor::{DType, Device, TensorData},
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

/// One image's pixels on the device, each a row of numbers.
struct Images {
    /// Metres, 0 where nothing was measured.
    depth: Tensor<1>,
    /// Above 0 and up to 1 wherever something was measured; `None` for 1 everywhere.
    confidence: Option<Tensor<1>>,
    /// Three bytes packed in one number: see [`pack_rgb`].
    color: Option<Tensor<1>>,
}

impl Images {
    /// A measurement of confidence 0 goes as none, so that neither form divides by a weight of 0; more than 1 counts as 1.
    fn upload(view: &DepthView<'_>, rgb: Option<&[u8]>, device: &Device) -> Self {
        let tensor = |values: Vec<f32>| {
            let count = values.len();
            Tensor::<1>::from_data(TensorData::new(values, [count]), (device, DType::F32))
        };
        let depth = match view.confidence {
            Some(_) => (0..view.depth_m.len()).map(|p| view.depth_at(p)).collect(),
            None => view.depth_m.to_vec(),
        };
        let clamped = |values: &[f32]| {
            let clamp = |&c: &f32| if c > 0.0 { c.min(1.0) } else { 0.0 };
            values.iter().map(clamp).collect()
        };
        Self {
            depth: tensor(depth),
            confidence: view.confidence.map(|values| tensor(clamped(values))),
            color: rgb.map(|rgb| tensor(rgb.chunks_exact(3).map(pack_rgb).collect())),
        }
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
    let images = Images::upload(view, with_color.map(|(rgb, _)| rgb), &device);
    let records: Vec<i32> = bricks
        .iter()
        .flat_map(|&brick| [lattice.slot(brick), brick.x, brick.y, brick.z])
        .collect();
    match form {
        Form::Plain => {
            plain::integrate(field, records, &camera, &images);
            Ok(())
        }
        Form::Fused => fused::integrate(field, records, &camera, images),
    }
}

/// Three bytes in one float, exactly: it holds every integer below 2^24.
fn pack_rgb(rgb: &[u8]) -> f32 {
    (u32::from(rgb[0]) << 16 | u32::from(rgb[1]) << 8 | u32::from(rgb[2])) as f32
}
