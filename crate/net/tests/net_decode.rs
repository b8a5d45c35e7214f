//! The sparse network of a level, against tests/reference/net_decode.py and against the method's counts.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::{
    Tensor,
    tensor::{Device, TensorData},
};
use common::{devices::values, digests::Digests, filled, numbers};
use glam::{IVec3, ivec3};
use net::{
    NetConfig,
    decode::{
        DecoderConfig, UNetMaps, halved,
        maps::{pooling, submanifold},
        unet::Residual,
    },
    ops::sparse_conv::{KernelMap, sparse_conv},
};

const CONFIG: DecoderConfig = DecoderConfig { inputs: 5, base: 3 };

/// Half of a box, in no order, and a few far from it.
fn sites() -> Vec<IVec3> {
    let chosen = numbers("sites", 11 * 9 * 7, 1.0);
    let mut order: Vec<usize> = (0..chosen.len()).filter(|i| chosen[*i] < 0.1).collect();
    order.sort_by(|a, b| chosen[*a].total_cmp(&chosen[*b]));
    let place = |i: usize| ivec3((i % 11) as i32, (i / 11 % 9) as i32, (i / 99) as i32);
    let mut sites: Vec<_> = order.iter().map(|i| place(*i) - ivec3(5, 4, 3)).collect();
    sites.extend([
        ivec3(-41, 26, -17),
        ivec3(-41, 26, -16),
        ivec3(100, -100, 3),
    ]);
    sites
}

fn made<const D: usize>(name: &str, shape: [usize; D], scale: f32, device: &Device) -> Tensor<D> {
    let values = numbers(name, shape.iter().product(), scale);
    Tensor::from_data(TensorData::new(values, shape), device)
}

fn features(device: &Device) -> Tensor<2> {
    made("features", [sites().len(), CONFIG.inputs], 1.0, device)
}

fn golden() -> Digests {
    let text = include_str!("../../../tests/golden/net_decode.json");
    Digests::read(text, 1e-4)
}

fn assert_sites(golden: &Digests, name: &str, found: &[IVec3]) {
    let flat = found.iter().flat_map(|site| site.to_array());
    let flat: Vec<f32> = flat.map(|place| place as f32).collect();
    golden.assert_numbers(name, &[found.len(), 3], &flat);
}

#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn sites_are_the_reference_s() {
    assert_sites(&golden(), "sites", &sites());
    assert_sites(&golden(), "halved", &halved(&sites()));
}

on_each_device! {
    async fn convolutions_are_the_reference_s(device: Device) {
        let golden = golden();
        let sites = sites();
        let halves = halved(&sites);
        let conv = |name, features, map: &KernelMap, taps: usize| {
            // As `filled` makes weights.
            let scale = (3.0_f32 / 20.0).sqrt();
            sparse_conv(features, made(name, [taps, 5, 4], scale, &device), map)
        };
        let same = submanifold(&sites, &device);
        golden.assert("same", conv("same", features(&device), &same, 27)).await;
        let down = pooling(&sites, &halves, &device);
        golden.assert("down", conv("down", features(&device), &down, 8)).await;
        let halves = made("halves", [halves.len(), 5], 1.0, &device);
        golden.assert("up", conv("up", halves, &down.transposed(), 8)).await;
    }
}

/// Blocks and the whole on a device, whose batch normalisation takes the statistics `named`.
async fn assert_networks(device: Device, named: &str) {
    let golden = golden();
    let maps = UNetMaps::new(&sites(), &device);
    let residual = |outputs| {
        let block = filled(Residual::new(CONFIG.inputs, outputs, &device));
        block.forward(features(&device), &maps.same[0])
    };
    golden
        .assert(&format!("residual.wider.{named}"), residual(7))
        .await;
    golden
        .assert(&format!("residual.same.{named}"), residual(5))
        .await;
    let decoder = filled(CONFIG.init(&device));
    let (features, logit) = decoder.forward(features(&device), &maps);
    golden.assert(&format!("features.{named}"), features).await;
    golden.assert(&format!("logit.{named}"), logit).await;
}

on_each_device! {
    async fn networks_are_the_reference_s(device: Device) {
        assert_networks(device, "running").await;
    }
}

on_each_device! {
    async fn no_sites_give_no_rows(device: Device) {
        let decoder = CONFIG.init(&device);
        let maps = UNetMaps::new(&[], &device);
        let (features, logit) = decoder.forward(Tensor::zeros([0, 5], &device), &maps);
        assert_eq!((features.dims(), logit.dims()), ([0, 9], [0]));
    }
}

on_each_device! {
    /// One site alone has no neighbours, and is its own half.
    async fn one_site_gives_one_row(device: Device) {
        let decoder = filled(CONFIG.init(&device));
        let maps = UNetMaps::new(&[ivec3(-1, 7, 2)], &device);
        let (features, logit) = decoder.forward(Tensor::ones([1, 5], &device), &maps);
        assert_eq!((features.dims(), logit.dims()), ([1, 9], [1]));
        assert!(values(logit).await[0].is_finite());
    }
}

#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn parameters_are_the_method_s() {
    let config = NetConfig::full();
    // Method 2.1.
    let counted = [(80, 4_499_425), (137, 1_167_905), (73, 293_521)];
    for ((inputs, counted), base) in counted.into_iter().zip(config.unet) {
        let decoder = DecoderConfig { inputs, base }.init(&Device::flex());
        let tensors = net::named::tensors(&decoder);
        let learned = tensors.iter().filter(|(path, _)| !path.contains("running"));
        let found: usize = learned.map(|(_, data)| data.num_elements()).sum();
        assert_eq!(found, counted);
    }
}

/// What autodiff does; the engine for the browser is built without.
#[cfg(not(target_family = "wasm"))]
mod trained {
    use super::*;
    use burn::{
        module::{Module, ModuleVisitor, Param},
        tensor::Gradients,
    };
    use net::decode::Decoder;

    on_each_device! {
        async fn networks_in_training_are_the_reference_s(device: Device) {
            assert_networks(device.autodiff(), "batch").await;
        }
    }

    /// The gradients of a decoder's parameters, in their order.
    struct Collected<'a>(&'a Gradients, Vec<Vec<f32>>);

    impl ModuleVisitor for Collected<'_> {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if param.val().is_require_grad() {
                let gradient = param.val().grad(self.0).expect("a gradient");
                self.1.push(pollster::block_on(values(gradient)));
            }
        }
    }

    fn gradients(device: Device) -> Vec<Vec<f32>> {
        let device = device.autodiff();
        let decoder: Decoder = filled(CONFIG.init(&device));
        let maps = UNetMaps::new(&sites(), &device);
        // Features with which no ReLU is nearer than 8e-5 to its kink: there rounding would decide.
        let features = made("given", [sites().len(), CONFIG.inputs], 1.0, &device);
        let (features, logit) = decoder.forward(features, &maps);
        let gradients = (features.powi_scalar(2).sum() + logit.powi_scalar(2).sum()).backward();
        let mut collected = Collected(&gradients, Vec::new());
        decoder.visit(&mut collected);
        let learned = |(path, _): &&(String, TensorData)| !path.contains("running");
        let expected = net::named::tensors(&decoder).iter().filter(learned).count();
        assert_eq!(collected.1.len(), expected);
        collected.1
    }

    #[test]
    fn every_parameter_has_a_gradient_alike_on_both_devices() {
        let flex = gradients(Device::flex());
        for gradient in &flex {
            let sum: f32 = gradient.iter().map(|v| v.abs()).sum();
            assert!(sum > 0.0 && sum.is_finite());
        }
        let Some(gpu) = common::devices::gpu() else {
            println!("skipped: no Vulkan, Metal or DirectX adapter on this machine");
            return;
        };
        for (gpu, flex) in gradients(gpu).iter().zip(&flex) {
            let off = common::relative_error(gpu, flex);
            assert!(off < 1e-4, "{off:e}");
        }
    }
}
