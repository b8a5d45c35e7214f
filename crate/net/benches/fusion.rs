//! Where the time of fusion goes on the processor, forward and backward:
//! `cargo bench --workspace --bench net_fusion`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::time::Instant;

use burn::tensor::{Device, Distribution, Tensor};
use net::fusion::{EncoderLayer, FusionConfig, Pairs, Pooling};
use net::ops::attention::attention;
use net::ops::pool::pool;
use net::ops::rows::sample;
use net::planes::Plane;

const PLANE: [usize; 2] = [40, 30];

/// Voxels that all views see, at places spread over the planes. In the crops of training a third of the views see a voxel.
fn pairs(voxels: usize, views: usize) -> Pairs {
    let count = voxels * views;
    // The fractions of multiples of an irrational number fill an interval evenly and in no order.
    let place = |number: f64, size: usize| -> Vec<f32> {
        (1..=count)
            .map(|i| ((i as f64 * number).fract() * (size - 1) as f64) as f32)
            .collect()
    };
    Pairs {
        u: place(0.754_877_666, PLANE[0]),
        v: place(0.569_840_291, PLANE[1]),
        z_m: vec![2.0; count],
        view: (0..count).map(|pair| (pair % views) as u32).collect(),
        offsets: (0..=voxels).map(|n| (n * views) as i32).collect(),
        plane: PLANE,
    }
}

/// Milliseconds of the fastest of three runs, forward and backward.
fn timed(inputs: &[Tensor<2>], run: impl Fn(Vec<Tensor<2>>) -> Tensor<2>) -> [f64; 2] {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..3 {
        let inputs = inputs.iter().map(|t| t.clone().detach().require_grad());
        let inputs = inputs.collect();
        let start = Instant::now();
        let out = run(inputs);
        best[0] = best[0].min(start.elapsed().as_secs_f64() * 1e3);
        let out = out.sum();
        let start = Instant::now();
        let _grads = out.backward();
        best[1] = best[1].min(start.elapsed().as_secs_f64() * 1e3);
    }
    best
}

/// Voxels in thousands, views, channels.
const CASES: [[usize; 3]; 7] = [
    [16, 8, 16],
    [16, 8, 24],
    [16, 8, 40],
    [16, 20, 16],
    [66, 8, 16],
    [66, 8, 24],
    [66, 20, 16],
];

fn random(rows: usize, channels: usize, device: &Device) -> Tensor<2> {
    Tensor::random([rows, channels], Distribution::Normal(0.0, 1.0), device)
}

/// Multiplications and additions of a pair; backward has twice as many, and those of forward again where they are not kept.
fn report(part: &str, flop: usize, pairs: usize, [f, b]: [f64; 2]) {
    let speed = |times: f64, ms: f64| times * (flop * pairs) as f64 / ms / 1e6;
    println!(
        "  {part:10} {f:8.1} {b:8.1} {:8.1} {:8.1}",
        speed(1.0, f),
        speed(2.0, b)
    );
}

fn whole() {
    let device = Device::flex().autodiff();
    for [thousands, views, c] in CASES {
        let pairs = pairs(1000 * thousands, views);
        let on = pairs.on(&device);
        let fusion = FusionConfig {
            channels: c,
            lift: true,
            matching: false,
        }
        .init(&device);
        let planes = random(views * PLANE[0] * PLANE[1], c, &device);
        let shape = [views, c, PLANE[1], PLANE[0]];
        let flop = 2 * (16 * c * c + 4 * views * c) + 4 * c * c;
        println!(
            "{thousands}k voxels, {views} views, {c} channels: forward ms, backward ms, GFLOP/s"
        );
        let plane = |t: &[Tensor<2>]| Plane {
            base: t[0].clone().reshape(shape),
            hidden: Some(t[1].clone().reshape(shape)),
            confidence: None,
        };
        let inputs = [planes.clone(), planes];
        let times = timed(&inputs, |t| {
            fusion.forward(&plane(&t), &on, Pooling::Softmax).features
        });
        report("whole", flop, pairs.len(), times);
        let depth = on.z_m.clone().unsqueeze_dim(1);
        // What the whole would take without the operation that keeps blocks of pairs in the cache.
        let times = timed(&inputs, |t| fusion.tokens(&plane(&t), &on, depth.clone()));
        report("in tensors", flop, pairs.len(), times);
    }
}

fn parts() {
    let device = Device::flex().autodiff();
    for [thousands, views, c] in CASES {
        let pairs = pairs(1000 * thousands, views);
        let rows = pairs.len();
        let on = pairs.on(&device);
        println!(
            "{thousands}k voxels, {views} views, {c} channels: forward ms, backward ms, GFLOP/s"
        );
        let shape = [views, c, PLANE[1], PLANE[0]];
        let planes = random(views * PLANE[0] * PLANE[1], c, &device);
        let times = timed(&[planes], |t| {
            sample(t[0].clone().reshape(shape), &on.places)
        });
        report("sample", 8 * c, rows, times);
        let table = random(rows, c, &device);
        let times = timed(&[table.clone(), table.clone(), table.clone()], |t| {
            attention(t[0].clone(), t[1].clone(), t[2].clone(), &on.segments, 2)
        });
        report("attention", 4 * views * c, rows, times);
        let layer = EncoderLayer::new(c, &device);
        let times = timed(std::slice::from_ref(&table), |t| {
            layer.forward(t[0].clone(), &on.segments)
        });
        report("layer", 16 * c * c + 4 * views * c, rows, times);
        let times = timed(&[table, random(rows, 1, &device)], |t| {
            let logits = t[1].clone().flatten(0, 1);
            pool(t[0].clone(), logits, &on.segments, Pooling::Softmax)
        });
        report("pool", 2 * c, rows, times);
    }
}

fn main() {
    whole();
    parts();
}
