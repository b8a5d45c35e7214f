//! The SiLU, `x / (1 + e^-x)`.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::{Tensor, activation};
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::functions::sigmoid;
use super::wide::wide;
use super::{flex, on_processor};

/// `x / (1 + e^-x)`. On the processor one pass each way that keeps `x` alone; elsewhere burn's.
pub fn silu<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    if on_processor(&x.device()) {
        return Tensor::from_dispatch(<Dispatch as Silu>::silu(x.into_dispatch()));
    }
    activation::silu(x)
}

/// The processor's form of [`silu`].
#[backend_extension(Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait Silu: Backend {
    /// See [`silu`].
    fn silu(x: FloatTensor<Self>) -> FloatTensor<Self>;
}

/// The way back, which a backend needs to be differentiated.
pub trait SiluGradient: Silu {
    /// Gradient of `x` from the output's.
    fn silu_backward(x: FloatTensor<Self>, grad: FloatTensor<Self>) -> FloatTensor<Self>;
}

/// Numbers a task.
const TASK: usize = 4096;

wide! {
    fn of_run(x: &[f32], y: &mut [f32]) {
        for (y, x) in y.iter_mut().zip(x) {
            *y = x * sigmoid(*x);
        }
    }
}

wide! {
    fn gradient_of_run(x: &[f32], grad: &[f32], out: &mut [f32]) {
        for ((out, x), grad) in out.iter_mut().zip(x).zip(grad) {
            let s = sigmoid(*x);
            *out = grad * s * (1.0 + x * (1.0 - s));
        }
    }
}

impl Silu for Flex {
    fn silu(x: FlexTensor) -> FlexTensor {
        let shape = x.shape();
        let x = flex::read(x);
        let mut y = vec![0.0; x.len()];
        y.par_chunks_mut(TASK)
            .zip(x.par_chunks(TASK))
            .for_each(|(y, x)| of_run(x, y));
        flex::tensor(y, shape)
    }
}

impl SiluGradient for Flex {
    fn silu_backward(x: FlexTensor, grad: FlexTensor) -> FlexTensor {
        let shape = x.shape();
        let (x, grad) = (flex::read(x), flex::read(grad));
        let mut out = vec![0.0; x.len()];
        out.par_chunks_mut(TASK)
            .zip(x.par_chunks(TASK))
            .zip(grad.par_chunks(TASK))
            .for_each(|((out, x), grad)| gradient_of_run(x, grad, out));
        flex::tensor(out, shape)
    }
}

#[cfg(not(target_family = "wasm"))]
mod backward {
    use burn::backend::Autodiff;
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind, unary};
    use burn::backend::tensor::FloatTensor;

    use super::{Silu, SiluGradient};

    #[derive(Debug)]
    struct Slope;

    impl<B: SiluGradient> Backward<B, 1> for Slope {
        type State = FloatTensor<B>;

        fn backward(
            self,
            ops: Ops<Self::State, 1>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let x = ops.state;
            unary::<B, _>(ops.parents, ops.node, grads, |grad| {
                B::silu_backward(x, grad)
            });
        }
    }

    impl<B: SiluGradient, C: CheckpointStrategy> Silu for Autodiff<B, C> {
        fn silu(x: FloatTensor<Self>) -> FloatTensor<Self> {
            let prepared = Slope.prepare::<C>([x.node()]);
            let x = x.into_primitive();
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => {
                    let y = B::silu(x.clone());
                    prepared.finish(x, y)
                }
                OpsKind::UnTracked(prepared) => prepared.finish(B::silu(x)),
            }
        }
    }
}
