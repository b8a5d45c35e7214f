//! Sums over windows, as [`crate::window`] has them.

use super::pack::{low_steps, pack};
use cubecl::prelude::*;

/// Pixels of a window along one axis of the picture.
#[cube]
pub(super) fn window(x: u32, length: u32, #[comptime] radius: u32) -> u32 {
    let low = x - x.min(radius);
    (x + radius + 1).min(length) - low
}

/// The mean of so many steps, as a whole number.
#[cube]
pub(super) fn mean(sum: i32, per: f32) -> i32 {
    low_steps(pack(sum as f32 * per, 0.0f32))
}

/// The sum of squared deviations: [`crate::window::Level::variance`].
#[cube]
pub(super) fn variance(sum: i32, mean: i32, squares: i32, count: i32, per: f32) -> f32 {
    let beside = sum - count * mean;
    let around = squares - mean * (sum + beside);
    around as f32 - beside as f32 * beside as f32 * per
}
