//! Sampled planes to tokens, all in one operation for the processor: lift, embedding and the encoder's layers.
//!
//! What `fusion` says in tensor operations costs some forty tables of `[P, C]`, and memory is what a processor has least of.
//! Here some hundred pairs at a time go all the way and stay in the nearest caches; the backward pass takes them
//! through again, so that nothing but what was given is kept. Matrix products are those of the gemm crate.

use burn::backend::{
    Backend, Dispatch, Flex, backend_extension,
    tensor::{FloatTensor, IntTensor},
};
use burn::tensor::{DType, Tensor};

use super::rows::Places;
use super::segments::Segments;

#[cfg(not(target_family = "wasm"))]
use burn::backend::Autodiff;

// The engine for the browser does not train: there, half of this has no caller.
#[cfg_attr(target_family = "wasm", allow(dead_code))]
mod block;
#[cfg_attr(target_family = "wasm", allow(dead_code))]
mod flex;
pub(crate) mod fused;
#[cfg_attr(target_family = "wasm", allow(dead_code))]
mod layer;
#[cfg_attr(target_family = "wasm", allow(dead_code))]
mod linear;
#[cfg_attr(target_family = "wasm", allow(dead_code))]
mod norm;

/// Widths of the operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewsShape {
    /// Channels of planes and tokens, `C`.
    pub channels: usize,
    /// Further numbers of each pair that are embedded with the sampled ones, `E`.
    pub extra: usize,
    /// Whether hidden planes are sampled and lifted (method 3.4).
    pub lift: bool,
    /// Layers of the encoder.
    pub layers: usize,
    /// Heads of its attention.
    pub heads: usize,
}

/// Whether the operation runs where `tensor` lies.
pub fn runs_on<const D: usize>(tensor: &Tensor<D>) -> bool {
    // Asking a tensor of its own leaves the one given, and its place among gradients, alone.
    let probe = Tensor::<1>::zeros([1], (&tensor.device().inner(), tensor.dtype()));
    tensor.dtype() == DType::F32 && probe.try_into_primitive::<Flex>().is_ok()
}

/// Tokens `[P, C]` of pairs: `x = sample(base) + L silu(sample(hidden))`, `x = W [x, extra]`, then the encoder's layers, each
/// `x + O attention(LN x)` and `x + W2 relu(W1 LN x)`, with biases everywhere (method 1.6, 3.4).
///
/// `base` and `hidden` are `[V, C, h, w]`, `extra` is `[P, E]`. `weights` holds, row by row and one after the other, the lift's
/// weight and bias where there is one, the embedding's, and for each layer scale and shift of its first norm, weights and
/// biases of query, key and value together and of the output, scale and shift of its second norm, and weights and
/// biases of the two layers of its perceptron.
pub fn view_tokens(
    base: Tensor<4>,
    hidden: Option<Tensor<4>>,
    extra: Tensor<2>,
    weights: Tensor<1>,
    at: (&Places, &Segments),
    shape: ViewsShape,
) -> Tensor<2> {
    let (places, segments) = at;
    let table = |planes: Tensor<4>| {
        let [views, channels, height, width] = planes.dims();
        let rows = planes.permute([0, 2, 3, 1]);
        rows.reshape([views * height * width, channels])
    };
    let device = base.device();
    let hidden = hidden.map_or_else(|| Tensor::zeros([1, 1], &device), table);
    let out = <Dispatch as ViewsExtension>::view_tokens(
        table(base).into_dispatch(),
        hidden.into_dispatch(),
        extra.into_dispatch(),
        weights.into_dispatch(),
        places.corner.clone().into_dispatch(),
        places.right.clone().into_dispatch(),
        places.down.clone().into_dispatch(),
        segments.offsets.clone().into_dispatch(),
        places.plane,
        shape,
    );
    Tensor::from_dispatch(out)
}

/// The operation, on the one backend that has it.
#[backend_extension(Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait ViewsExtension: Backend {
    /// See [`view_tokens`]; planes are tables of pixels, `[V * h * w, C]`.
    #[allow(clippy::too_many_arguments)]
    fn view_tokens(
        base: FloatTensor<Self>,
        hidden: FloatTensor<Self>,
        extra: FloatTensor<Self>,
        weights: FloatTensor<Self>,
        corner: IntTensor<Self>,
        right: FloatTensor<Self>,
        down: FloatTensor<Self>,
        offsets: IntTensor<Self>,
        plane: [usize; 2],
        shape: ViewsShape,
    ) -> FloatTensor<Self>;
}

#[cfg(not(target_family = "wasm"))]
mod trained {
    use burn::backend::autodiff::{
        checkpoint::{base::Checkpointer, strategy::CheckpointStrategy},
        grads::Gradients,
        ops::{Backward, Ops, OpsKind},
    };

    use super::flex::Given;
    use super::*;
    use crate::ops::rows::At;

    #[derive(Debug)]
    struct ViewsBackward;

    impl Backward<Flex, 4> for ViewsBackward {
        type State = Given;

        fn backward(
            self,
            ops: Ops<Self::State, 4>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<Flex>(&ops.node);
            let found = ops.state.backward(grad);
            for (parent, grad) in ops.parents.into_iter().zip(found) {
                if let (Some(node), Some(grad)) = (parent, grad) {
                    grads.register::<Flex>(node.id, grad);
                }
            }
        }
    }

    impl<C: CheckpointStrategy> ViewsExtension for Autodiff<Flex, C> {
        fn view_tokens(
            base: FloatTensor<Self>,
            hidden: FloatTensor<Self>,
            extra: FloatTensor<Self>,
            weights: FloatTensor<Self>,
            corner: IntTensor<Self>,
            right: FloatTensor<Self>,
            down: FloatTensor<Self>,
            offsets: IntTensor<Self>,
            plane: [usize; 2],
            shape: ViewsShape,
        ) -> FloatTensor<Self> {
            let nodes = [base.node(), hidden.node(), extra.node(), weights.node()];
            let at = At {
                corner,
                right: right.into_primitive(),
                down: down.into_primitive(),
                plane,
            };
            let inputs = [base, hidden, extra, weights].map(|t| t.into_primitive());
            let given = Given::new(inputs, at, offsets, shape);
            let out = given.forward();
            match ViewsBackward.prepare::<C>(nodes).compute_bound().stateful() {
                OpsKind::Tracked(prep) => prep.finish(given, out),
                OpsKind::UnTracked(prep) => prep.finish(out),
            }
        }
    }
}
