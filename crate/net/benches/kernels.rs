//! Kernels for WebGPU beside the tensor operations they stand for, in one run on the machine's GPU or what plays one.
//!
//! `cargo bench --bench net_kernels`

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::time::Instant;

use burn::tensor::{Device, Int, Tensor, TensorData};
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use glam::IVec3;
use net::decode::maps::submanifold;
use net::ops::pool::Pooling;
use net::ops::rows::{At, Places};
use net::ops::scan::Pass;
use net::ops::segments::Segments;
use net::ops::sparse_conv::KernelMap;
use net::ops::{affine, attention, channel_norm, linrec, pool, rows, scan, sparse_conv, upsample};

type Cube = CubeBackend;

fn numbers<const D: usize>(shape: [usize; D], device: &Device) -> Tensor<D> {
    let count = shape.iter().product::<usize>();
    let values: Vec<f32> = (0..count)
        .map(|i| (i * 7919 % 251) as f32 / 251.0 - 0.5)
        .collect();
    Tensor::from_data(TensorData::new(values, shape), device)
}

fn cube<const D: usize>(tensor: Tensor<D>) -> CubeTensor {
    tensor.try_into_primitive::<Cube>().unwrap()
}

fn whole<const D: usize>(tensor: Tensor<D, Int>) -> CubeTensor {
    tensor.try_into_primitive::<Cube>().unwrap()
}

fn tensor<const D: usize>(cube: CubeTensor) -> Tensor<D> {
    Tensor::from_primitive::<Cube>(cube)
}

/// Least milliseconds of three after one that makes the pipelines, each waited for.
fn milliseconds<const D: usize>(work: &dyn Fn() -> Tensor<D>) -> f64 {
    let once = || {
        let start = Instant::now();
        let first = work().flatten::<1>(0, D - 1).slice(0..1);
        first.into_data().try_to_vec::<f32>().unwrap();
        start.elapsed().as_secs_f64() * 1e3
    };
    once();
    (0..3).map(|_| once()).fold(f64::INFINITY, f64::min)
}

fn row<const D: usize>(name: &str, plain: &dyn Fn() -> Tensor<D>, fused: &dyn Fn() -> Tensor<D>) {
    let (plain, fused) = (milliseconds(plain), milliseconds(fused));
    println!(
        "| {name} | {plain:.1} | {fused:.1} | {:.1} |",
        plain / fused
    );
}

fn convolutions(device: &Device) {
    let side = |i: i32| IVec3::new(i % 32, i / 32 % 32, i / 1024);
    let dense: Vec<IVec3> = (0..32 * 32 * 32).map(side).collect();
    // A sheet three voxels thick.
    let sheet: Vec<IVec3> = (0..3 * 96 * 96)
        .map(|i| IVec3::new(i % 96, i / 96 % 96, i / 9216))
        .collect();
    for (name, sites, inputs, outputs) in [
        ("dense, 48 to 48", &dense, 48, 48),
        ("sheet, 24 to 24", &sheet, 24, 24),
    ] {
        let map = submanifold(sites, device);
        let KernelMap { gather, .. } = &map;
        let x = numbers([sites.len(), inputs], device);
        let w = numbers([27, inputs, outputs], device);
        row(
            &format!("sparse convolution, {name}, {} rows", sites.len()),
            &|| {
                let (x, w) = (cube(x.clone()), cube(w.clone()));
                tensor::<2>(sparse_conv::plain_forward::<Cube>(
                    x,
                    w,
                    whole(gather.clone()),
                ))
            },
            &|| sparse_conv::sparse_conv(x.clone(), w.clone(), &map),
        );
    }
}

fn views(device: &Device) {
    let [voxels, views, channels] = [5_000, 20, 40];
    let offsets: Vec<i32> = (0..=voxels as i32).map(|n| n * views as i32).collect();
    let segments = Segments::new(&offsets, device);
    let pairs = segments.rows;
    let x = numbers([pairs, channels], device);
    let [offsets, of_row] = [&segments.offsets, &segments.of_row];
    row(
        &format!("attention, {voxels} voxels of {views} views, {channels} channels"),
        &|| {
            let shared = attention::Shared {
                offsets: whole(offsets.clone()),
                of_row: whole(of_row.clone()),
                longest: segments.longest,
                heads: 2,
            };
            let inputs = [(); 3].map(|()| cube(x.clone()));
            let [query, key, value] = inputs;
            tensor::<2>(attention::plain_forward::<Cube>(query, key, value, &shared).0)
        },
        &|| attention::attention(x.clone(), x.clone(), x.clone(), &segments, 2),
    );
    let logits = numbers([pairs], device);
    row(
        "pooling of the same",
        &|| {
            let shared = pool::Shared {
                offsets: whole(offsets.clone()),
                of_row: whole(of_row.clone()),
                longest: segments.longest,
                pooling: Pooling::Softmax,
            };
            let (x, logits) = (cube(x.clone()), cube(logits.clone()));
            tensor::<2>(pool::plain_forward::<Cube>(x, logits, &shared).0)
        },
        &|| pool::pool(x.clone(), logits.clone(), &segments, Pooling::Softmax),
    );
    let plane = numbers([views, channels, 30, 40], device);
    let corner: Vec<i32> = (0..pairs as i32)
        .map(|p| p * 31 % (29 * 39) + 1200 * (p % views as i32))
        .collect();
    let places = Places {
        corner: Tensor::from_data(TensorData::new(corner, [pairs]), device),
        right: numbers([pairs], device) + 0.5,
        down: numbers([pairs], device) + 0.5,
        plane: [40, 30],
    };
    row(
        "sampling of the same",
        &|| {
            let at = At {
                corner: whole(places.corner.clone()),
                right: cube(places.right.clone()),
                down: cube(places.down.clone()),
                plane: places.plane,
            };
            let table = plane.clone().permute([0, 2, 3, 1]);
            let table = cube(table.reshape([views * 1200, channels]));
            tensor::<2>(rows::plain_forward::<Cube>(table, &at))
        },
        &|| rows::sample(plane.clone(), &places),
    );
}

fn planes(device: &Device) {
    let lanes = [2_880, 160];
    let (a, x) = (numbers(lanes, device) + 0.4, numbers(lanes, device));
    row(
        "linear recurrence, 2,880 lanes of 160",
        &|| {
            tensor::<2>(linrec::plain::<Cube>(
                cube(a.clone()),
                cube(x.clone()),
                false,
            ))
        },
        &|| linrec::linrec(a.clone(), x.clone(), false),
    );
    let shape = [1, 16, 120, 160];
    let (x, step) = (numbers(shape, device), numbers(shape, device));
    let rates = numbers([16], device);
    let each = || numbers([16], device);
    for (name, pass) in [("rows", Pass::Rows), ("columns", Pass::Columns)] {
        row(
            &format!("scan along {name}, 16 states, 160 x 120; plain with the recurrence's kernel"),
            &|| scan::composed(x.clone(), step.clone(), rates.clone(), pass),
            &|| scan::selective_scan(x.clone(), step.clone(), rates.clone(), pass),
        );
    }
    row(
        "layer normalisation of pixels, 16 channels, 160 x 120",
        &|| channel_norm::composed(x.clone(), each(), each()),
        &|| channel_norm::channel_norm(x.clone(), each(), each()),
    );
    row(
        "doubling of the same",
        &|| upsample::composed(x.clone()),
        &|| upsample::upsample2(x.clone()),
    );
    let maps = numbers([1, 6], device) * 2.0;
    row(
        "affine map of the same",
        &|| affine::composed(x.clone(), maps.clone()),
        &|| affine::affine_sample(x.clone(), maps.clone()),
    );
}

fn main() {
    let device = Device::wgpu_options().init().expect("a GPU");
    println!("| operation | plain ms | fused ms | ratio |\n|---|---|---|---|");
    convolutions(&device);
    views(&device);
    planes(&device);
}
