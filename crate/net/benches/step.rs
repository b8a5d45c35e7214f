//! Seconds of a training step on the processor, forward and backward apart: a made-up wall seen by eight cameras.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::time::Instant;

use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::Device;
use glam::{Affine3A, Mat3, Vec3};
use mesh::camera::Pinhole;
use net::fusion::Pooling;
use net::loss::{LossOptions, loss};
use net::sample::Truth;
use net::{Ipdrecon, NetConfig, Sample, View};

fn sample(views: usize, width: usize, height: usize, fine: [usize; 3]) -> Sample {
    let camera = Pinhole {
        width: width as u32,
        height: height as u32,
        fx: 0.8 * width as f32,
        fy: 0.8 * width as f32,
        cx: 0.5 * (width as f32 - 1.0),
        cy: 0.5 * (height as f32 - 1.0),
    };
    let turn = Mat3::from_cols(-Vec3::Y, -Vec3::Z, Vec3::X);
    let extent = Vec3::from_array(fine.map(|n| n as f32 * 0.04));
    let wall_m = 0.6 * extent.x;
    let place = |i: usize| {
        let share = (i as f32 + 0.5) / views as f32;
        Vec3::new(-1.2, share * extent.y, 0.5 * extent.z)
    };
    let size = [4, 2, 1].map(|step| fine.map(|n| n / step));
    let mut truth = Truth {
        size,
        ..Truth::default()
    };
    for (l, [nx, ny, nz]) in size.into_iter().enumerate() {
        let voxel_size_m = [0.16, 0.08, 0.04][l];
        for i in 0..nx * ny * nz {
            let off_m = wall_m - (i % nx) as f32 * voxel_size_m;
            truth.occupied[l].push(off_m.abs() < 0.12_f32.max(1.5 * voxel_size_m));
            truth.supervised[l].push(off_m > -0.12);
            if l == 2 {
                truth.tsdf.push((off_m / 0.12).clamp(-1.0, 1.0));
            }
        }
    }
    let pixels = width * height;
    Sample {
        views: (0..views)
            .map(|i| View {
                camera,
                world_from_camera: Affine3A::from_mat3_translation(turn, place(i)),
            })
            .collect(),
        images: (0..views * 3 * pixels)
            .map(|i| (i * 7919 % 251) as f32)
            .collect(),
        depth_m: vec![wall_m + 1.2; views * pixels],
        truth,
        guide: Vec::new(),
    }
}

fn main() {
    println!("| configuration | sites | pairs | forward s | backward s | optimiser s |");
    println!("|---|---|---|---|---|---|");
    let device = Device::flex().autodiff();
    for (name, config, fine) in [
        ("small", NetConfig::small(), [64, 64, 48]),
        (
            "small, baseline",
            NetConfig::small().baseline(),
            [64, 64, 48],
        ),
        ("full", NetConfig::full(), [64, 64, 48]),
    ] {
        let sample = sample(8, 160, 128, fine);
        let options = LossOptions {
            pooling: Pooling::Softmax,
            most_sites: [1 << 13, 1 << 14],
            seed: 1,
            at_least_true: true,
        };
        let mut model = Ipdrecon::new(&config, &device);
        let mut optimizer = AdamConfig::new().init();
        let mut best = [f64::INFINITY; 3];
        let mut counts = ([0; 3], [0; 3]);
        for _ in 0..3 {
            let start = Instant::now();
            let loss = loss(&model, &sample, [160, 128], &options, &device);
            loss.total.clone().into_data();
            let forward = start.elapsed().as_secs_f64();
            let start = Instant::now();
            let gradients = GradientsParams::from_grads(loss.total.backward(), &model);
            let backward = start.elapsed().as_secs_f64();
            let start = Instant::now();
            model = optimizer.step(1e-3, model, gradients);
            let update = start.elapsed().as_secs_f64();
            for (best, new) in best.iter_mut().zip([forward, backward, update]) {
                *best = best.min(new);
            }
            counts = (loss.sites, loss.pairs);
        }
        let [forward, backward, update] = best;
        println!(
            "| {name} | {:?} | {:?} | {forward:.3} | {backward:.3} | {update:.3} |",
            counts.0, counts.1
        );
    }
}
