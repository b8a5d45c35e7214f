//! The recurrence as one kernel: a thread is a lane, whose state stays in a register.

use burn::backend::TensorMetadata;
use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

use crate::ops::cube::{THREADS, empty, groups, rows};

/// [`super::linrec`] along the last axis.
pub(super) fn linear_recurrence(a: CubeTensor, x: CubeTensor, reverse: bool) -> CubeTensor {
    let shape = x.shape();
    let length = super::last(&x);
    let out = empty(shape.clone(), &x);
    let Some(lanes) = shape.num_elements().checked_div(length) else {
        return out;
    };
    if lanes == 0 {
        return out;
    }
    // SAFETY: threads past the last lane end at once.
    unsafe {
        recurrence_kernel::launch_unchecked(
            &out.client,
            groups(lanes),
            CubeDim::new_1d(THREADS),
            rows(a).into_buffer_arg(),
            rows(x).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            lanes as u32,
            length as u32,
            reverse,
        );
    }
    out
}

#[cube(launch_unchecked)]
fn recurrence_kernel(
    a: &[f32],
    x: &[f32],
    out: &mut [f32],
    lanes: u32,
    length: u32,
    #[comptime] reverse: bool,
) {
    let lane = ABSOLUTE_POS;
    if lane >= lanes as usize {
        terminate!();
    }
    let length = length as usize;
    let first = lane * length;
    let mut state = 0.0f32;
    for t in 0..length {
        let mut at = first + t;
        if comptime!(reverse) {
            at = first + length - 1 - t;
        }
        state = fma(a[at], state, x[at]);
        out[at] = state;
    }
}
