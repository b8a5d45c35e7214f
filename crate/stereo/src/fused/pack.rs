//! Two numbers in one: grey values, scores and costs are whole steps ([`crate::window`]) and cross memory with 16 bits each, which is what bounds the kernels.

use cubecl::prelude::*;

/// 1.5 * 2^23: between 2^23 and 2^24 floats are whole numbers, and their last bits are those of the summand, rounded.
const ROUND: f32 = 12_582_912.0;

/// Rounds two numbers from -32,768 to 32,767.
#[cube]
pub(super) fn pack(low: f32, high: f32) -> i32 {
    let low = i32::reinterpret(low + ROUND);
    let high = i32::reinterpret(high + ROUND);
    (high << 16i32) | (low & 65_535i32)
}

/// The first of two packed numbers.
#[cube]
pub(super) fn low(pair: i32) -> f32 {
    low_steps(pair) as f32
}

/// The second of two packed numbers.
#[cube]
pub(super) fn high(pair: i32) -> f32 {
    high_steps(pair) as f32
}

/// The first as a whole number.
#[cube]
pub(super) fn low_steps(pair: i32) -> i32 {
    (pair << 16i32) >> 16i32
}

/// The second as a whole number.
#[cube]
pub(super) fn high_steps(pair: i32) -> i32 {
    pair >> 16i32
}
