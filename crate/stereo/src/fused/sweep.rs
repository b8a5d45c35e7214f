//! The plane sweep as three kernels a chunk of planes: every source warped into the reference, windows correlated, the
//! best share of the sources kept.
//!
//! Between them lie samples and scores of 16 bits, two planes in one: a bilinear sample is made once and then used by
//! all windows it falls into. A picture of samples has a frame of zeros as wide as a window reaches, so that windows
//! need no borders: what lies outside adds nothing to any sum.

use super::{
    pack::{high, high_steps, low, low_steps, pack},
    window::{mean, variance, window},
};
use crate::window::{COST_STEPS, SCORE_STEPS};
use cubecl::prelude::*;

/// Two planes at a pixel.
type Two = Vector<f32, Const<2>>;

/// Whole numbers at two planes.
type Whole = Vector<i32, Const<2>>;

/// Four planes at a pixel.
pub(super) type Four = Vector<f32, Const<4>>;

/// Four packed costs at a pixel.
pub(super) type Packed = Vector<i32, Const<2>>;

/// Threads of a workgroup of the warp, along x and y.
pub(super) const TILE: (u32, u32) = (16, 4);

/// Rows that a thread of the warp does.
pub(super) const ROWS: u32 = 4;

/// Threads of a workgroup of the windows, along x.
pub(super) const STRIP: u32 = 32;

/// Windows beside each other that a thread correlates: they share most of their samples.
pub(super) const WIDE: usize = 2;

/// Rows that a thread of the windows walks down.
pub(super) const SEGMENT: u32 = 32;

/// Threads of a workgroup where a thread is a pixel.
pub(super) const THREADS: u32 = 64;

/// Numbers that a source has in `warps`: `a` (9) and `b` (3) of [`crate::view::Warp`], the largest x and y that can be
/// sampled, the length of a row, and the place among the pictures.
pub(super) const WARP: usize = 16;

/// The score of a source that does not see the point, in steps.
const NONE: f32 = -32_000.0;

/// A thread is a source and some pixels of the framed reference below each other; it goes through the planes of the chunk.
///
/// `warped`: `[pairs, sources, height + 2 radius, width + 2 radius]`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub(super) fn warp_kernel(
    pictures: &[i32],
    warps: &[f32],
    base: &[f32],
    warped: &mut [i32],
    width: u32,
    height: u32,
    slot: u32,
    first_pair: u32,
    pairs: u32,
    first_rho: f32,
    step: f32,
    #[comptime] radius: u32,
    #[comptime] has_base: bool,
) {
    let across = width + 2 * radius;
    let down = height + 2 * radius;
    let x = CUBE_POS_X * CUBE_DIM_X + UNIT_POS_X;
    if x >= across {
        terminate!();
    }
    let source = CUBE_POS_Z;
    let stride = (CUBE_COUNT_Z * down * across) as usize;
    let w = source as usize * WARP;
    let xf = x as f32 - comptime!(radius as f32);
    let ux = warps[w] * xf;
    let vx = warps[w + 3] * xf;
    let zx = warps[w + 6] * xf;
    let uy = warps[w + 1];
    let vy = warps[w + 4];
    let zy = warps[w + 7];
    let bu = warps[w + 9];
    let bv = warps[w + 10];
    let bz = warps[w + 11];
    let most_x = warps[w + 12];
    let most_y = warps[w + 13];
    let pitch = warps[w + 14] as i32;
    let start = warps[w + 15] as i32 * slot as i32;
    for row in 0..ROWS {
        let y = (CUBE_POS_Y * ROWS + row) * CUBE_DIM_Y + UNIT_POS_Y;
        if y < down {
            let inside = x >= radius && y >= radius && x < width + radius && y < height + radius;
            let mut from = 0.0f32;
            if comptime!(has_base) && inside {
                from = base[((y - radius) * width + x - radius) as usize];
            }
            let yf = y as f32 - comptime!(radius as f32);
            let u0 = ux + (uy * yf + warps[w + 2]);
            let v0 = vx + (vy * yf + warps[w + 5]);
            let z0 = zx + (zy * yf + warps[w + 8]);
            let mut to = ((source * down + y) * across + x) as usize;
            for pair in 0..pairs {
                let mut out = 0i32;
                if inside {
                    let plane = ((first_pair + pair) * 2) as f32;
                    let mut values = Two::new(0.0f32);
                    #[unroll]
                    for p in 0..2usize {
                        let mut rho = first_rho + step * (plane + comptime!(p as f32));
                        if comptime!(has_base) {
                            rho = (rho + from).max(1e-3f32);
                        }
                        let inv = 1.0f32 / (z0 + bz * rho).max(1e-6f32);
                        let u = ((u0 + bu * rho) * inv).max(0.0f32).min(most_x);
                        let v = ((v0 + bv * rho) * inv).max(0.0f32).min(most_y);
                        let iu = u as i32;
                        let iv = v as i32;
                        let fu = u - iu as f32;
                        let fv = v - iv as f32;
                        let at = start + iv * pitch + iu;
                        let upper = pictures[at as usize];
                        let lower = pictures[(at + pitch) as usize];
                        let top = low(upper) + (high(upper) - low(upper)) * fu;
                        let bottom = low(lower) + (high(lower) - low(lower)) * fu;
                        values.insert(p, top + (bottom - top) * fv);
                    }
                    out = pack(values.extract(0usize), values.extract(1usize));
                }
                warped[to] = out;
                to += stride;
            }
        }
    }
}

#[cube]
fn unpack(pair: i32) -> Whole {
    let mut values = Whole::new(low_steps(pair));
    values.insert(1usize, high_steps(pair));
    values
}

/// ZNCC of every window. A thread is `wide` columns, a segment of rows, a source and a pair of planes; it walks down the
/// segment with the sums of the last `2 radius + 1` rows of its windows at hand.
///
/// `gray`: the framed reference, each pixel with its right neighbour. `noise`: its variance in squared steps. `scores`: `[pairs, sources, height, width]`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub(super) fn window_kernel(
    warped: &[i32],
    gray: &[i32],
    warps: &[f32],
    base: &[f32],
    scores: &mut [i32],
    width: u32,
    height: u32,
    sources: u32,
    first_pair: u32,
    first_rho: f32,
    step: f32,
    noise: f32,
    #[comptime] radius: u32,
    #[comptime] wide: usize,
    #[comptime] has_base: bool,
) {
    let side = comptime!((2 * radius + 1) as usize);
    let x = (CUBE_POS_X * CUBE_DIM_X + UNIT_POS_X) * comptime!(wide as u32);
    if x >= width {
        terminate!();
    }
    let source = CUBE_POS_Z % sources;
    let pair = CUBE_POS_Z / sources;
    let top = CUBE_POS_Y * SEGMENT;
    let end = (top + SEGMENT).min(height);
    let across = width + 2 * radius;
    let down = height + 2 * radius;
    let w = source as usize * WARP;
    let ux = warps[w];
    let uy = warps[w + 1];
    let vx = warps[w + 3];
    let vy = warps[w + 4];
    let zx = warps[w + 6];
    let zy = warps[w + 7];
    let bu = warps[w + 9];
    let bv = warps[w + 10];
    let bz = warps[w + 11];
    let most_x = warps[w + 12];
    let most_y = warps[w + 13];
    let mut ring_s = Array::<Whole>::new(comptime!(side * wide));
    let mut ring_ss = Array::<Whole>::new(comptime!(side * wide));
    let mut ring_rs = Array::<Whole>::new(comptime!(side * wide));
    let mut ring_r = Array::<i32>::new(comptime!(side * wide));
    let mut ring_rr = Array::<i32>::new(comptime!(side * wide));
    let columns = comptime!(side + wide - 1);
    let mut column_s = Array::<Whole>::new(columns);
    let mut column_r = Array::<i32>::new(comptime!(columns + 1));
    let rounds = (end - top + 2 * radius).div_ceil(2 * radius + 1);
    let from = CUBE_POS_Z * across * down + x;
    let to = CUBE_POS_Z * width * height + x;
    let plane = ((first_pair + pair) * 2) as f32;
    let mut planes = Two::new(first_rho + step * plane);
    planes.insert(1usize, first_rho + step * (plane + 1.0f32));
    for round in 0..rounds {
        #[unroll]
        for j in 0..side {
            // The row of the framed picture that comes in below.
            let below = top + round * (2 * radius + 1) + j as u32;
            let row = below.min(down - 1) * across;
            let line = (from + row) as usize;
            let shade = (row + x) as usize;
            #[unroll]
            for k in 0..comptime!(columns.div_ceil(2)) {
                let two = gray[shade + comptime!(2 * k)];
                column_r[comptime!(2 * k)] = low_steps(two);
                column_r[comptime!(2 * k + 1)] = high_steps(two);
            }
            #[unroll]
            for k in 0..columns {
                column_s[k] = unpack(warped[line + k]);
            }
            // Sums over the columns that all windows of the thread have in common, then those that each has beside.
            let mut s = Whole::new(0i32);
            let mut ss = Whole::new(0i32);
            let mut rs = Whole::new(0i32);
            let mut r = 0i32;
            let mut rr = 0i32;
            #[unroll]
            for k in comptime!(wide - 1)..side {
                let v = column_s[k];
                let g = column_r[k];
                s += v;
                ss += v * v;
                rs += v * Whole::new(g);
                r += g;
                rr += g * g;
            }
            #[unroll]
            for i in 0..wide {
                let mut own_s = s;
                let mut own_ss = ss;
                let mut own_rs = rs;
                let mut own_r = r;
                let mut own_rr = rr;
                #[unroll]
                for k in 0..comptime!(wide - 1) {
                    let beside = comptime!(if k + i + 1 < wide {
                        i + k
                    } else {
                        side + k + i + 1 - wide
                    });
                    let v = column_s[beside];
                    let g = column_r[beside];
                    own_s += v;
                    own_ss += v * v;
                    own_rs += v * Whole::new(g);
                    own_r += g;
                    own_rr += g * g;
                }
                let kept = comptime!(j * wide + i);
                ring_s[kept] = own_s;
                ring_ss[kept] = own_ss;
                ring_rs[kept] = own_rs;
                ring_r[kept] = own_r;
                ring_rr[kept] = own_rr;
            }
            if below >= top + 2 * radius && below < end + 2 * radius {
                let y = below - 2 * radius;
                let yf = y as f32;
                let rows = window(y, height, radius);
                #[unroll]
                for i in 0..wide {
                    let mut s = ring_s[i];
                    let mut ss = ring_ss[i];
                    let mut rs = ring_rs[i];
                    let mut r = ring_r[i];
                    let mut rr = ring_rr[i];
                    #[unroll]
                    for k in 1..side {
                        s += ring_s[comptime!(k * wide + i)];
                        ss += ring_ss[comptime!(k * wide + i)];
                        rs += ring_rs[comptime!(k * wide + i)];
                        r += ring_r[comptime!(k * wide + i)];
                        rr += ring_rr[comptime!(k * wide + i)];
                    }
                    let own_x = x + comptime!(i as u32);
                    let n = rows * window(own_x.min(width - 1), width, radius);
                    let count = n as i32;
                    let per = 1.0f32 / n as f32;
                    let window_noise = noise * n as f32;
                    let mean_r = mean(r, per);
                    let beside_r = r - count * mean_r;
                    let var_r = variance(r, mean_r, rr, count, per) + window_noise;
                    let scale = SCORE_STEPS / var_r.sqrt();
                    let mut steps = Two::new(0.0f32);
                    #[unroll]
                    for p in 0..2usize {
                        let sum = s.extract(p);
                        let mean_s = mean(sum, per);
                        let beside = sum - count * mean_s;
                        let var_s = variance(sum, mean_s, ss.extract(p), count, per);
                        let products = rs.extract(p) - mean_s * beside_r - mean_r * sum;
                        let covariance = products as f32 - beside as f32 * beside_r as f32 * per;
                        let deviation = (var_s + window_noise).sqrt();
                        steps.insert(p, covariance * scale / deviation);
                    }
                    let mut rho = planes;
                    if comptime!(has_base) {
                        let from = base[(y * width + own_x.min(width - 1)) as usize];
                        rho = max(planes + Two::new(from), Two::new(1e-3f32));
                    }
                    let xf = own_x as f32;
                    let z = Two::new(zx * xf + (zy * yf + warps[w + 8])) + Two::new(bz) * rho;
                    let u = Two::new(ux * xf + (uy * yf + warps[w + 2])) + Two::new(bu) * rho;
                    let v = Two::new(vx * xf + (vy * yf + warps[w + 5])) + Two::new(bv) * rho;
                    // 0 <= u / z <= most with z > 0, without the division.
                    let room_x = min(u, Two::new(most_x) * z - u);
                    let room_y = min(v, Two::new(most_y) * z - v);
                    let room = min(min(room_x, room_y), z - Two::new(1e-6f32));
                    let sees = room.greater_equal(&Two::new(0.0f32));
                    let out = select_many(sees, steps, Two::new(NONE));
                    if own_x < width {
                        scores[(to + y * width) as usize + i] =
                            pack(out.extract(0usize), out.extract(1usize));
                    }
                }
            }
        }
    }
}

/// 1 - the mean of the best share of the scores. A thread is a pixel and four planes; it holds the best `kept` scores in order.
///
/// `cost`: `[pixels, groups]`, a row of all planes for every pixel.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub(super) fn best_kernel(
    scores: &[i32],
    cost: &mut [Packed],
    pixels: u32,
    sources: u32,
    groups: u32,
    first_group: u32,
    best: f32,
    #[comptime] kept: usize,
) {
    let at = CUBE_POS_X * THREADS + UNIT_POS_X;
    if at >= pixels {
        terminate!();
    }
    let group = CUBE_POS_Y;
    let mut top = Array::<Four>::new(kept);
    #[unroll]
    for k in 0..kept {
        top[k] = Four::new(NONE);
    }
    let mut seen = Four::new(0.0f32);
    let mut from = 2 * group * sources * pixels + at;
    for _ in 0..sources {
        let a = scores[from as usize];
        let b = scores[(from + sources * pixels) as usize];
        from += pixels;
        let mut score = Four::new(low(a));
        score.insert(1usize, high(a));
        score.insert(2usize, low(b));
        score.insert(3usize, high(b));
        let sees = score.greater_than(&Four::new(NONE));
        seen += select_many(sees, Four::new(1.0f32), Four::new(0.0f32));
        #[unroll]
        for k in 0..kept {
            let held = top[k];
            top[k] = max(held, score);
            score = min(held, score);
        }
    }
    let share = max((seen * Four::new(best)).ceil(), Four::new(1.0f32));
    let mut sum = Four::new(0.0f32);
    #[unroll]
    for k in 0..kept {
        let counts = share.greater_than(&Four::new(k as f32));
        sum += select_many(counts, top[k], Four::new(0.0f32));
    }
    let known = seen.greater_than(&Four::new(0.0f32));
    let mean = select_many(known, sum / share, Four::new(0.0f32));
    let out = (Four::new(1.0f32) - mean * Four::new(1.0f32 / SCORE_STEPS)) * Four::new(COST_STEPS);
    let mut packed = Packed::new(pack(out.extract(0usize), out.extract(1usize)));
    packed.insert(1usize, pack(out.extract(2usize), out.extract(3usize)));
    cost[(at * groups + first_group + group) as usize] = packed;
}
