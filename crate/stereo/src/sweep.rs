//! The plane sweep (Collins 1996): how well each pixel of a keyframe matches its source views at each inverse depth.
//!
//! The hypothesis of pixel `p` on plane `d` is the inverse depth `rho = base(p) + offset[d]`. A source view is sampled
//! there bilinearly and compared by zero-mean normalised cross-correlation over a square window, with the noise of a camera
//! added to both variances: exposure and white balance cancel out, and blank walls match nothing rather than everything. The sums
//! are exact (`window.rs`).
//! Of the sources that see the point the best share counts, since some are occluded (Kang, Szeliski and Chai 2001).

use crate::{
    lanes::{LANES, round},
    sample::Picture,
    view::{View, Warp, warp},
    window::{
        COST_STEPS, Count, Level, Padded, SCORE_STEPS, Windows, gray_steps, in_steps, window,
    },
};
use rayon::prelude::*;
use std::ops::Range;

/// Rows of a picture that are worked on at a time.
const BAND: usize = 16;
/// Planes whose costs are gathered before they are written out, so that memory is written a run at a time.
const BLOCK: usize = 8;
/// Below every score: the source does not see the point.
const UNSEEN: f32 = -2.0 * SCORE_STEPS;
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
    let pictures: Vec<Picture> = sources.iter().map(|s| Picture::new(s, steps)).collect();
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
        // Rows are filled up with zeros to whole registers, or the loops over them would end pixel by pixel.
        let wide = width.next_multiple_of(LANES);
        let pixels = (last - first) * wide;
        // Rows that the windows reach.
        let (above, below) = (first.saturating_sub(R), (last + R).min(height));
        let steps = gray_steps(R);
        let mut gray = vec![0i32; (below - above) * wide];
        for (to, y) in gray.chunks_exact_mut(wide).zip(above..below) {
            let row = in_steps(&self.reference.gray[y * width..(y + 1) * width], steps);
            for (to, gray) in to.iter_mut().zip(row) {
                *to = gray as i32;
            }
        }
        let noise = self.config.noise_var * steps * steps;
        let span = |y: usize| {
            (y.saturating_sub(R) - above) * wide..((y + R + 1).min(height) - above) * wide
        };

        let mut column = [Padded::<R>::new(wide), Padded::new(wide), Padded::new(wide)];
        let mut windows = Windows::new(pixels);
        let squares: Vec<i32> = gray.iter().map(|v| v * v).collect();
        let mut summed = 0..0;
        for y in first..last {
            let at = (y - first) * wide;
            column[0].slide(&gray, &summed, &span(y), wide);
            column[1].slide(&squares, &summed, &span(y), wide);
            summed = span(y);
            let rows = span(y).len() / wide;
            for x in 0..width {
                let columns = (x + R + 1).min(width) - x.saturating_sub(R);
                let count = Count::new(rows * columns);
                // SAFETY: the part is of one pixel.
                let sum = |column: &Padded<R>| unsafe { window::<R>(column.part(x, 1), 0) };
                let level = Level::new(sum(&column[0]), count);
                let variance = level.variance(sum(&column[1]), count) + count.times(noise);
                windows.set(at + x, count, level, SCORE_STEPS / variance.sqrt());
            }
        }

        let reach = (below - above) * wide;
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
                for (index, (source, warp)) in self.pictures.iter().zip(self.warps).enumerate() {
                    // So many are above `UNSEEN` at most, with this one.
                    let ranks = most.min(index + 1);
                    for y in above..below {
                        let row = (y - above) * wide..(y - above + 1) * wide;
                        let base = self.base.map(|base| &base[y * width..(y + 1) * width]);
                        source.sample_row(
                            warp,
                            y,
                            base,
                            offset,
                            &mut warped[row.clone()][..width],
                            &mut seen[row.clone()][..width],
                        );
                        let (gray, warped) = (&gray[row.clone()], &warped[row.clone()]);
                        let (squares, products) =
                            (&mut warped_squares[row.clone()], &mut products[row]);
                        for x in 0..wide {
                            squares[x] = warped[x] * warped[x];
                            products[x] = warped[x] * gray[x];
                        }
                    }
                    column.iter_mut().for_each(Padded::clear);
                    let mut summed = 0..0;
                    for y in first..last {
                        let rows = span(y);
                        column[0].slide(&warped, &summed, &rows, wide);
                        column[1].slide(&warped_squares, &summed, &rows, wide);
                        column[2].slide(&products, &summed, &rows, wide);
                        summed = rows;
                        let at = (y - first) * wide;
                        let here = at..at + wide;
                        let seen = &seen[(y - above) * wide..(y - above + 1) * wide];
                        let count = &mut count[here];
                        let mut score = [0.0f32; 64];
                        for from in (0..wide).step_by(64) {
                            let n = (wide - from).min(64);
                            let windows = windows.part(at + from, n);
                            let [gray, squares, products] = &column;
                            let (gray, squares, products) = (
                                gray.part(from, n),
                                squares.part(from, n),
                                products.part(from, n),
                            );
                            let (seen, count) = (&seen[from..][..n], &mut count[from..][..n]);
                            let score = &mut score[..n];
                            for i in 0..n {
                                // SAFETY: the parts are of `n` pixels, as are the scores.
                                let (s, ss, rs) = unsafe {
                                    (
                                        window::<R>(gray, i),
                                        window::<R>(squares, i),
                                        window::<R>(products, i),
                                    )
                                };
                                let pixels = windows.count(i);
                                let level = Level::new(s, pixels);
                                let covariance = level.covariance(windows.level(i), rs, pixels);
                                let variance = level.variance(ss, pixels) + pixels.times(noise);
                                let correlation = covariance * windows.scale[i] / variance.sqrt();
                                score[i] = if seen[i] > 0.0 {
                                    round(correlation)
                                } else {
                                    UNSEEN
                                };
                                count[i] += seen[i];
                            }
                            // Keeps the best in order: each pushes the lesser one down.
                            for rank in 0..ranks {
                                let best = &mut best[rank * pixels + at + from..][..n];
                                for (score, best) in score.iter_mut().zip(best) {
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
            for (index, out) in out.chunks_exact_mut(planes).enumerate() {
                let pixel = index / width * wide + index % width;
                let out = &mut out[block_index * BLOCK..][..run];
                for (plane, out) in out.iter_mut().enumerate() {
                    *out = block[plane * pixels + pixel];
                }
            }
        }
    }
}
