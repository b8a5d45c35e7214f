//! Layer normalisation over some rows.

use std::ops::Range;

use super::super::lanes::{dot, each, sum};
use super::super::wide::wide;

/// PyTorch's and burn's.
const EPSILON: f32 = 1e-5;

/// Where scale and shift lie among all weights.
#[derive(Clone, Debug)]
pub(super) struct Norm {
    pub scale: Range<usize>,
    pub shift: Range<usize>,
}

impl Norm {
    /// The normalisation whose scale begins at `start`, which moves to its end.
    pub fn take(start: &mut usize, channels: usize) -> Self {
        let scale = *start..*start + channels;
        let shift = scale.end..scale.end + channels;
        *start = shift.end;
        Self { scale, shift }
    }
}

wide! {
    /// `y = n scale + shift` with `n = (x - mean) r`, `r = 1 / sqrt(variance + 1e-5)`; rows have no gaps. Keeps `n` and `r`.
    pub(super) fn forward(norm: &Norm, weights: &[f32], x: &[f32], normed: &mut [f32], by: &mut [f32], y: &mut [f32]) {
        let (scale, shift) = (&weights[norm.scale.clone()], &weights[norm.shift.clone()]);
        let channels = scale.len();
        let share = 1.0 / channels as f32;
        let rows = x.chunks_exact(channels).zip(normed.chunks_exact_mut(channels));
        for (((x, normed), by), y) in rows.zip(by.iter_mut()).zip(y.chunks_exact_mut(channels)) {
            let mean = sum(x) * share;
            each(normed, [x], |_, [x]| x - mean);
            *by = 1.0 / (dot(normed, normed) * share + EPSILON).sqrt();
            each(normed, [], |n, []| n * *by);
            each(y, [normed, scale, shift], |_, [n, scale, shift]| n * scale + shift);
        }
    }
}

wide! {
    /// `dx += r (g - mean(g) - n mean(g n))` with `g = dy scale`; `dy` is overwritten.
    pub(super) fn backward(norm: &Norm, weights: &[f32], dy: &mut [f32], normed: &[f32], by: &[f32], dx: &mut [f32], grads: &mut [f32]) {
        let scale = &weights[norm.scale.clone()];
        let channels = scale.len();
        let share = 1.0 / channels as f32;
        let rows = dy.chunks_exact_mut(channels).zip(normed.chunks_exact(channels));
        for (((dy, normed), by), dx) in rows.zip(by).zip(dx.chunks_exact_mut(channels)) {
            each(&mut grads[norm.shift.clone()], [dy], |grad, [dy]| grad + dy);
            each(&mut grads[norm.scale.clone()], [dy, normed], |grad, [dy, n]| grad + dy * n);
            each(dy, [scale], |dy, [scale]| dy * scale);
            let mean = sum(dy) * share;
            let along = dot(dy, normed) * share;
            each(dx, [dy, normed], |dx, [dy, n]| dx + by * (dy - mean - n * along));
        }
    }
}
