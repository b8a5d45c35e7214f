//! Attention as one kernel: a thread is some rows of a segment and a head. It walks the segment once with the running maximum,
//! sum and result of its rows in registers, so that a key and a value that are read once serve all of them.

use burn::backend::TensorMetadata;
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use cubecl::prelude::*;

use super::Shared;
use crate::ops::cube::{THREADS, dims, empty, groups, largest_step, rows};

/// Numbers of queries and results that a thread may hold.
const HELD: usize = 160;
/// Rows of a thread at most.
const ROWS: usize = 4;

/// The result `[P, d]` and the logarithm of the sum of exponentials `[P, heads]`.
pub(super) fn forward(
    [query, key, value]: [CubeTensor; 3],
    shared: &Shared<CubeBackend>,
) -> (CubeTensor, CubeTensor) {
    let [count, channels] = dims(&query);
    let heads = shared.heads;
    let of_head = channels / heads;
    let out = empty([count, channels], &query);
    let log_sum = empty([count, heads], &query);
    let segments = shared.offsets.shape()[0] - 1;
    if count == 0 {
        return (out, log_sum);
    }
    let width = largest_step(of_head, &[2, 4]);
    let held = (HELD / (2 * of_head)).clamp(1, ROWS);
    let blocks = shared.longest.div_ceil(held);
    // SAFETY: a thread's rows are those of its segment, which the offsets bound.
    unsafe {
        attention_kernel::launch_unchecked(
            &out.client,
            groups(segments * heads * blocks),
            CubeDim::new_1d(THREADS),
            width,
            rows(query).into_buffer_arg(),
            rows(key).into_buffer_arg(),
            rows(value).into_buffer_arg(),
            rows(shared.offsets.clone()).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            log_sum.clone().into_buffer_arg(),
            segments as u32,
            heads as u32,
            blocks as u32,
            1.0 / (of_head as f32).sqrt(),
            width,
            of_head / width,
            held,
        );
    }
    (out, log_sum)
}

#[cube]
fn dot<N: Size>(
    a: &Array<Vector<f32, N>>,
    b: &Array<Vector<f32, N>>,
    #[comptime] first: usize,
    #[comptime] length: usize,
    #[comptime] width: usize,
) -> f32 {
    let mut sums = Vector::<f32, N>::new(0.0f32);
    #[unroll]
    for v in 0..length {
        sums += a[first + v] * b[v];
    }
    let mut sum = 0.0f32;
    #[unroll]
    for c in 0..width {
        sum += sums.extract(c);
    }
    sum
}

/// Threads in the order of segment, block of rows, head. `length` vectors of `width` numbers are a head's.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn attention_kernel<N: Size>(
    query: &[Vector<f32, N>],
    key: &[Vector<f32, N>],
    value: &[Vector<f32, N>],
    offsets: &[i32],
    out: &mut [Vector<f32, N>],
    log_sum: &mut [f32],
    segments: u32,
    heads: u32,
    blocks: u32,
    scale: f32,
    #[comptime] width: usize,
    #[comptime] length: usize,
    #[comptime] held: usize,
) {
    let head = ABSOLUTE_POS % heads as usize;
    let block = ABSOLUTE_POS / heads as usize % blocks as usize;
    let segment = ABSOLUTE_POS / (heads * blocks) as usize;
    if segment >= segments as usize {
        terminate!();
    }
    let start = offsets[segment] as usize;
    let end = offsets[segment + 1] as usize;
    let first = start + block * held;
    if first >= end {
        terminate!();
    }
    let stride = heads as usize * length;
    let column = head * length;
    let mut asked = Array::<Vector<f32, N>>::new(comptime!(held * length));
    let mut heard = Array::<Vector<f32, N>>::new(comptime!(held * length));
    let mut most = Array::<f32>::new(held);
    let mut sum = Array::<f32>::new(held);
    #[unroll]
    for r in 0..held {
        // What stands in for rows past the end is not written.
        let row = (first + r).min(end - 1);
        #[unroll]
        for v in 0..length {
            asked[r * length + v] = query[row * stride + column + v] * Vector::new(scale);
            heard[r * length + v] = Vector::new(0.0f32);
        }
        most[r] = f32::MIN;
        sum[r] = 0.0f32;
    }
    let mut k = Array::<Vector<f32, N>>::new(length);
    let mut v = Array::<Vector<f32, N>>::new(length);
    for other in start..end {
        let at = other * stride + column;
        #[unroll]
        for i in 0..length {
            k[i] = key[at + i];
            v[i] = value[at + i];
        }
        #[unroll]
        for r in 0..held {
            let score = dot::<N>(&asked, &k, r * length, length, width);
            let fresh = score.max(most[r]);
            let keep = (most[r] - fresh).exp();
            let weight = (score - fresh).exp();
            most[r] = fresh;
            sum[r] = sum[r] * keep + weight;
            #[unroll]
            for i in 0..length {
                let before = heard[r * length + i] * Vector::new(keep);
                heard[r * length + i] = before + v[i] * Vector::new(weight);
            }
        }
    }
    #[unroll]
    for r in 0..held {
        let row = first + r;
        if row < end {
            let share = Vector::new(1.0f32 / sum[r]);
            #[unroll]
            for i in 0..length {
                out[row * stride + column + i] = heard[r * length + i] * share;
            }
            log_sum[row * heads as usize + head] = most[r] + sum[r].ln();
        }
    }
}
