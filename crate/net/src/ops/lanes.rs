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

#[cfg(test)]
mod tests {
    use super::*;

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
