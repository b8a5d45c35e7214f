//! The sparse U-Net of a level and its head.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::{Tensor, module::Module, tensor::Device};
use glam::{IVec3, ivec3};
use net::{
    NetConfig,
    decode::{DecoderConfig, UNetMaps},
};

fn sites() -> Vec<IVec3> {
    let all = (0..11 * 9 * 7).map(|i| ivec3(i % 11 - 5, i / 11 % 9 - 3, i / 99 - 4));
    all.filter(|s| (s.x * s.y + 3 * s.z + s.x).rem_euclid(5) < 2)
        .collect()
}

#[test]
fn parameters_are_as_counted() {
    let config = NetConfig::full();
    let inputs = [80, 137, 73];
    let counted = [4_499_425, 1_167_905, 293_521];
    for level in 0..3 {
        let config = DecoderConfig {
            inputs: inputs[level],
            base: config.unet[level],
        };
        let decoder = config.init(&Device::flex());
        let running =
            |(name, data): &(String, burn::tensor::TensorData)| match name.contains("running") {
                true => 0,
                false => data.shape().iter().product(),
            };
        let found: usize = net::named::tensors(&decoder).iter().map(running).sum();
        assert_eq!(found, counted[level]);
    }
}

#[test]
fn every_parameter_has_a_gradient() {
    let device = Device::flex().autodiff();
    let sites = sites();
    let decoder = DecoderConfig { inputs: 5, base: 4 }.init(&device);
    let maps = UNetMaps::new(&sites, &device);
    let input = common::numbers("input", 5 * sites.len(), 1.0);
    let input = burn::tensor::TensorData::new(input, [sites.len(), 5]);
    let (features, logit) = decoder.forward(Tensor::from_data(input, &device), &maps);
    assert_eq!(features.dims(), [sites.len(), 12]);
    assert_eq!(logit.dims(), [sites.len()]);
    let gradients = (features.powi_scalar(2).sum() + logit.sum()).backward();
    struct Check<'a>(&'a burn::tensor::Gradients, usize);
    impl burn::module::ModuleVisitor for Check<'_> {
        fn visit_float<const D: usize>(&mut self, param: &burn::module::Param<Tensor<D>>) {
            if param.val().is_require_grad() {
                let gradient = param.val().grad(self.0).expect("a gradient");
                assert!(gradient.abs().sum().into_scalar::<f32>() > 0.0);
                self.1 += 1;
            }
        }
    }
    let mut check = Check(&gradients, 0);
    decoder.visit(&mut check);
    println!("{} tensors", check.1);
}

#[test]
fn no_sites_give_no_rows() {
    for device in [Device::flex(), Device::flex().autodiff()] {
        let decoder = DecoderConfig { inputs: 5, base: 4 }.init(&device);
        let maps = UNetMaps::new(&[], &device);
        let (features, logit) = decoder.forward(Tensor::zeros([0, 5], &device), &maps);
        assert_eq!((features.dims(), logit.dims()), ([0, 12], [0]));
    }
}
