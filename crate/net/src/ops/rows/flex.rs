//! Sampling in loops for the processor.

use burn::backend::{Flex, tensor::FloatTensor};
use rayon::prelude::*;

use super::super::flex::tensor;
use super::super::lanes::{add_scaled, each};
use super::super::wide::wide;
use super::{At, RowsPasses, strides};

/// Pairs that a thread takes at a time.
const PAIRS: usize = 2048;

/// Where rows are read from a table, as [`At`].
#[derive(Clone, Copy)]
pub(crate) struct Slices<'a> {
    pub corner: &'a [i32],
    pub right: &'a [f32],
    pub down: &'a [f32],
    pub plane: [usize; 2],
}

impl Slices<'_> {
    /// The four rows of a pair and their weights.
    #[inline(always)]
    fn places(&self, pair: usize) -> [(usize, f32); 4] {
        let corner = self.corner[pair] as usize;
        let [right, down] = [self.right[pair], self.down[pair]];
        let [across, below] = strides(self.plane);
        [
            (corner, (1.0 - right) * (1.0 - down)),
            (corner + across, right * (1.0 - down)),
            (corner + below, (1.0 - right) * down),
            (corner + across + below, right * down),
        ]
    }

    /// Reads a pair's row.
    #[inline(always)]
    pub fn read(&self, pair: usize, table: &[f32], out: &mut [f32]) {
        let channels = out.len();
        let [(a, wa), (b, wb), (c, wc), (d, wd)] = self.places(pair);
        let row = |at: usize| &table[at * channels..(at + 1) * channels];
        each(out, [row(a), row(b), row(c), row(d)], |_, [a, b, c, d]| {
            (wa * a + wb * b) + (wc * c + wd * d)
        });
    }

    /// The gradient of a table of `rows` rows, from that of what was read. A plane is one thread's: no two threads add to
    /// the same row, and sums come out alike on every machine.
    pub fn spread(&self, grad: &[f32], rows: usize, channels: usize) -> Vec<f32> {
        let pixels = self.plane[0] * self.plane[1];
        let mut pairs_of = vec![Vec::new(); rows / pixels];
        for (pair, corner) in (0_u32..).zip(self.corner) {
            pairs_of[*corner as usize / pixels].push(pair);
        }
        let mut out = vec![0.0; rows * channels];
        (out.par_chunks_mut(pixels * channels), &pairs_of)
            .into_par_iter()
            .enumerate()
            .for_each(|(view, (out, pairs))| {
                add_pairs(*self, view * pixels, grad, pairs, channels, out)
            });
        out
    }
}

wide! {
    /// Adds the gradients of `pairs` to the plane that begins with row `first`.
    fn add_pairs(at: Slices<'_>, first: usize, grad: &[f32], pairs: &[u32], channels: usize, out: &mut [f32]) {
        for &pair in pairs {
            let pair = pair as usize;
            let grad = &grad[pair * channels..][..channels];
            for (row, weight) in at.places(pair) {
                add_scaled(&mut out[(row - first) * channels..][..channels], weight, grad);
            }
        }
    }
}

wide! {
    /// Reads the pairs from `first` on.
    fn read_pairs(at: Slices<'_>, first: usize, table: &[f32], channels: usize, out: &mut [f32]) {
        for (i, out) in out.chunks_exact_mut(channels).enumerate() {
            at.read(first + i, table, out);
        }
    }
}

impl RowsPasses for Flex {
    fn rows_forward(table: FloatTensor<Self>, at: &At<Self>) -> FloatTensor<Self> {
        let table = table.to_contiguous();
        let [_, channels] = table.layout().shape().dims();
        let table: &[f32] = table.storage();
        with_slices(at, |at| {
            let mut out = vec![0.0; at.corner.len() * channels];
            out.par_chunks_mut(PAIRS * channels)
                .enumerate()
                .for_each(|(part, out)| read_pairs(at, part * PAIRS, table, channels, out));
            tensor(out, [at.corner.len(), channels].into())
        })
    }

    fn rows_backward(grad: FloatTensor<Self>, rows: usize, at: &At<Self>) -> FloatTensor<Self> {
        let grad = grad.to_contiguous();
        let [_, channels] = grad.layout().shape().dims();
        let grad: &[f32] = grad.storage();
        with_slices(at, |at| {
            tensor(at.spread(grad, rows, channels), [rows, channels].into())
        })
    }
}

/// Runs with the places as slices.
pub(crate) fn with_slices<R>(at: &At<Flex>, run: impl FnOnce(Slices<'_>) -> R) -> R {
    let corner = at.corner.to_contiguous();
    let [right, down] = [&at.right, &at.down].map(|t| t.to_contiguous());
    run(Slices {
        corner: corner.storage(),
        right: right.storage(),
        down: down.storage(),
        plane: at.plane,
    })
}
