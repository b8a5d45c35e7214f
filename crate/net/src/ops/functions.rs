//! Exponentials and logarithm without branches, which loops over slices turn into wide instructions. Within 2 units of the last place.

/// `2^n` and `e^r - 1` of `x = n ln 2 + r`, for -87 <= x <= 88.
#[inline(always)]
fn reduced(x: f32) -> (f32, f32) {
    // Adding this rounds to whole numbers and leaves them in the low bits.
    const ROUND: f32 = 12_582_912.0;
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN2_HIGH) - n * LN2_LOW;
    let tail = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)));
    let p = r + r * r * (0.5 + r * (1.0 / 6.0 + r * tail));
    let exponent = shifted
        .to_bits()
        .wrapping_sub(ROUND.to_bits())
        .wrapping_add(127);
    (f32::from_bits(exponent << 23), p)
}

#[inline(always)]
fn in_range(x: f32) -> f32 {
    // Not `clamp`: NaN shall stay NaN, and does in both comparisons.
    let x = if x < -87.0 { -87.0 } else { x };
    if x > 88.0 { 88.0 } else { x }
}

/// `e^x`; beyond +-87 the value there.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    let (scale, p) = reduced(in_range(x));
    scale + scale * p
}

/// `e^x - 1`, exact near 0 too.
#[inline(always)]
pub(crate) fn exp_m1(x: f32) -> f32 {
    let (scale, p) = reduced(in_range(x));
    (scale - 1.0) + scale * p
}

/// `ln(1 + e^x)` and its derivative, `1 / (1 + e^-x)`.
#[inline(always)]
pub(crate) fn softplus(x: f32) -> (f32, f32) {
    let t = exp(-x.abs());
    // ln(1 + t) = 2 artanh(s), |s| <= 1/3.
    let s = t / (2.0 + t);
    let q = s * s;
    let tail = 1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0 + q * (1.0 / 13.0 + q * (1.0 / 15.0))));
    let ln = 2.0 * s * (1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * tail)));
    let positive = if x > 0.0 { x } else { 0.0 };
    let high = if x > 0.0 { 1.0 } else { t };
    (positive + ln, high / (1.0 + t))
}

/// `1 / (1 + e^-x)`.
#[inline(always)]
pub(crate) fn sigmoid(x: f32) -> f32 {
    let t = exp(-x.abs());
    let high = if x > 0.0 { 1.0 } else { t };
    high / (1.0 + t)
}

/// `ln x` within two units in the last place, for a normal number above 0. After Cephes: a polynomial for the mantissa in
/// `sqrt(1 / 2)..sqrt(2)`.
#[inline(always)]
pub(crate) fn ln(x: f32) -> f32 {
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    // A mantissa above sqrt(2) counts as half of itself with the next exponent.
    let bits = x
        .to_bits()
        .wrapping_sub(std::f32::consts::FRAC_1_SQRT_2.to_bits());
    let exponent = (bits as i32 >> 23) as f32;
    let mantissa = (bits & 0x007f_ffff).wrapping_add(std::f32::consts::FRAC_1_SQRT_2.to_bits());
    let r = f32::from_bits(mantissa) - 1.0;
    let p = 7.037_683_6e-2;
    let p = p * r - 1.151_461e-1;
    let p = p * r + 1.167_699_9e-1;
    let p = p * r - 1.242_014_1e-1;
    let p = p * r + 1.424_932_3e-1;
    let p = p * r - 1.666_805_8e-1;
    let p = p * r + 2.000_071_5e-1;
    let p = p * r - 2.499_999_4e-1;
    let p = p * r + 3.333_333e-1;
    let square = r * r;
    let rest = p * r * square + exponent * LN2_LOW - 0.5 * square;
    (r + rest) + exponent * LN2_HIGH
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest relative error on a fine grid, `of` against the same in 64 bits.
    fn worst(low: f32, high: f32, of: fn(f32) -> f32, by_definition: fn(f64) -> f64) -> f64 {
        (0..=100_000)
            .map(|i| low + (high - low) * i as f32 / 100_000.0)
            .map(|x| {
                let expected = by_definition(f64::from(x));
                (f64::from(of(x)) - expected).abs() / expected.abs().max(1e-37)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn within_three_units_of_the_last_place() {
        let most = 3.0 * f64::from(f32::EPSILON);
        assert!(worst(-86.0, 87.0, exp, f64::exp) < most);
        assert!(worst(-20.0, 10.0, exp_m1, f64::exp_m1) < most);
        assert!(worst(-1e-3, 1e-3, exp_m1, f64::exp_m1) < most);
        let sigmoid_64 = |x: f64| 1.0 / (1.0 + (-x).exp());
        assert!(worst(-80.0, 80.0, sigmoid, sigmoid_64) < most);
        assert!(worst(-80.0, 80.0, |x| softplus(x).0, |x| x.exp().ln_1p()) < most);
        assert!(worst(-80.0, 80.0, |x| softplus(x).1, sigmoid_64) < most);
    }

    #[test]
    fn beyond_what_a_number_holds_it_stays_at_the_edge() {
        assert!(exp(f32::NEG_INFINITY) < 2e-38);
        assert!(exp(f32::INFINITY) > 1e38);
        assert_eq!(exp(0.0), 1.0);
    }

    #[test]
    fn not_a_number_stays_none() {
        assert!(exp(f32::NAN).is_nan());
        assert!(softplus(f32::NAN).0.is_nan());
        assert!(sigmoid(f32::NAN).is_nan());
    }

    #[test]
    fn logarithm_is_exact_to_two_units() {
        for i in -120..120 {
            for j in 0..100 {
                let x = 2.0_f32.powi(i) * (1.0 + 0.01 * j as f32);
                let exact = f64::from(x).ln();
                let error = (f64::from(ln(x)) - exact).abs();
                assert!(
                    error <= 2.4e-7 * exact.abs(),
                    "ln {x}: {} is not {exact}",
                    ln(x)
                );
            }
        }
    }
}
