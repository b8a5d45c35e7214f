//! Inputs are the same on every device and with words of 32 bits.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use bench::input::image;
use burn::tensor::Device;

#[test]
fn a_large_picture_is_what_the_scripts_give_the_peer() {
    let values = image((640, 480), &Device::flex()).into_data();
    let found: Vec<f32> = values.try_to_vec().unwrap();
    assert_eq!(found.len(), 3 * 640 * 480);
    for (i, value) in found.into_iter().enumerate() {
        assert_eq!(value, (i as u64 * 7919 % 251) as f32, "number {i}");
    }
}
