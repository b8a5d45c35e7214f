//! Attention among the rows of a segment: what a voxel's views have to say to each other.
//!
//! `out_i = sum_j p_ij v_j`, `p_ij = softmax_j(q_i . k_j / sqrt(d / heads))` over the rows `j` of row `i`'s segment and
//! for each head's part of the channels apart (method 1.6). Views that do not see a voxel have no row, which is what
//! VoRTX's mask amounts to. The softmax is taken online (Milakov and Gimelshein 2018), and the backward pass makes the
//! probabilities again from the logarithm of their sum (FlashAttention, Dao et al. 2022): memory is that of the inputs.

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

pub(crate) mod flex;
mod forward;
mod fused;

/// Attention among the rows of each segment. `query`, `key`, `value` are `[P, d]`; `heads` divides `d`.
pub fn attention(
    query: Tensor<2>,
    key: Tensor<2>,
    value: Tensor<2>,
    segments: &Segments,
    heads: usize,
) -> Tensor<2> {
    let out = <burn::backend::Dispatch as AttentionExtension>::segment_attention(
        query.into_dispatch(),
        key.into_dispatch(),
        value.into_dispatch(),
        segments.offsets.clone().into_dispatch(),
        segments.of_row.clone().into_dispatch(),
        segments.longest,
        heads,
    );
    Tensor::from_dispatch(out)
}

/// The operation by backend.
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait AttentionExtension: Backend {
    /// See [`attention`].
    fn segment_attention(
        query: FloatTensor<Self>,
        key: FloatTensor<Self>,
        value: FloatTensor<Self>,
        offsets: IntTensor<Self>,
        of_row: IntTensor<Self>,
        longest: usize,
        heads: usize,
    ) -> FloatTensor<Self>;
}

/// Rows, segments and heads of an attention.
#[derive(Clone, Debug)]
pub struct Shared<B: Backend> {
    /// First row of each segment and the end of the last.
    pub offsets: IntTensor<B>,
    /// Segment of each row.
    pub of_row: IntTensor<B>,
    /// Rows of the longest segment.
    pub longest: usize,
    /// Parts of the channels that attend on their own.
    pub heads: usize,
}

/// Both directions of the operation, in tensor operations unless a backend has better.
pub trait AttentionPasses: Backend {
    /// The result `[P, d]` and the logarithm of the sum of exponentials `[P, heads]`.
    fn attention_forward(
        [query, key, value]: [FloatTensor<Self>; 3],
        shared: &Shared<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        plain_forward::<Self>(query, key, value, shared)
    }

    /// Gradients of query, key and value.
    fn attention_backward(
        inputs: [FloatTensor<Self>; 3],
        out: FloatTensor<Self>,
        log_sum: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        shared: &Shared<Self>,
    ) -> [FloatTensor<Self>; 3] {
        plain_backward::<Self>(inputs, out, log_sum, grad, shared)
    }
}

impl AttentionPasses for CubeBackend {
    fn attention_forward(
        inputs: [CubeTensor; 3],
        shared: &Shared<Self>,
    ) -> (CubeTensor, CubeTensor) {
        if cube::plain() {
            let [query, key, value] = inputs;
            return plain_forward::<Self>(query, key, value, shared);
        }
        fused::forward(inputs, shared)
    }
}

impl<B: AttentionPasses> AttentionExtension for B {
    fn segment_attention(
        query: FloatTensor<Self>,
        key: FloatTensor<Self>,
        value: FloatTensor<Self>,
        offsets: IntTensor<Self>,
        of_row: IntTensor<Self>,
        longest: usize,
        heads: usize,
    ) -> FloatTensor<Self> {
        let shared = Shared {
            offsets,
            of_row,
            longest,
            heads,
        };
        Self::attention_forward([query, key, value], &shared).0
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
    struct AttentionBackward;

    impl<B: AttentionPasses> Backward<B, 3> for AttentionBackward {
        type State = (
            [FloatTensor<B>; 3],
            FloatTensor<B>,
            FloatTensor<B>,
            Shared<B>,
        );

        fn backward(
            self,
            ops: Ops<Self::State, 3>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let (inputs, out, log_sum, shared) = ops.state;
            let found = B::attention_backward(inputs, out, log_sum, grad, &shared);
            let parents = ops.parents.map(|parent| parent.map(|parent| parent.id));
            hand_on::<B, _>(grads, parents, found);
        }
    }

    impl<B: AttentionPasses, C: CheckpointStrategy> AttentionExtension for Autodiff<B, C> {
        fn segment_attention(
            query: FloatTensor<Self>,
            key: FloatTensor<Self>,
            value: FloatTensor<Self>,
            offsets: IntTensor<Self>,
            of_row: IntTensor<Self>,
            longest: usize,
            heads: usize,
        ) -> FloatTensor<Self> {
            let shared = Shared::<B> {
                offsets,
                of_row,
                longest,
                heads,
            };
            let nodes = [query.node(), key.node(), value.node()];
            let inputs = [query, key, value].map(|t| t.into_primitive());
            let (out, log_sum) = B::attention_forward(inputs.clone(), &shared);
            match AttentionBackward
                .prepare::<C>(nodes)
                .compute_bound()
                .stateful()
            {
                OpsKind::Tracked(prep) => prep.finish((inputs, out.clone(), log_sum, shared), out),
                OpsKind::UnTracked(prep) => prep.finish(out),
            }
        }
    }
}

/// Each row of `table [P, d]` as `heads` rows of a head's channels, `[P * heads, d / heads]`.
fn split<B: Backend>(table: FloatTensor<B>, heads: usize) -> FloatTensor<B> {
    let [rows, channels] = table.shape().dims();
    B::float_reshape(table, [rows * heads, channels / heads].into())
}

/// `column [P, 1]` for every head, `[P * heads, 1]`.
fn for_heads<B: Backend>(column: FloatTensor<B>, heads: usize) -> FloatTensor<B> {
    let rows = column.shape()[0];
    let wide = B::float_repeat_dim(column, 1, heads);
    B::float_reshape(wide, [rows * heads, 1].into())
}

/// `sum_c a[.., c] b[.., c]`, `[.., 1]`.
fn dot<B: Backend>(a: FloatTensor<B>, b: FloatTensor<B>) -> FloatTensor<B> {
    B::float_sum_dim(B::float_mul(a, b), 1)
}

fn scale<B: Backend>(query: &FloatTensor<B>, heads: usize) -> f32 {
    let channels = query.shape()[1] / heads;
    1.0 / (channels as f32).sqrt()
}

/// The operation in tensor operations: one step a row of the longest segment, each of the inputs' size. Under automatic
/// differentiation all steps are kept: that is for tests.
pub fn plain_forward<B: Backend>(
    query: FloatTensor<B>,
    key: FloatTensor<B>,
    value: FloatTensor<B>,
    shared: &Shared<B>,
) -> (FloatTensor<B>, FloatTensor<B>) {
    let heads = shared.heads;
    let [rows, channels] = query.shape().dims();
    let walk = Walk::<B>::by_row(shared.offsets.clone(), shared.of_row.clone());
    let scale = scale::<B>(&query, heads);
    let query = B::float_mul_scalar(split::<B>(query, heads), scale.into());
    let at = |s: usize| {
        let (partner, there) = walk.step(s);
        let key = split::<B>(take::<B>(&key, &partner), heads);
        let value = split::<B>(take::<B>(&value, &partner), heads);
        (
            dot::<B>(query.clone(), key),
            value,
            for_heads::<B>(there, heads),
        )
    };
    // Every row has itself in its segment, so the first step shows something to all.
    let (mut most, mut out, mut sum) = at(0);
    for s in 1..shared.longest {
        let (score, value, there) = at(s);
        // Where a segment has no row `s` the score is one that was seen before: the maximum stays right.
        let rise = B::float_clamp_min(B::float_sub(score.clone(), most.clone()), 0.0.into());
        let fresh = B::float_add(most.clone(), rise);
        let keep = B::float_exp(B::float_sub(most, fresh.clone()));
        let weight = B::float_mul(B::float_exp(B::float_sub(score, fresh.clone())), there);
        sum = B::float_add(B::float_mul(sum, keep.clone()), weight.clone());
        out = B::float_add(B::float_mul(out, keep), B::float_mul(value, weight));
        most = fresh;
    }
    out = B::float_div(out, sum.clone());
    let log_sum = B::float_add(most, B::float_log(sum));
    (
        B::float_reshape(out, [rows, channels].into()),
        B::float_reshape(log_sum, [rows, heads].into()),
    )
}

/// With `g` the gradient of the result, `D_i = g_i . out_i` and `S_ij = p_ij (g_i . v_j - D_i)`:
/// `dq_i = scale sum_j S_ij k_j`, `dk_j = scale sum_i S_ij q_i`, `dv_j = sum_i p_ij g_i`. A row is asked both as `i`
/// and as `j` in each step, so that nothing is scattered.
pub fn plain_backward<B: Backend>(
    [query, key, value]: [FloatTensor<B>; 3],
    out: FloatTensor<B>,
    log_sum: FloatTensor<B>,
    grad: FloatTensor<B>,
    shared: &Shared<B>,
) -> [FloatTensor<B>; 3] {
    let heads = shared.heads;
    let [rows, channels] = query.shape().dims();
    let walk = Walk::<B>::by_row(shared.offsets.clone(), shared.of_row.clone());
    let scale = scale::<B>(&query, heads);
    let query = B::float_mul_scalar(query, scale.into());
    let delta = dot::<B>(split::<B>(grad.clone(), heads), split::<B>(out, heads));
    let delta = B::float_reshape(delta, [rows, heads].into());
    // As rows of single heads: query, key, value, gradient, logarithm of the sum, delta.
    let split = |t: FloatTensor<B>| split::<B>(t, heads);
    let tables = [query, key, value, grad, log_sum, delta];
    let own = tables.clone().map(split);
    let influence = |i: &[FloatTensor<B>; 6], j: &[FloatTensor<B>; 6], there: FloatTensor<B>| {
        let score = dot::<B>(i[0].clone(), j[1].clone());
        let weight = B::float_mul(B::float_exp(B::float_sub(score, i[4].clone())), there);
        let gain = B::float_sub(dot::<B>(i[3].clone(), j[2].clone()), i[5].clone());
        (B::float_mul(weight.clone(), gain), weight)
    };
    let mut sums: Option<[FloatTensor<B>; 3]> = None;
    for s in 0..shared.longest {
        let (partner, there) = walk.step(s);
        let there = for_heads::<B>(there, heads);
        let other = tables.clone().map(|t| split(take::<B>(&t, &partner)));
        let (gain, _) = influence(&own, &other, there.clone());
        let dq = B::float_mul(other[1].clone(), gain);
        let (gain, weight) = influence(&other, &own, there);
        let dk = B::float_mul(other[0].clone(), gain);
        let dv = B::float_mul(other[3].clone(), weight);
        sums = Some(match sums {
            None => [dq, dk, dv],
            Some([q, k, v]) => [
                B::float_add(q, dq),
                B::float_add(k, dk),
                B::float_add(v, dv),
            ],
        });
    }
    let [dq, dk, dv] = sums.unwrap_or_else(|| [own[0].clone(), own[1].clone(), own[2].clone()]);
    // The queries were scaled before, so keys have their scale; the gradient of the query itself has not.
    let dq = B::float_mul_scalar(dq, scale.into());
    [dq, dk, dv].map(|t| B::float_reshape(t, [rows, channels].into()))
}
