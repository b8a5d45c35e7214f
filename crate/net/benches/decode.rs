//! Where the time of the sparse network goes on the processor:
//! `cargo bench --workspace --bench net_decode`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use burn::{
    Tensor,
    tensor::{Device, Distribution, Int},
};
use glam::{IVec3, Vec3, ivec3, vec3};
use net::{
    NetConfig,
    decode::{
        DecoderConfig, UNetMaps, children, halved,
        maps::{pooling, submanifold},
    },
    ops::sparse_conv::{KernelMap, sparse_conv},
};
use std::time::Instant;

/// Seconds of the fastest of some runs.
fn fastest<T>(mut run: impl FnMut() -> T) -> f64 {
    let times = (0..7).map(|_| {
        let start = Instant::now();
        std::hint::black_box(run());
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn random<const D: usize>(shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::random(shape, Distribution::Normal(0.0, 1.0), device)
}

/// Sites of the three levels of a crop of 3.84 x 3.84 x 1.92 m with a floor, a wall, a table and a ball.
fn levels() -> [Vec<IVec3>; 3] {
    let distance = |p: Vec3| -> f32 {
        let board = (p - vec3(1.2, 2.4, 0.95)).abs() - vec3(0.6, 0.5, 0.05);
        let board = board.max(Vec3::ZERO).length();
        let ball = (p - vec3(2.7, 1.5, 0.7)).length() - 0.35;
        (p.z - 0.2)
            .abs()
            .min(p.x - 0.3)
            .min(board)
            .min(ball.abs())
            .abs()
    };
    let near = |sites: &[IVec3], size_m: f32, band_m: f32| -> Vec<IVec3> {
        let near = |site: &&IVec3| distance(site.as_vec3() * size_m) < band_m;
        children(&sites.iter().filter(near).copied().collect::<Vec<_>>())
    };
    let all = (0..24 * 24 * 12).map(|i| ivec3(i % 24, i / 24 % 24, i / 576));
    let coarse: Vec<_> = all.collect();
    let medium = near(&coarse, 0.16, 0.16);
    let fine = near(&medium, 0.08, 0.12);
    [coarse, medium, fine]
}

fn pairs(map: &KernelMap) -> usize {
    let gather: Vec<i32> = map.gather.clone().into_data().try_to_vec().unwrap();
    gather.iter().filter(|m| **m < map.inputs as i32).count()
}

/// Rows gathered, then one product.
fn gathered(x: Tensor<2>, w: Tensor<3>, map: &KernelMap) -> Tensor<2> {
    let [taps, inputs, outputs] = w.dims();
    let zero = Tensor::zeros([1, inputs], &x.device());
    let index: Tensor<1, Int> = map.gather.clone().reshape([map.outputs * taps]);
    let rows = Tensor::cat(vec![x, zero], 0).select(0, index);
    rows.reshape([map.outputs, taps * inputs])
        .matmul(w.reshape([taps * inputs, outputs]))
}

fn convolutions() {
    let device = Device::flex();
    let (a, b) = (random([2048, 1024], &device), random([1024, 1024], &device));
    let peak = 2.0 * 2048.0 * 1024.0 * 1024.0 / fastest(|| a.clone().matmul(b.clone()));
    println!("gemm 2048x1024x1024: {:.0} GFLOP/s", peak / 1e9);
    let [coarse, medium, fine] = levels();
    let shapes = [
        (
            "coarse",
            &coarse,
            vec![
                (80, 32),
                (32, 32),
                (32, 96),
                (128, 96),
                (64, 64),
                (128, 128),
            ],
        ),
        (
            "medium",
            &medium,
            vec![(137, 16), (16, 16), (64, 48), (48, 48)],
        ),
        ("fine", &fine, vec![(73, 8), (8, 8), (32, 24), (24, 24)]),
    ];
    println!(
        "level, rows, kind, taps there, I, O | GFLOP/s of the pairs there: forward, by features, by weight | gathered and multiplied"
    );
    for (name, sites, widths) in shapes {
        let start = Instant::now();
        let maps = UNetMaps::new(sites, &device);
        println!(
            "{name}: maps of {:?} rows in {:.1} ms",
            maps.rows,
            start.elapsed().as_secs_f64() * 1e3
        );
        let same = submanifold(sites, &device);
        let down = pooling(sites, &halved(sites), &device);
        for (kind, map, taps) in [
            ("same", same, 27),
            ("down", down.clone(), 8),
            ("up", down.transposed(), 8),
        ] {
            let there = pairs(&map);
            for (inputs, outputs) in &widths {
                let x = random([map.inputs, *inputs], &device);
                let w = random([taps, *inputs, *outputs], &device);
                let flops = 2.0 * (there * inputs * outputs) as f64;
                let forward = fastest(|| sparse_conv(x.clone(), w.clone(), &map));
                let plain = fastest(|| gathered(x.clone(), w.clone(), &map));
                let backward = |of_x: bool| {
                    let x = Tensor::<2>::from_inner(x.clone());
                    let w = Tensor::<3>::from_inner(w.clone());
                    let (x, w) = if of_x {
                        (x.require_grad(), w)
                    } else {
                        (x, w.require_grad())
                    };
                    let mut best = f64::INFINITY;
                    for _ in 0..7 {
                        let y = sparse_conv(x.clone(), w.clone(), &map);
                        let loss = y.sum();
                        let start = Instant::now();
                        let _ = loss.backward();
                        best = best.min(start.elapsed().as_secs_f64());
                    }
                    best
                };
                let (by_x, by_w) = (backward(true), backward(false));
                println!(
                    "{name} {} {kind} {:.2} {inputs} {outputs} | {:.0} {:.0} {:.0} | {:.0}",
                    map.outputs,
                    there as f64 / (map.outputs * taps) as f64,
                    flops / forward / 1e9,
                    flops / by_x / 1e9,
                    flops / by_w / 1e9,
                    flops / plain / 1e9,
                );
            }
        }
    }
}

fn networks() {
    for (size, config) in [("small", NetConfig::small()), ("full", NetConfig::full())] {
        let planes = config.planes;
        let bases = config.unet;
        for (level, sites) in levels().into_iter().enumerate() {
            let above = if level == 0 {
                0
            } else {
                3 * bases[level - 1] + 1
            };
            let inputs = planes[level] + above;
            let device = Device::flex();
            let decoder = DecoderConfig {
                inputs,
                base: bases[level],
            }
            .init(&device);
            let maps = UNetMaps::new(&sites, &device);
            let x = random([sites.len(), inputs], &device);
            let inference = fastest(|| decoder.forward(x.clone(), &maps));
            let training = device.autodiff();
            let decoder = DecoderConfig {
                inputs,
                base: bases[level],
            }
            .init(&training);
            let maps = UNetMaps::new(&sites, &training);
            let x = random([sites.len(), inputs], &training).require_grad();
            let (mut forward, mut backward) = (f64::INFINITY, f64::INFINITY);
            for _ in 0..5 {
                let start = Instant::now();
                let (features, logit) = decoder.forward(x.clone(), &maps);
                forward = forward.min(start.elapsed().as_secs_f64());
                let loss = features.sum() + logit.sum();
                let start = Instant::now();
                let _ = loss.backward();
                backward = backward.min(start.elapsed().as_secs_f64());
            }
            println!(
                "{size} level {level}: {} rows, {inputs} inputs: inference {:.1} ms, training forward {:.1} ms, backward {:.1} ms",
                sites.len(),
                inference * 1e3,
                forward * 1e3,
                backward * 1e3
            );
        }
    }
}

fn main() {
    convolutions();
    networks();
}
