//! Layer normalisation of each pixel's channels.

use std::ops::Range;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::Tensor;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::wide::wide;
use super::{cube, flex, on_processor, planar};

/// Added to variances.
const EPSILON: f32 = 1e-5;
/// Pixels of a task: their channels stay in the nearest caches.
const PIECE: usize = 1024;

/// `gamma (x - mean) / sqrt(variance + 1e-5) + beta`, mean and variance of each pixel's channels; `x` `[V, C, h, w]`, `gamma`
/// and `beta` `[C]`. On the processor one operation that keeps its inputs alone, on a GPU without gradients one kernel; elsewhere tensor
/// operations.
pub fn channel_norm(x: Tensor<4>, gamma: Tensor<1>, beta: Tensor<1>) -> Tensor<4> {
    if on_processor(&x.device()) {
        return Tensor::from_dispatch(<Dispatch as ChannelNormalisation>::channel_norm(
            x.into_dispatch(),
            gamma.into_dispatch(),
            beta.into_dispatch(),
        ));
    }
    if cube::runs_on(&x.device()) {
        return planar::channel_norm(x, gamma, beta, EPSILON);
    }
    composed(x, gamma, beta)
}

/// [`channel_norm`] by tensor operations, on any device.
pub fn composed(x: Tensor<4>, gamma: Tensor<1>, beta: Tensor<1>) -> Tensor<4> {
    let [channels] = gamma.dims();
    let each = |values: Tensor<1>| values.reshape([1, channels, 1, 1]);
    let centred = x.clone() - x.mean_dim(1);
    let variance = centred.clone().square().mean_dim(1);
    centred * (variance + EPSILON).sqrt().recip() * each(gamma) + each(beta)
}

/// The processor's form of [`channel_norm`].
#[backend_extension(Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait ChannelNormalisation: Backend {
    /// See [`channel_norm`].
    fn channel_norm(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
    ) -> FloatTensor<Self>;
}

/// The way back, which a backend needs to be differentiated.
pub trait ChannelNormalisationGradient: ChannelNormalisation {
    /// Gradients of `x`, `gamma` and `beta` from the output's.
    fn channel_norm_backward(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        grad: FloatTensor<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>);
}

wide! {
    fn add(to: &mut [f32], from: &[f32]) {
        for (to, from) in to.iter_mut().zip(from) {
            *to += from;
        }
    }
}

wide! {
    fn add_square(to: &mut [f32], x: &[f32], mean: &[f32]) {
        for ((to, x), mean) in to.iter_mut().zip(x).zip(mean) {
            *to += (x - mean) * (x - mean);
        }
    }
}

wide! {
    fn normalise(x: &[f32], mean: &[f32], scale: &[f32], gamma: f32, beta: f32, out: &mut [f32]) {
        for (((out, x), mean), scale) in out.iter_mut().zip(x).zip(mean).zip(scale) {
            *out = (x - mean) * scale * gamma + beta;
        }
    }
}

wide! {
    /// Adds `gamma g` and `gamma g x^` to each pixel's sums; gives the sums of `g` and `g x^` over the pixels.
    fn add_gradient(x: &[f32], grad: &[f32], view: &Moments, gamma: f32, sums: &mut [f32], products: &mut [f32]) -> [f32; 2] {
        let mut of_channel = [0.0_f32; 2];
        let statistics = view.mean.iter().zip(&view.scale);
        let pixels = x.iter().zip(grad).zip(statistics).zip(sums).zip(products);
        for ((((x, grad), (mean, scale)), sum), product) in pixels {
            let normal = (x - mean) * scale;
            *sum += gamma * grad;
            *product += gamma * grad * normal;
            of_channel[0] += grad;
            of_channel[1] += grad * normal;
        }
        of_channel
    }
}

wide! {
    /// `scale (gamma g - mean of that - x^ mean of (that x^))`.
    fn gradient(x: &[f32], grad: &[f32], view: &Moments, gamma: f32, means: [&[f32]; 2], out: &mut [f32]) {
        let statistics = view.mean.iter().zip(&view.scale);
        let means = means[0].iter().zip(means[1]);
        let pixels = x.iter().zip(grad).zip(statistics).zip(means);
        for (out, (((x, grad), (mean, scale)), (sum, product))) in out.iter_mut().zip(pixels) {
            *out = scale * (gamma * grad - sum - (x - mean) * scale * product);
        }
    }
}

/// Mean and `1 / sqrt(variance + epsilon)` of each pixel of a view.
struct Moments {
    mean: Vec<f32>,
    scale: Vec<f32>,
}

impl Moments {
    /// Of the `piece` of the pixels of `x` `[C, pixels]`.
    fn new(x: &[f32], pixels: usize, piece: Range<usize>) -> Self {
        let count = (x.len() / pixels) as f32;
        let mut mean = vec![0.0; piece.len()];
        for x in x.chunks_exact(pixels) {
            add(&mut mean, &x[piece.clone()]);
        }
        mean.iter_mut().for_each(|mean| *mean /= count);
        let mut squares = vec![0.0; piece.len()];
        for x in x.chunks_exact(pixels) {
            add_square(&mut squares, &x[piece.clone()], &mean);
        }
        let scale = squares
            .iter()
            .map(|sum| 1.0 / (sum / count + EPSILON).sqrt());
        Self {
            scale: scale.collect(),
            mean,
        }
    }
}

impl ChannelNormalisation for Flex {
    fn channel_norm(x: FlexTensor, gamma: FlexTensor, beta: FlexTensor) -> FlexTensor {
        let shape = x.shape();
        let [_, channels, height, width] = shape.dims();
        let pixels = height * width;
        let (x, gamma, beta) = (flex::read(x), flex::read(gamma), flex::read(beta));
        let mut out = vec![0.0; x.len()];
        let of_view = pixels.div_ceil(PIECE);
        flex::pieces(&mut out, channels, pixels, PIECE)
            .into_par_iter()
            .enumerate()
            .for_each(|(task, outs)| {
                let x = &x[task / of_view * channels * pixels..][..channels * pixels];
                let first = task % of_view * PIECE;
                let piece = first..(first + PIECE).min(pixels);
                let Moments { mean, scale } = Moments::new(x, pixels, piece.clone());
                let planes = outs.into_iter().zip(x.chunks_exact(pixels));
                for ((out, x), (gamma, beta)) in planes.zip(gamma.iter().zip(&*beta)) {
                    normalise(&x[piece.clone()], &mean, &scale, *gamma, *beta, out);
                }
            });
        flex::tensor(out, shape)
    }
}

impl ChannelNormalisationGradient for Flex {
    fn channel_norm_backward(
        x: FlexTensor,
        gamma: FlexTensor,
        grad: FlexTensor,
    ) -> (FlexTensor, FlexTensor, FlexTensor) {
        let shape = x.shape();
        let [_, channels, height, width] = shape.dims();
        let pixels = height * width;
        let (x, gamma, grad) = (flex::read(x), flex::read(gamma), flex::read(grad));
        let mut out = vec![0.0; x.len()];
        let of_views: Vec<Vec<[f32; 2]>> = out
            .par_chunks_mut(channels * pixels)
            .zip(x.par_chunks(channels * pixels))
            .zip(grad.par_chunks(channels * pixels))
            .map(|((out, x), grad)| {
                let view = Moments::new(x, pixels, 0..pixels);
                let (mut sums, mut products) = (vec![0.0; pixels], vec![0.0; pixels]);
                let planes = || x.chunks_exact(pixels).zip(grad.chunks_exact(pixels));
                let of_channels = planes()
                    .zip(&*gamma)
                    .map(|((x, grad), gamma)| {
                        add_gradient(x, grad, &view, *gamma, &mut sums, &mut products)
                    })
                    .collect();
                for mean in [&mut sums, &mut products] {
                    mean.iter_mut().for_each(|sum| *sum /= channels as f32);
                }
                let outs = out.chunks_exact_mut(pixels);
                for (out, ((x, grad), gamma)) in outs.zip(planes().zip(&*gamma)) {
                    gradient(x, grad, &view, *gamma, [&sums, &products], out);
                }
                of_channels
            })
            .collect();
        let sum = |which: usize| {
            let of_channel = |c: usize| of_views.iter().map(|view| view[c][which]).sum();
            let sums: Vec<f32> = (0..channels).map(of_channel).collect();
            flex::tensor(sums, [channels].into())
        };
        (flex::tensor(out, shape), sum(1), sum(0))
    }
}

#[cfg(not(target_family = "wasm"))]
mod backward {
    use burn::backend::Autodiff;
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
    use burn::backend::tensor::FloatTensor;

    use super::{ChannelNormalisation, ChannelNormalisationGradient};
    use crate::ops::hand_on;

    #[derive(Debug)]
    struct Normalised;

    impl<B: ChannelNormalisationGradient> Backward<B, 3> for Normalised {
        type State = [FloatTensor<B>; 2];

        fn backward(
            self,
            ops: Ops<Self::State, 3>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let [x, gamma] = ops.state;
            let found = B::channel_norm_backward(x, gamma, grad);
            let inputs = ops.parents.map(|parent| parent.map(|parent| parent.id));
            hand_on::<B, _>(grads, inputs, [found.0, found.1, found.2]);
        }
    }

    impl<B: ChannelNormalisationGradient, C: CheckpointStrategy> ChannelNormalisation
        for Autodiff<B, C>
    {
        fn channel_norm(
            x: FloatTensor<Self>,
            gamma: FloatTensor<Self>,
            beta: FloatTensor<Self>,
        ) -> FloatTensor<Self> {
            let prepared = Normalised.prepare::<C>([x.node(), gamma.node(), beta.node()]);
            let [x, gamma, beta] = [x, gamma, beta].map(|tensor| tensor.into_primitive());
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => {
                    let y = B::channel_norm(x.clone(), gamma.clone(), beta);
                    prepared.finish([x, gamma], y)
                }
                OpsKind::UnTracked(prepared) => prepared.finish(B::channel_norm(x, gamma, beta)),
            }
        }
    }
}
