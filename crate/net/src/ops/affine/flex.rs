//! The sampling in loops, a plane a task.

use burn::backend::TensorMetadata;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use crate::ops::flex::{read, tensor};

/// Where a pixel is sampled.
struct Sample {
    /// Places in the plane: above left, above right, below left, below right.
    corners: [usize; 4],
    /// Parts of the way to the right and down.
    right: f32,
    down: f32,
    /// 0 where the sample lies outside and moving it changes nothing.
    moves: [f32; 2],
    /// The pixel itself, from the middle.
    x: f32,
    y: f32,
}

impl Sample {
    fn value(&self, plane: &[f32]) -> f32 {
        let [a, b, c, d] = self.corners.map(|corner| plane[corner]);
        let top = a + (b - a) * self.right;
        let bottom = c + (d - c) * self.right;
        top + (bottom - top) * self.down
    }
}

/// The samples of a view's pixels under the map `[a11 a12 a13 a21 a22 a23]`.
fn samples(map: &[f32], height: usize, width: usize) -> Vec<Sample> {
    let middle = [width, height].map(|side| (side as f32 - 1.0) / 2.0);
    // Along one axis: the lower pixel, the one after it, the part of the way, and whether the sample may move.
    let along = |at: f32, size: usize| {
        let last = size as f32 - 1.0;
        let inside = at.clamp(0.0, last);
        let low = inside.floor();
        let first = low as usize;
        let moves = if inside == at { 1.0 } else { 0.0 };
        (first, (first + 1).min(size - 1), inside - low, moves)
    };
    let of_pixel = |pixel: usize| {
        let x = (pixel % width) as f32 - middle[0];
        let y = (pixel / width) as f32 - middle[1];
        let mapped = |row: &[f32]| row[0] * x + row[1] * y + row[2] * (height as f32 / 2.0);
        let (left, after, right, moves_x) = along(mapped(&map[..3]) + middle[0], width);
        let (top, below, down, moves_y) = along(mapped(&map[3..]) + middle[1], height);
        let (top, below) = (top * width, below * width);
        Sample {
            corners: [top + left, top + after, below + left, below + after],
            right,
            down,
            moves: [moves_x, moves_y],
            x,
            y,
        }
    };
    (0..height * width).map(of_pixel).collect()
}

fn of_views(maps: &[f32], height: usize, width: usize) -> Vec<Vec<Sample>> {
    maps.par_chunks(6)
        .map(|map| samples(map, height, width))
        .collect()
}

pub(super) fn forward(planes: FlexTensor, maps: FlexTensor) -> FlexTensor {
    let shape = planes.shape();
    let [_, channels, height, width] = shape.dims();
    let (planes, views) = (read(planes), of_views(&read(maps), height, width));
    let mut out = vec![0.0; planes.len()];
    out.par_chunks_mut(height * width)
        .zip(planes.par_chunks(height * width))
        .enumerate()
        .for_each(|(plane, (out, from))| {
            for (out, sample) in out.iter_mut().zip(&views[plane / channels]) {
                *out = sample.value(from);
            }
        });
    tensor(out, shape)
}

pub(super) fn backward(
    planes: FlexTensor,
    maps: FlexTensor,
    grad: FlexTensor,
) -> (FlexTensor, FlexTensor) {
    let shape = planes.shape();
    let [views, channels, height, width] = shape.dims();
    let samples = of_views(&read(maps), height, width);
    let (planes, grad) = (read(planes), read(grad));
    let mut of_planes = vec![0.0; planes.len()];
    let mut of_maps = vec![[0.0_f32; 6]; views * channels];
    of_planes
        .par_chunks_mut(height * width)
        .zip(&mut of_maps)
        .zip(planes.par_chunks(height * width))
        .zip(grad.par_chunks(height * width))
        .enumerate()
        .for_each(|(plane, (((of_plane, of_map), from), grad))| {
            for (grad, sample) in grad.iter().zip(&samples[plane / channels]) {
                let &Sample { right, down, .. } = sample;
                let (above, below) = (grad * (1.0 - down), grad * down);
                let shares = [
                    above * (1.0 - right),
                    above * right,
                    below * (1.0 - right),
                    below * right,
                ];
                for (corner, share) in sample.corners.iter().zip(shares) {
                    of_plane[*corner] += share;
                }
                let [a, b, c, d] = sample.corners.map(|corner| from[corner]);
                let of_x = sample.moves[0] * (above * (b - a) + below * (d - c));
                let of_y = sample.moves[1] * grad * ((c - a) + (d - b - c + a) * right);
                for (of_row, of) in of_map.chunks_exact_mut(3).zip([of_x, of_y]) {
                    of_row[0] += of * sample.x;
                    of_row[1] += of * sample.y;
                    of_row[2] += of * (height as f32 / 2.0);
                }
            }
        });
    let mut sums = vec![0.0; views * 6];
    for (plane, of_map) in of_maps.iter().enumerate() {
        let view = plane / channels;
        for (sum, of_map) in sums[6 * view..][..6].iter_mut().zip(of_map) {
            *sum += of_map;
        }
    }
    (tensor(of_planes, shape), tensor(sums, [views, 6].into()))
}
