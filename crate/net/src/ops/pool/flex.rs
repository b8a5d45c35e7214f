//! Pooling in loops for the processor.

use burn::backend::{Flex, tensor::FloatTensor};
use rayon::prelude::*;

use super::super::flex::{parts, split_rows, tensor};
use super::{PoolPasses, Pooling, Shared};

/// Rows that a thread takes at a time.
const ROWS: usize = 4096;

impl PoolPasses for Flex {
    fn pool_forward(
        tokens: FloatTensor<Self>,
        logits: FloatTensor<Self>,
        shared: &Shared<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let tokens = tokens.to_contiguous();
        let logits = logits.to_contiguous();
        let offsets = shared.offsets.clone().to_contiguous();
        let [tokens_table, logits] = [&tokens, &logits].map(|t| t.storage::<f32>());
        let offsets: &[i32] = offsets.storage();
        let channels = tokens.layout().shape()[1];
        let segments = offsets.len() - 1;
        let mut out = vec![0.0; segments * channels];
        let mut weights = vec![0.0; logits.len()];
        let parts = parts(offsets, ROWS);
        let mut outs = Vec::with_capacity(parts.len());
        let mut rest = out.as_mut_slice();
        for part in &parts {
            let (here, after) = rest.split_at_mut(part.len() * channels);
            outs.push(here);
            rest = after;
        }
        let split = split_rows(&mut weights, offsets, &parts, 1);
        (&parts, outs, split)
            .into_par_iter()
            .for_each(|(part, out, weights)| {
                let start = offsets[part.start] as usize;
                for (segment, out) in part.clone().zip(out.chunks_exact_mut(channels)) {
                    let [first, end] = [offsets[segment], offsets[segment + 1]].map(|o| o as usize);
                    let weights = &mut weights[first - start..end - start];
                    weigh(&logits[first..end], weights, shared.pooling);
                    let rows =
                        tokens_table[first * channels..end * channels].chunks_exact(channels);
                    for (weight, token) in weights.iter().zip(rows) {
                        for (out, t) in out.iter_mut().zip(token) {
                            *out += weight * t;
                        }
                    }
                }
            });
        let rows = weights.len();
        (
            tensor(out, [segments, channels].into()),
            tensor(weights, [rows].into()),
        )
    }

    fn pool_backward(
        tokens: FloatTensor<Self>,
        weights: FloatTensor<Self>,
        out: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        shared: &Shared<Self>,
    ) -> [FloatTensor<Self>; 2] {
        let all = [tokens, weights, out, grad].map(|t| t.to_contiguous());
        let [tokens, weights, out, grad] = all.each_ref().map(|t| t.storage::<f32>());
        let offsets = shared.offsets.clone().to_contiguous();
        let offsets: &[i32] = offsets.storage();
        let [rows, channels] = [weights.len(), all[0].layout().shape()[1]];
        let mut dtokens = vec![0.0; rows * channels];
        let mut dlogits = vec![0.0; rows];
        let parts = parts(offsets, ROWS);
        let tokens_split = split_rows(&mut dtokens, offsets, &parts, channels);
        let logits_split = split_rows(&mut dlogits, offsets, &parts, 1);
        (&parts, tokens_split, logits_split)
            .into_par_iter()
            .for_each(|(part, dtokens, dlogits)| {
                let start = offsets[part.start] as usize;
                for segment in part.clone() {
                    let [first, end] = [offsets[segment], offsets[segment + 1]].map(|o| o as usize);
                    let own = segment * channels..(segment + 1) * channels;
                    let grad = &grad[own.clone()];
                    let mean = dot(grad, &out[own]);
                    for row in first..end {
                        let weight = weights[row];
                        let to = (row - start) * channels..(row - start + 1) * channels;
                        for (to, g) in dtokens[to].iter_mut().zip(grad) {
                            *to = weight * g;
                        }
                        if shared.pooling == Pooling::Softmax {
                            let token = &tokens[row * channels..(row + 1) * channels];
                            dlogits[row - start] = weight * (dot(grad, token) - mean);
                        }
                    }
                }
            });
        [
            tensor(dtokens, [rows, channels].into()),
            tensor(dlogits, [rows].into()),
        ]
    }
}

fn weigh(logits: &[f32], weights: &mut [f32], pooling: Pooling) {
    match pooling {
        Pooling::Mean => weights.fill(1.0 / weights.len() as f32),
        Pooling::Softmax => {
            let most = logits.iter().fold(0.0_f32, |most, o| most.max(*o));
            let mut sum = (-most).exp();
            for (weight, logit) in weights.iter_mut().zip(logits) {
                *weight = (logit - most).exp();
                sum += *weight;
            }
            weights.iter_mut().for_each(|w| *w /= sum);
        }
    }
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
