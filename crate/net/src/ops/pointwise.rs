//! A linear layer of each pixel's channels.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Shape, Tensor};
use burn_cubecl::CubeBackend;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::wide::wide;
use super::{flex, lanes};

/// `y = W x (+ b)` at each pixel: `x` `[V, C, h, w]`, `weight` `[C', C, 1, 1]`, `bias` `[C']`; `[V, C', h, w]`. A 1x1
/// convolution whose gradients are matrix products; those that burn composes take four times as long on the processor.
pub fn pointwise(x: Tensor<4>, weight: Tensor<4>, bias: Option<Tensor<1>>) -> Tensor<4> {
    let (x, weight) = (x.into_dispatch(), weight.into_dispatch());
    Tensor::from_dispatch(match bias {
        Some(bias) => <Dispatch as Pointwise>::pointwise_biased(x, weight, bias.into_dispatch()),
        None => <Dispatch as Pointwise>::pointwise(x, weight),
    })
}

/// Backends that run [`pointwise`].
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait Pointwise: Backend {
    /// Without bias.
    fn pointwise(x: FloatTensor<Self>, weight: FloatTensor<Self>) -> FloatTensor<Self> {
        Self::conv2d(x, weight, None, ConvOptions::new([1; 2], [0; 2], [1; 2], 1))
    }

    /// With bias.
    fn pointwise_biased(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
    ) -> FloatTensor<Self> {
        let options = ConvOptions::new([1; 2], [0; 2], [1; 2], 1);
        Self::conv2d(x, weight, Some(bias), options)
    }

    /// Sum over views and pixels: `[V, C, h, w]` to `[C]`.
    fn channel_sums(x: FloatTensor<Self>) -> FloatTensor<Self> {
        let [views, channels, height, width] = x.shape().dims();
        let x = Self::float_reshape(x, Shape::new([views, channels, height * width]));
        let x = Self::float_sum_dim(Self::float_sum_dim(x, 2), 0);
        Self::float_reshape(x, Shape::new([channels]))
    }
}

impl Pointwise for CubeBackend {}

impl Pointwise for Flex {
    fn pointwise_biased(x: FlexTensor, weight: FlexTensor, bias: FlexTensor) -> FlexTensor {
        let mut y = Self::pointwise(x, weight);
        let [_, channels, height, width] = y.shape().dims();
        let bias = flex::read(bias);
        y.storage_mut::<f32>()
            .par_chunks_mut(height * width)
            .enumerate()
            .for_each(|(plane, y)| add(y, bias[plane % channels]));
        y
    }

    fn channel_sums(x: FlexTensor) -> FlexTensor {
        let [views, channels, height, width] = x.shape().dims();
        let x = flex::read(x);
        let pixels = height * width;
        let of_planes: Vec<f32> = x.par_chunks(pixels).map(sum).collect();
        let of_channel = |c| (0..views).map(|v| of_planes[v * channels + c]).sum();
        flex::tensor((0..channels).map(of_channel).collect(), [channels].into())
    }
}

wide! {
    fn sum(values: &[f32]) -> f32 {
        lanes::sum(values)
    }
}

wide! {
    fn add(values: &mut [f32], by: f32) {
        for value in values {
            *value += by;
        }
    }
}

#[cfg(not(target_family = "wasm"))]
mod backward {
    use burn::backend::Autodiff;
    use burn::backend::TensorMetadata;
    use burn::backend::autodiff::NodeId;
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
    use burn::backend::tensor::FloatTensor;
    use burn::tensor::Shape;

    use super::Pointwise;

    /// `dx = W^T g`, `dW = sum over views of g x^T`, `db = sum of g`.
    #[derive(Debug)]
    struct Products;

    /// Registers the gradients of `x` and `weight`.
    fn register<B: Pointwise>(
        [of_x, of_weight]: [Option<NodeId>; 2],
        x: FloatTensor<B>,
        weight: FloatTensor<B>,
        grad: FloatTensor<B>,
        grads: &mut Gradients,
    ) {
        let [views, channels, height, width] = x.shape().dims();
        let [out, ..] = weight.shape().dims::<4>();
        let pixels = height * width;
        let grad = B::float_reshape(grad, Shape::new([views, out, pixels]));
        if let Some(node) = of_x {
            let weight = B::float_reshape(weight, Shape::new([1, out, channels]));
            let of_x = B::float_matmul(B::float_swap_dims(weight, 1, 2), grad.clone());
            let shape = Shape::new([views, channels, height, width]);
            grads.register::<B>(node, B::float_reshape(of_x, shape));
        }
        if let Some(node) = of_weight {
            let x = B::float_reshape(x, Shape::new([views, channels, pixels]));
            let products = B::float_matmul(grad, B::float_swap_dims(x, 1, 2));
            let sum = B::float_sum_dim(products, 0);
            let shape = Shape::new([out, channels, 1, 1]);
            grads.register::<B>(node, B::float_reshape(sum, shape));
        }
    }

    impl<B: Pointwise> Backward<B, 2> for Products {
        type State = (FloatTensor<B>, FloatTensor<B>);

        fn backward(
            self,
            ops: Ops<Self::State, 2>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let (x, weight) = ops.state;
            let parents = ops.parents.map(|node| node.map(|node| node.id));
            register::<B>(parents, x, weight, grad, grads);
        }
    }

    impl<B: Pointwise> Backward<B, 3> for Products {
        type State = (FloatTensor<B>, FloatTensor<B>);

        fn backward(
            self,
            ops: Ops<Self::State, 3>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let [of_x, of_weight, of_bias] = ops.parents.map(|node| node.map(|node| node.id));
            if let Some(node) = of_bias {
                grads.register::<B>(node, B::channel_sums(grad.clone()));
            }
            let (x, weight) = ops.state;
            register::<B>([of_x, of_weight], x, weight, grad, grads);
        }
    }

    impl<B: Pointwise, C: CheckpointStrategy> Pointwise for Autodiff<B, C> {
        fn pointwise(x: FloatTensor<Self>, weight: FloatTensor<Self>) -> FloatTensor<Self> {
            let prepared = Products.prepare::<C>([x.node(), weight.node()]);
            let (x, weight) = (x.into_primitive(), weight.into_primitive());
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => {
                    let y = B::pointwise(x.clone(), weight.clone());
                    prepared.finish((x, weight), y)
                }
                OpsKind::UnTracked(prepared) => prepared.finish(B::pointwise(x, weight)),
            }
        }

        fn pointwise_biased(
            x: FloatTensor<Self>,
            weight: FloatTensor<Self>,
            bias: FloatTensor<Self>,
        ) -> FloatTensor<Self> {
            let prepared = Products.prepare::<C>([x.node(), weight.node(), bias.node()]);
            let (x, weight) = (x.into_primitive(), weight.into_primitive());
            let bias = bias.into_primitive();
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => {
                    let y = B::pointwise_biased(x.clone(), weight.clone(), bias);
                    prepared.finish((x, weight), y)
                }
                OpsKind::UnTracked(prepared) => {
                    prepared.finish(B::pointwise_biased(x, weight, bias))
                }
            }
        }
    }
}
