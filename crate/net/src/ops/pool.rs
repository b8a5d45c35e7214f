//! Rows of a segment merged into one: the views of a voxel by their weights.
//!
//! `out_n = sum_i w_i t_i` over the rows `i` of segment `n`. A segment without rows gives zeros.

use burn::backend::{
    Backend, TensorMetadata, backend_extension,
    tensor::{FloatTensor, IntTensor},
};
use burn::tensor::Tensor;
use burn_cubecl::{CubeBackend, tensor::CubeTensor};

use super::cube;
use super::segments::{Segments, Walk, take};

#[cfg(not(target_family = "wasm"))]
use burn::backend::Autodiff;

mod flex;
mod fused;

/// How rows are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pooling {
    /// Alike: one over their number. VoRTX's first phase of training (method 1.6).
    Mean,
    /// `softmax({o_1, .., o_n, 0})` of their logits: the extra 0 is a null view without features, so that a voxel which
    /// all views believe to be hidden fades to nothing.
    Softmax,
}

/// `[N, C]` from `tokens [P, C]` and their `logits [P]`, which the mean does not look at.
pub fn pool(
    tokens: Tensor<2>,
    logits: Tensor<1>,
    segments: &Segments,
    pooling: Pooling,
) -> Tensor<2> {
    if segments.rows == 0 {
        return Tensor::zeros([segments.count, tokens.dims()[1]], &tokens.device());
    }
    let out = <burn::backend::Dispatch as PoolExtension>::segment_pool(
        tokens.into_dispatch(),
        logits.into_dispatch(),
        segments.offsets.clone().into_dispatch(),
        segments.of_row.clone().into_dispatch(),
        segments.longest,
        pooling,
    );
    Tensor::from_dispatch(out)
}

/// The operation by backend.
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait PoolExtension: Backend {
    /// See [`pool`].
    fn segment_pool(
        tokens: FloatTensor<Self>,
        logits: FloatTensor<Self>,
        offsets: IntTensor<Self>,
        of_row: IntTensor<Self>,
        longest: usize,
        pooling: Pooling,
    ) -> FloatTensor<Self>;
}

/// What both directions of pooling know besides their inputs.
#[derive(Clone, Debug)]
pub struct Shared<B: Backend> {
    /// First row of each segment and the end of the last.
    pub offsets: IntTensor<B>,
    /// Segment of each row.
    pub of_row: IntTensor<B>,
    /// Rows of the longest segment.
    pub longest: usize,
    /// How rows are weighed.
    pub pooling: Pooling,
}

/// Both directions of the operation, in tensor operations unless a backend has better.
pub trait PoolPasses: Backend {
    /// The result `[N, C]` and the weight of each row `[P]`.
    fn pool_forward(
        tokens: FloatTensor<Self>,
        logits: FloatTensor<Self>,
        shared: &Shared<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        plain_forward::<Self>(tokens, logits, shared)
    }

    /// Gradients of tokens and logits.
    fn pool_backward(
        tokens: FloatTensor<Self>,
        weights: FloatTensor<Self>,
        out: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        shared: &Shared<Self>,
    ) -> [FloatTensor<Self>; 2] {
        plain_backward::<Self>(tokens, weights, out, grad, shared)
    }
}

impl PoolPasses for CubeBackend {
    fn pool_forward(
        tokens: CubeTensor,
        logits: CubeTensor,
        shared: &Shared<Self>,
    ) -> (CubeTensor, CubeTensor) {
        if cube::plain() {
            return plain_forward::<Self>(tokens, logits, shared);
        }
        fused::forward(tokens, logits, shared)
    }
}

impl<B: PoolPasses> PoolExtension for B {
    fn segment_pool(
        tokens: FloatTensor<Self>,
        logits: FloatTensor<Self>,
        offsets: IntTensor<Self>,
        of_row: IntTensor<Self>,
        longest: usize,
        pooling: Pooling,
    ) -> FloatTensor<Self> {
        let shared = Shared {
            offsets,
            of_row,
            longest,
            pooling,
        };
        Self::pool_forward(tokens, logits, &shared).0
    }
}

#[cfg(not(target_family = "wasm"))]
mod trained {
    use burn::backend::autodiff::{
        checkpoint::{base::Checkpointer, strategy::CheckpointStrategy},
        grads::Gradients,
        ops::{Backward, Ops, OpsKind},
    };

    use super::super::hand_on;
    use super::*;

    #[derive(Debug)]
    struct PoolBackward;

    impl<B: PoolPasses> Backward<B, 2> for PoolBackward {
        type State = ([FloatTensor<B>; 3], Shared<B>);

        fn backward(
            self,
            ops: Ops<Self::State, 2>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let ([tokens, weights, out], shared) = ops.state;
            let found = B::pool_backward(tokens, weights, out, grad, &shared);
            let inputs = ops.parents.map(|parent| parent.map(|parent| parent.id));
            hand_on::<B, _>(grads, inputs, found);
        }
    }

    impl<B: PoolPasses, C: CheckpointStrategy> PoolExtension for Autodiff<B, C> {
        fn segment_pool(
            tokens: FloatTensor<Self>,
            logits: FloatTensor<Self>,
            offsets: IntTensor<Self>,
            of_row: IntTensor<Self>,
            longest: usize,
            pooling: Pooling,
        ) -> FloatTensor<Self> {
            let shared = Shared::<B> {
                offsets,
                of_row,
                longest,
                pooling,
            };
            let nodes = [tokens.node(), logits.node()];
            let tokens = tokens.into_primitive();
            let (out, weights) = B::pool_forward(tokens.clone(), logits.into_primitive(), &shared);
            match PoolBackward.prepare::<C>(nodes).compute_bound().stateful() {
                OpsKind::Tracked(prep) => {
                    prep.finish(([tokens, weights, out.clone()], shared), out)
                }
                OpsKind::UnTracked(prep) => prep.finish(out),
            }
        }
    }
}

/// `[N, 1]`: the sum over each segment of `step(row, there)`, which shows one row of each.
fn sum_over<B: Backend>(
    walk: &Walk<B>,
    longest: usize,
    step: impl Fn(IntTensor<B>) -> FloatTensor<B>,
) -> Option<FloatTensor<B>> {
    (0..longest)
        .map(|s| {
            let (row, there) = walk.step(s);
            B::float_mul(step(row), there)
        })
        .reduce(B::float_add)
}

/// The operation in tensor operations: one step a row of the longest segment.
pub fn plain_forward<B: Backend>(
    tokens: FloatTensor<B>,
    logits: FloatTensor<B>,
    shared: &Shared<B>,
) -> (FloatTensor<B>, FloatTensor<B>) {
    let rows = tokens.shape()[0];
    let column = B::float_reshape(logits, [rows, 1].into());
    let walk = Walk::<B>::by_segment(shared.offsets.clone(), rows);
    let weights = match shared.pooling {
        Pooling::Mean => {
            let ones = B::float_add_scalar(B::float_mul_scalar(column, 0.0.into()), 1.0.into());
            let count = sum_over(&walk, shared.longest, |row| take::<B>(&ones, &row));
            let count = count.unwrap_or_else(|| ones.clone());
            B::float_div(ones, take::<B>(&count, &shared.of_row))
        }
        Pooling::Softmax => {
            // The largest of a segment's logits and 0; a stand-in row changes nothing, since it is 0.
            let mut most: Option<FloatTensor<B>> = None;
            for s in 0..shared.longest {
                let (row, there) = walk.step(s);
                let logit = B::float_mul(take::<B>(&column, &row), there);
                most = Some(match most {
                    None => B::float_clamp_min(logit, 0.0.into()),
                    Some(most) => {
                        let rise =
                            B::float_clamp_min(B::float_sub(logit, most.clone()), 0.0.into());
                        B::float_add(most, rise)
                    }
                });
            }
            let most = most.unwrap_or_else(|| column.clone());
            let raised = B::float_sub(column, take::<B>(&most, &shared.of_row));
            let raised = B::float_exp(raised);
            let sum = sum_over(&walk, shared.longest, |row| take::<B>(&raised, &row));
            let null = B::float_exp(B::float_neg(most));
            let sum = sum.map_or_else(|| null.clone(), |sum| B::float_add(sum, null.clone()));
            B::float_div(raised, take::<B>(&sum, &shared.of_row))
        }
    };
    let parts = B::float_mul(tokens, weights.clone());
    let out = sum_over(&walk, shared.longest, |row| take::<B>(&parts, &row));
    (
        out.unwrap_or_else(|| parts.clone()),
        B::float_reshape(weights, [rows].into()),
    )
}

/// `dt_i = w_i g_n` and, for the softmax, `do_i = w_i (g_n . t_i - g_n . out_n)`: the null view has nothing to add.
pub fn plain_backward<B: Backend>(
    tokens: FloatTensor<B>,
    weights: FloatTensor<B>,
    out: FloatTensor<B>,
    grad: FloatTensor<B>,
    shared: &Shared<B>,
) -> [FloatTensor<B>; 2] {
    let rows = tokens.shape()[0];
    let weights = B::float_reshape(weights, [rows, 1].into());
    let mean = B::float_sum_dim(B::float_mul(grad.clone(), out), 1);
    let grad = take::<B>(&grad, &shared.of_row);
    let gain = B::float_sum_dim(B::float_mul(grad.clone(), tokens), 1);
    let dlogits = match shared.pooling {
        Pooling::Mean => B::float_mul_scalar(gain, 0.0.into()),
        Pooling::Softmax => {
            let beyond = B::float_sub(gain, take::<B>(&mean, &shared.of_row));
            B::float_mul(beyond, weights.clone())
        }
    };
    let dtokens = B::float_mul(grad, weights);
    [dtokens, B::float_reshape(dlogits, [rows].into())]
}
