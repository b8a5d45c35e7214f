//! The scan in loops, a plane a task. Planes lie with the scanned axis first, so that all lanes take a step at once.

use burn::backend::TensorMetadata;
use burn_flex::FlexTensor;
use rayon::prelude::*;

use super::Pass;
use crate::ops::flex::{read, tensor};
use crate::ops::functions::{exp_m1, softplus};
use crate::ops::wide::wide;

/// A plane's place in memory and its rate.
struct Lines {
    /// Steps along the scanned axis.
    length: usize,
    /// Lines side by side.
    lanes: usize,
    turned: bool,
}

impl Lines {
    fn new(height: usize, width: usize, pass: Pass) -> Self {
        match pass {
            Pass::Rows => Self {
                length: width,
                lanes: height,
                turned: true,
            },
            Pass::Columns => Self {
                length: height,
                lanes: width,
                turned: false,
            },
        }
    }

    fn count(&self) -> usize {
        self.length * self.lanes
    }

    /// A plane with the scanned axis first.
    fn gather(&self, plane: &[f32], to: &mut [f32]) {
        if self.turned {
            transpose(plane, to, self.length, self.lanes);
        } else {
            to.copy_from_slice(plane);
        }
    }

    /// And back.
    fn scatter(&self, from: &[f32], plane: &mut [f32]) {
        if self.turned {
            transpose(from, plane, self.lanes, self.length);
        } else {
            plane.copy_from_slice(from);
        }
    }
}

/// `from` has rows of `width`, `to` rows of `height`. In tiles, so that both stay in the cache.
fn transpose(from: &[f32], to: &mut [f32], width: usize, height: usize) {
    const TILE: usize = 16;
    for y0 in (0..height).step_by(TILE) {
        for x0 in (0..width).step_by(TILE) {
            for x in x0..(x0 + TILE).min(width) {
                for y in y0..(y0 + TILE).min(height) {
                    to[x * height + y] = from[y * width + x];
                }
            }
        }
    }
}

/// Rate `u` of a state and the factor of its gain: gain = `(e^{du} - 1) factor`.
fn rate(log_rate: f32, pass: Pass) -> (f32, f32) {
    let u = -log_rate.exp();
    match pass {
        Pass::Rows => (u, 1.0 / u),
        Pass::Columns => (u, -1.0),
    }
}

wide! {
    /// `e^{du} - 1` and the input `v`.
    fn prepare(x: &[f32], step: &[f32], u: f32, factor: f32, less: &mut [f32], v: &mut [f32]) {
        let given = x.iter().zip(step);
        for (((x, step), less), v) in given.zip(less).zip(v) {
            *less = exp_m1(u * softplus(*step).0);
            *v = *less * factor * x;
        }
    }
}

wide! {
    /// `state = a state + v`, and a copy of it; `a = less + 1`.
    fn advance(state: &mut [f32], less: &[f32], v: &[f32], out: &mut [f32]) {
        for (((state, less), v), out) in state.iter_mut().zip(less).zip(v).zip(out) {
            *state = *state + less * *state + v;
            *out = *state;
        }
    }
}

wide! {
    /// `state = a state + v`, `out += state - v`.
    fn advance_back(state: &mut [f32], less: &[f32], v: &[f32], out: &mut [f32]) {
        for (((state, less), v), out) in state.iter_mut().zip(less).zip(v).zip(out) {
            let carried = *state + less * *state;
            *state = carried + v;
            *out += carried;
        }
    }
}

pub(super) fn forward(
    x: FlexTensor,
    step: FlexTensor,
    log_rate: FlexTensor,
    pass: Pass,
) -> FlexTensor {
    let shape = x.shape();
    let [_, states, height, width] = shape.dims();
    let lines = Lines::new(height, width, pass);
    let (x, step, log_rate) = (read(x), read(step), read(log_rate));
    let count = lines.count();
    let mut out = vec![0.0; x.len()];
    let inputs = x.par_chunks(count).zip(step.par_chunks(count));
    out.par_chunks_mut(count)
        .zip(inputs)
        .enumerate()
        .for_each_init(
            || vec![0.0; 5 * count + lines.lanes],
            |scratch, (plane, (out, (x, step)))| {
                let (u, factor) = rate(log_rate[plane % states], pass);
                let [xs, steps, less, v, sum] = parts(scratch, count);
                lines.gather(x, xs);
                lines.gather(step, steps);
                prepare(xs, steps, u, factor, less, v);
                let mut state = vec![0.0; lines.lanes];
                for t in 0..lines.length {
                    let at = t * lines.lanes..(t + 1) * lines.lanes;
                    advance(&mut state, &less[at.clone()], &v[at.clone()], &mut sum[at]);
                }
                state.fill(0.0);
                for t in (0..lines.length).rev() {
                    let at = t * lines.lanes..(t + 1) * lines.lanes;
                    advance_back(&mut state, &less[at.clone()], &v[at.clone()], &mut sum[at]);
                }
                lines.scatter(sum, out);
            },
        );
    tensor(out, shape)
}

/// The first `N` runs of `count` numbers.
fn parts<const N: usize>(scratch: &mut [f32], count: usize) -> [&mut [f32]; N] {
    let mut chunks = scratch.chunks_exact_mut(count);
    std::array::from_fn(|_| chunks.next().unwrap_or_default())
}

/// What the way back through a plane carries from line to line, and what it adds up.
struct Way {
    u: f32,
    factor: f32,
    /// The backward recurrence's state at t + 1.
    back: Vec<f32>,
    /// `a_{t+1} lam_{t+1}` of the forward recurrence.
    carried: Vec<f32>,
    /// Sums over t, lane by lane, towards the gradients of `u` and of the gain's factor.
    of_u: Vec<f32>,
    of_factor: Vec<f32>,
}

/// Lines at t of what is given.
struct Given<'a> {
    x: &'a [f32],
    step: &'a [f32],
    less: &'a [f32],
    grad: &'a [f32],
    /// The forward recurrence at t - 1, zeros at the first.
    before: &'a [f32],
    /// The other direction's gradient at t.
    lam_back: &'a [f32],
}

wide! {
    fn return_line(way: &mut Way, given: Given<'_>, of_x: &mut [f32], of_step: &mut [f32]) {
        let lanes = of_x.len();
        let Given { x, step, less, grad, before, lam_back } = given;
        let (x, step, less, grad) = (&x[..lanes], &step[..lanes], &less[..lanes], &grad[..lanes]);
        let (before, lam_back) = (&before[..lanes], &lam_back[..lanes]);
        let (u, factor) = (way.u, way.factor);
        let (back, carried) = (&mut way.back[..lanes], &mut way.carried[..lanes]);
        let (of_u, of_factor) = (&mut way.of_u[..lanes], &mut way.of_factor[..lanes]);
        let of_step = &mut of_step[..lanes];
        for i in 0..lanes {
            let a = 1.0 + less[i];
            let (d, slope) = softplus(step[i]);
            let lam = grad[i] + carried[i];
            let of_v = lam + lam_back[i] - grad[i];
            let of_a = lam * before[i] + lam_back[i] * back[i];
            let of_less = of_a + of_v * factor * x[i];
            let of_du = of_less * a;
            of_x[i] = of_v * less[i] * factor;
            of_step[i] = of_du * u * slope;
            of_u[i] += of_du * d;
            of_factor[i] += of_v * less[i] * x[i];
            carried[i] = a * lam;
            back[i] = a * back[i] + less[i] * factor * x[i];
        }
    }
}

pub(super) fn backward(
    x: FlexTensor,
    step: FlexTensor,
    log_rate: FlexTensor,
    grad: FlexTensor,
    pass: Pass,
) -> (FlexTensor, FlexTensor, FlexTensor) {
    let shape = x.shape();
    let [views, states, height, width] = shape.dims();
    let lines = Lines::new(height, width, pass);
    let (x, step, log_rate, grad) = (read(x), read(step), read(log_rate), read(grad));
    let (count, lanes) = (lines.count(), lines.lanes);
    let mut of_x = vec![0.0; x.len()];
    let mut of_step = vec![0.0; x.len()];
    let mut of_rate = vec![0.0_f32; views * states];
    let inputs = x.par_chunks(count).zip(step.par_chunks(count));
    let inputs = inputs.zip(grad.par_chunks(count));
    let outputs = of_x
        .par_chunks_mut(count)
        .zip(of_step.par_chunks_mut(count));
    outputs
        .zip(&mut of_rate)
        .zip(inputs)
        .enumerate()
        .for_each_init(
            || vec![0.0; 9 * count],
            |scratch, (plane, (((of_x, of_step), of_rate), ((x, step), grad)))| {
                let (u, factor) = rate(log_rate[plane % states], pass);
                let [xs, steps, grads, less, v, ahead, lam_back, of_xs, of_steps] =
                    parts(scratch, count);
                lines.gather(x, xs);
                lines.gather(step, steps);
                lines.gather(grad, grads);
                prepare(xs, steps, u, factor, less, v);
                let line = |t: usize| t * lanes..(t + 1) * lanes;
                let mut state = vec![0.0; lanes];
                for t in 0..lines.length {
                    advance(&mut state, &less[line(t)], &v[line(t)], &mut ahead[line(t)]);
                }
                // lam_back_t = g_t + a_{t-1} lam_back_{t-1}: the backward recurrence's gradient goes forward.
                state.fill(0.0);
                let zeros = vec![0.0; lanes];
                for t in 0..lines.length {
                    let less = if t == 0 { &zeros } else { &less[line(t - 1)] };
                    advance(&mut state, less, &grads[line(t)], &mut lam_back[line(t)]);
                }
                let mut way = Way {
                    u,
                    factor,
                    back: vec![0.0; lanes],
                    carried: vec![0.0; lanes],
                    of_u: vec![0.0; lanes],
                    of_factor: vec![0.0; lanes],
                };
                for t in (0..lines.length).rev() {
                    let given = Given {
                        x: &xs[line(t)],
                        step: &steps[line(t)],
                        less: &less[line(t)],
                        grad: &grads[line(t)],
                        before: if t == 0 { &zeros } else { &ahead[line(t - 1)] },
                        lam_back: &lam_back[line(t)],
                    };
                    return_line(&mut way, given, &mut of_xs[line(t)], &mut of_steps[line(t)]);
                }
                lines.scatter(of_xs, of_x);
                lines.scatter(of_steps, of_step);
                let of_u: f32 = way.of_u.iter().sum();
                let of_factor: f32 = match pass {
                    Pass::Rows => way.of_factor.iter().sum(),
                    Pass::Columns => 0.0,
                };
                // u = -e^{log_rate}, so du = u dlog_rate; factor = 1 / u.
                *of_rate = (of_u - of_factor / (u * u)) * u;
            },
        );
    let of_state = |m: usize| (0..views).map(|v| of_rate[v * states + m]).sum();
    let of_log_rate = (0..states).map(of_state).collect();
    (
        tensor(of_x, shape.clone()),
        tensor(of_step, shape),
        tensor(of_log_rate, [states].into()),
    )
}
