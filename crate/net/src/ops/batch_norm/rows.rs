//! Batch normalisation of rows `[N, C]`: the channels lie side by side. The factors of the channels are repeated until they
//! fill several registers, so that narrow rows run as fast as wide ones.

use crate::ops::wide::wide;
use rayon::prelude::*;

/// Numbers of a piece of work.
const PIECE: usize = 1 << 14;

/// How often the channels are repeated: to 64 numbers or more.
fn repeats(channels: usize) -> usize {
    64_usize.div_ceil(channels)
}

/// One factor of each channel, repeated.
fn repeated(values: impl Iterator<Item = f32>, channels: usize) -> Vec<f32> {
    let values: Vec<f32> = values.collect();
    values.repeat(repeats(channels))
}

/// The length of a piece: whole repetitions.
fn piece(channels: usize) -> usize {
    let width = channels * repeats(channels);
    PIECE.div_ceil(width) * width
}

/// Sums over pieces and repetitions, each piece having two numbers for each repeated channel.
fn summed(pieces: Vec<[Vec<f32>; 2]>, channels: usize) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; channels];
    for piece in pieces {
        for (i, of_piece) in piece.iter().enumerate() {
            for (at, value) in of_piece.iter().enumerate() {
                sums[at % channels][i] += f64::from(*value);
            }
        }
    }
    sums
}

wide! {
    fn scale_rows(x: &[f32], y: &mut [f32], scale: &[f32], shift: &[f32], relu: bool) {
        let least = if relu { 0.0 } else { f32::NEG_INFINITY };
        for (y, x) in y.chunks_mut(scale.len()).zip(x.chunks(scale.len())) {
            for (((y, x), scale), shift) in y.iter_mut().zip(x).zip(scale).zip(shift) {
                let value = scale * x + shift;
                *y = if value < least { least } else { value };
            }
        }
    }
}

/// `scale x + shift` of each channel, then, where asked, a ReLU.
pub(super) fn apply(x: &[f32], scales: &[[f32; 2]], relu: bool) -> Vec<f32> {
    let channels = scales.len();
    let scale = repeated(scales.iter().map(|s| s[0]), channels);
    let shift = repeated(scales.iter().map(|s| s[1]), channels);
    let mut y = vec![0.0; x.len()];
    y.par_chunks_mut(piece(channels))
        .zip(x.par_chunks(piece(channels)))
        .for_each(|(y, x)| scale_rows(x, y, &scale, &shift, relu));
    y
}

wide! {
    fn add_moments(x: &[f32], middle: &[f32], sums: &mut [f32], squares: &mut [f32]) {
        for x in x.chunks(middle.len()) {
            let sums = sums.iter_mut().zip(squares.iter_mut());
            for (((sum, square), x), middle) in sums.zip(x).zip(middle) {
                let off = x - middle;
                *sum += off;
                *square += off * off;
            }
        }
    }
}

/// Sum of each channel around `middle`, and sum of squares.
pub(super) fn moments(x: &[f32], middle: &[f32]) -> Vec<[f64; 2]> {
    let channels = middle.len();
    let middle = repeated(middle.iter().copied(), channels);
    let of_piece = |x: &[f32]| {
        let mut of_piece = [vec![0.0; middle.len()], vec![0.0; middle.len()]];
        let [sums, squares] = &mut of_piece;
        add_moments(x, &middle, sums, squares);
        of_piece
    };
    let pieces = x.par_chunks(piece(channels)).map(of_piece).collect();
    summed(pieces, channels)
}

wide! {
    /// `by`: scale, shift and mean.
    fn add_gradient_moments(
        x: &[f32],
        grad: &[f32],
        by: [&[f32]; 3],
        relu: bool,
        sums: &mut [f32],
        products: &mut [f32],
    ) {
        let [scale, shift, mean] = by;
        let width = scale.len();
        for (x, grad) in x.chunks(width).zip(grad.chunks(width)) {
            let sums = sums.iter_mut().zip(products.iter_mut());
            let by = scale.iter().zip(shift).zip(mean);
            for (((sum, product), (x, grad)), ((scale, shift), mean)) in sums.zip(x.iter().zip(grad)).zip(by) {
                let grad = if relu && scale * x + shift <= 0.0 { 0.0 } else { *grad };
                *sum += grad;
                *product += grad * (x - mean);
            }
        }
    }
}

/// The gradient of each channel through the ReLU summed, and summed times `x - mean`.
pub(super) fn gradient_moments(
    x: &[f32],
    grad: &[f32],
    scales: &[[f32; 2]],
    mean: &[f32],
    relu: bool,
) -> Vec<[f64; 2]> {
    let channels = scales.len();
    let scale = repeated(scales.iter().map(|s| s[0]), channels);
    let shift = repeated(scales.iter().map(|s| s[1]), channels);
    let mean = repeated(mean.iter().copied(), channels);
    let length = piece(channels);
    let of_piece = |(x, grad): (&[f32], &[f32])| {
        let mut of_piece = [vec![0.0; mean.len()], vec![0.0; mean.len()]];
        let [sums, products] = &mut of_piece;
        add_gradient_moments(x, grad, [&scale, &shift, &mean], relu, sums, products);
        of_piece
    };
    let pieces = x.par_chunks(length).zip(grad.par_chunks(length));
    summed(pieces.map(of_piece).collect(), channels)
}

wide! {
    /// `by`: scale and shift; then what the gradient, x and 1 are multiplied by.
    fn gradient_rows(x: &[f32], grad: &[f32], out: &mut [f32], by: [&[f32]; 5], relu: bool) {
        let [scale, shift, by_grad, by_x, plus] = by;
        let width = scale.len();
        let rows = out.chunks_mut(width).zip(x.chunks(width)).zip(grad.chunks(width));
        for ((out, x), grad) in rows {
            let forward = scale.iter().zip(shift);
            let factors = by_grad.iter().zip(by_x).zip(plus);
            let values = out.iter_mut().zip(x.iter().zip(grad));
            for (((out, (x, grad)), (scale, shift)), ((by_grad, by_x), plus)) in values.zip(forward).zip(factors) {
                let grad = if relu && scale * x + shift <= 0.0 { 0.0 } else { *grad };
                *out = by_grad * grad + by_x * x + plus;
            }
        }
    }
}

/// `out = by_grad grad' + by_x x + plus` with each channel's `factors`, `grad'` the gradient through the ReLU.
pub(super) fn gradient(
    x: &[f32],
    grad: &[f32],
    out: &mut [f32],
    scales: &[[f32; 2]],
    factors: &[[f32; 3]],
    relu: bool,
) {
    let channels = scales.len();
    let length = piece(channels);
    let [scale, shift] = [0, 1].map(|i| repeated(scales.iter().map(|s| s[i]), channels));
    let [by_grad, by_x, plus] = [0, 1, 2].map(|i| repeated(factors.iter().map(|f| f[i]), channels));
    out.par_chunks_mut(length)
        .zip(x.par_chunks(length).zip(grad.par_chunks(length)))
        .for_each(|(out, (x, grad))| {
            let by = [&*scale, &shift, &by_grad, &by_x, &plus];
            gradient_rows(x, grad, out, by, relu);
        });
}
