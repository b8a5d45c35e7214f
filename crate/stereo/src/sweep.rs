//! The plane sweep (Collins 1996): how well each pixel of a keyframe matches its source views at each inverse depth.
//!
//! The hypothesis of pixel `p` on plane `d` is the inverse depth `rho = base(p) + offset[d]`. A source view is sampled
//! there bilinearly and compared by zero-mean normalised cross-correlation over a square window, with the noise of a camera
//! added to both variances: exposure and white balance cancel out, and blank walls match nothing rather than everything.
//! Of the sources that see the point the best share counts, since some are occluded (Kang, Szeliski and Chai 2001).

use crate::view::{View, Warp, warp};
use rayon::prelude::*;
use std::ops::Range;

/// Rows of a picture that are worked on at a time.
const BAND: usize = 16;
/// Planes whose costs are gathered before they are written out, so that memory is written a run at a time.
const BLOCK: usize = 8;
/// Below every correlation: the source does not see the point.
const UNSEEN: f32 = -2.0;
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
    let mut cost = vec![1.0f32; rows.len() * width * planes];
    let job = Job {
        reference,
        sources,
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

struct Job<'a> {
    reference: &'a View,
    sources: &'a [&'a View],
    warps: &'a [Warp],
    base: Option<&'a [f32]>,
    offsets: &'a [f32],
    config: &'a SweepConfig,
}

/// A row with room for a window beyond both ends, filled with zeros there.
struct Padded<const R: usize>(Vec<f32>);

impl<const R: usize> Padded<R> {
    fn new(width: usize) -> Self {
        Self(vec![0.0; width + 2 * R])
    }

    /// Sums some rows of `width` values.
    #[inline(always)]
    fn sum_rows(&mut self, rows: &[f32], width: usize) {
        let to = &mut self.0[R..R + width];
        let mut rows = rows.chunks_exact(width);
        if let Some(first) = rows.next() {
            to.copy_from_slice(first);
        }
        for row in rows {
            for (to, from) in to.iter_mut().zip(row) {
                *to += from;
            }
        }
    }

    #[inline(always)]
    fn window(&self, x: usize) -> f32 {
        let mut sum = 0.0;
        for k in 0..2 * R + 1 {
            sum += self.0[x + k];
        }
        sum
    }
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
        let gray = &self.reference.gray[above * width..below * width];
        let span = |y: usize| {
            (y.saturating_sub(R) - above) * width..((y + R + 1).min(height) - above) * width
        };

        let mut column = [
            Padded::<R>::new(width),
            Padded::new(width),
            Padded::new(width),
        ];
        // Per pixel: 1 / window size, mean of the reference, 1 / sqrt(variance sum with noise).
        let (mut per_count, mut ref_sum, mut ref_scale) = (
            vec![0.0f32; pixels],
            vec![0.0f32; pixels],
            vec![0.0f32; pixels],
        );
        let squares: Vec<f32> = gray.iter().map(|v| v * v).collect();
        for y in first..last {
            let at = (y - first) * width;
            column[0].sum_rows(&gray[span(y)], width);
            column[1].sum_rows(&squares[span(y)], width);
            let rows = span(y).len() / width;
            for x in 0..width {
                let columns = (x + R + 1).min(width) - x.saturating_sub(R);
                let count = (rows * columns) as f32;
                let (sum, sum_of_squares) = (column[0].window(x), column[1].window(x));
                let variance =
                    (sum_of_squares - sum * sum / count).max(0.0) + self.config.noise_var * count;
                per_count[at + x] = 1.0 / count;
                ref_sum[at + x] = sum;
                ref_scale[at + x] = 1.0 / variance.sqrt();
            }
        }

        let reach = (below - above) * width;
        let (mut warped, mut warped_squares, mut products) = (
            vec![0.0f32; reach],
            vec![0.0f32; reach],
            vec![0.0f32; reach],
        );
        let mut seen = vec![0.0f32; reach];
        let most = ((self.sources.len() as f32 * self.config.best).ceil() as usize)
            .clamp(1, self.sources.len().max(1));
        let mut best = vec![UNSEEN; most * pixels];
        let mut count = vec![0.0f32; pixels];
        let mut block = vec![1.0f32; BLOCK * pixels];
        for (block_index, offsets) in self.offsets.chunks(BLOCK).enumerate() {
            for (plane, &offset) in offsets.iter().enumerate() {
                best.fill(UNSEEN);
                count.fill(0.0);
                for (source, warp) in self.sources.iter().zip(self.warps) {
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
                        let (per_count, ref_sum, ref_scale) = (
                            &per_count[here.clone()],
                            &ref_sum[here.clone()],
                            &ref_scale[here.clone()],
                        );
                        let count = &mut count[here];
                        let noise = self.config.noise_var;
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
                                let covariance = rs - s * ref_sum[x] * per_count[x];
                                let variance =
                                    (ss - s * s * per_count[x]).max(0.0) + noise / per_count[x];
                                let correlation = covariance * ref_scale[x] / variance.sqrt();
                                *score = if seen[x] > 0.0 { correlation } else { UNSEEN };
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
                        1.0 - *cost / counted
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
    source: &View,
    warp: &Warp,
    y: usize,
    base: Option<&[f32]>,
    offset: f32,
    out: &mut [f32],
    seen: &mut [f32],
) {
    let width = out.len();
    let (columns, rows) = source.size();
    // A hair inside, so that the right and lower neighbour exist.
    let (last_u, last_v) = (columns as f32 - 1.001, rows as f32 - 1.001);
    let Warp { a, b } = warp;
    let y = y as f32;
    let start = [a[1] * y + a[2], a[4] * y + a[5], a[7] * y + a[8]];
    let gray = &source.gray[..columns * rows];
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
            let inv = 1.0 / z;
            let u = (a[0] * x + start[0] + b[0] * rho) * inv;
            let v = (a[3] * x + start[1] + b[1] * rho) * inv;
            let (cu, cv) = (u.max(0.0).min(last_u), v.max(0.0).min(last_v));
            // Inside is what no clamp moved.
            let is = (z > 1e-6) & (u == cu) & (v == cv);
            inside[i] = if is { 1.0 } else { 0.0 };
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
            *out = top + (bottom - top) * fv[i];
        }
    }
}
