//! The plane sweep (Collins 1996): how well each pixel of a keyframe matches its source views at each inverse depth.
//!
//! The hypothesis of pixel `p` on plane `d` is the inverse depth `rho = base(p) + offset[d]`. A source view is sampled
//! there bilinearly and compared by zero-mean normalised cross-correlation over a square window, with the noise of a camera
//! added to both variances: exposure and white balance cancel out, and blank walls match nothing rather than everything. The sums
//! are exact (`window.rs`).
//! Of the sources that see the point the best share counts, since some are occluded (Kang, Szeliski and Chai 2001).

use crate::{
    view::{View, Warp, warp},
    window::{COST_STEPS, Count, Level, Padded, SCORE_STEPS, gray_steps, in_steps, round},
};
use rayon::prelude::*;
use std::ops::Range;

/// Rows of a picture that are worked on at a time.
const BAND: usize = 16;
/// Planes whose costs are gathered before they are written out, so that memory is written a run at a time.
const BLOCK: usize = 8;
/// Below every score: the source does not see the point.
const UNSEEN: f32 = -2.0 * SCORE_STEPS;
/// What a source sees is at least so far before it, as a multiple of the reference's depth.
const LEAST_Z: f32 = 1e-6;
/// An inverse depth cannot be less, in 1/m.
pub(crate) const LEAST_RHO: f32 = 1e-3;

/// How views are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepConfig {
    /// The window is `2 radius + 1` pixels wide; 1 to 4.
    pub radius: usize,
    /// Variance of a camera's noise, in squared grey levels of 256.
    pub noise_var: f32,
    /// Share of the seeing sources that counts, the best first; rounded up.
    pub best: f32,
}

/// The cost of every plane at every pixel: `[height * width * offsets]`, planes innermost; `1 - mean correlation`, 0 to 2,
/// and 1 where no source sees the point. `base` has `[height * width]` inverse depths in 1/m.
pub fn sweep(
    reference: &View,
    sources: &[&View],
    base: Option<&[f32]>,
    offsets: &[f32],
    config: &SweepConfig,
) -> Vec<f32> {
    let rows = 0..reference.size().1;
    sweep_rows(reference, sources, base, offsets, config, rows)
}

/// The same for some rows of the picture: `[rows * width * offsets]`.
pub fn sweep_rows(
    reference: &View,
    sources: &[&View],
    base: Option<&[f32]>,
    offsets: &[f32],
    config: &SweepConfig,
    rows: Range<usize>,
) -> Vec<f32> {
    let width = reference.size().0;
    let planes = offsets.len();
    let warps: Vec<Warp> = sources.iter().map(|s| warp(reference, s)).collect();
    let steps = gray_steps(config.radius);
    let pictures = sources.iter().map(|source| Picture {
        steps: in_steps(&source.gray, steps),
        size: source.size(),
    });
    let pictures: Vec<Picture> = pictures.collect();
    let mut cost = vec![1.0f32; rows.len() * width * planes];
    let job = Job {
        reference,
        pictures: &pictures,
        warps: &warps,
        base,
        offsets,
        config,
    };
    let bands = cost.par_chunks_mut(BAND * width * planes).enumerate();
    bands.for_each(|(band, out)| {
        let first = rows.start + band * BAND;
        let last = (first + BAND).min(rows.end);
        job.costs(first, last, out);
    });
    cost
}

/// Evenly spaced hypotheses. Every device makes them of the same two numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spacing {
    /// The first, in 1/m.
    pub(crate) first: f32,
    /// From one to the next, in 1/m.
    pub(crate) step: f32,
}

impl Spacing {
    /// Of a list of them.
    pub(crate) fn of(offsets: &[f32]) -> Self {
        let first = offsets.first().copied().unwrap_or_default();
        let last = offsets.last().copied().unwrap_or_default();
        let step = (last - first) / offsets.len().saturating_sub(1).max(1) as f32;
        Self { first, step }
    }

    /// One of them, or between two.
    #[inline(always)]
    pub(crate) fn at(self, plane: f32) -> f32 {
        self.first + self.step * plane
    }
}

struct Job<'a> {
    reference: &'a View,
    pictures: &'a [Picture],
    warps: &'a [Warp],
    base: Option<&'a [f32]>,
    offsets: &'a [f32],
    config: &'a SweepConfig,
}

/// A source's grey values in steps.
struct Picture {
    steps: Vec<f32>,
    size: (usize, usize),
}

impl Job<'_> {
    /// Costs of the rows `first..last`, with the processor's wide registers where it has them: the same numbers, faster.
    fn costs(&self, first: usize, last: usize, out: &mut [f32]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor was asked just now.
            unsafe { self.costs_avx2(first, last, out) };
            return;
        }
        self.costs_anywhere(first, last, out);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn costs_avx2(&self, first: usize, last: usize, out: &mut [f32]) {
        self.costs_anywhere(first, last, out);
    }

    #[inline(always)]
    fn costs_anywhere(&self, first: usize, last: usize, out: &mut [f32]) {
        match self.config.radius {
            1 => self.band::<1>(first, last, out),
            2 => self.band::<2>(first, last, out),
            3 => self.band::<3>(first, last, out),
            _ => self.band::<4>(first, last, out),
        }
    }

    /// Costs of the rows `first..last`.
    #[inline(always)]
    fn band<const R: usize>(&self, first: usize, last: usize, out: &mut [f32]) {
        let (width, height) = self.reference.size();
        let planes = self.offsets.len();
        let pixels = (last - first) * width;
        // Rows that the windows reach.
        let (above, below) = (first.saturating_sub(R), (last + R).min(height));
        let steps = gray_steps(R);
        let gray = in_steps(&self.reference.gray[above * width..below * width], steps);
        let gray: Vec<i32> = gray.iter().map(|&gray| gray as i32).collect();
        let noise = self.config.noise_var * steps * steps;
        let span = |y: usize| {
            (y.saturating_sub(R) - above) * width..((y + R + 1).min(height) - above) * width
        };

        let mut column = [
            Padded::<R>::new(width),
            Padded::new(width),
            Padded::new(width),
        ];
        // Per pixel: the size of its window, the reference's mean there, 1 / sqrt(variance sum with noise) in steps of a score.
        let mut counts = vec![Count::default(); pixels];
        let mut levels = vec![Level::default(); pixels];
        let mut scales = vec![0.0f32; pixels];
        let squares: Vec<i32> = gray.iter().map(|v| v * v).collect();
        for y in first..last {
            let at = (y - first) * width;
            column[0].sum_rows(&gray[span(y)], width);
            column[1].sum_rows(&squares[span(y)], width);
            let rows = span(y).len() / width;
            for x in 0..width {
                let columns = (x + R + 1).min(width) - x.saturating_sub(R);
                let count = Count::new(rows * columns);
                let level = Level::new(column[0].window(x), count);
                let variance = level.variance(column[1].window(x), count) + count.times(noise);
                counts[at + x] = count;
                levels[at + x] = level;
                scales[at + x] = SCORE_STEPS / variance.sqrt();
            }
        }

        let reach = (below - above) * width;
        let (mut warped, mut warped_squares, mut products) =
            (vec![0i32; reach], vec![0i32; reach], vec![0i32; reach]);
        let mut seen = vec![0.0f32; reach];
        let most = ((self.pictures.len() as f32 * self.config.best).ceil() as usize)
            .clamp(1, self.pictures.len().max(1));
        let mut best = vec![UNSEEN; most * pixels];
        let mut count = vec![0.0f32; pixels];
        let mut block = vec![1.0f32; BLOCK * pixels];
        let spacing = Spacing::of(self.offsets);
        for (block_index, offsets) in self.offsets.chunks(BLOCK).enumerate() {
            for plane in 0..offsets.len() {
                let offset = spacing.at((block_index * BLOCK + plane) as f32);
                best.fill(UNSEEN);
                count.fill(0.0);
                for (source, warp) in self.pictures.iter().zip(self.warps) {
                    for y in above..below {
                        let row = (y - above) * width..(y - above + 1) * width;
                        let base = self.base.map(|base| &base[y * width..(y + 1) * width]);
                        warp_row(
                            source,
                            warp,
                            y,
                            base,
                            offset,
                            &mut warped[row.clone()],
                            &mut seen[row.clone()],
                        );
                        let (gray, warped) = (&gray[row.clone()], &warped[row.clone()]);
                        let (squares, products) =
                            (&mut warped_squares[row.clone()], &mut products[row]);
                        for x in 0..width {
                            squares[x] = warped[x] * warped[x];
                            products[x] = warped[x] * gray[x];
                        }
                    }
                    for y in first..last {
                        column[0].sum_rows(&warped[span(y)], width);
                        column[1].sum_rows(&warped_squares[span(y)], width);
                        column[2].sum_rows(&products[span(y)], width);
                        let at = (y - first) * width;
                        let here = at..at + width;
                        let seen = &seen[(y - above) * width..(y - above + 1) * width];
                        let (counts, levels, scales) = (
                            &counts[here.clone()],
                            &levels[here.clone()],
                            &scales[here.clone()],
                        );
                        let count = &mut count[here];
                        let mut score = [0.0f32; 64];
                        for from in (0..width).step_by(64) {
                            let n = (width - from).min(64);
                            for (i, score) in score[..n].iter_mut().enumerate() {
                                let x = from + i;
                                let (s, ss, rs) = (
                                    column[0].window(x),
                                    column[1].window(x),
                                    column[2].window(x),
                                );
                                let n = counts[x];
                                let level = Level::new(s, n);
                                let covariance = level.covariance(levels[x], rs, n);
                                let variance = level.variance(ss, n) + n.times(noise);
                                let correlation = covariance * scales[x] / variance.sqrt();
                                *score = if seen[x] > 0.0 {
                                    round(correlation)
                                } else {
                                    UNSEEN
                                };
                                count[x] += seen[x];
                            }
                            // Keeps the best in order: each pushes the lesser one down.
                            for rank in 0..most {
                                let best = &mut best[rank * pixels + at + from..][..n];
                                for (score, best) in score[..n].iter_mut().zip(best) {
                                    let (high, low) = if *score > *best {
                                        (*score, *best)
                                    } else {
                                        (*best, *score)
                                    };
                                    *best = high;
                                    *score = low;
                                }
                            }
                        }
                    }
                }
                let block = &mut block[plane * pixels..(plane + 1) * pixels];
                block.fill(0.0);
                for rank in 0..most {
                    let best = &best[rank * pixels..(rank + 1) * pixels];
                    for ((sum, &best), &count) in block.iter_mut().zip(best).zip(&count) {
                        *sum += if (rank as f32) < count * self.config.best {
                            best
                        } else {
                            0.0
                        };
                    }
                }
                for (cost, &count) in block.iter_mut().zip(&count) {
                    let counted = (count * self.config.best).ceil();
                    *cost = if count > 0.0 {
                        let mean = *cost / counted * (1.0 / SCORE_STEPS);
                        round((1.0 - mean) * COST_STEPS) * (1.0 / COST_STEPS)
                    } else {
                        1.0
                    };
                }
            }
            let run = offsets.len();
            for (pixel, out) in out.chunks_exact_mut(planes).enumerate() {
                let out = &mut out[block_index * BLOCK..][..run];
                for (plane, out) in out.iter_mut().enumerate() {
                    *out = block[plane * pixels + pixel];
                }
            }
        }
    }
}

/// Samples one row of a source at the hypotheses of a plane; `seen` is 1 where the sample lies in the source, else 0 and the
/// nearest pixel of its border stands in.
#[inline(always)]
fn warp_row(
    source: &Picture,
    warp: &Warp,
    y: usize,
    base: Option<&[f32]>,
    offset: f32,
    out: &mut [i32],
    seen: &mut [f32],
) {
    let width = out.len();
    let (columns, rows) = source.size;
    // A hair inside, so that the right and lower neighbour exist.
    let (last_u, last_v) = (columns as f32 - 1.001, rows as f32 - 1.001);
    let Warp { a, b } = warp;
    let y = y as f32;
    let start = [a[1] * y + a[2], a[4] * y + a[5], a[7] * y + a[8]];
    let gray = &source.steps[..columns * rows];
    let (mut at, mut fu, mut fv) = ([0u32; 64], [0.0f32; 64], [0.0f32; 64]);
    for from in (0..width).step_by(64) {
        let n = (width - from).min(64);
        // Always all 64, and no index that could be out of bounds: that is what makes this loop one of vectors.
        let mut rhos = [offset; 64];
        if let Some(base) = base {
            for (rho, base) in rhos.iter_mut().zip(&base[from..from + n]) {
                *rho = (base + offset).max(LEAST_RHO);
            }
        }
        let mut inside = [0.0f32; 64];
        for i in 0..64 {
            let (x, rho) = ((from as i32 + i as i32) as f32, rhos[i]);
            let z = a[6] * x + start[2] + b[2] * rho;
            let (u, v) = (
                a[0] * x + start[0] + b[0] * rho,
                a[3] * x + start[1] + b[1] * rho,
            );
            // 0 <= u / z <= last with z > 0, without the division.
            let room = u.min(last_u * z - u).min(v).min(last_v * z - v);
            inside[i] = if room.min(z - LEAST_Z) >= 0.0 {
                1.0
            } else {
                0.0
            };
            let inv = 1.0 / z.max(LEAST_Z);
            let (u, v) = (u * inv, v * inv);
            let (cu, cv) = (u.max(0.0).min(last_u), v.max(0.0).min(last_v));
            // SAFETY: clamped to the picture just now, NaN included (max gives 0).
            let (iu, iv): (i32, i32) = unsafe { (cu.to_int_unchecked(), cv.to_int_unchecked()) };
            fu[i] = cu - iu as f32;
            fv[i] = cv - iv as f32;
            at[i] = (iv * columns as i32 + iu) as u32;
        }
        seen[from..from + n].copy_from_slice(&inside[..n]);
        for (i, out) in out[from..from + n].iter_mut().enumerate() {
            let at = at[i] as usize;
            // SAFETY: `at` has a right and a lower neighbour in the picture: see `last_u` and `last_v`.
            let (p, q, r, s) = unsafe {
                (
                    *gray.get_unchecked(at),
                    *gray.get_unchecked(at + 1),
                    *gray.get_unchecked(at + columns),
                    *gray.get_unchecked(at + columns + 1),
                )
            };
            let top = p + (q - p) * fu[i];
            let bottom = r + (s - r) * fu[i];
            let sample = round(top + (bottom - top) * fv[i]);
            // SAFETY: between samples of a picture, some thousands of steps at most.
            *out = unsafe { sample.to_int_unchecked() };
        }
    }
}
