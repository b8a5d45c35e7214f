//! Tensors by path.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::module::Module;
use burn::nn::{BatchNorm, BatchNormConfig, Linear, LinearConfig};
use burn::tensor::Device;

#[derive(Module, Debug)]
struct Pair {
    first: Linear,
    many: Vec<Linear>,
    norm: BatchNorm,
}

#[test]
fn paths_name_every_tensor_statistics_too() {
    let device = Device::flex();
    let linear = || LinearConfig::new(2, 3).init(&device);
    let pair = common::filled(Pair {
        first: linear(),
        many: vec![linear()],
        norm: BatchNormConfig::new(4).init(&device),
    });
    let found = net::named::tensors(&pair);
    let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "first.weight",
            "first.bias",
            "many.0.weight",
            "many.0.bias",
            "norm.gamma",
            "norm.beta",
            "norm.running_mean",
            "norm.running_var",
        ]
    );
    let variance = &found[7].1.try_to_vec::<f32>().unwrap();
    let made = common::numbers("norm.running_var", 4, 0.5);
    let expected: Vec<f32> = made.iter().map(|v| v + 1.0).collect();
    assert_eq!(variance, &expected);
}
