//! The winning plane of every pixel as one kernel.

use super::{
    pack::{high, low},
    sweep::{Four, THREADS},
};
use crate::window::COST_STEPS;
use cubecl::prelude::*;

/// A thread is a pixel. Writes inverse depth, ZNCC and uniqueness as three maps, one after the other: `[3, pixels]`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub(super) fn winners_kernel(
    cost: &[i32],
    sum: &[Four],
    base: &[f32],
    maps: &mut [f32],
    pixels: u32,
    planes: u32,
    groups: u32,
    first_rho: f32,
    step: f32,
    #[comptime] has_base: bool,
) {
    let at = (CUBE_POS_X * THREADS + UNIT_POS_X) as usize;
    if at >= pixels as usize {
        terminate!();
    }
    let row = at * groups as usize;
    let mut least = f32::new(1e9);
    let mut best = 0i32;
    let mut before = f32::new(0.0);
    let mut after = f32::new(0.0);
    let mut last = f32::new(0.0);
    let mut next = false;
    for group in 0..groups as usize {
        let four = sum[row + group];
        #[unroll]
        for p in 0..4usize {
            let s = four.extract(p);
            if next {
                after = s;
            }
            next = s < least;
            if next {
                least = s;
                best = (group * 4 + p) as i32;
                before = last;
            }
            last = s;
        }
    }
    let mut second = f32::new(1e9);
    for group in 0..groups as usize {
        let four = sum[row + group];
        #[unroll]
        for p in 0..4usize {
            let away = (group * 4 + p) as i32 - best;
            if away * away > 4 {
                second = min(second, four.extract(p));
            }
        }
    }
    let mut shift = f32::new(0.0);
    if best > 0 && best + 1 < planes as i32 {
        let bend = before - 2.0f32 * least + after;
        if bend > 1e-6f32 {
            shift = (0.5f32 * (before - after) / bend).clamp(-0.5f32, 0.5f32);
        }
    }
    let mut rho = first_rho + step * (best as f32 + shift);
    if comptime!(has_base) {
        rho += base[at];
    }
    let n = pixels as usize;
    maps[at] = rho;
    let pair = cost[row * 2 + (best / 2) as usize];
    let mut own = low(pair);
    if best % 2 == 1 {
        own = high(pair);
    }
    maps[n + at] = 1.0f32 - own * (1.0f32 / COST_STEPS);
    maps[2 * n + at] = (second - least) * 0.125f32;
}
