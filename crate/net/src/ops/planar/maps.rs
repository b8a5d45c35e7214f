//! Planes seen through maps of their pixels, as kernels.

use burn::tensor::Tensor;
use cubecl::prelude::*;

use crate::ops::cube::{THREADS, dims, empty, groups, numbers, tensor};

/// Twice the height and width: [`crate::ops::upsample::upsample2`].
pub(crate) fn upsample2(x: Tensor<4>) -> Tensor<4> {
    let x = numbers(x);
    let [views, channels, height, width] = dims(&x);
    let out = empty([views, channels, 2 * height, 2 * width], &x);
    let count = views * channels * 4 * height * width;
    if count == 0 {
        return tensor(out);
    }
    // SAFETY: threads past the last pixel end at once; neighbours are clamped into their plane.
    unsafe {
        upsample_kernel::launch_unchecked(
            &out.client,
            groups(count),
            CubeDim::new_1d(THREADS),
            x.into_buffer_arg(),
            out.clone().into_buffer_arg(),
            count as u32,
            height as u32,
            width as u32,
        );
    }
    tensor(out)
}

/// The farther of the two pixels that an output pixel lies between; the nearer one is `at / 2`.
#[cube]
fn farther(at: usize, length: usize) -> usize {
    let near = at / 2;
    let mut far = near;
    if at % 2 == 1 {
        far = (near + 1).min(length - 1);
    } else if near > 0 {
        far = near - 1;
    }
    far
}

#[cube(launch_unchecked)]
fn upsample_kernel(x: &[f32], out: &mut [f32], count: u32, height: u32, width: u32) {
    let at = ABSOLUTE_POS;
    if at >= count as usize {
        terminate!();
    }
    let (height, width) = (height as usize, width as usize);
    let column = at % (2 * width);
    let row = at / (2 * width) % (2 * height);
    let plane = at / (4 * width * height) * width * height;
    let far_column = farther(column, width);
    let near = plane + row / 2 * width;
    let far = plane + farther(row, height) * width;
    let upper = 0.75f32 * x[near + column / 2] + 0.25f32 * x[near + far_column];
    let lower = 0.75f32 * x[far + column / 2] + 0.25f32 * x[far + far_column];
    out[at] = 0.75f32 * upper + 0.25f32 * lower;
}

/// Planes `[V, C, h, w]` seen through `maps` `[V, 6]`: [`crate::ops::affine::affine_sample`].
pub(crate) fn affine_sample(planes: Tensor<4>, maps: Tensor<2>) -> Tensor<4> {
    let planes = numbers(planes);
    let [views, channels, height, width] = dims(&planes);
    let out = empty([views, channels, height, width], &planes);
    let count = views * height * width;
    if count == 0 {
        return tensor(out);
    }
    // SAFETY: threads past the last pixel end at once; samples are clamped into their plane.
    unsafe {
        affine_kernel::launch_unchecked(
            &out.client,
            groups(count),
            CubeDim::new_1d(THREADS),
            planes.into_buffer_arg(),
            numbers(maps).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            count as u32,
            channels as u32,
            height as u32,
            width as u32,
        );
    }
    tensor(out)
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn affine_kernel(
    planes: &[f32],
    maps: &[f32],
    out: &mut [f32],
    count: u32,
    channels: u32,
    height: u32,
    width: u32,
) {
    let at = ABSOLUTE_POS;
    if at >= count as usize {
        terminate!();
    }
    let area = (height * width) as usize;
    let view = at / area;
    let map = view * 6;
    let right_end = (width - 1) as f32;
    let lower_end = (height - 1) as f32;
    let x = (at as u32 % width) as f32 - right_end * 0.5f32;
    let y = (at as u32 / width % height) as f32 - lower_end * 0.5f32;
    let unit = height as f32 * 0.5f32;
    let u = maps[map] * x + maps[map + 1] * y + maps[map + 2] * unit + right_end * 0.5f32;
    let v = maps[map + 3] * x + maps[map + 4] * y + maps[map + 5] * unit + lower_end * 0.5f32;
    let u = u.max(0.0f32).min(right_end);
    let v = v.max(0.0f32).min(lower_end);
    let column = u.floor();
    let row = v.floor();
    let right = u - column;
    let down = v - row;
    let next = (column + 1.0f32).min(right_end) as u32 as usize;
    let column = column as u32 as usize;
    let upper = row as u32 as usize * width as usize;
    let lower = (row + 1.0f32).min(lower_end) as u32 as usize * width as usize;
    let pixel = at % area;
    for channel in 0..channels as usize {
        let plane = (view * channels as usize + channel) * area;
        let a = planes[plane + upper + column];
        let b = planes[plane + upper + next];
        let c = planes[plane + lower + column];
        let d = planes[plane + lower + next];
        let top = a + (b - a) * right;
        let bottom = c + (d - c) * right;
        out[plane + pixel] = top + (bottom - top) * down;
    }
}
