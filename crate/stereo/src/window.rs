//! Exact sums over windows.
//!
//! A variance is the difference of two large sums: of 25 bright pixels the squares come to over a million, and what noise leaves of it on a blank wall
//! is two or three. In `f32` as it comes, rounding decides there, another device rounds otherwise, and smoothing carries that
//! over the picture. So pictures are whole steps of a grey level, sums are whole numbers, and both sums are moved to
//! the window's own mean, exactly, before they are subtracted. All devices do the same.

/// The middle of the grey scale, from which steps are counted.
pub(crate) const MIDDLE: f32 = 128.0;

/// Steps of a unit of correlation in a score.
pub(crate) const SCORE_STEPS: f32 = 30_000.0;

/// Steps of a unit of cost; costs lie from 0 to 2.
pub(crate) const COST_STEPS: f32 = 15_000.0;

/// 1.5 * 2^23: between 2^23 and 2^24 floats are whole numbers.
const ROUND: f32 = 12_582_912.0;

/// Steps of a grey level with windows of this radius: the squares of a window, taken from its mean, fit in 31 bits.
pub(crate) const fn gray_steps(radius: usize) -> f32 {
    if radius <= 2 { 64.0 } else { 32.0 }
}

/// The nearest whole number, for numbers below 2^22.
#[inline(always)]
pub(crate) fn round(number: f32) -> f32 {
    (number + ROUND) - ROUND
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

    /// Sums some rows of `width` values.
    #[inline(always)]
    pub(crate) fn sum_rows(&mut self, rows: &[i32], width: usize) {
        let to = &mut self.0[R..R + width];
        let mut rows = rows.chunks_exact(width);
        if let Some(first) = rows.next() {
            to.copy_from_slice(first);
        }
        for row in rows {
            for (to, from) in to.iter_mut().zip(row) {
                *to = to.wrapping_add(*from);
            }
        }
    }

    #[inline(always)]
    pub(crate) fn window(&self, x: usize) -> i32 {
        let mut sum = 0i32;
        for k in 0..2 * R + 1 {
            sum = sum.wrapping_add(self.0[x + k]);
        }
        sum
    }
}

/// The pixels of a window: how many.
#[derive(Clone, Copy, Default)]
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
#[derive(Clone, Copy, Default)]
pub(crate) struct Level {
    sum: i32,
    mean: i32,
    beside: i32,
}

impl Level {
    #[inline(always)]
    pub(crate) fn new(sum: i32, count: Count) -> Self {
        let mean = round(sum as f32 * count.per);
        // SAFETY: a mean of steps is one of a few thousand whole numbers.
        let mean: i32 = unsafe { mean.to_int_unchecked() };
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
