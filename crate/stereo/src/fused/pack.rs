//! Two numbers in one: grey values, scores and costs cross memory with 16 bits each, which is what bounds the kernels.

use super::CENTER;
use cubecl::prelude::*;

/// Steps of a grey level in a packed sample.
pub(super) const GRAY_STEPS: f32 = 256.0;

/// Steps of a unit of ZNCC in a packed score.
pub(super) const SCORE_STEPS: f32 = 30_000.0;

/// Steps of a unit of cost in a packed cost; costs lie from 0 to 2.
pub(super) const COST_STEPS: f32 = 15_000.0;

/// 1.5 * 2^23: between 2^23 and 2^24 floats are whole numbers, and their last bits are those of the summand, rounded.
const ROUND: f32 = 12_582_912.0;

/// Grey values in steps from the middle of the scale, each with its right neighbour in the upper half.
pub(super) fn shades(gray: &[f32]) -> Vec<i32> {
    let steps: Vec<i32> = gray.iter().copied().map(shade).collect();
    let next = steps.iter().skip(1).chain(std::iter::once(&0));
    steps.iter().zip(next).map(|(a, b)| both(*a, *b)).collect()
}

/// The same with a frame of zeros, `radius` pixels wide, around the picture.
pub(super) fn framed_shades(gray: &[f32], width: usize, radius: usize) -> Vec<i32> {
    let height = gray.len() / width;
    let across = width + 2 * radius;
    let mut steps = vec![0i32; across * (height + 2 * radius) + 1];
    for (y, row) in gray.chunks_exact(width).enumerate() {
        let start = (y + radius) * across + radius;
        for (to, from) in steps[start..].iter_mut().zip(row) {
            *to = shade(*from);
        }
    }
    // A thread of two windows reads one pair past the last.
    let mut pairs: Vec<i32> = steps
        .windows(2)
        .map(|pair| both(pair[0], pair[1]))
        .collect();
    pairs.resize(pairs.len() + 2 * radius + 4, 0);
    pairs
}

fn shade(gray: f32) -> i32 {
    let steps = ((gray - CENTER) * GRAY_STEPS).round();
    steps.clamp(f32::from(i16::MIN), f32::from(i16::MAX)) as i32
}

fn both(low: i32, high: i32) -> i32 {
    (high << 16) | (low & 0xffff)
}

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
    ((pair << 16i32) >> 16i32) as f32
}

/// The second of two packed numbers.
#[cube]
pub(super) fn high(pair: i32) -> f32 {
    (pair >> 16i32) as f32
}
