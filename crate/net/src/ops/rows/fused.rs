//! Sampling as one kernel: a thread is a pair and some channels.

use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use cubecl::prelude::*;

use super::{At, strides};
use crate::ops::cube::{THREADS, dims, empty, groups, largest_step, rows};

/// `[P, C]` from the table `[R, C]`.
pub(crate) fn forward(table: CubeTensor, at: &At<CubeBackend>) -> CubeTensor {
    let [_, channels] = dims(&table);
    let [pairs] = dims(&at.corner);
    let out = empty([pairs, channels], &table);
    if pairs == 0 {
        return out;
    }
    let width = largest_step(channels, &[2, 4]);
    let [across, below] = strides(at.plane);
    // SAFETY: threads past the last pair end at once, and a pair's four pixels lie in the table.
    unsafe {
        sample_kernel::launch_unchecked(
            &out.client,
            groups(pairs * (channels / width)),
            CubeDim::new_1d(THREADS),
            width,
            rows(table).into_buffer_arg(),
            rows(at.corner.clone()).into_buffer_arg(),
            rows(at.right.clone()).into_buffer_arg(),
            rows(at.down.clone()).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            pairs as u32,
            (channels / width) as u32,
            across as u32,
            below as u32,
        );
    }
    out
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn sample_kernel<N: Size>(
    table: &[Vector<f32, N>],
    corner: &[i32],
    right: &[f32],
    down: &[f32],
    out: &mut [Vector<f32, N>],
    pairs: u32,
    channels: u32,
    across: u32,
    below: u32,
) {
    let channels = channels as usize;
    let pair = ABSOLUTE_POS / channels;
    if pair >= pairs as usize {
        terminate!();
    }
    let at = corner[pair] as usize * channels + ABSOLUTE_POS % channels;
    let across = across as usize * channels;
    let below = below as usize * channels;
    let right = Vector::<f32, N>::new(right[pair]);
    let down = Vector::<f32, N>::new(down[pair]);
    let one = Vector::<f32, N>::new(1.0f32);
    let upper = table[at] * (one - right) + table[at + across] * right;
    let lower = table[at + below] * (one - right) + table[at + below + across] * right;
    out[ABSOLUTE_POS] = upper * (one - down) + lower * down;
}
