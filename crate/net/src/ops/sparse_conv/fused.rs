//! Sparse convolution as one kernel: a thread is some output rows and some of their channels, and walks the table of who lies
//! under which tap. Nothing is gathered into memory, and what follows a convolution (scale and shift, a sum, a ReLU) happens
//! to the sums in registers.

use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

use crate::ops::cube::{THREADS, dims, empty, largest_step, rows};

/// Output rows of a thread: weights that are read once serve them all. With two or three vectors of four channels that is what the
/// rasterisers of software GPUs hold in registers; two rows of sixteen channels, with inputs read
/// four at a time, were ten to twenty times slower.
const ROWS: usize = 4;

/// What becomes of a convolution's sums: `max(scale sum + shift + added, least)`.
pub(crate) struct Finish {
    /// Scale and shift of each channel, `[O]`.
    pub factors: Option<[CubeTensor; 2]>,
    /// `[N, O]`.
    pub added: Option<CubeTensor>,
    /// Whether negative numbers become 0.
    pub relu: bool,
}

/// Features `[M, I]`, weight `[K, I, O]` and gather `[N, K]` to `[N, O]`.
pub(crate) fn convolve(
    features: CubeTensor,
    weight: CubeTensor,
    gather: CubeTensor,
    finish: Finish,
) -> CubeTensor {
    let [inputs_rows, inputs] = dims(&features);
    let [taps, _, outputs] = dims(&weight);
    let [count, _] = dims(&gather);
    let out = empty([count, outputs], &features);
    if count == 0 || outputs == 0 {
        return out;
    }
    let step = largest_step(outputs, &[4]);
    let tile = largest_step(outputs / step, &[2, 3]);
    let [scaled, added] = [finish.factors.is_some(), finish.added.is_some()];
    let client = out.client.clone();
    let weight = rows(weight);
    // A binding cannot stay empty, nor shorter than a vector: what is not read may be anything else.
    let [scale, shift] = finish.factors.map_or_else(
        || [weight.clone(), weight.clone()],
        |factors| factors.map(rows),
    );
    let around = finish.added.map_or_else(|| weight.clone(), rows);
    // SAFETY: threads past the last row end at once, and a row under a tap counts only where it is one of the input's.
    unsafe {
        convolve_kernel::launch_unchecked(
            &client,
            CubeCount::Static(
                (count as u32).div_ceil(THREADS * ROWS as u32),
                (outputs / (step * tile)) as u32,
                1,
            ),
            CubeDim::new_1d(THREADS),
            step,
            rows(features).into_buffer_arg(),
            weight.into_buffer_arg(),
            rows(gather).into_buffer_arg(),
            scale.into_buffer_arg(),
            shift.into_buffer_arg(),
            around.into_buffer_arg(),
            out.clone().into_buffer_arg(),
            inputs_rows as u32,
            count as u32,
            taps as u32,
            inputs as u32,
            (outputs / step) as u32,
            if finish.relu { 0.0 } else { f32::MIN },
            tile,
            scaled,
            added,
        );
    }
    out
}

/// `features` `[present, inputs]` and `weight` `[taps, inputs, outputs]`, whose rows are vectors of `M` numbers.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn convolve_kernel<M: Size>(
    features: &[f32],
    weight: &[Vector<f32, M>],
    gather: &[i32],
    scale: &[Vector<f32, M>],
    shift: &[Vector<f32, M>],
    around: &[Vector<f32, M>],
    out: &mut [Vector<f32, M>],
    present: u32,
    count: u32,
    taps: u32,
    inputs: u32,
    outputs: u32,
    least: f32,
    #[comptime] tile: usize,
    #[comptime] scaled: bool,
    #[comptime] added: bool,
) {
    let first = CUBE_POS_X * comptime!(THREADS * ROWS as u32) + UNIT_POS_X;
    if first >= count {
        terminate!();
    }
    let column = CUBE_POS_Y as usize * tile;
    let mut sums = Array::<Vector<f32, M>>::new(comptime!(ROWS * tile));
    #[unroll]
    for s in 0..comptime!(ROWS * tile) {
        sums[s] = Vector::new(0.0f32);
    }
    let mut from = Array::<usize>::new(ROWS);
    let mut there = Array::<f32>::new(ROWS);
    let mut matrix = column;
    for tap in 0..taps {
        let mut any = false;
        #[unroll]
        for r in 0..ROWS {
            // The last rows of a ragged end repeat the last of all, and are not written.
            let row = (first + comptime!(r as u32 * THREADS)).min(count - 1);
            let found = gather[(row * taps + tap) as usize] as u32;
            let mut counts = 0.0f32;
            if found < present {
                counts = 1.0f32;
            }
            there[r] = counts;
            from[r] = (found.min(present - 1) * inputs) as usize;
            any = any || found < present;
        }
        if any {
            let mut at = matrix;
            for channel in 0..inputs as usize {
                let mut x = Array::<Vector<f32, M>>::new(ROWS);
                #[unroll]
                for r in 0..ROWS {
                    x[r] = Vector::new(features[from[r] + channel] * there[r]);
                }
                #[unroll]
                for t in 0..tile {
                    let w = weight[at + t];
                    #[unroll]
                    for r in 0..ROWS {
                        sums[r * tile + t] += x[r] * w;
                    }
                }
                at += outputs as usize;
            }
        }
        matrix += (inputs * outputs) as usize;
    }
    #[unroll]
    for r in 0..ROWS {
        let row = first + comptime!(r as u32 * THREADS);
        if row < count {
            #[unroll]
            for t in 0..tile {
                let mut value = sums[r * tile + t];
                let to = row as usize * outputs as usize + column + t;
                if comptime!(scaled) {
                    value = fma(value, scale[column + t], shift[column + t]);
                }
                if comptime!(added) {
                    value += around[to];
                }
                out[to] = value.max(Vector::new(least));
            }
        }
    }
}
