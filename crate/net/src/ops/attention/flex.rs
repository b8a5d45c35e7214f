//! Attention in loops for the processor: a segment's rows lie together and stay in the nearest cache. On the way back the
//! scores of one row at a time are held, never those of all.

use burn::backend::{Flex, tensor::FloatTensor};
use rayon::prelude::*;

use super::super::flex::{parts, split_rows, tensor};
use super::super::functions::exp;
use super::super::lanes::{LANES, add_scaled, dot, each};
use super::super::wide::wide;
use super::{AttentionPasses, Shared, forward};

/// Rows that a thread takes at a time.
const ROWS: usize = 512;

/// Query, key and value of the rows of a segment.
#[derive(Clone, Copy)]
pub(crate) struct Table<'a> {
    /// The first row's query, key and value, and what follows.
    pub parts: [&'a [f32]; 3],
    /// Numbers from one row to the next.
    pub stride: usize,
    /// Channels of a row.
    pub channels: usize,
    /// Parts of the channels that attend on their own.
    pub heads: usize,
}

impl<'a> Table<'a> {
    /// From a later row on.
    #[inline(always)]
    pub fn starting_at(self, row: usize) -> Self {
        Self {
            parts: self.parts.map(|part| &part[row * self.stride..]),
            ..self
        }
    }

    /// Channels of a head.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.channels / self.heads
    }
}

/// Room for one segment's scores and what is packed for them.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// Packed keys, or queries.
    pub(super) keys: Vec<f32>,
    /// Packed values, or sums of them.
    pub(super) values: Vec<f32>,
    pub(super) scores: Vec<f32>,
    gains: Vec<f32>,
}

impl AttentionPasses for Flex {
    fn attention_forward(
        inputs: [FloatTensor<Self>; 3],
        shared: &Shared<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let inputs = inputs.map(|t| t.to_contiguous());
        let [rows, channels] = inputs[0].layout().shape().dims();
        let heads = shared.heads;
        let offsets = shared.offsets.to_contiguous();
        let offsets: &[i32] = offsets.storage();
        let table = Table {
            parts: inputs.each_ref().map(|t| t.storage()),
            stride: channels,
            channels,
            heads,
        };
        let mut out = vec![0.0; rows * channels];
        let mut log_sum = vec![0.0; rows * heads];
        let parts = parts(offsets, ROWS);
        let outs = split_rows(&mut out, offsets, &parts, channels);
        let sums = split_rows(&mut log_sum, offsets, &parts, heads);
        (&parts, outs, sums).into_par_iter().for_each_init(
            Scratch::default,
            |scratch, (part, out, log_sum)| {
                forward(
                    table,
                    &offsets[part.start..=part.end],
                    scratch,
                    out,
                    log_sum,
                );
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
        let inputs = inputs.map(|t| t.to_contiguous());
        let results = [out, grad, log_sum].map(|t| t.to_contiguous());
        let [rows, channels] = inputs[0].layout().shape().dims();
        let heads = shared.heads;
        let offsets = shared.offsets.to_contiguous();
        let offsets: &[i32] = offsets.storage();
        let table = Table {
            parts: inputs.each_ref().map(|t| t.storage()),
            stride: channels,
            channels,
            heads,
        };
        let [out, grad, log_sum] = results.each_ref().map(|t| t.storage::<f32>());
        let mut grads = [(); 3].map(|()| vec![0.0; rows * channels]);
        let parts = parts(offsets, ROWS);
        let [dq, dk, dv] = grads
            .each_mut()
            .map(|g| split_rows(g, offsets, &parts, channels));
        (&parts, dq, dk, dv).into_par_iter().for_each_init(
            || (Scratch::default(), Vec::new()),
            |(scratch, joint), (part, dq, dk, dv)| {
                let [first, end] = [offsets[part.start], offsets[part.end]].map(|o| o as usize);
                joint.clear();
                joint.resize((end - first) * 3 * channels, 0.0);
                let wide = first * channels..end * channels;
                backward(
                    table.starting_at(first),
                    &offsets[part.start..=part.end],
                    scratch,
                    [&out[wide.clone()], &grad[wide]],
                    &log_sum[first * heads..end * heads],
                    joint,
                );
                for (i, joint) in joint.chunks_exact(3 * channels).enumerate() {
                    let own = i * channels..(i + 1) * channels;
                    dq[own.clone()].copy_from_slice(&joint[..channels]);
                    dk[own.clone()].copy_from_slice(&joint[channels..2 * channels]);
                    dv[own].copy_from_slice(&joint[2 * channels..]);
                }
            },
        );
        grads.map(|g| tensor(g, [rows, channels].into()))
    }
}

/// Attention in the segments between `offsets`; `table`, `out` and `log_sum` begin with the first of them.
pub(crate) fn forward(
    table: Table<'_>,
    offsets: &[i32],
    scratch: &mut Scratch,
    out: &mut [f32],
    log_sum: &mut [f32],
) {
    forward::run(forward::Segments {
        table,
        offsets,
        scratch,
        out,
        log_sum,
    });
}

wide! {
    /// As [`forward`]; `results` are the forward pass's result and its gradient. Adds to `joint`, whose rows hold the
    /// gradients of query, key and value one after the other, and begin as zeros.
    pub(crate) fn backward(table: Table<'_>, offsets: &[i32], scratch: &mut Scratch, results: [&[f32]; 2], log_sum: &[f32], joint: &mut [f32]) {
        let Some(start) = offsets.first().map(|o| *o as usize) else { return };
        let (channels, heads) = (table.channels, table.heads);
        for bounds in offsets.windows(2) {
            let [first, end] = [bounds[0] as usize, bounds[1] as usize];
            if first == end {
                continue;
            }
            let rows = first - start..end - start;
            let results = results.map(|t| &t[rows.start * channels..rows.end * channels]);
            let log_sum = &log_sum[rows.start * heads..rows.end * heads];
            let joint = &mut joint[rows.start * 3 * channels..rows.end * 3 * channels];
            let table = table.starting_at(first - start);
            match channels / heads {
                8 => segment_backward::<8>(table, end - first, scratch, results, log_sum, joint),
                12 => segment_backward::<12>(table, end - first, scratch, results, log_sum, joint),
                20 => segment_backward::<20>(table, end - first, scratch, results, log_sum, joint),
                40 => segment_backward::<40>(table, end - first, scratch, results, log_sum, joint),
                _ => segment_backward::<0>(table, end - first, scratch, results, log_sum, joint),
            }
        }
    }
}

/// Eight rows of a head's channels side by side, `[ceil(rows / 8)][width][8]`, with zeros beyond the last row.
#[inline(always)]
fn pack(table: &[f32], stride: usize, rows: usize, width: usize, packed: &mut Vec<f32>) {
    let group = width * LANES;
    packed.resize(rows.div_ceil(LANES) * group, 0.0);
    if !rows.is_multiple_of(LANES) {
        packed[rows / LANES * group..].fill(0.0);
    }
    for (g, packed) in packed.chunks_exact_mut(group).enumerate() {
        for lane in 0..LANES.min(rows - g * LANES) {
            let row = &table[(g * LANES + lane) * stride..][..width];
            for (packed, value) in packed.chunks_exact_mut(LANES).zip(row) {
                packed[lane] = *value;
            }
        }
    }
}

/// Scalar products of `row` with the packed rows.
#[inline(always)]
fn products(row: &[f32], packed: &[f32], out: &mut [f32]) {
    let groups = packed.chunks_exact(row.len() * LANES);
    for (out, group) in out.chunks_exact_mut(LANES).zip(groups) {
        let mut lanes = [0.0; LANES];
        for (value, group) in row.iter().zip(group.chunks_exact(LANES)) {
            for lane in 0..LANES {
                lanes[lane] += value * group[lane];
            }
        }
        out.copy_from_slice(&lanes);
    }
}

/// `out = by sum_j weights_j row_j` over rows of `out`'s channels, which are `W` unless that is 0.
#[inline(always)]
fn mix<const W: usize>(by: f32, weights: &[f32], table: &[f32], stride: usize, out: &mut [f32]) {
    if W == 0 {
        out.fill(0.0);
        for (j, weight) in weights.iter().enumerate() {
            add_scaled(out, by * *weight, &table[j * stride..]);
        }
        return;
    }
    let mut sums = [0.0; W];
    for (j, weight) in weights.iter().enumerate() {
        let row = &table[j * stride..][..W];
        for c in 0..W {
            sums[c] += weight * row[c];
        }
    }
    for (out, sum) in out.iter_mut().zip(sums) {
        *out = by * sum;
    }
}

#[inline(always)]
fn segment_backward<const W: usize>(
    table: Table<'_>,
    rows: usize,
    scratch: &mut Scratch,
    [out, grad]: [&[f32]; 2],
    log_sum: &[f32],
    joint: &mut [f32],
) {
    let (channels, heads) = (table.channels, table.heads);
    let width = if W == 0 { channels / heads } else { W };
    let scale = 1.0 / (width as f32).sqrt();
    let padded = rows.div_ceil(LANES) * LANES;
    for head in 0..heads {
        let channel = head * width;
        let [query, key, value] = table.parts.map(|part| &part[channel..]);
        pack(key, table.stride, rows, width, &mut scratch.keys);
        pack(value, table.stride, rows, width, &mut scratch.values);
        scratch.scores.resize(padded, 0.0);
        scratch.gains.resize(padded, 0.0);
        for i in 0..rows {
            let query = &query[i * table.stride..][..width];
            let own = i * channels + channel;
            let grad = &grad[own..own + width];
            products(query, &scratch.keys, &mut scratch.scores);
            products(grad, &scratch.values, &mut scratch.gains);
            let delta = dot(grad, &out[own..own + width]);
            let log_sum = log_sum[i * heads + head];
            let (weights, gains) = (&mut scratch.scores, &mut scratch.gains);
            each(weights, [], |weight, []| exp(scale * weight - log_sum));
            each(gains, [weights], |gain, [weight]| {
                scale * weight * (gain - delta)
            });
            let (weights, gains) = (&weights[..rows], &gains[..rows]);
            mix::<W>(
                1.0,
                gains,
                key,
                table.stride,
                &mut joint[3 * i * channels + channel..][..width],
            );
            for (j, (weight, gain)) in weights.iter().zip(gains.iter()).enumerate() {
                let row = &mut joint[3 * j * channels..][..3 * channels];
                add_scaled(&mut row[channels + channel..][..width], *gain, query);
                add_scaled(&mut row[2 * channels + channel..][..width], *weight, grad);
            }
        }
    }
}
