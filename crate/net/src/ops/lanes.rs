//! Short sums and an exponential for use within [`wide`](super::wide::wide) functions, into which they are inlined.
//! Additions are in the same order whatever the width of the registers.

/// Lanes of a sum.
pub(crate) const LANES: usize = 8;

/// Sum of eight lanes.
#[inline(always)]
pub(crate) fn across(lanes: [f32; LANES]) -> f32 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// `sum_c a_c b_c`.
#[inline(always)]
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0; LANES];
    let whole = a.len() / LANES * LANES;
    let (a, a_rest) = a.split_at(whole);
    let (b, b_rest) = b.split_at(whole);
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    for (lane, (a, b)) in lanes.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *lane += a * b;
    }
    across(lanes)
}

/// `sum_c a_c`.
#[inline(always)]
pub(crate) fn sum(values: &[f32]) -> f32 {
    let mut lanes = [0.0; LANES];
    let (whole, rest) = values.split_at(values.len() / LANES * LANES);
    for values in whole.chunks_exact(LANES) {
        for lane in 0..LANES {
            lanes[lane] += values[lane];
        }
    }
    for (lane, value) in lanes.iter_mut().zip(rest) {
        *lane += value;
    }
    across(lanes)
}

/// `to = f(to, from)` element by element, eight at a time: rows are short, and a loop of unknown length would take most
/// of them one by one.
#[inline(always)]
pub(crate) fn each<const N: usize>(
    to: &mut [f32],
    from: [&[f32]; N],
    f: impl Fn(f32, [f32; N]) -> f32,
) {
    let count = to.len();
    let (groups, rest) = to.as_chunks_mut::<LANES>();
    for (g, to) in groups.iter_mut().enumerate() {
        let from = from.map(|from| load(from, g * LANES));
        // All that is read comes before what is written: the two might overlap for all that a compiler knows.
        let mut lanes = *to;
        for lane in 0..LANES {
            lanes[lane] = f(lanes[lane], from.map(|from| from[lane]));
        }
        *to = lanes;
    }
    for (i, to) in (count - rest.len()..).zip(rest) {
        *to = f(*to, from.map(|from| from[i]));
    }
}

/// Eight numbers from `start` on.
#[inline(always)]
pub(crate) fn load(from: &[f32], start: usize) -> [f32; LANES] {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(&from[start..start + LANES]);
    lanes
}

/// `to += by * from`.
#[inline(always)]
pub(crate) fn add_scaled(to: &mut [f32], by: f32, from: &[f32]) {
    each(to, [&from[..to.len()]], |to, [from]| to + by * from);
}

/// `e^x` within two units in the last place for `x` in -80..88, and no less and no more than there: as good as nothing, and
/// without branches. After Cephes: `2^n e^r` with a polynomial for `r` in `-ln 2 / 2..ln 2 / 2`.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    // Adding this rounds to a whole number and leaves it in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    let x = if x > 88.0 { 88.0 } else { x };
    let x = if x < -80.0 { -80.0 } else { x };
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    let r = (x - whole * LN2_HIGH) - whole * LN2_LOW;
    let p = 1.987_569_1e-4;
    let p = p * r + 1.398_2e-3;
    let p = p * r + 8.333_452e-3;
    let p = p * r + 4.166_579_6e-2;
    let p = p * r + 1.666_666_5e-1;
    let p = p * r + 0.5;
    let fraction = (p * r) * r + r + 1.0;
    let exponent = shifted.to_bits().wrapping_sub(ROUND.to_bits());
    let scale = f32::from_bits(exponent.wrapping_add(127) << 23);
    fraction * scale
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

    #[test]
    fn exponential_is_exact_to_two_units() {
        for i in -8000..=8800 {
            let x = i as f32 * 0.01;
            let exact = f64::from(x).exp();
            let error = (f64::from(exp(x)) - exact).abs() / exact;
            assert!(error < 2.4e-7, "e^{x}: relative error {error}");
        }
        assert!(exp(f32::NEG_INFINITY) < 2e-35);
        assert!(exp(f32::INFINITY) > 1e38);
        assert_eq!(exp(0.0), 1.0);
        assert!(exp(f32::NAN).is_nan());
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

    #[test]
    fn sums_take_every_element_once() {
        for count in 0..40 {
            let values: Vec<f32> = (1..=count).map(|i| i as f32).collect();
            let n = count as f32;
            assert_eq!(sum(&values), n * (n + 1.0) / 2.0);
            assert_eq!(dot(&values, &values), n * (n + 1.0) * (2.0 * n + 1.0) / 6.0);
        }
    }
}
