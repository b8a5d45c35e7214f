//! Attention in loops for the processor: a segment's rows lie together and stay in the nearest cache.

use burn::backend::{Flex, tensor::FloatTensor};
use rayon::prelude::*;

use super::super::flex::{parts, split_rows, tensor};
use super::{AttentionPasses, Shared};

/// Rows that a thread takes at a time.
const ROWS: usize = 2048;

/// Where query, key and value of a row begin, and how far the next row is.
#[derive(Clone, Copy)]
pub(crate) struct Strided<'a> {
    /// The first row's query.
    pub query: &'a [f32],
    /// The first row's key.
    pub key: &'a [f32],
    /// The first row's value.
    pub value: &'a [f32],
    /// Numbers from one row to the next.
    pub stride: usize,
}

impl<'a> Strided<'a> {
    fn at(self, row: usize) -> Self {
        let from = row * self.stride;
        Self {
            query: &self.query[from..],
            key: &self.key[from..],
            value: &self.value[from..],
            stride: self.stride,
        }
    }
}

impl AttentionPasses for Flex {
    fn attention_forward(
        inputs: [FloatTensor<Self>; 3],
        shared: &Shared<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let [query, key, value] = inputs.map(|t| t.to_contiguous());
        let [rows, channels] = *query.layout().shape().as_slice() else {
            return (query, key);
        };
        let heads = shared.heads;
        let offsets = shared.offsets.clone().to_contiguous();
        let offsets: &[i32] = offsets.storage();
        let table = Strided {
            query: query.storage(),
            key: key.storage(),
            value: value.storage(),
            stride: channels,
        };
        let mut out = vec![0.0; rows * channels];
        let mut log_sum = vec![0.0; rows * heads];
        let parts = parts(offsets, ROWS);
        let outs = split_rows(&mut out, offsets, &parts, channels);
        let sums = split_rows(&mut log_sum, offsets, &parts, heads);
        (&parts, outs, sums).into_par_iter().for_each_init(
            Vec::new,
            |scores, (part, out, log_sum)| {
                let start = offsets[part.start] as usize;
                for segment in part.clone() {
                    let [first, end] = [offsets[segment], offsets[segment + 1]].map(|o| o as usize);
                    forward(
                        table.at(first),
                        end - first,
                        [channels, heads],
                        scores,
                        &mut out[(first - start) * channels..(end - start) * channels],
                        &mut log_sum[(first - start) * heads..(end - start) * heads],
                    );
                }
            },
        );
        (
            tensor(out, [rows, channels].into()),
            tensor(log_sum, [rows, heads].into()),
        )
    }

    fn attention_backward(
        inputs: [FloatTensor<Self>; 3],
        out: FloatTensor<Self>,
        log_sum: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        shared: &Shared<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let [query, key, value] = inputs.map(|t| t.to_contiguous());
        let [out, log_sum, grad] = [out, log_sum, grad].map(|t| t.to_contiguous());
        let [rows, channels] = *query.layout().shape().as_slice() else {
            return [query, key, value];
        };
        let heads = shared.heads;
        let offsets = shared.offsets.clone().to_contiguous();
        let offsets: &[i32] = offsets.storage();
        let table = Strided {
            query: query.storage(),
            key: key.storage(),
            value: value.storage(),
            stride: channels,
        };
        let [out, log_sum, grad] = [&out, &log_sum, &grad].map(|t| t.storage::<f32>());
        let mut grads = [(); 3].map(|()| vec![0.0; rows * channels]);
        let parts = parts(offsets, ROWS);
        let [dq, dk, dv] = grads
            .each_mut()
            .map(|g| split_rows(g, offsets, &parts, channels));
        (&parts, dq, dk, dv)
            .into_par_iter()
            .for_each(|(part, dq, dk, dv)| {
                let start = offsets[part.start] as usize;
                for segment in part.clone() {
                    let [first, end] = [offsets[segment], offsets[segment + 1]].map(|o| o as usize);
                    let wide = first * channels..end * channels;
                    let here = (first - start) * channels..(end - start) * channels;
                    backward(
                        table.at(first),
                        end - first,
                        [channels, heads],
                        [&out[wide.clone()], &grad[wide]],
                        &log_sum[first * heads..end * heads],
                        [&mut dq[here.clone()], &mut dk[here.clone()], &mut dv[here]],
                    );
                }
            });
        grads.map(|g| tensor(g, [rows, channels].into()))
    }
}

/// One segment of `rows` rows. `scores` is scratch.
pub(crate) fn forward(
    table: Strided,
    rows: usize,
    [channels, heads]: [usize; 2],
    scores: &mut Vec<f32>,
    out: &mut [f32],
    log_sum: &mut [f32],
) {
    let width = channels / heads;
    let scale = 1.0 / (width as f32).sqrt();
    scores.resize(rows, 0.0);
    for i in 0..rows {
        for head in 0..heads {
            let channel = head * width;
            let part =
                |row: usize| row * table.stride + channel..row * table.stride + channel + width;
            let query = &table.query[part(i)];
            let mut most = f32::NEG_INFINITY;
            for (j, score) in scores.iter_mut().enumerate() {
                *score = scale * dot(query, &table.key[part(j)]);
                most = most.max(*score);
            }
            let out = &mut out[i * channels + channel..][..width];
            let mut sum = 0.0;
            for (j, score) in scores.iter().enumerate() {
                let weight = (score - most).exp();
                sum += weight;
                add_scaled(out, weight, &table.value[part(j)]);
            }
            let scale = 1.0 / sum;
            out.iter_mut().for_each(|o| *o *= scale);
            log_sum[i * heads + head] = most + sum.ln();
        }
    }
}

/// One segment of `rows` rows: adds to the gradients.
pub(crate) fn backward(
    table: Strided,
    rows: usize,
    [channels, heads]: [usize; 2],
    [out, grad]: [&[f32]; 2],
    log_sum: &[f32],
    [dq, dk, dv]: [&mut [f32]; 3],
) {
    let width = channels / heads;
    let scale = 1.0 / (width as f32).sqrt();
    for i in 0..rows {
        for head in 0..heads {
            let channel = head * width;
            let part =
                |row: usize| row * table.stride + channel..row * table.stride + channel + width;
            let row = |row: usize| row * channels + channel..row * channels + channel + width;
            let query = &table.query[part(i)];
            let grad = &grad[row(i)];
            let delta = dot(grad, &out[row(i)]);
            for j in 0..rows {
                let key = &table.key[part(j)];
                let weight = (scale * dot(query, key) - log_sum[i * heads + head]).exp();
                let gain = scale * weight * (dot(grad, &table.value[part(j)]) - delta);
                add_scaled(&mut dq[row(i)], gain, key);
                add_scaled(&mut dk[row(j)], gain, query);
                add_scaled(&mut dv[row(j)], weight, grad);
            }
        }
    }
}

#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[inline(always)]
fn add_scaled(to: &mut [f32], by: f32, from: &[f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += by * from;
    }
}
