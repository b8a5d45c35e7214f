//! Depthwise convolution: one kernel a channel.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::Tensor;
use burn::tensor::ops::ConvOptions;
use burn_cubecl::CubeBackend;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::padded::Layout;
use super::wide::wide;
use super::{flex, lanes};

/// Convolves each channel of `x` `[V, C, H, W]` with its kernel of `weight` `[C, 1, K, K]`, `K` odd. Output pixel `i` is
/// centred on input pixel `stride * i`, zeros lie outside; `[V, C, ceil(H / stride), ceil(W / stride)]`.
pub fn depthwise(x: Tensor<4>, weight: Tensor<4>, stride: usize) -> Tensor<4> {
    Tensor::from_dispatch(<Dispatch as Depthwise>::depthwise(
        x.into_dispatch(),
        weight.into_dispatch(),
        stride,
    ))
}

/// Backends that run [`depthwise`]: burn's own convolution, but on the processor, where its gradients take many times as
/// long as these loops.
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait Depthwise: Backend {
    /// See [`depthwise`].
    fn depthwise(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        stride: usize,
    ) -> FloatTensor<Self> {
        let options = options(&weight, stride);
        Self::conv2d(x, weight, None, options)
    }

    /// Gradients of `x` and of `weight` from the output's.
    fn depthwise_backward(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        stride: usize,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let options = options(&weight, stride);
        (
            Self::conv2d_x_backward(x.clone(), weight.clone(), grad.clone(), options.clone()),
            Self::conv2d_weight_backward(x, weight, grad, options),
        )
    }
}

impl Depthwise for CubeBackend {}

fn options(weight: &impl TensorMetadata, stride: usize) -> ConvOptions<2> {
    let [channels, _, kernel, _] = weight.shape().dims();
    ConvOptions::new([stride; 2], [kernel / 2; 2], [1; 2], channels)
}

/// Numbers that a task's run is cut into: what is added to stays in the nearest cache.
const BLOCK: usize = 1024;

/// `out_i += sum over taps of weight * from_{i + offset}`.
fn add_taps(out: &mut [f32], from: &[f32], taps: &[(usize, f32)]) {
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let from = &from[block * BLOCK..];
        for taps in taps.chunks(5) {
            match taps.len() {
                1 => add_some::<1>(out, from, taps),
                2 => add_some::<2>(out, from, taps),
                3 => add_some::<3>(out, from, taps),
                4 => add_some::<4>(out, from, taps),
                _ => add_some::<5>(out, from, taps),
            }
        }
    }
}

wide! {
    fn add_some<const N: usize>(out: &mut [f32], from: &[f32], taps: &[(usize, f32)]) {
        let length = out.len();
        let runs: [&[f32]; N] = std::array::from_fn(|n| &from[taps[n].0..][..length]);
        let weights: [f32; N] = std::array::from_fn(|n| taps[n].1);
        for i in 0..length {
            let mut value = out[i];
            for n in 0..N {
                value += weights[n] * runs[n][i];
            }
            out[i] = value;
        }
    }
}

wide! {
    /// `sum_i a_i b_i`.
    fn dot(a: &[f32], b: &[f32]) -> f32 {
        lanes::dot(a, b)
    }
}

impl Depthwise for Flex {
    fn depthwise(x: FlexTensor, weight: FlexTensor, stride: usize) -> FlexTensor {
        let [views, channels, height, width] = x.shape().dims();
        let [_, _, kernel, _] = weight.shape().dims();
        let layout = Layout::new(height, width, kernel, stride);
        let [out_height, out_width] = layout.out();
        let (x, weight) = (flex::read(x), flex::read(weight));
        let mut out = vec![0.0; views * channels * out_height * out_width];
        out.par_chunks_mut(out_height * out_width)
            .zip(x.par_chunks(height * width))
            .enumerate()
            .for_each_init(
                || (vec![0.0; layout.len()], vec![0.0; layout.run()]),
                |(parts, run), (plane, (out, x))| {
                    layout.deal(x, parts);
                    run.fill(0.0);
                    let kernels = weight.chunks_exact(kernel * kernel);
                    let weights = kernels.skip(plane % channels).take(1).flatten();
                    let taps: Vec<(usize, f32)> = weights
                        .enumerate()
                        .map(|(tap, weight)| (layout.offset(tap), *weight))
                        .collect();
                    add_taps(run, parts, &taps);
                    let rows = run.chunks_exact(layout.columns);
                    for (to, from) in out.chunks_exact_mut(out_width).zip(rows) {
                        to.copy_from_slice(&from[..out_width]);
                    }
                },
            );
        flex::tensor(out, [views, channels, out_height, out_width].into())
    }

    fn depthwise_backward(
        x: FlexTensor,
        weight: FlexTensor,
        grad: FlexTensor,
        stride: usize,
    ) -> (FlexTensor, FlexTensor) {
        let [views, channels, height, width] = x.shape().dims();
        let [_, _, kernel, _] = weight.shape().dims();
        let layout = Layout::new(height, width, kernel, stride);
        let [out_height, out_width] = layout.out();
        let (x, weight, grad) = (flex::read(x), flex::read(weight), flex::read(grad));
        let taps = kernel * kernel;
        let reach = layout.reach();
        let mut of_x = vec![0.0; x.len()];
        let mut of_weight = vec![0.0; views * channels * taps];
        of_x.par_chunks_mut(height * width)
            .zip(of_weight.par_chunks_mut(taps))
            .zip(x.par_chunks(height * width))
            .zip(grad.par_chunks(out_height * out_width))
            .enumerate()
            .for_each_init(
                || {
                    // The run of the gradient has zeros before it, for the taps that reach there, and behind it.
                    let run = vec![0.0; reach + layout.len()];
                    (vec![0.0; layout.len()], vec![0.0; layout.len()], run)
                },
                |(parts, of_parts, run), (plane, (((of_x, of_weight), x), grad))| {
                    layout.deal(x, parts);
                    layout.spread(grad, reach, run);
                    let kernels = weight.chunks_exact(taps);
                    let weights = kernels.skip(plane % channels).take(1).flatten();
                    let mut by_part = vec![Vec::new(); stride * stride];
                    for ((tap, weight), of_weight) in weights.enumerate().zip(of_weight) {
                        let (part, offset) = layout.tap(tap);
                        let seen = &parts[part * layout.part() + offset..];
                        *of_weight = dot(&run[reach..][..layout.run()], &seen[..layout.run()]);
                        by_part[part].push((reach - offset, *weight));
                    }
                    of_parts.fill(0.0);
                    let each = of_parts.chunks_exact_mut(layout.part());
                    for (of_part, taps) in each.zip(&by_part) {
                        add_taps(of_part, run, taps);
                    }
                    layout.collect(of_parts, of_x);
                },
            );
        // Views one after the other, whatever the threads did.
        let mut sum = vec![0.0; channels * taps];
        for of_view in of_weight.chunks_exact(channels * taps) {
            for (sum, of_view) in sum.iter_mut().zip(of_view) {
                *sum += of_view;
            }
        }
        (
            flex::tensor(of_x, [views, channels, height, width].into()),
            flex::tensor(sum, [channels, 1, kernel, kernel].into()),
        )
    }
}

#[cfg(not(target_family = "wasm"))]
mod backward {
    use burn::backend::Autodiff;
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
    use burn::backend::tensor::FloatTensor;

    use super::Depthwise;
    use crate::ops::hand_on;

    #[derive(Debug)]
    struct DepthwiseBackward;

    impl<B: Depthwise> Backward<B, 2> for DepthwiseBackward {
        type State = (FloatTensor<B>, FloatTensor<B>, usize);

        fn backward(
            self,
            ops: Ops<Self::State, 2>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let (x, weight, stride) = ops.state;
            let (of_x, of_weight) = B::depthwise_backward(x, weight, grad, stride);
            let inputs = ops.parents.map(|parent| parent.map(|parent| parent.id));
            hand_on::<B, _>(grads, inputs, [of_x, of_weight]);
        }
    }

    impl<B: Depthwise, C: CheckpointStrategy> Depthwise for Autodiff<B, C> {
        fn depthwise(
            x: FloatTensor<Self>,
            weight: FloatTensor<Self>,
            stride: usize,
        ) -> FloatTensor<Self> {
            let prepared = DepthwiseBackward.prepare::<C>([x.node(), weight.node()]);
            let (x, weight) = (x.into_primitive(), weight.into_primitive());
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => {
                    let out = B::depthwise(x.clone(), weight.clone(), stride);
                    prepared.finish((x, weight, stride), out)
                }
                OpsKind::UnTracked(prepared) => prepared.finish(B::depthwise(x, weight, stride)),
            }
        }
    }
}
