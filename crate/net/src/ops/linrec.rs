//! The linear recurrence `s_t = a_t s_{t-1} + x_t` (method 3.7).

mod fused;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, TensorMetadata, backend_extension};
use burn::tensor::{Slice, Tensor};
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::{cube, flex};

/// `s_t = a_t s_{t-1} + x_t` along the last axis from `s_{-1}` = 0; with `reverse`, `s_t = a_t s_{t+1} + x_t` from the end.
/// `a` and `x` have the same shape.
pub fn linrec<const D: usize>(a: Tensor<D>, x: Tensor<D>, reverse: bool) -> Tensor<D> {
    assert_eq!(a.dims(), x.dims(), "factors and inputs of a recurrence");
    let s = <Dispatch as LinearRecurrence>::linear_recurrence(
        a.into_dispatch(),
        x.into_dispatch(),
        reverse,
    );
    Tensor::from_dispatch(s)
}

/// Backends that run [`linrec`].
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait LinearRecurrence: Backend {
    /// See [`linrec`].
    fn linear_recurrence(
        a: FloatTensor<Self>,
        x: FloatTensor<Self>,
        reverse: bool,
    ) -> FloatTensor<Self> {
        plain::<Self>(a, x, reverse)
    }
}

/// The recurrence in tensor operations: each step doubles the reach of the sums (Hillis and Steele), so that there are log2 T.
pub fn plain<B: Backend>(a: FloatTensor<B>, x: FloatTensor<B>, reverse: bool) -> FloatTensor<B> {
    let length = last(&x);
    let (mut a, mut s) = (a, x);
    let mut reach = 1;
    while reach < length {
        // The sums within reach end at t; those of the rest end at t - reach.
        let (ends, starts) = if reverse {
            (0..length - reach, reach..length)
        } else {
            (reach..length, 0..length - reach)
        };
        let kept = if reverse {
            length - reach..length
        } else {
            0..reach
        };
        let join = |kept: FloatTensor<B>, changed: FloatTensor<B>| {
            let axis = kept.shape().num_dims() - 1;
            let parts = if reverse {
                vec![changed, kept]
            } else {
                vec![kept, changed]
            };
            B::float_cat(parts, axis)
        };
        let a_ends = part::<B>(&a, ends.clone());
        let added = B::float_mul(a_ends.clone(), part::<B>(&s, starts.clone()));
        let changed = B::float_add(part::<B>(&s, ends), added);
        s = join(part::<B>(&s, kept.clone()), changed);
        let product = B::float_mul(a_ends, part::<B>(&a, starts));
        a = join(part::<B>(&a, kept), product);
        reach *= 2;
    }
    s
}

impl LinearRecurrence for CubeBackend {
    fn linear_recurrence(a: CubeTensor, x: CubeTensor, reverse: bool) -> CubeTensor {
        if cube::plain() {
            return plain::<Self>(a, x, reverse);
        }
        fused::linear_recurrence(a, x, reverse)
    }
}

impl LinearRecurrence for Flex {
    fn linear_recurrence(a: FlexTensor, x: FlexTensor, reverse: bool) -> FlexTensor {
        let length = last(&x);
        let shape = x.shape();
        let (a, x) = (flex::read(a), flex::read(x));
        let mut s = vec![0.0_f32; x.len()];
        if let Some(lanes) = 4096_usize.checked_div(length) {
            // Some thousand numbers a task.
            let task = lanes.max(1) * length;
            s.par_chunks_mut(task)
                .zip(a.par_chunks(task))
                .zip(x.par_chunks(task))
                .for_each(|((s, a), x)| {
                    let lanes = s.chunks_exact_mut(length);
                    let inputs = a.chunks_exact(length).zip(x.chunks_exact(length));
                    for (s, (a, x)) in lanes.zip(inputs) {
                        lane(s, a, x, reverse);
                    }
                });
        }
        flex::tensor(s, shape)
    }
}

/// One recurrence.
fn lane(s: &mut [f32], a: &[f32], x: &[f32], reverse: bool) {
    let mut state = 0.0_f32;
    let mut step = |((s, a), x): ((&mut f32, &f32), &f32)| {
        state = a * state + x;
        *s = state;
    };
    let all = s.iter_mut().zip(a).zip(x);
    if reverse {
        all.rev().for_each(&mut step);
    } else {
        all.for_each(&mut step);
    }
}

/// Length of the last axis.
fn last(tensor: &impl TensorMetadata) -> usize {
    let shape = tensor.shape();
    shape[shape.num_dims() - 1]
}

/// Elements `range` of the last axis.
fn part<B: Backend>(tensor: &FloatTensor<B>, range: std::ops::Range<usize>) -> FloatTensor<B> {
    let shape = tensor.shape();
    let mut slices: Vec<Slice> = shape.iter().map(|&size| Slice::from(0..size)).collect();
    if let Some(slice) = slices.last_mut() {
        *slice = Slice::from(range);
    }
    B::float_slice(tensor.clone(), &slices)
}

#[cfg(not(target_family = "wasm"))]
mod backward {
    use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
    use burn::backend::autodiff::grads::Gradients;
    use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
    use burn::backend::tensor::FloatTensor;
    use burn::backend::{Autodiff, Backend, TensorMetadata};

    use super::{LinearRecurrence, last, part};

    /// `lam_t = g_t + a_{t+1} lam_{t+1}`, the same recurrence the other way; `dx = lam`, `da_t = lam_t s_{t-1}`.
    #[derive(Debug)]
    struct Reversed;

    impl<B: LinearRecurrence> Backward<B, 2> for Reversed {
        type State = (FloatTensor<B>, FloatTensor<B>, bool);

        fn backward(
            self,
            ops: Ops<Self::State, 2>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let [of_a, of_x] = ops.parents;
            let grad = grads.consume::<B>(&ops.node);
            let (a, s, reverse) = ops.state;
            // Factor of the state that comes next in time, state that came before.
            let next = delayed::<B>(&a, !reverse);
            let lam = B::linear_recurrence(next, grad, !reverse);
            if let Some(node) = of_a {
                let before = delayed::<B>(&s, reverse);
                grads.register::<B>(node.id, B::float_mul(lam.clone(), before));
            }
            if let Some(node) = of_x {
                grads.register::<B>(node.id, lam);
            }
        }
    }

    /// Element `t - 1` at `t`, 0 at the first; with `reverse`, element `t + 1`, 0 at the last.
    fn delayed<B: Backend>(tensor: &FloatTensor<B>, reverse: bool) -> FloatTensor<B> {
        let length = last(tensor);
        if length == 0 {
            return tensor.clone();
        }
        let axis = tensor.shape().num_dims() - 1;
        let mut edge = tensor.shape();
        edge[axis] = 1;
        let zero = B::float_zeros(edge, &tensor.device(), tensor.dtype().into());
        let parts = if reverse {
            vec![part::<B>(tensor, 1..length), zero]
        } else {
            vec![zero, part::<B>(tensor, 0..length - 1)]
        };
        B::float_cat(parts, axis)
    }

    impl<B: LinearRecurrence, C: CheckpointStrategy> LinearRecurrence for Autodiff<B, C> {
        fn linear_recurrence(
            a: FloatTensor<Self>,
            x: FloatTensor<Self>,
            reverse: bool,
        ) -> FloatTensor<Self> {
            let prepared = Reversed.prepare::<C>([a.node(), x.node()]);
            let (a, x) = (a.into_primitive(), x.into_primitive());
            match prepared.compute_bound().stateful() {
                OpsKind::Tracked(prepared) => {
                    let s = B::linear_recurrence(a.clone(), x, reverse);
                    prepared.finish((a, s.clone(), reverse), s)
                }
                OpsKind::UnTracked(prepared) => {
                    prepared.finish(B::linear_recurrence(a, x, reverse))
                }
            }
        }
    }
}
