//! Normalisations of planes as kernels.

use burn::nn::BatchNorm;
use burn::tensor::Tensor;
use cubecl::prelude::*;

use super::statistics;
use crate::ops::cube::{THREADS, dims, empty, groups, numbers, tensor};

/// What `norm` gives for `x` `[V, C, ..]` by its running statistics, then, where asked, a ReLU.
pub(crate) fn scaled<const D: usize>(norm: &BatchNorm, x: Tensor<D>, relu: bool) -> Tensor<D> {
    let shape = x.dims();
    let x = numbers(x);
    let out = empty(shape, &x);
    let count: usize = shape.iter().product();
    if count == 0 {
        return tensor(out);
    }
    let pixels: usize = shape[2..].iter().product();
    let [gamma, beta, mean, variance] =
        statistics(norm).map(|values| numbers(values).into_buffer_arg());
    // SAFETY: threads past the last number end at once.
    unsafe {
        scaled_kernel::launch_unchecked(
            &out.client,
            groups(count),
            CubeDim::new_1d(THREADS),
            x.into_buffer_arg(),
            gamma,
            beta,
            mean,
            variance,
            out.clone().into_buffer_arg(),
            count as u32,
            shape[1] as u32,
            pixels as u32,
            norm.epsilon as f32,
            if relu { 0.0 } else { f32::MIN },
        );
    }
    tensor(out)
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn scaled_kernel(
    x: &[f32],
    gamma: &[f32],
    beta: &[f32],
    mean: &[f32],
    variance: &[f32],
    out: &mut [f32],
    count: u32,
    channels: u32,
    pixels: u32,
    epsilon: f32,
    least: f32,
) {
    let at = ABSOLUTE_POS;
    if at >= count as usize {
        terminate!();
    }
    let channel = at / pixels as usize % channels as usize;
    let scale = gamma[channel] / (variance[channel] + epsilon).sqrt();
    let value = (x[at] - mean[channel]) * scale + beta[channel];
    out[at] = value.max(least);
}

/// `gamma (x - mean) / sqrt(variance + epsilon) + beta`, mean and variance of each pixel's channels; `x` `[V, C, h, w]`.
pub(crate) fn channel_norm(
    x: Tensor<4>,
    gamma: Tensor<1>,
    beta: Tensor<1>,
    epsilon: f32,
) -> Tensor<4> {
    let x = numbers(x);
    let [views, channels, height, width] = dims(&x);
    let out = empty([views, channels, height, width], &x);
    let (count, pixels) = (views * height * width, height * width);
    if count == 0 {
        return tensor(out);
    }
    // SAFETY: threads past the last pixel end at once.
    unsafe {
        channel_norm_kernel::launch_unchecked(
            &out.client,
            groups(count),
            CubeDim::new_1d(THREADS),
            x.into_buffer_arg(),
            numbers(gamma).into_buffer_arg(),
            numbers(beta).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            count as u32,
            channels as u32,
            pixels as u32,
            epsilon,
        );
    }
    tensor(out)
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn channel_norm_kernel(
    x: &[f32],
    gamma: &[f32],
    beta: &[f32],
    out: &mut [f32],
    count: u32,
    channels: u32,
    pixels: u32,
    epsilon: f32,
) {
    let at = ABSOLUTE_POS;
    if at >= count as usize {
        terminate!();
    }
    let pixels = pixels as usize;
    let channels = channels as usize;
    let first = at / pixels * channels * pixels + at % pixels;
    let share = 1.0f32 / channels as f32;
    let mut mean = 0.0f32;
    for c in 0..channels {
        mean += x[first + c * pixels];
    }
    mean *= share;
    let mut variance = 0.0f32;
    for c in 0..channels {
        let off = x[first + c * pixels] - mean;
        variance += off * off;
    }
    let scale = 1.0f32 / (variance * share + epsilon).sqrt();
    for c in 0..channels {
        let off = (x[first + c * pixels] - mean) * scale;
        out[first + c * pixels] = off * gamma[c] + beta[c];
    }
}
