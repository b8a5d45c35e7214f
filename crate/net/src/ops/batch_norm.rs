//! Batch normalisation with the ReLU that follows it.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::nn::BatchNorm;
use burn::tensor::{Device, Shape, Tensor};
use burn_cubecl::CubeBackend;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::wide::wide;
use super::{cube, flex, planar};

#[cfg(not(target_family = "wasm"))]
mod backward;
mod rows;

/// What `norm` gives for `x` `[V, C, h, w]` or rows `[N, C]`, then, where asked, a ReLU; in one pass over the numbers where burn makes several.
/// As burn's module does it, training takes the batch's statistics and adds them to the running ones.
pub fn batch_norm<const D: usize>(norm: &BatchNorm, x: Tensor<D>, relu: bool) -> Tensor<D> {
    let device = x.device();
    if cube::runs_on(&device) {
        return planar::scaled(norm, x, relu);
    }
    if !(device.is_autodiff() && norm.training.is_enabled()) {
        let (scale, shift) = running_factors(norm, &device);
        return scaled(x, scale, shift, relu);
    }
    let (y, mean, variance) = <Dispatch as BatchNormalisation>::normalised(
        x.into_dispatch(),
        norm.gamma.val().into_dispatch(),
        norm.beta.val().into_dispatch(),
        norm.epsilon,
        relu,
    );
    for (running, found) in [(&norm.running_mean, mean), (&norm.running_var, variance)] {
        let found = Tensor::<1>::from_dispatch(found).detach();
        let before = running.value_sync().to_device(&device);
        let after = before * (1.0 - norm.momentum) + found * norm.momentum;
        running.update(after.detach());
    }
    Tensor::from_dispatch(y)
}

/// `scale x + shift` of each channel of `x` `[V, C, h, w]` or `[N, C]`, with `scale` and `shift` `[C]`; then, where asked, a ReLU.
pub fn scaled<const D: usize>(
    x: Tensor<D>,
    scale: Tensor<1>,
    shift: Tensor<1>,
    relu: bool,
) -> Tensor<D> {
    Tensor::from_dispatch(<Dispatch as BatchNormalisation>::scaled(
        x.into_dispatch(),
        scale.into_dispatch(),
        shift.into_dispatch(),
        relu,
    ))
}

/// Scale and shift of each channel by the running statistics.
pub(crate) fn running_factors(norm: &BatchNorm, device: &Device) -> (Tensor<1>, Tensor<1>) {
    let (mean, variance) = (norm.running_mean.value(), norm.running_var.value());
    let scale = norm.gamma.val() / (variance.to_device(device) + norm.epsilon).sqrt();
    let shift = norm.beta.val() - mean.to_device(device) * scale.clone();
    (scale, shift)
}

/// Backends that run [`batch_norm`].
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait BatchNormalisation: Backend {
    /// `scale x + shift` of each channel, then, where asked, a ReLU.
    fn scaled(
        x: FloatTensor<Self>,
        scale: FloatTensor<Self>,
        shift: FloatTensor<Self>,
        relu: bool,
    ) -> FloatTensor<Self> {
        let channels = scale.shape()[0];
        let mut each = vec![1; x.shape().num_dims()];
        each[1] = channels;
        let each = |values| Self::float_reshape(values, Shape::from(each.clone()));
        let y = Self::float_add(Self::float_mul(x, each(scale)), each(shift));
        if relu { Self::relu(y) } else { y }
    }

    /// `gamma (x - mean) / sqrt(variance + epsilon) + beta`, then, where asked, a ReLU; with mean and biased variance of each
    /// channel, which follow.
    fn normalised(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        epsilon: f64,
        relu: bool,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>) {
        let found = Self::batch_norm_train(x, gamma, beta, epsilon);
        let y = if relu {
            Self::relu(found.output)
        } else {
            found.output
        };
        (y, found.mean, found.variance)
    }

    /// Gradients of `x`, `gamma` and `beta` from the output's.
    #[allow(clippy::too_many_arguments)]
    fn normalised_backward(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        mean: FloatTensor<Self>,
        variance: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        epsilon: f64,
        relu: bool,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>) {
        let grad = if relu {
            let y = Self::batch_norm(
                x.clone(),
                gamma.clone(),
                beta,
                mean.clone(),
                variance.clone(),
                epsilon,
            );
            Self::relu_backward(Self::relu(y), grad)
        } else {
            grad
        };
        let found = Self::batch_norm_train_backward(x, gamma, mean, variance, epsilon, grad);
        (found.x_grad, found.gamma_grad, found.beta_grad)
    }
}

impl BatchNormalisation for CubeBackend {}

/// Numbers that a sum keeps apart, so that it runs in wide registers.
const LANES: usize = 16;

wide! {
    fn scale_plane(x: &[f32], y: &mut [f32], scale: f32, shift: f32, relu: bool) {
        let least = if relu { 0.0 } else { f32::NEG_INFINITY };
        for (y, x) in y.iter_mut().zip(x) {
            let value = scale * x + shift;
            // Not `max`, which would hide NaN.
            *y = if value < least { least } else { value };
        }
    }
}

wide! {
    /// Sum, then the sum of squares around `middle`.
    fn moments(x: &[f32], middle: f32) -> [f32; 2] {
        let mut sums = [0.0_f32; LANES];
        let mut squares = [0.0_f32; LANES];
        let chunks = x.chunks_exact(LANES);
        for (lane, x) in chunks.remainder().iter().enumerate() {
            let off = x - middle;
            sums[lane] += off;
            squares[lane] += off * off;
        }
        for chunk in chunks {
            for lane in 0..LANES {
                let off = chunk[lane] - middle;
                sums[lane] += off;
                squares[lane] += off * off;
            }
        }
        [sums.iter().sum(), squares.iter().sum()]
    }
}

wide! {
    /// The gradient through the ReLU summed, and summed times `x - mean`.
    fn gradient_moments(x: &[f32], grad: &[f32], by: [f32; 3], relu: bool) -> [f32; 2] {
        let [scale, shift, mean] = by;
        let mut sums = [0.0_f32; LANES];
        let mut products = [0.0_f32; LANES];
        let (xs, grads) = (x.chunks_exact(LANES), grad.chunks_exact(LANES));
        let rest = xs.remainder().iter().zip(grads.remainder()).enumerate();
        for (lane, (x, grad)) in rest {
            let grad = if relu && scale * x + shift <= 0.0 { 0.0 } else { *grad };
            sums[lane] += grad;
            products[lane] += grad * (x - mean);
        }
        for (x, grad) in xs.zip(grads) {
            for lane in 0..LANES {
                let off = relu && scale * x[lane] + shift <= 0.0;
                let grad = if off { 0.0 } else { grad[lane] };
                sums[lane] += grad;
                products[lane] += grad * (x[lane] - mean);
            }
        }
        [sums.iter().sum(), products.iter().sum()]
    }
}

wide! {
    /// `out = by_grad grad' + by_x x + plus`, `grad'` the gradient through the ReLU.
    fn gradient_plane(
        x: &[f32],
        grad: &[f32],
        out: &mut [f32],
        forward: [f32; 2],
        factors: [f32; 3],
        relu: bool,
    ) {
        let ([scale, shift], [by_grad, by_x, plus]) = (forward, factors);
        for ((out, x), grad) in out.iter_mut().zip(x).zip(grad) {
            let grad = if relu && scale * x + shift <= 0.0 { 0.0 } else { *grad };
            *out = by_grad * grad + by_x * x + plus;
        }
    }
}

/// Two sums of each channel from those of its planes, which are `[V, C]`.
fn by_channel(of_planes: &[[f32; 2]], channels: usize) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; channels];
    for (plane, of_plane) in of_planes.iter().enumerate() {
        for (sum, of_plane) in sums[plane % channels].iter_mut().zip(of_plane) {
            *sum += f64::from(*of_plane);
        }
    }
    sums
}

/// `scale` and `shift` of each channel, so that `scale x + shift` is normalised.
fn scales(
    gamma: &[f32],
    beta: &[f32],
    mean: &[f32],
    variance: &[f32],
    epsilon: f64,
) -> Vec<[f32; 2]> {
    let each = gamma.iter().zip(beta).zip(mean).zip(variance);
    each.map(|(((gamma, beta), mean), variance)| {
        let scale = gamma / (variance + epsilon as f32).sqrt();
        [scale, beta - mean * scale]
    })
    .collect()
}

fn apply(x: &[f32], scales: &[[f32; 2]], pixels: usize, relu: bool) -> Vec<f32> {
    if pixels == 1 {
        return rows::apply(x, scales, relu);
    }
    let mut y = vec![0.0; x.len()];
    y.par_chunks_mut(pixels)
        .zip(x.par_chunks(pixels))
        .enumerate()
        .for_each(|(plane, (y, x))| {
            let [scale, shift] = scales[plane % scales.len()];
            scale_plane(x, y, scale, shift, relu);
        });
    y
}

/// Views, channels, and the pixels of a plane: one for rows `[N, C]`.
fn sizes(shape: &Shape) -> [usize; 3] {
    let (views, channels) = (shape[0], shape[1]);
    [
        views,
        channels,
        shape.num_elements() / (views * channels).max(1),
    ]
}

impl BatchNormalisation for Flex {
    fn scaled(x: FlexTensor, scale: FlexTensor, shift: FlexTensor, relu: bool) -> FlexTensor {
        let shape = x.shape();
        let [_, _, pixels] = sizes(&shape);
        let (scale, shift) = (flex::read(scale), flex::read(shift));
        let scales: Vec<[f32; 2]> = scale.iter().zip(&*shift).map(|(a, b)| [*a, *b]).collect();
        flex::tensor(apply(&flex::read(x), &scales, pixels, relu), shape)
    }

    fn normalised(
        x: FlexTensor,
        gamma: FlexTensor,
        beta: FlexTensor,
        epsilon: f64,
        relu: bool,
    ) -> (FlexTensor, FlexTensor, FlexTensor) {
        let shape = x.shape();
        let [views, channels, pixels] = sizes(&shape);
        let (x, gamma, beta) = (flex::read(x), flex::read(gamma), flex::read(beta));
        // Around a number of the channel's own, so that a variance far below the mean's square is not lost.
        let middle = |channel: usize| x[channel * pixels];
        let sums = if pixels == 1 {
            rows::moments(&x, &x[..channels])
        } else {
            let of_planes: Vec<[f32; 2]> = x
                .par_chunks(pixels)
                .enumerate()
                .map(|(plane, x)| moments(x, middle(plane % channels)))
                .collect();
            by_channel(&of_planes, channels)
        };
        let count = (views * pixels) as f64;
        let (mean, variance): (Vec<f32>, Vec<f32>) = sums
            .iter()
            .enumerate()
            .map(|(channel, [sum, squares])| {
                let off = sum / count;
                let mean = f64::from(middle(channel)) + off;
                (mean as f32, (squares / count - off * off).max(0.0) as f32)
            })
            .unzip();
        let scales = scales(&gamma, &beta, &mean, &variance, epsilon);
        let y = apply(&x, &scales, pixels, relu);
        (
            flex::tensor(y, shape),
            flex::tensor(mean, [channels].into()),
            flex::tensor(variance, [channels].into()),
        )
    }

    fn normalised_backward(
        x: FlexTensor,
        gamma: FlexTensor,
        beta: FlexTensor,
        mean: FlexTensor,
        variance: FlexTensor,
        grad: FlexTensor,
        epsilon: f64,
        relu: bool,
    ) -> (FlexTensor, FlexTensor, FlexTensor) {
        let shape = x.shape();
        let [views, channels, pixels] = sizes(&shape);
        let (x, grad) = (flex::read(x), flex::read(grad));
        let (mean, variance) = (flex::read(mean), flex::read(variance));
        let scales = scales(
            &flex::read(gamma),
            &flex::read(beta),
            &mean,
            &variance,
            epsilon,
        );
        let sums = if pixels == 1 {
            rows::gradient_moments(&x, &grad, &scales, &mean, relu)
        } else {
            let of_planes: Vec<[f32; 2]> = x
                .par_chunks(pixels)
                .zip(grad.par_chunks(pixels))
                .enumerate()
                .map(|(plane, (x, grad))| {
                    let channel = plane % channels;
                    let [scale, shift] = scales[channel];
                    gradient_moments(x, grad, [scale, shift, mean[channel]], relu)
                })
                .collect();
            by_channel(&of_planes, channels)
        };
        let count = (views * pixels) as f64;
        // dx = scale (g - mean of g - x^ mean of (g x^)), x^ = (x - mean) / deviation.
        let factors: Vec<[f32; 3]> = (0..channels)
            .map(|channel| {
                let [sum, products] = sums[channel];
                let scale = f64::from(scales[channel][0]);
                let by_x = -scale * products / (count * (f64::from(variance[channel]) + epsilon));
                let plus = -scale * sum / count - by_x * f64::from(mean[channel]);
                [scale as f32, by_x as f32, plus as f32]
            })
            .collect();
        let mut of_x = vec![0.0; x.len()];
        if pixels == 1 {
            rows::gradient(&x, &grad, &mut of_x, &scales, &factors, relu);
        } else {
            of_x.par_chunks_mut(pixels)
                .zip(x.par_chunks(pixels))
                .zip(grad.par_chunks(pixels))
                .enumerate()
                .for_each(|(plane, ((of_x, x), grad))| {
                    let channel = plane % channels;
                    gradient_plane(x, grad, of_x, scales[channel], factors[channel], relu);
                });
        }
        let of_gamma = sums.iter().zip(&*variance);
        let of_gamma = of_gamma.map(|([_, products], variance)| {
            (products / (f64::from(*variance) + epsilon).sqrt()) as f32
        });
        let of_beta = sums.iter().map(|[sum, _]| *sum as f32);
        (
            flex::tensor(of_x, shape),
            flex::tensor(of_gamma.collect(), [channels].into()),
            flex::tensor(of_beta.collect(), [channels].into()),
        )
    }
}
