//! The encoder of sampled views as a row of kernels, for WebGPU where nothing is differentiated.

use burn::tensor::Tensor;
use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

use super::ViewsShape;
use crate::ops::cube::{THREADS, dims, empty, groups, numbers, tensor};
use crate::ops::linear::{Around, Matrix, linear, row_norm};
use crate::ops::segments::Segments;
use crate::ops::{attention::attention, cube};

/// Weight `[I, O]` and bias of a linear layer, taken from a list of both.
fn layer(
    weights: &mut impl Iterator<Item = Tensor<1>>,
    inputs: usize,
    outputs: usize,
) -> (Matrix, CubeTensor) {
    let weight = next(weights).reshape([inputs, outputs]);
    (Matrix::whole(numbers(weight)), numbers(next(weights)))
}

fn next(weights: &mut impl Iterator<Item = Tensor<1>>) -> Tensor<1> {
    match weights.next() {
        Some(weight) => weight,
        None => panic!("as many weights as the layers have"),
    }
}

/// Tokens `[P, C]` as [`super::view_tokens`] makes them, from what was sampled of the planes: `base` and `hidden` `[P, C]`. The
/// weights come one by one, in the order that is told there.
pub(crate) fn tokens(
    base: Tensor<2>,
    hidden: Option<Tensor<2>>,
    extra: Tensor<2>,
    weights: Vec<Tensor<1>>,
    segments: &Segments,
    shape: ViewsShape,
) -> Tensor<2> {
    let ViewsShape {
        channels, heads, ..
    } = shape;
    let mut weights = weights.into_iter();
    let biased = |bias, added| Around {
        bias: Some(bias),
        added,
        ..Around::default()
    };
    let mut x = numbers(base);
    if let Some(hidden) = hidden {
        let (matrix, bias) = layer(&mut weights, channels, channels);
        let around = Around {
            silu: true,
            ..biased(bias, Some(x))
        };
        x = linear(numbers(hidden), matrix, around);
    }
    let (matrix, bias) = layer(&mut weights, channels + shape.extra, channels);
    x = linear(x, matrix.clone(), biased(bias, None));
    let around = Around {
        added: Some(x),
        ..Around::default()
    };
    x = linear(numbers(extra), matrix.below(channels), around);
    for _ in 0..shape.layers {
        let normed = row_norm(
            x.clone(),
            numbers(next(&mut weights)),
            numbers(next(&mut weights)),
        );
        let (matrix, bias) = layer(&mut weights, channels, 3 * channels);
        // Three tables instead of one wide one, so that more pairs fit in a device's largest binding.
        let [query, key, value] = [0, 1, 2].map(|part| {
            let columns = matrix.columns(part * channels, channels);
            tensor(linear(normed.clone(), columns, biased(bias.clone(), None)))
        });
        let heard = attention(query, key, value, segments, heads);
        let (matrix, bias) = layer(&mut weights, channels, channels);
        x = linear(numbers(heard), matrix, biased(bias, Some(x)));
        let normed = row_norm(
            x.clone(),
            numbers(next(&mut weights)),
            numbers(next(&mut weights)),
        );
        let (matrix, bias) = layer(&mut weights, channels, 2 * channels);
        let around = Around {
            relu: true,
            ..biased(bias, None)
        };
        let wide = linear(normed, matrix, around);
        let (matrix, bias) = layer(&mut weights, 2 * channels, channels);
        x = linear(wide, matrix, biased(bias, Some(x)));
    }
    tensor(x)
}

/// Cosine of each pair's features `[P, C]` with the mean of the others' of its segment, in `parts` parts of the channels;
/// `[P, parts]`. `mean` `[N, C]` is that of all of a segment; a length below `short` has no direction.
pub(crate) fn likeness(
    features: Tensor<2>,
    mean: Tensor<2>,
    segments: &Segments,
    parts: usize,
    short: f32,
) -> Tensor<2> {
    let features = numbers(features);
    let [pairs, channels] = dims(&features);
    let out = empty([pairs, parts], &features);
    if pairs == 0 {
        return tensor(out);
    }
    let index = |tensor| cube::whole_numbers(tensor).into_buffer_arg();
    // SAFETY: threads past the last pair end at once, and a pair's segment is one of those that have a mean.
    unsafe {
        likeness_kernel::launch_unchecked(
            &out.client,
            groups(pairs * parts),
            CubeDim::new_1d(THREADS),
            features.into_buffer_arg(),
            numbers(mean).into_buffer_arg(),
            index(segments.of_row.clone()),
            index(segments.offsets.clone()),
            out.clone().into_buffer_arg(),
            pairs as u32,
            channels as u32,
            parts as u32,
            short * short * short * short,
        );
    }
    tensor(out)
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn likeness_kernel(
    features: &[f32],
    mean: &[f32],
    of_row: &[i32],
    offsets: &[i32],
    out: &mut [f32],
    pairs: u32,
    channels: u32,
    parts: u32,
    least: f32,
) {
    let at = ABSOLUTE_POS;
    let pair = at / parts as usize;
    if pair >= pairs as usize {
        terminate!();
    }
    let channels = channels as usize;
    let each = channels / parts as usize;
    let column = at % parts as usize * each;
    let segment = of_row[pair] as usize;
    let count = (offsets[segment + 1] - offsets[segment]) as f32;
    let mut product = 0.0f32;
    let mut own_square = 0.0f32;
    let mut other_square = 0.0f32;
    // What is left of a sum of one is rounding, whose direction means nothing.
    if count > 1.0 {
        for c in 0..each {
            let own = features[pair * channels + column + c];
            let sum = mean[segment * channels + column + c] * count;
            let other = (sum - own) / (count - 1.0f32);
            product += own * other;
            own_square += own * own;
            other_square += other * other;
        }
    }
    out[at] = product / (own_square * other_square + least).sqrt();
}
