//! Integration as one kernel: a thread a voxel.

use super::{BRICK_RECORD, Camera, Images, NEAR_M};
use crate::{
    VolumeError,
    compute::{float_buffer, float_tensor, int_buffer},
    evidence::{FRAME, FULL, SURE},
    field::{COLOR, Field, SAMPLE},
    lattice::BRICK_VOXELS,
};
use burn::{
    Tensor,
    tensor::{DType, Int, TensorData},
};
use cubecl::prelude::*;

/// WebGPU allows 65,535 workgroups in a dimension; two of them hold a brick.
const BRICKS_A_LAUNCH: usize = 16_384;
const THREADS: u32 = 256;

pub(super) fn integrate(
    field: &mut Field,
    records: Vec<i32>,
    camera: &Camera,
    images: Images,
) -> Result<(), VolumeError> {
    let device = field.device().clone();
    let weigh_by_depth = camera.rule.weigh_by_depth;
    let numbers = camera.numbers();
    let numbers = TensorData::new(numbers.clone(), [numbers.len()]);
    let camera = float_buffer(Tensor::<1>::from_data(numbers, (&device, DType::F32)))?;
    let (has_confidence, has_color) = (images.confidence.is_some(), images.color.is_some());
    let depth = float_buffer(images.depth)?;
    // A binding cannot stay empty: what is not read may be anything.
    let confidence = images.confidence.map_or(Ok(depth.clone()), float_buffer)?;
    let image = images.color.map_or(Ok(depth.clone()), float_buffer)?;
    let samples = float_buffer(field.samples.clone())?;
    let colors = float_buffer(field.colors.clone())?;
    for records in records.chunks(BRICKS_A_LAUNCH * BRICK_RECORD) {
        let bricks = records.len() / BRICK_RECORD;
        let data = TensorData::new(records.to_vec(), [records.len()]);
        let records = int_buffer(Tensor::<1, Int>::from_data(data, (&device, DType::I32)))?;
        let voxels = bricks * BRICK_VOXELS;
        // SAFETY: every index is checked against the image's size or derived from a slot that `Field::grow` made room for.
        unsafe {
            integrate_kernel::launch_unchecked(
                &samples.client,
                CubeCount::new_1d((voxels as u32).div_ceil(THREADS)),
                CubeDim::new_1d(THREADS),
                samples.clone().into_buffer_arg(),
                colors.clone().into_buffer_arg(),
                records.into_buffer_arg(),
                camera.clone().into_buffer_arg(),
                depth.clone().into_buffer_arg(),
                confidence.clone().into_buffer_arg(),
                image.clone().into_buffer_arg(),
                voxels as u32,
                has_confidence,
                has_color,
                weigh_by_depth,
            );
        }
    }
    // The kernel wrote in place: the handles are the same, and nobody else holds them.
    field.samples = float_tensor(samples);
    field.colors = float_tensor(colors);
    Ok(())
}

/// One more than the index of the pixel nearest to a projected point, or 0 outside the image. `intrinsics` is where fx starts in `camera`.
#[cube]
fn pixel(camera: &[f32], #[comptime] intrinsics: usize, x: f32, y: f32, z: f32) -> i32 {
    let width = camera[intrinsics + 4];
    let height = camera[intrinsics + 5];
    let u = (camera[intrinsics] * (x / z) + camera[intrinsics + 2] + 0.5).floor();
    let v = (camera[intrinsics + 1] * (y / z) + camera[intrinsics + 3] + 0.5).floor();
    let mut index = 0i32;
    if u >= 0.0 && v >= 0.0 && u < width && v < height {
        index = v as i32 * width as i32 + u as i32 + 1;
    }
    index
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn integrate_kernel(
    samples: &mut [f32],
    colors: &mut [f32],
    records: &[i32],
    camera: &[f32],
    depth: &[f32],
    confidence: &[f32],
    image: &[f32],
    voxels: u32,
    #[comptime] has_confidence: bool,
    #[comptime] has_color: bool,
    #[comptime] weigh_by_depth: bool,
) {
    let thread = ABSOLUTE_POS;
    if thread >= voxels as usize {
        terminate!();
    }
    let brick = thread / BRICK_VOXELS;
    let local = thread % BRICK_VOXELS;
    let record = brick * BRICK_RECORD;
    let voxel = records[record] as usize * BRICK_VOXELS + local;

    let voxel_size_m = camera[24];
    let truncation_m = camera[25];
    let px = (records[record + 1] * 8 + (local % 8) as i32) as f32 * voxel_size_m;
    let py = (records[record + 2] * 8 + (local / 8 % 8) as i32) as f32 * voxel_size_m;
    let pz = (records[record + 3] * 8 + (local / 64) as i32) as f32 * voxel_size_m;
    let x = camera[0] * px + camera[1] * py + camera[2] * pz + camera[9];
    let y = camera[3] * px + camera[4] * py + camera[5] * pz + camera[10];
    let z = camera[6] * px + camera[7] * py + camera[8] * pz + camera[11];

    if z > 0.0 {
        let at = pixel(camera, 12usize, x, y, z);
        if at > 0 {
            let measured = depth[at as usize - 1];
            let sdf = measured - z;
            if measured > 0.0 && measured <= camera[26] && sdf >= -truncation_m {
                let s = (sdf / truncation_m).min(1.0);
                let mut weight = 1.0f32;
                if comptime!(weigh_by_depth) {
                    let far = z.max(NEAR_M);
                    weight = 1.0f32 / (far * far);
                }
                if comptime!(has_confidence) {
                    weight *= confidence[at as usize - 1];
                }
                if sdf <= truncation_m && samples[voxel * SAMPLE + 2] < FULL {
                    let mut frame = f32::new(FRAME);
                    if comptime!(has_confidence) {
                        frame += (confidence[at as usize - 1] * SURE).ceil();
                    }
                    samples[voxel * SAMPLE + 2] += frame;
                }
                let sum = samples[voxel * SAMPLE + 1] + weight;
                let mean = samples[voxel * SAMPLE];
                samples[voxel * SAMPLE] = mean + (s - mean) * weight / sum;
                samples[voxel * SAMPLE + 1] = sum;
                if comptime!(has_color) && sdf <= truncation_m {
                    let at = pixel(camera, 18usize, x, y, z);
                    if at > 0 {
                        let packed = image[at as usize - 1];
                        let red = (packed / 65536.0).floor();
                        let green = ((packed - red * 65536.0) / 256.0).floor();
                        let blue = packed - red * 65536.0 - green * 256.0;
                        let to = voxel * COLOR;
                        let sum = colors[to + 3] + weight;
                        colors[to] = colors[to] + (red - colors[to]) * weight / sum;
                        colors[to + 1] = colors[to + 1] + (green - colors[to + 1]) * weight / sum;
                        colors[to + 2] = colors[to + 2] + (blue - colors[to + 2]) * weight / sum;
                        colors[to + 3] = sum;
                    }
                }
            }
        }
    }
}
