//! Operations on planes as kernels, for WebGPU where nothing is differentiated: convolutions with what follows them, and what has
//! to be done to each pixel.

mod maps;
mod norm;

pub(crate) use maps::{affine_sample, upsample2};
pub(crate) use norm::{channel_norm, scaled};

use burn::nn::{BatchNorm, conv::Conv2d};
use burn::tensor::Tensor;
use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

use super::cube::{THREADS, dims, empty, numbers, rows, tensor};

/// Output pixels of a thread: weights that are read once serve them all.
const PIXELS: usize = 4;
/// Output channels of a thread of a dense convolution.
const TILE: usize = 8;

/// Numbers of a batch normalisation's channels as they are kept: gamma, beta, mean, variance.
pub(crate) fn statistics(norm: &BatchNorm) -> [Tensor<1>; 4] {
    let gamma = norm.gamma.val();
    let device = gamma.device();
    let [mean, variance] = [norm.running_mean.value(), norm.running_var.value()];
    let beta = norm.beta.val();
    [
        gamma,
        beta,
        mean.to_device(&device),
        variance.to_device(&device),
    ]
}

/// What `conv`, dense or a kernel a channel, centred and odd, gives for `x` `[V, C, H, W]`, then `norm` by its running statistics,
/// then, where asked, a ReLU; `[V, C', ceil(H / stride), ceil(W / stride)]`.
pub(crate) fn convolved(
    conv: &Conv2d,
    norm: Option<&BatchNorm>,
    relu: bool,
    x: Tensor<4>,
) -> Tensor<4> {
    let x = numbers(x);
    let weight = numbers(conv.weight.val());
    let finish = Finish {
        bias: conv.bias.as_ref().map(|bias| numbers(bias.val())),
        norm: norm.map(|norm| (statistics(norm).map(numbers), norm.epsilon as f32)),
    };
    tensor(convolve(x, weight, finish, conv.stride[0], relu))
}

/// What follows the sums of a convolution: one of these or nothing.
struct Finish {
    /// A number for each channel that is added.
    bias: Option<CubeTensor>,
    /// Gamma, beta, mean, variance, and what is added to variances.
    norm: Option<([CubeTensor; 4], f32)>,
}

fn convolve(
    x: CubeTensor,
    weight: CubeTensor,
    finish: Finish,
    stride: usize,
    relu: bool,
) -> CubeTensor {
    let [views, channels, height, width] = dims(&x);
    let [outputs, inputs, kernel, _] = dims(&weight);
    let [out_height, out_width] = [height, width].map(|side| side.div_ceil(stride));
    let out = empty([views, outputs, out_height, out_width], &x);
    let count = views * out_height * out_width;
    if count * outputs == 0 {
        return out;
    }
    let tile = if inputs == channels && outputs > 1 {
        TILE
    } else {
        1
    };
    let [biased, normed] = [finish.bias.is_some(), finish.norm.is_some()];
    // A binding cannot stay empty: what is not read may be anything.
    let bias = finish.bias.unwrap_or_else(|| weight.clone());
    let (factors, epsilon) = finish
        .norm
        .unwrap_or_else(|| ([(); 4].map(|()| bias.clone()), 0.0));
    let [gamma, beta, mean, variance] = factors.map(|factor| rows(factor).into_buffer_arg());
    // SAFETY: threads past the last pixel end at once; taps outside of a plane are not read, and channels past the last repeat it.
    unsafe {
        convolve_kernel::launch_unchecked(
            &out.client,
            CubeCount::Static(
                (count as u32).div_ceil(THREADS * PIXELS as u32),
                outputs.div_ceil(tile) as u32,
                1,
            ),
            CubeDim::new_1d(THREADS),
            x.into_buffer_arg(),
            weight.into_buffer_arg(),
            gamma,
            beta,
            mean,
            variance,
            out.clone().into_buffer_arg(),
            count as u32,
            channels as u32,
            inputs as u32,
            outputs as u32,
            height as u32,
            width as u32,
            out_height as u32,
            out_width as u32,
            kernel as u32,
            stride as u32,
            epsilon,
            if relu { 0.0 } else { f32::MIN },
            tile,
            biased,
            normed,
        );
    }
    out
}

/// `weight` is `[outputs, inputs, kernel, kernel]`; with one input of several channels each output has the channel of its number.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn convolve_kernel(
    x: &[f32],
    weight: &[f32],
    gamma: &[f32],
    beta: &[f32],
    mean: &[f32],
    variance: &[f32],
    out: &mut [f32],
    count: u32,
    channels: u32,
    inputs: u32,
    outputs: u32,
    height: u32,
    width: u32,
    out_height: u32,
    out_width: u32,
    kernel: u32,
    stride: u32,
    epsilon: f32,
    least: f32,
    #[comptime] tile: usize,
    #[comptime] biased: bool,
    #[comptime] normed: bool,
) {
    let first = CUBE_POS_X * comptime!(THREADS * PIXELS as u32) + UNIT_POS_X;
    if first >= count {
        terminate!();
    }
    let column = CUBE_POS_Y * comptime!(tile as u32);
    let area = height * width;
    let taps = inputs * kernel * kernel;
    let pad = (kernel / 2) as i32;
    let mut sums = Array::<f32>::new(comptime!(PIXELS * tile));
    #[unroll]
    for s in 0..comptime!(PIXELS * tile) {
        sums[s] = 0.0f32;
    }
    let mut plane = Array::<u32>::new(PIXELS);
    let mut left = Array::<i32>::new(PIXELS);
    let mut top = Array::<i32>::new(PIXELS);
    #[unroll]
    for r in 0..PIXELS {
        // The last pixels of a ragged end repeat the last of all, and are not written.
        let pixel = (first + comptime!(r as u32 * THREADS)).min(count - 1);
        let view = pixel / (out_height * out_width);
        plane[r] = view * channels * area;
        left[r] = (pixel % out_width * stride) as i32 - pad;
        top[r] = (pixel / out_width % out_height * stride) as i32 - pad;
        if inputs < channels {
            plane[r] += column * area;
        }
    }
    let mut from = Array::<u32>::new(tile);
    #[unroll]
    for t in 0..tile {
        from[t] = (column + comptime!(t as u32)).min(outputs - 1) * taps;
    }
    let mut tap = 0u32;
    for input in 0..inputs {
        for ky in 0..kernel {
            for kx in 0..kernel {
                let mut seen = Array::<f32>::new(PIXELS);
                #[unroll]
                for r in 0..PIXELS {
                    let row = top[r] + ky as i32;
                    let line = left[r] + kx as i32;
                    seen[r] = 0.0f32;
                    if row >= 0 && line >= 0 && row < height as i32 && line < width as i32 {
                        let at = plane[r] + input * area + row as u32 * width + line as u32;
                        seen[r] = x[at as usize];
                    }
                }
                #[unroll]
                for t in 0..tile {
                    let w = weight[(from[t] + tap) as usize];
                    #[unroll]
                    for r in 0..PIXELS {
                        sums[r * tile + t] += seen[r] * w;
                    }
                }
                tap += 1;
            }
        }
    }
    let out_area = out_height * out_width;
    #[unroll]
    for t in 0..tile {
        let output = column + comptime!(t as u32);
        if output < outputs {
            let at = output as usize;
            #[unroll]
            for r in 0..PIXELS {
                let pixel = first + comptime!(r as u32 * THREADS);
                if pixel < count {
                    let mut value = sums[r * tile + t];
                    if comptime!(biased) {
                        value += beta[at];
                    }
                    if comptime!(normed) {
                        let scale = gamma[at] / (variance[at] + epsilon).sqrt();
                        value = (value - mean[at]) * scale + beta[at];
                    }
                    let view = pixel / out_area;
                    let to = (view * outputs + output) * out_area + pixel % out_area;
                    out[to as usize] = value.max(least);
                }
            }
        }
    }
}
