//! Sampling in loops for the processor.

use burn::backend::{Flex, tensor::FloatTensor};
use rayon::prelude::*;

use super::super::flex::tensor;
use super::{At, RowsPasses, strides};

/// Pairs that a thread takes at a time.
const PAIRS: usize = 2048;

impl RowsPasses for Flex {
    fn rows_forward(table: FloatTensor<Self>, at: &At<Self>) -> FloatTensor<Self> {
        let table = table.to_contiguous();
        let channels = table.layout().shape()[1];
        let table: &[f32] = table.storage();
        let corner = at.corner.clone().to_contiguous();
        let weights = [at.right.clone(), at.down.clone()].map(|t| t.to_contiguous());
        let corner: &[i32] = corner.storage();
        let [right, down] = weights.each_ref().map(|t| t.storage::<f32>());
        let mut out = vec![0.0; corner.len() * channels];
        out.par_chunks_mut(PAIRS * channels)
            .enumerate()
            .for_each(|(part, out)| {
                for (i, out) in out.chunks_exact_mut(channels).enumerate() {
                    let pair = part * PAIRS + i;
                    let places = places(corner[pair], right[pair], down[pair], at.plane);
                    let rows = places.map(|(row, _)| &table[row * channels..(row + 1) * channels]);
                    let weights = places.map(|(_, weight)| weight);
                    for (c, out) in out.iter_mut().enumerate() {
                        *out = (weights[0] * rows[0][c] + weights[1] * rows[1][c])
                            + (weights[2] * rows[2][c] + weights[3] * rows[3][c]);
                    }
                }
            });
        tensor(out, [corner.len(), channels].into())
    }

    fn rows_backward(grad: FloatTensor<Self>, rows: usize, at: &At<Self>) -> FloatTensor<Self> {
        let grad = grad.to_contiguous();
        let channels = grad.layout().shape()[1];
        let grad: &[f32] = grad.storage();
        let corner = at.corner.clone().to_contiguous();
        let weights = [at.right.clone(), at.down.clone()].map(|t| t.to_contiguous());
        let corner: &[i32] = corner.storage();
        let [right, down] = weights.each_ref().map(|t| t.storage::<f32>());
        // A plane is one thread's: no two threads add to the same row, and sums come out alike on every machine.
        let pixels = at.plane[0] * at.plane[1];
        let mut pairs_of = vec![Vec::new(); rows / pixels];
        for (pair, corner) in (0_u32..).zip(corner) {
            pairs_of[*corner as usize / pixels].push(pair);
        }
        let mut out = vec![0.0; rows * channels];
        (out.par_chunks_mut(pixels * channels), &pairs_of)
            .into_par_iter()
            .enumerate()
            .for_each(|(view, (out, pairs))| {
                for &pair in pairs {
                    let pair = pair as usize;
                    let grad = &grad[pair * channels..(pair + 1) * channels];
                    for (row, weight) in places(corner[pair], right[pair], down[pair], at.plane) {
                        let row = row - view * pixels;
                        let out = &mut out[row * channels..(row + 1) * channels];
                        for (out, g) in out.iter_mut().zip(grad) {
                            *out += weight * g;
                        }
                    }
                }
            });
        tensor(out, [rows, channels].into())
    }
}

/// The four rows and their weights.
fn places(corner: i32, right: f32, down: f32, plane: [usize; 2]) -> [(usize, f32); 4] {
    let corner = corner as usize;
    let [across, below] = strides(plane);
    [
        (corner, (1.0 - right) * (1.0 - down)),
        (corner + across, right * (1.0 - down)),
        (corner + below, (1.0 - right) * down),
        (corner + across + below, right * down),
    ]
}
