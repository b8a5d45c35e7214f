//! The largest block that callers hand to fusion fits what every WebGPU device guarantees: bindings of 128 MiB.
//! Takes a minute on a software GPU: `cargo test --release --workspace --test net_fusion_block -- --ignored`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::devices::values;
use net::fusion::{FusionConfig, Pairs, Pooling};
use net::planes::Plane;
use net::{Level, NetConfig};

const PAIRS: usize = 200_000;
const VIEWS: usize = 2;

async fn fuse(device: &Device) -> (Vec<f32>, Vec<f32>) {
    let config = FusionConfig::new(
        &NetConfig {
            matching: true,
            ..NetConfig::full()
        },
        Level::Coarse,
    );
    let channels = config.channels;
    let fusion = common::filled(config.init(device));
    let place = |name: &str, size: f32| -> Vec<f32> {
        let spread = common::numbers(name, PAIRS, 0.5);
        spread.iter().map(|p| (p + 0.5) * (size - 1.0)).collect()
    };
    let pairs = Pairs {
        u: place("u", 20.0),
        v: place("v", 15.0),
        z_m: vec![2.0; PAIRS],
        view: (0..PAIRS).map(|pair| (pair % VIEWS) as u32).collect(),
        offsets: (0..=PAIRS / VIEWS).map(|n| (n * VIEWS) as i32).collect(),
        plane: [20, 15],
    };
    let plane = |name: &str| {
        let values = common::numbers(name, VIEWS * channels * 300, 1.0);
        Tensor::<4>::from_data(TensorData::new(values, [VIEWS, channels, 15, 20]), device)
    };
    let plane = Plane {
        base: plane("base"),
        hidden: Some(plane("hidden")),
        confidence: None,
    };
    let fused = fusion.forward(&plane, &pairs.on(device), Pooling::Softmax);
    (values(fused.features).await, values(fused.occupancy).await)
}

async fn compare(gpu: Device) {
    let (features, occupancy) = fuse(&gpu).await;
    let (expected, expected_occupancy) = fuse(&Device::flex()).await;
    let error = common::relative_error(&features, &expected);
    assert!(error < 1e-4, "features: relative error {error}");
    let error = common::relative_error(&occupancy, &expected_occupancy);
    assert!(error < 1e-4, "occupancy: relative error {error}");
}

#[cfg(not(target_family = "wasm"))]
#[test]
#[ignore = "a minute on a software GPU"]
fn two_hundred_thousand_pairs_fit() {
    match common::devices::gpu() {
        Some(device) => pollster::block_on(compare(device)),
        None => println!("skipped: no Vulkan, Metal or DirectX adapter on this machine"),
    }
}

#[cfg(target_family = "wasm")]
#[wasm_bindgen_test::wasm_bindgen_test]
#[ignore = "a minute on a software GPU"]
async fn two_hundred_thousand_pairs_fit() {
    compare(common::devices::gpu().await).await;
}
