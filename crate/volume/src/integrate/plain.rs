//! Integration in tensor operations: the definition that the kernel is checked against, and what CPU devices run.

use super::{BRICK_RECORD, Camera, Images, NEAR_M};
use crate::{
    evidence::{FRAME, FULL, SURE},
    field::Field,
    lattice::BRICK_VOXELS,
};
use burn::{
    Tensor,
    tensor::{Bool, DType, Device, IndexingUpdateOp, Int, TensorData},
};
use mesh::camera::Pinhole;

/// Bricks handled at a time: bounds the memory of the intermediate tensors to some 20 MB.
const BRICKS_A_BATCH: usize = 512;

pub(super) fn integrate(field: &mut Field, records: Vec<i32>, camera: &Camera, images: &Images) {
    for records in records.chunks(BRICKS_A_BATCH * BRICK_RECORD) {
        integrate_batch(field, records, camera, images);
    }
}

fn integrate_batch(field: &mut Field, records: &[i32], camera: &Camera, images: &Images) {
    let device = field.device().clone();
    let bricks = records.len() / BRICK_RECORD;
    let slots: Vec<i32> = records.iter().step_by(BRICK_RECORD).copied().collect();
    let slots =
        Tensor::<1, Int>::from_data(TensorData::new(slots, [bricks]), (&device, DType::I32));
    let [x, y, z] = camera_points(records, camera, &device);

    let rule = camera.rule;
    let (at, inside) = pixels(&camera.depth, &x, &y, &z);
    let measured = images.depth.clone().gather(0, at.clone());
    let sdf = measured.clone() - z.clone();
    let seen = inside
        .bool_and(measured.clone().greater_elem(0.0))
        .bool_and(measured.lower_equal_elem(rule.max_depth_m))
        .bool_and(sdf.clone().greater_equal_elem(-rule.truncation_m));
    let s = (sdf.clone() / rule.truncation_m).clamp_max(1.0);
    let mut weight = if rule.weigh_by_depth {
        z.clone().clamp_min(NEAR_M).powi_scalar(-2)
    } else {
        z.ones_like()
    };
    let mut frame = z.full_like(FRAME);
    if let Some(confidence) = &images.confidence {
        let confidence = confidence.clone().gather(0, at);
        frame = frame + (confidence.clone() * SURE).ceil();
        weight = weight * confidence;
    }
    let near = seen
        .clone()
        .bool_and(sdf.lower_equal_elem(rule.truncation_m));
    let step = weight.clone() * seen.float();
    let frame = frame * near.clone().float();
    average(&mut field.samples, &slots, step, &[s], Some(frame));

    if let (Some(image), Some(color_camera)) = (&images.color, camera.color) {
        let (at, inside) = pixels(&color_camera, &x, &y, &z);
        let near = near.bool_and(inside);
        let packed = image.clone().gather(0, at);
        let red = (packed.clone() / 65536.0).floor();
        let rest = packed - red.clone() * 65536.0;
        let green = (rest.clone() / 256.0).floor();
        let blue = rest - green.clone() * 256.0;
        let step = weight * near.float();
        average(&mut field.colors, &slots, step, &[red, green, blue], None);
    }
}

/// Camera coordinates of the voxels of each brick, `[bricks * 512]` each.
fn camera_points(records: &[i32], camera: &Camera, device: &Device) -> [Tensor<1>; 3] {
    let size = camera.rule.voxel_size_m;
    let voxels = records.len() / BRICK_RECORD * BRICK_VOXELS;
    let mut world: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::with_capacity(voxels));
    for record in records.chunks_exact(BRICK_RECORD) {
        for local in 0..BRICK_VOXELS as i32 {
            let offset = [local % 8, local / 8 % 8, local / 64];
            for axis in 0..3 {
                world[axis].push((record[axis + 1] * 8 + offset[axis]) as f32 * size);
            }
        }
    }
    let [px, py, pz] = world.map(|values| {
        Tensor::<1>::from_data(TensorData::new(values, [voxels]), (device, DType::F32))
    });
    let numbers = camera.numbers();
    std::array::from_fn(|row| {
        px.clone() * numbers[row * 3]
            + py.clone() * numbers[row * 3 + 1]
            + pz.clone() * numbers[row * 3 + 2]
            + numbers[9 + row]
    })
}

/// Index of the pixel nearest to each projected point (0 where there is none), and whether there is one.
fn pixels(
    camera: &Pinhole,
    x: &Tensor<1>,
    y: &Tensor<1>,
    z: &Tensor<1>,
) -> (Tensor<1, Int>, Tensor<1, Bool>) {
    let (width, height) = (camera.width as f32, camera.height as f32);
    let u = (x.clone() / z.clone() * camera.fx + camera.cx + 0.5).floor();
    let v = (y.clone() / z.clone() * camera.fy + camera.cy + 0.5).floor();
    let inside = (z.clone().greater_elem(0.0))
        .bool_and(u.clone().greater_equal_elem(0.0))
        .bool_and(v.clone().greater_equal_elem(0.0))
        .bool_and(u.clone().lower_elem(width))
        .bool_and(v.clone().lower_elem(height));
    let index = v * width + u;
    let index = index.mask_fill(inside.clone().bool_not(), 0.0).int();
    (index, inside)
}

/// One step of the running average at the rows `slots` of `stored`: channels for the values, one for the sum of weights, and
/// one for evidence, if a `frame`'s is added. `step` is the weight of the new values, 0 where there are none.
fn average(
    stored: &mut Tensor<2>,
    slots: &Tensor<1, Int>,
    step: Tensor<1>,
    values: &[Tensor<1>],
    frame: Option<Tensor<1>>,
) {
    let channels = values.len() + 1 + usize::from(frame.is_some());
    let bricks = slots.dims()[0];
    let device = stored.device();
    let old = stored.clone().select(0, slots.clone());
    let old = old.reshape([bricks * BRICK_VOXELS, channels]);
    let weight = old.clone().narrow(1, values.len(), 1).squeeze_dim::<1>(1);
    // Where nothing was ever seen the share is 0 / tiny.
    let share = step.clone() / (weight + step.clone()).clamp_min(f32::MIN_POSITIVE);
    let mut changes: Vec<Tensor<2>> = Vec::with_capacity(channels);
    for (channel, value) in values.iter().enumerate() {
        let old = old.clone().narrow(1, channel, 1).squeeze_dim::<1>(1);
        changes.push(((value.clone() - old) * share.clone()).unsqueeze_dim(1));
    }
    changes.push(step.unsqueeze_dim(1));
    if let Some(frame) = frame {
        let known = old.narrow(1, values.len() + 1, 1);
        let full = known.lower_elem(FULL).float();
        changes.push(frame.unsqueeze_dim(1) * full);
    }
    let changes = Tensor::cat(changes, 1).reshape([bricks, BRICK_VOXELS * channels]);
    let whole = std::mem::replace(stored, Tensor::empty([1, 1], &device));
    *stored = whole.select_assign(0, slots.clone(), changes, IndexingUpdateOp::Add);
}
