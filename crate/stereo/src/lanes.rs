//! Arithmetic as wide registers have it, on every processor. `f32::min` and its like are more: what they promise of NaN is a call in wasm, which keeps a loop
//! from being one of vectors.

/// Numbers in a wide register.
pub(crate) const LANES: usize = 8;

/// 1.5 * 2^23: between 2^23 and 2^24 floats are whole numbers.
const ROUND: f32 = 12_582_912.0;

/// The nearest whole number, for numbers below 2^22.
#[inline(always)]
pub(crate) fn round(number: f32) -> f32 {
    (number + ROUND) - ROUND
}

/// The same as an integer: read off the bits of the sum, where a conversion costs more.
#[inline(always)]
pub(crate) fn whole(number: f32) -> i32 {
    (number + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i32
}

/// The lesser; `b` where one is no number.
#[inline(always)]
pub(crate) fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater; `b` where one is no number.
#[inline(always)]
pub(crate) fn more(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The least of some numbers, `f32::MAX` of none.
#[inline(always)]
pub(crate) fn least_of(values: &[f32]) -> f32 {
    let mut strands = [f32::MAX; LANES];
    let whole = values.chunks_exact(LANES);
    let rest = whole.remainder();
    for part in whole {
        for (least, value) in strands.iter_mut().zip(part) {
            *least = less(*value, *least);
        }
    }
    strands
        .iter()
        .chain(rest)
        .fold(f32::MAX, |least, &value| less(value, least))
}
