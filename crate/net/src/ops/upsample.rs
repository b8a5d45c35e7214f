//! Bilinear upsampling by two.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::Tensor;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::wide::wide;
use super::{cube, flex, on_processor, planar};

/// Twice the height and width, bilinear, with half-pixel centres (`align_corners = false`): output `2 i` is
/// `(x_{i-1} + 3 x_i) / 4`, output `2 i + 1` is `(3 x_i + x_{i+1}) / 4`, and the edge repeats. On the processor one operation,
/// on a GPU without gradients one kernel; elsewhere tensor operations, since burn's own has no gradient on a GPU.
pub fn upsample2(x: Tensor<4>) -> Tensor<4> {
    if on_processor(&x.device()) {
        return Tensor::from_dispatch(<Dispatch as Upsampling>::upsample2(x.into_dispatch()));
    }
    if cube::runs_on(&x.device()) {
        return planar::upsample2(x);
    }
    composed(x)
}

/// [`upsample2`] by tensor operations, on any device.
pub fn composed(x: Tensor<4>) -> Tensor<4> {
    doubled(doubled(x, 2), 3)
}

/// Along one axis.
fn doubled(x: Tensor<4>, axis: usize) -> Tensor<4> {
    let mut shape = x.dims();
    let length = shape[axis];
    let run = |from: usize, length: usize| x.clone().narrow(axis, from, length);
    let (before, after) = if length == 1 {
        (x.clone(), x.clone())
    } else {
        let before = Tensor::cat(vec![run(0, 1), run(0, length - 1)], axis);
        let after = Tensor::cat(vec![run(1, length - 1), run(length - 1, 1)], axis);
        (before, after)
    };
    let x = x * 0.75;
    let even = x.clone() + before * 0.25;
    let odd = x + after * 0.25;
    shape[axis] *= 2;
    // Interleaved: a new axis right after the doubled one.
    Tensor::stack::<5>(vec![even, odd], axis + 1).reshape(shape)
}

/// The processor's form of [`upsample2`].
#[backend_extension(Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait Upsampling: Backend {
    /// See [`upsample2`].
    fn upsample2(x: FloatTensor<Self>) -> FloatTensor<Self>;
}

/// The way back, which a backend needs to be differentiated.
pub trait UpsamplingGradient: Upsampling {
    /// Gradient of `x` from the output's.
    fn upsample2_backward(grad: FloatTensor<Self>) -> FloatTensor<Self>;
}

wide! {
    /// `(3 near + far) / 4`.
    fn mix(near: &[f32], far: &[f32], out: &mut [f32]) {
        for ((out, near), far) in out.iter_mut().zip(near).zip(far) {
            *out = 0.75 * near + 0.25 * far;
        }
    }
}

wide! {
    /// Adds `factor * from`.
    fn add(out: &mut [f32], from: &[f32], factor: f32) {
        for (out, from) in out.iter_mut().zip(from) {
            *out += factor * from;
        }
    }
}

/// A row at twice its width.
fn double_row(x: &[f32], out: &mut [f32]) {
    let last = x.len() - 1;
    for (i, out) in out.chunks_exact_mut(2).enumerate() {
        let near = 0.75 * x[i];
        out[0] = near + 0.25 * x[i.saturating_sub(1)];
        out[1] = near + 0.25 * x[(i + 1).min(last)];
    }
}

/// The gradient of [`double_row`].
fn halve_row(grad: &[f32], out: &mut [f32]) {
    let (last, end) = (out.len() - 1, grad.len() - 1);
    for (i, out) in out.iter_mut().enumerate() {
        *out = 0.75 * (grad[2 * i] + grad[2 * i + 1]);
        // Their far pixel: that of the next even output and of the odd one before; at the edge, of the edge's own.
        let next = if i == last { end } else { 2 * i + 2 };
        let before = if i == 0 { 0 } else { 2 * i - 1 };
        *out += 0.25 * (grad[next] + grad[before]);
    }
}

impl Upsampling for Flex {
    fn upsample2(x: FlexTensor) -> FlexTensor {
        let [views, channels, height, width] = x.shape().dims();
        let x = flex::read(x);
        let wide = 2 * width;
        let mut out = vec![0.0; 4 * x.len()];
        out.par_chunks_mut(4 * height * width)
            .zip(x.par_chunks(height * width))
            .for_each_init(
                || vec![0.0; height * wide],
                |rows, (out, x)| {
                    let each = rows.chunks_exact_mut(wide).zip(x.chunks_exact(width));
                    each.for_each(|(row, x)| double_row(x, row));
                    let row = |i: usize| &rows[i * wide..(i + 1) * wide];
                    for (i, pair) in out.chunks_exact_mut(2 * wide).enumerate() {
                        let (even, odd) = pair.split_at_mut(wide);
                        mix(row(i), row(i.saturating_sub(1)), even);
                        mix(row(i), row((i + 1).min(height - 1)), odd);
                    }
                },
            );
        flex::tensor(out, [views, channels, 2 * height, wide].into())
    }
}

impl UpsamplingGradient for Flex {
    fn upsample2_backward(grad: FlexTensor) -> FlexTensor {
        let [views, channels, height, width] = grad.shape().dims();
        let grad = flex::read(grad);
        let (rows, columns) = (height / 2, width / 2);
        let mut out = vec![0.0; grad.len() / 4];
        out.par_chunks_mut(rows * columns)
            .zip(grad.par_chunks(height * width))
            .for_each_init(
                || vec![0.0; width],
                |sum, (out, grad)| {
                    let line = |i: usize| &grad[i * width..(i + 1) * width];
                    for (i, out) in out.chunks_exact_mut(columns).enumerate() {
                        let next = if i + 1 == rows { height - 1 } else { 2 * i + 2 };
                        let before = if i == 0 { 0 } else { 2 * i - 1 };
                        sum.fill(0.0);
                        add(sum, line(2 * i), 0.75);
                        add(sum, line(2 * i + 1), 0.75);
                        add(sum, line(next), 0.25);
                        add(sum, line(before), 0.25);
                        halve_row(sum, out);
                    }
                },
            );
        flex::tensor(out, [views, channels, rows, columns].into())
    }
}

#[cfg(not(target_family = "wasm"))]
mod backward {
    use burn::backend::Autodiff;
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind, unary};
    use burn::backend::tensor::FloatTensor;

    use super::{Upsampling, UpsamplingGradient};

    #[derive(Debug)]
    struct Upsampled;

    impl<B: UpsamplingGradient> Backward<B, 1> for Upsampled {
        type State = ();

        fn backward(
            self,
            ops: Ops<Self::State, 1>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            unary::<B, _>(ops.parents, ops.node, grads, B::upsample2_backward);
        }
    }

    impl<B: UpsamplingGradient, C: CheckpointStrategy> Upsampling for Autodiff<B, C> {
        fn upsample2(x: FloatTensor<Self>) -> FloatTensor<Self> {
            let prepared = Upsampled.prepare::<C>([x.node()]);
            let y = B::upsample2(x.into_primitive());
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => prepared.finish((), y),
                OpsKind::UnTracked(prepared) => prepared.finish(y),
            }
        }
    }
}
