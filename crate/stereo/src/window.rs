//! Exact sums over windows.
//!
//! A variance is the difference of two large sums: of 25 bright pixels the squares come to over a million, and what noise leaves of it on a blank wall
//! is two or three. In `f32` as it comes, rounding decides there, another device rounds otherwise, and smoothing carries that
//! over the picture. So pictures are whole steps of a grey level, sums are whole numbers, and both sums are moved to
//! the window's own mean, exactly, before they are subtracted. All devices do the same.

use crate::lanes::{round, whole};
use std::ops::Range;

/// The middle of the grey scale, from which steps are counted.
pub(crate) const MIDDLE: f32 = 128.0;

/// Steps of a unit of correlation in a score.
pub(crate) const SCORE_STEPS: f32 = 30_000.0;

/// Steps of a unit of cost; costs lie from 0 to 2.
pub(crate) const COST_STEPS: f32 = 15_000.0;

/// Steps of a grey level with windows of this radius: the squares of a window, taken from its mean, fit in 31 bits.
pub(crate) const fn gray_steps(radius: usize) -> f32 {
    if radius <= 2 { 64.0 } else { 32.0 }
}

/// A picture in steps from the middle.
pub(crate) fn in_steps(gray: &[f32], steps: f32) -> Vec<f32> {
    let step = |gray: &f32| round((gray - MIDDLE) * steps);
    gray.iter().map(step).collect()
}

/// A row with room for a window beyond both ends, filled with zeros there.
pub(crate) struct Padded<const R: usize>(Vec<i32>);

impl<const R: usize> Padded<R> {
    pub(crate) fn new(width: usize) -> Self {
        Self(vec![0; width + 2 * R])
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        self.0.fill(0);
    }

    /// From the sums of the rows `from` of `values` to those of `to`, which begin and end no earlier: adds what comes in and takes away what goes out, which whole
    /// numbers allow. Both count values, `width` a row.
    #[inline(always)]
    pub(crate) fn slide(
        &mut self,
        values: &[i32],
        from: &Range<usize>,
        to: &Range<usize>,
        width: usize,
    ) {
        let sums = &mut self.0[R..R + width];
        let (old, new) = (&values[from.start..to.start], &values[from.end..to.end]);
        if old.len() == width && new.len() == width {
            for ((sum, new), old) in sums.iter_mut().zip(new).zip(old) {
                *sum = sum.wrapping_add(new.wrapping_sub(*old));
            }
            return;
        }
        for row in new.chunks_exact(width) {
            for (sum, new) in sums.iter_mut().zip(row) {
                *sum = sum.wrapping_add(*new);
            }
        }
        for row in old.chunks_exact(width) {
            for (sum, old) in sums.iter_mut().zip(row) {
                *sum = sum.wrapping_sub(*old);
            }
        }
    }

    /// What the windows of `n` pixels reach.
    #[inline(always)]
    pub(crate) fn part(&self, from: usize, n: usize) -> &[i32] {
        &self.0[from..][..n + 2 * R]
    }
}

/// The sum over the window of one pixel of a [`Padded::part`]. Nothing is checked: the check alone would end the loops over pixels one pixel at a time.
///
/// # Safety
/// The part is of more than `x` pixels.
#[inline(always)]
pub(crate) unsafe fn window<const R: usize>(sums: &[i32], x: usize) -> i32 {
    debug_assert!(x + 2 * R < sums.len());
    let mut sum = 0i32;
    for k in 0..2 * R + 1 {
        // SAFETY: a part has `2 R` more than its pixels.
        sum = sum.wrapping_add(unsafe { *sums.get_unchecked(x + k) });
    }
    sum
}

/// The pixels of a window: how many.
#[derive(Clone, Copy)]
pub(crate) struct Count {
    whole: i32,
    per: f32,
}

impl Count {
    pub(crate) fn new(pixels: usize) -> Self {
        Self {
            whole: pixels as i32,
            per: 1.0 / pixels as f32,
        }
    }

    /// The sum of `noise` over the pixels.
    #[inline(always)]
    pub(crate) fn times(self, noise: f32) -> f32 {
        self.whole as f32 * noise
    }
}

/// A window's sum, its mean as a whole number, and what the sum is beside that.
#[derive(Clone, Copy)]
pub(crate) struct Level {
    sum: i32,
    mean: i32,
    beside: i32,
}

impl Level {
    #[inline(always)]
    pub(crate) fn new(sum: i32, count: Count) -> Self {
        let mean = whole(sum as f32 * count.per);
        Self {
            sum,
            mean,
            beside: sum.wrapping_sub(count.whole.wrapping_mul(mean)),
        }
    }

    /// The sum of squared deviations, of the sum of squares. What overflows on the way comes back: the result fits.
    #[inline(always)]
    pub(crate) fn variance(self, squares: i32, count: Count) -> f32 {
        let twice = self.sum.wrapping_add(self.beside);
        let around = squares.wrapping_sub(self.mean.wrapping_mul(twice));
        let beside = self.beside as f32;
        around as f32 - beside * beside * count.per
    }

    /// The sum of the products of deviations, of the sum of products.
    #[inline(always)]
    pub(crate) fn covariance(self, other: Self, products: i32, count: Count) -> f32 {
        let around = products
            .wrapping_sub(self.mean.wrapping_mul(other.beside))
            .wrapping_sub(other.mean.wrapping_mul(self.sum));
        around as f32 - self.beside as f32 * other.beside as f32 * count.per
    }
}

/// The reference's windows. Each number has a row of its own: mixed, they would have to be sorted apart for wide registers.
pub(crate) struct Windows {
    whole: Vec<i32>,
    per: Vec<f32>,
    sum: Vec<i32>,
    mean: Vec<i32>,
    beside: Vec<i32>,
    scale: Vec<f32>,
}

impl Windows {
    pub(crate) fn new(pixels: usize) -> Self {
        Self {
            whole: vec![0; pixels],
            per: vec![0.0; pixels],
            sum: vec![0; pixels],
            mean: vec![0; pixels],
            beside: vec![0; pixels],
            scale: vec![0.0; pixels],
        }
    }

    /// `scale` is 1 / sqrt(variance sum with noise) in steps of a score.
    pub(crate) fn set(&mut self, pixel: usize, count: Count, level: Level, scale: f32) {
        self.whole[pixel] = count.whole;
        self.per[pixel] = count.per;
        self.sum[pixel] = level.sum;
        self.mean[pixel] = level.mean;
        self.beside[pixel] = level.beside;
        self.scale[pixel] = scale;
    }

    /// Those of `n` pixels.
    #[inline(always)]
    pub(crate) fn part(&self, from: usize, n: usize) -> Part<'_> {
        Part {
            whole: &self.whole[from..][..n],
            per: &self.per[from..][..n],
            sum: &self.sum[from..][..n],
            mean: &self.mean[from..][..n],
            beside: &self.beside[from..][..n],
            scale: &self.scale[from..][..n],
        }
    }
}

/// Some [`Windows`].
#[derive(Clone, Copy)]
pub(crate) struct Part<'a> {
    whole: &'a [i32],
    per: &'a [f32],
    sum: &'a [i32],
    mean: &'a [i32],
    beside: &'a [i32],
    pub(crate) scale: &'a [f32],
}

impl Part<'_> {
    #[inline(always)]
    pub(crate) fn count(&self, i: usize) -> Count {
        Count {
            whole: self.whole[i],
            per: self.per[i],
        }
    }

    #[inline(always)]
    pub(crate) fn level(&self, i: usize) -> Level {
        Level {
            sum: self.sum[i],
            mean: self.mean[i],
            beside: self.beside[i],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Count, Level};

    /// Deviations in whole numbers of 128 bits: no rounding but the last.
    fn exactly(a: &[i32], b: &[i32]) -> f64 {
        let (n, sum) = (a.len() as i128, |v: &[i32]| {
            v.iter().map(|&v| i128::from(v)).sum::<i128>()
        });
        let products: i128 = a
            .iter()
            .zip(b)
            .map(|(&a, &b)| i128::from(a) * i128::from(b))
            .sum();
        (n * products - sum(a) * sum(b)) as f64 / n as f64
    }

    #[test]
    fn deviations_are_exact_where_squares_are_a_million_times_larger() {
        // Bright and almost blank, black and white, and anything.
        let windows: [[i32; 25]; 4] = [
            std::array::from_fn(|i| 8120 + (i as i32 * 7) % 3),
            std::array::from_fn(|i| if i % 2 == 0 { -8192 } else { 8128 }),
            std::array::from_fn(|i| if i < 12 { 8128 } else { -8192 }),
            std::array::from_fn(|i| (i as i32 * 5381) % 16_321 - 8192),
        ];
        let count = Count::new(25);
        let sum = |values: &[i32; 25]| values.iter().sum::<i32>();
        let products = |a: &[i32; 25], b: &[i32; 25]| {
            let all = a.iter().zip(b).map(|(a, b)| a.wrapping_mul(*b));
            all.fold(0i32, i32::wrapping_add)
        };
        for a in &windows {
            let level = Level::new(sum(a), count);
            let (found, expected) = (level.variance(products(a, a), count), exactly(a, a));
            assert!(
                (f64::from(found) / expected - 1.0).abs() < 1e-6,
                "{found}, not {expected}"
            );
            for b in &windows {
                let other = Level::new(sum(b), count);
                let found = level.covariance(other, products(a, b), count);
                let expected = exactly(a, b);
                let scale = (exactly(a, a) * exactly(b, b)).sqrt();
                assert!(
                    (f64::from(found) - expected).abs() < 1e-6 * scale,
                    "{found}, not {expected}"
                );
            }
        }
    }
}
