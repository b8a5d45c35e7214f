//! On the processor: for a block of output rows and a tap, the pairs that are there, and one product over them. Nothing is
//! gathered in memory and absent neighbours cost nothing.

use super::tile::{Products, ROWS, Rows};
use crate::ops::register::on_best_register;
use rayon::prelude::*;

/// Output rows of a block: their sums stay in the second-level cache.
const BLOCK: usize = 256;

/// Columns are padded to this many, a multiple of every register's lanes.
const PAD: usize = 16;

/// Sizes of a convolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    pub taps: usize,
    /// Rows of the input.
    pub rows: usize,
    pub inputs: usize,
    pub outputs: usize,
}

impl Sizes {
    fn width(&self) -> usize {
        self.outputs.next_multiple_of(PAD)
    }
}

/// The pairs of a block under a tap: output row within the block, input row. `gather` is the block's.
fn pairs(gather: &[i32], tap: usize, sizes: &Sizes, pairs: &mut Vec<(u32, u32)>) {
    pairs.clear();
    pairs.resize(gather.len() / sizes.taps, (0, 0));
    let mut count = 0;
    for (row, taps) in gather.chunks_exact(sizes.taps).enumerate() {
        // Written always and kept if there: no branch to guess.
        let source = taps[tap];
        pairs[count] = (row as u32, source as u32);
        count += usize::from((source as usize) < sizes.rows);
    }
    pairs.truncate(count);
}

/// Rows of `table` `[_, from]` with zeros up to `to` columns.
fn padded(table: &[f32], from: usize, to: usize, out: &mut Vec<f32>) {
    out.clear();
    out.resize(table.len() / from * to, 0.0);
    for (out, row) in out.chunks_exact_mut(to).zip(table.chunks_exact(from)) {
        out[..from].copy_from_slice(row);
    }
}

/// `features` `[rows, inputs]` under `gather` `[N, taps]` by `weight` `[taps, inputs, outputs]`: `[N, outputs]`.
pub(super) fn convolve(features: &[f32], weight: &[f32], gather: &[i32], sizes: Sizes) -> Vec<f32> {
    let Sizes {
        taps,
        inputs,
        outputs,
        ..
    } = sizes;
    let width = sizes.width();
    let mut wide = Vec::new();
    let weight = if width == outputs {
        weight
    } else {
        padded(weight, outputs, width, &mut wide);
        &wide
    };
    let rows = gather.len() / taps;
    // Rows do not meet each other: the size of a block changes no number.
    let block = rows
        .div_ceil(4 * rayon::current_num_threads())
        .next_multiple_of(ROWS)
        .clamp(ROWS, BLOCK);
    let mut output = vec![0.0; rows * outputs];
    let blocks = output
        .par_chunks_mut(block * outputs)
        .zip(gather.par_chunks(block * taps));
    blocks.for_each_init(
        || (Vec::new(), Vec::new()),
        |(sums, found), (output, gather)| {
            let rows = gather.len() / taps;
            sums.clear();
            // One more row, for what fills the last tile.
            sums.resize((rows + 1) * width, 0.0);
            for (tap, columns) in weight.chunks_exact(inputs * width).enumerate() {
                pairs(gather, tap, &sizes, found);
                let Some((_, any)) = found.first().copied() else {
                    continue;
                };
                found.resize(found.len().next_multiple_of(ROWS), (rows as u32, any));
                on_rows(Rows {
                    pairs: found,
                    factors: features,
                    columns,
                    depth: inputs,
                    sums,
                    width,
                });
            }
            for (output, sums) in output
                .chunks_exact_mut(outputs)
                .zip(sums.chunks_exact(width))
            {
                output.copy_from_slice(&sums[..outputs]);
            }
        },
    );
    output
}

/// The gradient of the weight, `[taps, inputs, outputs]`, from that of the output `[N, outputs]`.
pub(super) fn weight_gradient(
    features: &[f32],
    gradient: &[f32],
    gather: &[i32],
    sizes: Sizes,
) -> Vec<f32> {
    let Sizes {
        taps,
        inputs,
        outputs,
        ..
    } = sizes;
    let width = sizes.width();
    let rows = gather.len() / taps;
    // Parts of the rows, summed in their order, and groups of taps: as many pieces of work on any number of threads, so that
    // the sum is the same on each.
    let parts = rows.div_ceil(4096).clamp(1, 16);
    let part = rows.div_ceil(parts).max(1);
    let groups = (1..=taps)
        .find(|g| taps.is_multiple_of(*g) && g * parts >= 16)
        .unwrap_or(taps);
    let group = taps / groups;
    let mut sums = vec![0.0; parts * taps * inputs * width];
    sums.par_chunks_mut(group * inputs * width)
        .enumerate()
        .for_each_init(
            || (Vec::new(), Vec::new()),
            |(wide, found), (piece, sums)| {
                let (part_index, first_tap) = (piece / groups, piece % groups * group);
                let first = (part_index * part).min(rows);
                let last = (first + part).min(rows);
                for start in (first..last).step_by(BLOCK) {
                    let end = (start + BLOCK).min(last);
                    let gather = &gather[start * taps..end * taps];
                    let mut right = &gradient[start * outputs..end * outputs];
                    if width != outputs {
                        padded(right, outputs, width, wide);
                        right = wide;
                    }
                    for (tap, sums) in sums.chunks_exact_mut(inputs * width).enumerate() {
                        pairs(gather, first_tap + tap, &sizes, found);
                        on_products(Products {
                            pairs: found,
                            left: features,
                            depth: inputs,
                            right,
                            width,
                            sums,
                        });
                    }
                }
            },
        );
    let mut output = vec![0.0; taps * inputs * outputs];
    output
        .par_chunks_mut(outputs)
        .enumerate()
        .for_each(|(row, output)| {
            for part in sums.chunks_exact(taps * inputs * width) {
                for (output, sum) in output.iter_mut().zip(&part[row * width..]) {
                    *output += sum;
                }
            }
        });
    output
}

on_best_register!(fn on_rows(Rows));
on_best_register!(fn on_products(Products));
