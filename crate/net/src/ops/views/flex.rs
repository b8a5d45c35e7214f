//! The blocks of all pairs, over the processor's threads.

use burn::backend::{
    Flex,
    tensor::{FloatTensor, IntTensor},
};
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::super::flex::{parts, split_rows, tensor};
use super::super::rows::At;
use super::super::rows::flex::with_slices;
use super::block::{Block, Layout, RowGradients, Sources};
use super::{ViewsExtension, ViewsShape};

/// Numbers of a block's tokens: with what a layer makes of them, a good part of the second cache.
const BLOCK: usize = 6144;
/// Rows of a block at least: weights are read once a block.
const LEAST_ROWS: usize = 64;
/// Parts of the pairs that threads take; each has its own gradient of the weights.
const PARTS: usize = 32;

/// Everything that the operation is given.
#[derive(Clone, Debug)]
pub(super) struct Given {
    base: FlexTensor,
    hidden: FlexTensor,
    extra: FlexTensor,
    weights: FlexTensor,
    at: At<Flex>,
    offsets: FlexTensor,
    shape: ViewsShape,
}

impl ViewsExtension for Flex {
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
        let at = At {
            corner,
            right,
            down,
            plane,
        };
        Given::new([base, hidden, extra, weights], at, offsets, shape).forward()
    }
}

impl Given {
    pub fn new(
        inputs: [FlexTensor; 4],
        at: At<Flex>,
        offsets: FlexTensor,
        shape: ViewsShape,
    ) -> Self {
        let [base, hidden, extra, weights] = inputs.map(|t| t.to_contiguous());
        Self {
            base,
            hidden,
            extra,
            weights,
            at,
            offsets: offsets.to_contiguous(),
            shape,
        }
    }

    /// Runs with everything as slices.
    fn with_sources<R>(&self, run: impl FnOnce(Sources<'_>, &[i32]) -> R) -> R {
        let layout = Layout::new(self.shape);
        assert_eq!(self.weights.layout().num_elements(), layout.size, "weights");
        with_slices(&self.at, |at| {
            let from = Sources {
                shape: self.shape,
                layout: &layout,
                base: self.base.storage(),
                hidden: self.hidden.storage(),
                extra: self.extra.storage(),
                weights: self.weights.storage(),
                at,
            };
            run(from, self.offsets.storage())
        })
    }

    /// The tokens.
    pub fn forward(&self) -> FlexTensor {
        let c = self.shape.channels;
        self.with_sources(|from, offsets| {
            let rows = from.at.corner.len();
            let mut out = vec![0.0; rows * c];
            let parts = parts(offsets, part_rows(rows));
            let outs = split_rows(&mut out, offsets, &parts, c);
            (&parts, outs)
                .into_par_iter()
                .for_each_init(Block::default, |block, (part, out)| {
                    let offsets = &offsets[part.start..=part.end];
                    let blocks = blocks(offsets, c);
                    let outs = split_rows(out, offsets, &blocks, c);
                    for (segments, out) in blocks.iter().zip(outs) {
                        block.forward(from, &offsets[segments.start..=segments.end], out);
                    }
                });
            tensor(out, [rows, c].into())
        })
    }

    /// Gradients of base and hidden planes, further numbers and weights; hidden planes have none without the lift.
    pub fn backward(self, grad: FlexTensor) -> [Option<FlexTensor>; 4] {
        let (c, extra) = (self.shape.channels, self.shape.extra);
        let grad = grad.to_contiguous();
        let grad: &[f32] = grad.storage();
        let hidden_width = if self.shape.lift { c } else { 0 };
        let table_rows = self.base.layout().shape()[0];
        self.with_sources(|from, offsets| {
            let rows = from.at.corner.len();
            let mut dbase = vec![0.0; rows * c];
            let mut dhidden = vec![0.0; rows * hidden_width];
            let mut dextra = vec![0.0; rows * extra];
            let parts = parts(offsets, part_rows(rows));
            let bases = split_rows(&mut dbase, offsets, &parts, c);
            let hiddens = split_rows(&mut dhidden, offsets, &parts, hidden_width);
            let extras = split_rows(&mut dextra, offsets, &parts, extra);
            let of_parts: Vec<Vec<f32>> = (&parts, bases, hiddens, extras)
                .into_par_iter()
                .map_init(
                    || (Block::default(), Vec::new(), Vec::new()),
                    |(block, x, dx), (part, base, hidden, extras)| {
                        let mut grads = vec![0.0; from.layout.size];
                        let offsets = &offsets[part.start..=part.end];
                        let blocks = blocks(offsets, c);
                        let bases = split_rows(base, offsets, &blocks, c);
                        let hiddens = split_rows(hidden, offsets, &blocks, hidden_width);
                        let extras = split_rows(extras, offsets, &blocks, extra);
                        let to = bases.into_iter().zip(hiddens).zip(extras);
                        for (segments, ((base, hidden), extra)) in blocks.iter().zip(to) {
                            let offsets = &offsets[segments.start..=segments.end];
                            let [first, end] =
                                [offsets[0], offsets[segments.len()]].map(|o| o as usize);
                            x.resize((end - first) * c, 0.0);
                            block.forward(from, offsets, x);
                            dx.clear();
                            dx.extend_from_slice(&grad[first * c..end * c]);
                            let to = RowGradients {
                                base,
                                hidden,
                                extra,
                            };
                            block.backward(from, offsets, dx, to, &mut grads);
                        }
                        grads
                    },
                )
                .collect();
            let mut weights = vec![0.0; from.layout.size];
            for part in &of_parts {
                for (sum, grad) in weights.iter_mut().zip(part) {
                    *sum += grad;
                }
            }
            let table = |grads: &[f32]| {
                let spread = from.at.spread(grads, table_rows, c);
                tensor(spread, [table_rows, c].into())
            };
            [
                Some(table(&dbase)),
                self.shape.lift.then(|| table(&dhidden)),
                Some(tensor(dextra, [rows, extra].into())),
                Some(tensor(weights, [from.layout.size].into())),
            ]
        })
    }
}

/// Rows of a part. It depends on the rows alone: sums come out alike on every machine.
fn part_rows(rows: usize) -> usize {
    rows.div_ceil(PARTS).max(512)
}

/// The blocks of a part's segments.
fn blocks(offsets: &[i32], channels: usize) -> Vec<std::ops::Range<usize>> {
    parts(offsets, (BLOCK / channels).max(LEAST_ROWS))
}
