//! What a device makes of widths and sizes that fill no vector and no workgroup, against the processor.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::devices::values;
use common::{filled, numbers, relative_error};
use glam::{Affine3A, IVec3, Mat3, Vec3, ivec3};
use mesh::camera::Pinhole;
use net::View;
use net::decode::{DecoderConfig, UNetMaps};
use net::fusion::{FusionConfig, PairTensors, Pooling, likeness};
use net::ops::attention::attention;
use net::ops::rows::Places;
use net::ops::segments::Segments;
use net::planes::{Plane, PlaneNet};

fn made<const D: usize>(name: &str, shape: [usize; D], device: &Device) -> Tensor<D> {
    let values = numbers(name, shape.iter().product(), 1.0);
    Tensor::from_data(TensorData::new(values, shape), device)
}

async fn assert_close<const D: usize>(what: &str, found: Tensor<D>, expected: Tensor<D>) {
    assert_eq!(found.dims(), expected.dims(), "{what}");
    let off = relative_error(&values(found).await, &values(expected).await);
    assert!(off < 2e-5, "{what}: {off:e}");
}

/// Lengths of segments: none, one, many; more rows than a thread or a workgroup takes.
const LENGTHS: [i32; 12] = [0, 1, 7, 0, 20, 2, 5, 33, 1, 0, 70, 0];

fn offsets() -> Vec<i32> {
    let ends = LENGTHS.iter().scan(0, |end, length| {
        *end += length;
        Some(*end)
    });
    std::iter::once(0).chain(ends).collect()
}

/// Pairs anywhere in planes of 9 x 7 pixels of three views.
fn pairs(device: &Device) -> PairTensors {
    let segments = Segments::new(&offsets(), device);
    let rows = segments.rows;
    let of = |name: &str| numbers(name, rows, 0.5).into_iter().map(|v| v + 0.5);
    let column = of("column").map(|v| (v * 7.99) as i32);
    let corner = column.zip(of("row")).zip(of("view"));
    let corner: Vec<i32> = corner
        .map(|((x, y), view)| x + 9 * ((y * 5.99) as i32 + 7 * (view * 2.99) as i32))
        .collect();
    let floats = |name: &str| {
        let values: Vec<f32> = of(name).collect();
        Tensor::<1>::from_data(TensorData::new(values, [rows]), device)
    };
    PairTensors {
        places: Places {
            corner: Tensor::from_data(TensorData::new(corner, [rows]), device),
            right: floats("right"),
            down: floats("down"),
            plane: [9, 7],
        },
        z_m: floats("depth") * 3.0,
        segments,
    }
}

on_each_device! {
    async fn fusion_of_any_width(device: Device) {
        for (channels, lift, matching) in [(6, true, false), (8, true, true), (10, false, false), (24, true, true), (40, true, true), (80, true, false)] {
            let what = format!("{channels} channels, lift {lift}, matching {matching}");
            let config = FusionConfig { channels, lift, matching };
            let fused = |device: &Device| {
                let plane = Plane {
                    base: made("base", [3, channels, 7, 9], device),
                    hidden: Some(made("hidden", [3, channels, 7, 9], device)),
                    confidence: None,
                };
                filled(config.init(device)).forward(&plane, &pairs(device), Pooling::Softmax)
            };
            let (found, expected) = (fused(&device), fused(&Device::flex()));
            assert_close(&format!("features, {what}"), found.features, expected.features).await;
            assert_close(&format!("occupancy, {what}"), found.occupancy, expected.occupancy).await;
        }
    }
}

on_each_device! {
    async fn likeness_where_one_view_is_alone(device: Device) {
        let of = |device: &Device| {
            let segments = Segments::new(&offsets(), device);
            likeness(made("features", [segments.rows, 24], device), &segments)
        };
        assert_close("likeness", of(&device), of(&Device::flex())).await;
    }
}

on_each_device! {
    async fn attention_of_any_width(device: Device) {
        for (channels, heads) in [(3, 3), (6, 2), (14, 1), (80, 2), (160, 1)] {
            let of = |device: &Device| {
                let segments = Segments::new(&offsets(), device);
                let [query, key, value] = ["query", "key", "value"]
                    .map(|name| made(name, [segments.rows, channels], device) * 3.0);
                attention(query, key, value, &segments, heads)
            };
            let what = format!("{channels} channels, {heads} heads");
            assert_close(&what, of(&device), of(&Device::flex())).await;
        }
    }
}

on_each_device! {
    async fn decoders_of_any_width(device: Device) {
        let some = numbers("some", 700, 1.0);
        let sites = (0..700).map(|i| ivec3(i % 10, i / 10 % 10, i / 100));
        let sites: Vec<IVec3> = sites.zip(some).filter(|(_, v)| *v < 0.3).map(|(site, _)| site).collect();
        for (inputs, base, sites) in [(5, 3, &sites[..]), (43, 8, &sites), (1, 12, &sites[..1])] {
            let of = |device: &Device| {
                let decoder = filled(DecoderConfig { inputs, base }.init(device));
                let features = made("features", [sites.len(), inputs], device);
                decoder.forward(features, &UNetMaps::new(sites, device))
            };
            let (found, expected) = (of(&device), of(&Device::flex()));
            let what = format!("{} sites of {inputs} channels, base {base}", sites.len());
            assert_close(&what, found.0, expected.0).await;
            assert_close(&what, found.1, expected.1).await;
        }
    }
}

on_each_device! {
    async fn planes_of_odd_pictures(device: Device) {
        let camera = Pinhole { width: 53, height: 37, fx: 50.0, fy: 50.0, cx: 26.0, cy: 18.0 };
        let view = |x: f32| View {
            camera,
            world_from_camera: Affine3A::from_mat3_translation(Mat3::IDENTITY, Vec3::new(x, 0.0, 0.0)),
        };
        let views = [view(0.0), view(0.5)];
        let of = |device: &Device| {
            let net = filled(PlaneNet::init(&common::tiny(), device));
            let images = (made("images", [2, 3, 37, 53], device) + 1.0) * 127.0;
            net.forward(images, &views)
        };
        for (level, (found, expected)) in of(&device).into_iter().zip(of(&Device::flex())).enumerate() {
            assert_close(&format!("base of level {level}"), found.base, expected.base).await;
            assert_close(&format!("hidden of level {level}"), found.hidden.unwrap(), expected.hidden.unwrap()).await;
        }
    }
}
