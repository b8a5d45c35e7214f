//! Semi-global smoothing (Hirschmueller 2008): the costs of a pixel's planes plus those of its neighbours along eight straight
//! paths, where a change of plane costs something, less across an edge of the picture.
//!
//! Along a path that comes from pixel `q` to `p`:
//! `L(p, d) = C(p, d) + min(L(q, d), L(q, d ± 1) + P1, min L(q) + P2') - min L(q)`, with
//! `P2' = max(P1, P2 / (1 + |I(p) - I(q)| / edge))`; a path starts with its cost. The result is the sum over the eight.

use crate::lanes::{least_of, less, more};
use rayon::prelude::*;

/// What a change of plane costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothConfig {
    /// To the next plane.
    pub p1: f32,
    /// To any other, where the picture has no edge.
    pub p2: f32,
    /// Difference in grey, of 256 levels, at which that is halved.
    pub edge: f32,
}

/// Pixels of a row that one thread takes at a time.
const PIXELS_A_TASK: usize = 32;

/// The paths of one pass come from the row before, from these columns.
const FROM: [isize; 3] = [-1, 0, 1];

/// The sums, laid out as `cost`: `[height * width * planes]`, planes innermost. `gray` has `[height * width]` values.
pub fn smooth(
    cost: &[f32],
    gray: &[f32],
    (width, height): (usize, usize),
    planes: usize,
    config: &SmoothConfig,
) -> Vec<f32> {
    let job = Job {
        cost,
        gray,
        width,
        height,
        planes,
        config,
    };
    let mut sum = vec![0.0f32; cost.len()];
    let rows = sum.par_chunks_mut(width * planes).enumerate();
    rows.for_each(|(y, sum)| job.along_row(y, sum));
    job.across_rows(&mut sum, false);
    job.across_rows(&mut sum, true);
    sum
}

struct Job<'a> {
    cost: &'a [f32],
    gray: &'a [f32],
    width: usize,
    height: usize,
    planes: usize,
    config: &'a SmoothConfig,
}

impl Job<'_> {
    fn cost(&self, at: usize) -> &[f32] {
        &self.cost[at * self.planes..(at + 1) * self.planes]
    }

    fn far_penalty(&self, at: usize, from: usize) -> f32 {
        let SmoothConfig { p1, p2, edge } = *self.config;
        let far = p2 / (1.0 + (self.gray[at] - self.gray[from]).abs() / edge);
        more(far, p1)
    }

    /// The two paths along a row.
    fn along_row(&self, y: usize, sum: &mut [f32]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor was asked just now.
            return unsafe { self.along_row_avx2(y, sum) };
        }
        self.along_row_anywhere(y, sum);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn along_row_avx2(&self, y: usize, sum: &mut [f32]) {
        self.along_row_anywhere(y, sum);
    }

    #[inline(always)]
    fn along_row_anywhere(&self, y: usize, sum: &mut [f32]) {
        let mut before = vec![0.0f32; self.planes];
        let mut path = vec![0.0f32; self.planes];
        for backwards in [false, true] {
            let mut least = 0.0;
            for i in 0..self.width {
                let x = if backwards { self.width - 1 - i } else { i };
                let at = y * self.width + x;
                least = if i == 0 {
                    start(self.cost(at), &mut path)
                } else {
                    let from = if backwards { at + 1 } else { at - 1 };
                    let far = self.far_penalty(at, from);
                    step(
                        self.cost(at),
                        &before,
                        least,
                        self.config.p1,
                        far,
                        &mut path,
                    )
                };
                add(&mut sum[x * self.planes..(x + 1) * self.planes], &path);
                std::mem::swap(&mut before, &mut path);
            }
        }
    }

    /// The three paths that come from the row above, or below. A row needs the one before whole; its pixels go side by side.
    fn across_rows(&self, sum: &mut [f32], upwards: bool) {
        let (width, planes) = (self.width, self.planes);
        let paths = FROM.len() * planes;
        let (mut before, mut path) = (vec![0.0f32; width * paths], vec![0.0f32; width * paths]);
        let (mut least_before, mut least) = ([0.0f32; 3].repeat(width), [0.0f32; 3].repeat(width));
        for i in 0..self.height {
            let y = if upwards { self.height - 1 - i } else { i };
            let row = &mut sum[y * width * planes..(y + 1) * width * planes];
            let pixels = path.par_chunks_mut(PIXELS_A_TASK * paths);
            let pixels = pixels.zip(least.par_chunks_mut(PIXELS_A_TASK * FROM.len()));
            let pixels = pixels
                .zip(row.par_chunks_mut(PIXELS_A_TASK * planes))
                .enumerate();
            let row = Row {
                y,
                from: (i > 0).then(|| if upwards { y + 1 } else { y - 1 }),
                before: &before,
                least_before: &least_before,
            };
            pixels.for_each(|(task, ((path, least), sum))| {
                self.pixels(&row, task * PIXELS_A_TASK, path, least, sum);
            });
            std::mem::swap(&mut before, &mut path);
            std::mem::swap(&mut least_before, &mut least);
        }
    }

    /// Some pixels of a row, from column `first` on.
    fn pixels(
        &self,
        row: &Row,
        first: usize,
        path: &mut [f32],
        least: &mut [f32],
        sum: &mut [f32],
    ) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor was asked just now.
            return unsafe { self.pixels_avx2(row, first, path, least, sum) };
        }
        self.pixels_anywhere(row, first, path, least, sum);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn pixels_avx2(
        &self,
        row: &Row,
        first: usize,
        path: &mut [f32],
        least: &mut [f32],
        sum: &mut [f32],
    ) {
        self.pixels_anywhere(row, first, path, least, sum);
    }

    #[inline(always)]
    fn pixels_anywhere(
        &self,
        row: &Row,
        first: usize,
        path: &mut [f32],
        least: &mut [f32],
        sum: &mut [f32],
    ) {
        let pixels = path.chunks_exact_mut(FROM.len() * self.planes);
        let pixels = pixels.zip(least.chunks_exact_mut(FROM.len()));
        let pixels = pixels.zip(sum.chunks_exact_mut(self.planes)).enumerate();
        for (k, ((paths, least), sum)) in pixels {
            let x = first + k;
            let at = row.y * self.width + x;
            let paths = paths.chunks_exact_mut(self.planes).zip(least);
            for ((direction, dx), (path, least)) in FROM.into_iter().enumerate().zip(paths) {
                let from_x = x.checked_add_signed(dx).filter(|&x| x < self.width);
                *least = match (row.from, from_x) {
                    (Some(from_row), Some(from_x)) => {
                        let index = from_x * FROM.len() + direction;
                        let before = &row.before[index * self.planes..(index + 1) * self.planes];
                        let far = self.far_penalty(at, from_row * self.width + from_x);
                        let least_before = row.least_before[index];
                        step(
                            self.cost(at),
                            before,
                            least_before,
                            self.config.p1,
                            far,
                            path,
                        )
                    }
                    _ => start(self.cost(at), path),
                };
                add(sum, path);
            }
        }
    }
}

/// A row that paths come into.
struct Row<'a> {
    y: usize,
    /// The row that they come from; none where they start.
    from: Option<usize>,
    /// Their values there, and the least of each.
    before: &'a [f32],
    least_before: &'a [f32],
}

/// A path's first values are the costs. Gives their least.
#[inline(always)]
fn start(cost: &[f32], path: &mut [f32]) -> f32 {
    path.copy_from_slice(cost);
    least_of(path)
}

/// One step along a path: from the values `before`, whose least is `least`, to `path`. Gives its least.
#[inline(always)]
fn step(cost: &[f32], before: &[f32], least: f32, p1: f32, p2: f32, path: &mut [f32]) -> f32 {
    let planes = cost.len();
    let far = least + p2;
    let (before, path) = (&before[..planes], &mut path[..planes]);
    for d in 1..planes - 1 {
        let near = less(before[d - 1], before[d + 1]) + p1;
        path[d] = cost[d] + (less(less(before[d], far), near) - least);
    }
    let last = planes - 1;
    path[0] = cost[0] + (less(less(before[0], far), before[1] + p1) - least);
    path[last] = cost[last] + (less(less(before[last], far), before[last - 1] + p1) - least);
    least_of(path)
}

#[inline(always)]
fn add(sum: &mut [f32], path: &[f32]) {
    for (sum, path) in sum.iter_mut().zip(path) {
        *sum += path;
    }
}
