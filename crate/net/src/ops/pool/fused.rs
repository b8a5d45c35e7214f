//! Pooling as one kernel: a thread is a segment and some channels, and goes through its rows.

use burn::backend::TensorMetadata;
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use cubecl::prelude::*;

use super::{Pooling, Shared};
use crate::ops::cube::{THREADS, dims, empty, groups, largest_step, rows};

/// The result `[N, C]` and the weight of each row `[P]`.
pub(super) fn forward(
    tokens: CubeTensor,
    logits: CubeTensor,
    shared: &Shared<CubeBackend>,
) -> (CubeTensor, CubeTensor) {
    let [count, channels] = dims(&tokens);
    let segments = shared.offsets.shape()[0] - 1;
    let out = empty([segments, channels], &tokens);
    let weights = empty([count], &tokens);
    let width = largest_step(channels, &[2, 4]);
    // SAFETY: a thread's rows are those of its segment, which the offsets bound.
    unsafe {
        pool_kernel::launch_unchecked(
            &out.client,
            groups(segments * (channels / width)),
            CubeDim::new_1d(THREADS),
            width,
            rows(tokens).into_buffer_arg(),
            rows(logits).into_buffer_arg(),
            rows(shared.offsets.clone()).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            weights.clone().into_buffer_arg(),
            segments as u32,
            (channels / width) as u32,
            shared.pooling == Pooling::Mean,
        );
    }
    (out, weights)
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments, clippy::needless_range_loop)]
fn pool_kernel<N: Size>(
    tokens: &[Vector<f32, N>],
    logits: &[f32],
    offsets: &[i32],
    out: &mut [Vector<f32, N>],
    weights: &mut [f32],
    segments: u32,
    channels: u32,
    #[comptime] mean: bool,
) {
    let channels = channels as usize;
    let segment = ABSOLUTE_POS / channels;
    let column = ABSOLUTE_POS % channels;
    if segment >= segments as usize {
        terminate!();
    }
    let start = offsets[segment] as usize;
    let end = offsets[segment + 1] as usize;
    let mut most = 0.0f32;
    let mut sum = (end - start) as f32;
    if comptime!(!mean) {
        for row in start..end {
            most = most.max(logits[row]);
        }
        // The null view's logit is 0.
        sum = (0.0f32 - most).exp();
        for row in start..end {
            sum += (logits[row] - most).exp();
        }
    }
    let mut total = Vector::<f32, N>::new(0.0f32);
    for row in start..end {
        let mut weight = 1.0f32 / sum;
        if comptime!(!mean) {
            weight *= (logits[row] - most).exp();
        }
        total = fma(tokens[row * channels + column], Vector::new(weight), total);
        if column == 0 {
            weights[row] = weight;
        }
    }
    out[ABSOLUTE_POS] = total;
}
