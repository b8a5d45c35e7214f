//! Semi-global smoothing as one kernel a direction.
//!
//! A line of pixels is walked by a few threads, its lanes, each with its share of the planes in registers, so that only costs
//! and sums cross memory. After each step they exchange their outermost planes and their least value through workgroup
//! memory: one barrier a pixel. Diagonal lines wrap around the picture's left and right border and start afresh there,
//! so that all lines of a direction have the same length.

use super::{
    pack::{high, low},
    sweep::{Four, Packed},
};
use crate::window::COST_STEPS;
use cubecl::prelude::*;

/// Threads of a workgroup.
pub(super) const THREADS: usize = 32;

/// The most lanes of a line.
pub(super) const MOST_LANES: usize = 8;

/// Lanes of a line: each has at least eight planes, so that the exchange costs little beside them.
pub(super) fn lanes(planes: usize) -> usize {
    match planes {
        0..=32 => 2,
        33..=64 => 4,
        _ => MOST_LANES,
    }
}

/// More than any cost along a path.
const NEVER: f32 = 1e6;

/// The eight directions (dx, dy) in which paths go, in the order in which [`crate::smooth`] adds them up.
pub(super) const DIRECTIONS: [(i32, i32); 8] = [
    (1, 0),
    (-1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (1, -1),
    (0, -1),
    (-1, -1),
];

/// `cost` and `sum`: `[pixels, planes]`; a line has `lanes` threads, and `held` groups of four planes are a thread's. `ragged`: the last planes only fill up.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub(super) fn path_kernel(
    cost: &[Packed],
    gray: &[f32],
    sum: &mut [Four],
    width: u32,
    height: u32,
    dx: i32,
    dy: i32,
    planes: u32,
    p1: f32,
    p2: f32,
    edge: f32,
    #[comptime] lanes: usize,
    #[comptime] held: usize,
    #[comptime] ragged: bool,
    #[comptime] first: bool,
) {
    let own = comptime!(held * 4);
    // Of each thread the first and last plane and the least value.
    let kept = comptime!(3 * THREADS);
    let lane = UNIT_POS as usize % lanes;
    let local = UNIT_POS as usize / lanes;
    let mut lines = width;
    let mut steps = height;
    if dy == 0 {
        lines = height;
        steps = width;
    }
    let line = CUBE_POS_X * comptime!((THREADS / lanes) as u32) + local as u32;
    // A thread without a line walks along the last one and writes nothing: barriers are for all.
    let active = line < lines;
    let line = line.min(lines - 1);
    let mut shared = Shared::<[f32]>::new_slice(comptime!(2 * kept));
    let mut path = Array::<f32>::new(own);
    #[unroll]
    for j in 0..own {
        path[j] = 0.0f32;
    }
    let mut least = 0.0f32;
    let mut below = f32::new(NEVER);
    let mut above = f32::new(NEVER);
    let mut shade = 0.0f32;
    // Position across the direction's main axis; along a diagonal it moves.
    let mut across = line;
    for step in 0..steps {
        let mut x = across;
        let mut y = step;
        if dy < 0 {
            y = height - 1 - step;
        }
        if dy == 0 {
            y = line;
            x = step;
            if dx < 0 {
                x = width - 1 - step;
            }
        }
        let wrapped = dy != 0 && ((dx > 0 && x == 0) || (dx < 0 && x == width - 1));
        let at = (y * width + x) as usize;
        let here = gray[at];
        let mut penalty = (p2 / (1.0f32 + (here - shade).abs() / edge)).max(p1);
        if step == 0 || wrapped {
            // Then every plane inherits the least value, and it is taken off again: a path's first value is its cost.
            penalty = 0.0f32;
        }
        shade = here;
        let far = least + penalty;
        let from = (at * lanes + lane) * held;
        let mut lowest = f32::new(NEVER);
        let mut before = below;
        #[unroll]
        for v in 0..held {
            let four = cost[from + v];
            let mut out = Four::new(0.0f32);
            #[unroll]
            for p in 0..4usize {
                let j = comptime!(v * 4 + p);
                let pair = four.extract(comptime!(p / 2));
                let mut price = low(pair);
                if comptime!(p % 2 == 1) {
                    price = high(pair);
                }
                price *= 1.0f32 / COST_STEPS;
                if comptime!(ragged) && (lane * own + j) as u32 >= planes {
                    price = f32::new(NEVER);
                }
                let old = path[j];
                let mut after = above;
                if comptime!(j + 1 < own) {
                    after = path[comptime!((j + 1).min(own - 1))];
                }
                let beside = min(before, after) + p1;
                let new = price + (min(min(old, far), beside) - least);
                path[j] = new;
                before = old;
                lowest = min(lowest, new);
                out.insert(p, new);
            }
            if active {
                if comptime!(first) {
                    sum[from + v] = out;
                } else {
                    sum[from + v] += out;
                }
            }
        }
        // Two halves of the memory take turns, so that one barrier is enough.
        let half = (step % 2) as usize * kept;
        let row = half + local * comptime!(3 * lanes);
        shared[row + lane] = path[0];
        shared[row + lanes + lane] = path[comptime!(own - 1)];
        shared[row + comptime!(2 * lanes) + lane] = lowest;
        sync_cube();
        least = shared[row + comptime!(2 * lanes)];
        #[unroll]
        for k in 1..lanes {
            least = min(least, shared[row + comptime!(2 * lanes) + k]);
        }
        below = f32::new(NEVER);
        above = f32::new(NEVER);
        if lane > 0 {
            below = shared[row + lanes + lane - 1];
        }
        if lane + 1 < lanes {
            above = shared[row + lane + 1];
        }
        if dy != 0 {
            if dx > 0 {
                across += 1;
                if across == width {
                    across = 0;
                }
            }
            if dx < 0 {
                if across == 0 {
                    across = width;
                }
                across -= 1;
            }
        }
    }
}
