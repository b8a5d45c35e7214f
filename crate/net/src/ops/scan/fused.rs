//! The selective scan as one kernel: a thread is a line of a state and goes along it forth and back, with the exponentials of its
//! steps made on the way.

use burn::tensor::Tensor;
use cubecl::prelude::*;

use super::Pass;
use crate::ops::cube::{THREADS, dims, empty, groups, numbers, tensor};

/// [`super::selective_scan`].
pub(super) fn scan(x: Tensor<4>, step: Tensor<4>, log_rate: Tensor<1>, pass: Pass) -> Tensor<4> {
    let x = numbers(x);
    let [views, states, height, width] = dims(&x);
    let out = empty([views, states, height, width], &x);
    let planes = views * states;
    if planes * height * width == 0 {
        return tensor(out);
    }
    let columns = pass == Pass::Columns;
    // Lines of a plane, from one to the next, pixels of a line, from one to the next.
    let [lines, beside, length, along] = match pass {
        Pass::Rows => [height, width, width, 1],
        Pass::Columns => [width, 1, height, width],
    };
    // SAFETY: threads past the last line end at once, and a line lies in its plane.
    unsafe {
        scan_kernel::launch_unchecked(
            &out.client,
            groups(planes * lines),
            CubeDim::new_1d(THREADS),
            x.into_buffer_arg(),
            numbers(step).into_buffer_arg(),
            numbers(log_rate).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            planes as u32,
            states as u32,
            lines as u32,
            beside as u32,
            length as u32,
            along as u32,
            columns,
        );
    }
    tensor(out)
}

/// What is kept of a state over a step.
#[cube]
fn kept(step: f32, rate: f32) -> f32 {
    // softplus, without overflow.
    let soft = step.max(0.0f32) + (1.0f32 + (0.0f32 - step.abs()).exp()).ln();
    (soft * rate).exp()
}

/// What a pixel adds to the state.
#[cube]
fn gain(keep: f32, rate: f32, #[comptime] columns: bool) -> f32 {
    let mut gain = 1.0f32 - keep;
    if comptime!(!columns) {
        gain = (keep - 1.0f32) / rate;
    }
    gain
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn scan_kernel(
    x: &[f32],
    step: &[f32],
    log_rate: &[f32],
    out: &mut [f32],
    planes: u32,
    states: u32,
    lines: u32,
    beside: u32,
    length: u32,
    along: u32,
    #[comptime] columns: bool,
) {
    let lines = lines as usize;
    let plane = ABSOLUTE_POS / lines;
    if plane >= planes as usize {
        terminate!();
    }
    let rate = 0.0f32 - log_rate[plane % states as usize].exp();
    let area = lines * length as usize;
    let first = plane * area + ABSOLUTE_POS % lines * beside as usize;
    let mut at = first;
    let mut state = 0.0f32;
    for _ in 0..length {
        let keep = kept(step[at], rate);
        state = keep * state + gain(keep, rate, columns) * x[at];
        out[at] = state;
        at += along as usize;
    }
    // A pixel's own input counts once: back goes what came from beyond.
    let mut beyond = 0.0f32;
    for _ in 0..length {
        at -= along as usize;
        let keep = kept(step[at], rate);
        let from_beyond = keep * beyond;
        out[at] += from_beyond;
        beyond = from_beyond + gain(keep, rate, columns) * x[at];
    }
}
