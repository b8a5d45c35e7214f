//! The whole network: its size, its start, its loss.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::module::Module;
use burn::tensor::Device;
use common::tiny;
use glam::{Affine3A, IVec3, Mat3, Vec3};
use mesh::camera::Pinhole;
use net::fusion::Pooling;
use net::loss::{LossOptions, loss};
use net::sample::Truth;
use net::{Ipdrecon, NetConfig, Sample, View, named};

const WIDTH: usize = 64;
const HEIGHT: usize = 48;

/// Three cameras that look along x at a wall at x = 1.1 m, in a crop of 1.28 x 1.28 x 0.64 m.
fn sample() -> Sample {
    let camera = Pinhole {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        fx: 50.0,
        fy: 50.0,
        cx: 31.5,
        cy: 23.5,
    };
    // Columns: the camera's right, down and forward.
    let turn = Mat3::from_cols(-Vec3::Y, -Vec3::Z, Vec3::X);
    let views: Vec<View> = [-0.2, 0.0, 0.25]
        .map(|y| View {
            camera,
            world_from_camera: Affine3A::from_mat3_translation(
                turn,
                Vec3::new(-0.6, 0.64 + y, 0.32),
            ),
        })
        .to_vec();
    let size = [[8, 8, 4], [16, 16, 8], [32, 32, 16]];
    let mut truth = Truth {
        size,
        ..Truth::default()
    };
    for (l, [nx, ny, nz]) in size.into_iter().enumerate() {
        let voxel_size_m = [0.16, 0.08, 0.04][l];
        for i in 0..nx * ny * nz {
            let off_m = 1.1 - (i % nx) as f32 * voxel_size_m;
            let tsdf = (off_m / 0.12).clamp(-1.0, 1.0);
            truth.occupied[l].push(off_m.abs() < 0.12_f32.max(1.5 * voxel_size_m));
            truth.supervised[l].push(off_m > -0.12);
            if l == 2 {
                truth.tsdf.push(tsdf);
            }
        }
    }
    let pixels = WIDTH * HEIGHT;
    let images = common::numbers("images", views.len() * 3 * pixels, 127.0);
    Sample {
        images: images.iter().map(|v| v + 128.0).collect(),
        depth_m: vec![1.7; views.len() * pixels],
        views,
        truth,
        guide: Vec::new(),
    }
}

fn options() -> LossOptions {
    LossOptions {
        pooling: Pooling::Softmax,
        most_sites: [1 << 14, 1 << 16],
        seed: 1,
        at_least_true: true,
    }
}

/// Parameters whose path starts with `prefix`, without the statistics of normalisation.
fn parameters(model: &Ipdrecon, prefix: &str) -> usize {
    let tensors = named::tensors(model);
    let ours = tensors
        .iter()
        .filter(|(name, _)| name.starts_with(prefix) && !name.contains("running_"));
    ours.map(|(_, data)| data.shape().num_elements()).sum()
}

#[test]
fn parameters_are_those_of_the_paper_and_of_vortx() {
    let device = Device::flex();
    let full = Ipdrecon::new(&NetConfig::full(), &device);
    let baseline = Ipdrecon::new(&NetConfig::full().baseline(), &device);
    let all = parameters(&full, "");
    let vortx = parameters(&baseline, "");
    println!("full {all}, baseline {vortx}");
    for (name, _) in named::tensors(&baseline) {
        assert!(
            !["pce", "acm", "ipsd", "lift"]
                .iter()
                .any(|part| name.contains(part)),
            "{name}"
        );
    }
    let near = |what: &str, found: usize, expected: usize| {
        let off = found as f64 / expected as f64 - 1.0;
        println!(
            "{what}: {found}, expected {expected} ({:+.2} %)",
            100.0 * off
        );
        assert!(off.abs() < 0.02, "{what}");
    };
    near(
        "VoRTX",
        vortx,
        264_072 + 58_208 + 12_464 + 149_395 + 288 + 5_960_851,
    );
    near("what IPDRecon adds", all - vortx, 122_000);
    near("IPDRecon", all, 6_570_000);
    for (level, expected) in [4_499_425, 1_167_905, 293_521].into_iter().enumerate() {
        near(
            "3D network",
            parameters(&baseline, &format!("decoders.{level}.")),
            expected,
        );
    }
}

/// Fused features and view occupancy at some sites of all levels, one after the other.
fn fused(model: &Ipdrecon, sample: &Sample, device: &Device) -> Vec<f32> {
    let shape = [sample.views.len(), 3, HEIGHT, WIDTH];
    let images = burn::tensor::TensorData::new(sample.images.clone(), shape);
    let planes = model.planes(
        burn::tensor::Tensor::from_data(images, device),
        &sample.views,
    );
    let mut found = Vec::new();
    for level in net::Level::ALL {
        let sites: Vec<IVec3> = (0..8 * 8 * 4)
            .map(|i| IVec3::new(i % 8, i / 8 % 8, i / 64))
            .collect();
        let plane = &planes[level as usize];
        let [_, _, height, width] = plane.base.dims();
        let pairs = net::fusion::Pairs::find(
            &sites,
            level.voxel_size_m(),
            Vec3::new(0.4, 0.3, 0.0),
            &sample.views,
            [width, height],
            level.stride(),
        );
        let fused = model.fuse(level, plane, &pairs.on(device), Pooling::Softmax);
        found.extend(fused.features.into_data().iter::<f32>());
        found.extend(fused.occupancy.into_data().iter::<f32>());
    }
    found
}

#[test]
fn fresh_weights_of_the_full_network_are_the_baseline() {
    let device = Device::flex();
    let sample = sample();
    let full = Ipdrecon::new(&tiny(), &device);
    let shared: std::collections::HashMap<_, _> = named::tensors(&full).into_iter().collect();
    let baseline = named::replace(Ipdrecon::new(&tiny().baseline(), &device), |path, _| {
        let data = shared
            .get(path)
            .unwrap_or_else(|| panic!("{path} is in both"));
        Some(data.iter::<f32>().collect())
    });
    let (ours, theirs) = (
        fused(&full, &sample, &device),
        fused(&baseline, &sample, &device),
    );
    let error = common::relative_error(&ours, &theirs);
    assert!(error < 1e-5, "{error}");
    // Not because nothing depends on anything.
    assert!(theirs.iter().any(|v| v.abs() > 0.1));
    let trained = common::filled(full);
    assert!(common::relative_error(&fused(&trained, &sample, &device), &theirs) > 0.1);
}

fn weights(model: &Ipdrecon) -> Vec<f32> {
    let tensors = named::tensors(model);
    tensors
        .iter()
        .flat_map(|(_, data)| data.iter::<f32>().collect::<Vec<_>>())
        .collect()
}

#[test]
fn a_loss_step_is_the_same_on_both_devices() {
    let Some(gpu) = common::devices::gpu() else {
        println!("skipped: no Vulkan, Metal or DirectX adapter on this machine");
        return;
    };
    let sample = sample();
    let step = |device: Device| {
        let device = device.autodiff();
        let model = common::filled(Ipdrecon::new(&tiny(), &device));
        let before = weights(&model);
        let loss = loss(&model, &sample, [WIDTH, HEIGHT], &options(), &device);
        let gradients = burn::optim::GradientsParams::from_grads(loss.total.backward(), &model);
        let optimizer = burn::optim::SgdConfig::new();
        let mut optimizer = optimizer.init();
        let after = optimizer.step(0.01, model, gradients);
        let moved: Vec<f32> = weights(&after)
            .iter()
            .zip(before)
            .map(|(a, b)| a - b)
            .collect();
        let total = loss.total.into_data().iter::<f32>().next().unwrap();
        (total, moved)
    };
    let (cpu_loss, cpu_moved) = step(Device::flex());
    let (gpu_loss, gpu_moved) = step(gpu);
    assert!(
        (cpu_loss - gpu_loss).abs() < 1e-3 * cpu_loss,
        "{cpu_loss} {gpu_loss}"
    );
    let error = common::relative_error(&gpu_moved, &cpu_moved);
    println!("loss {cpu_loss} on flex, {gpu_loss} on wgpu; what a step moves differs by {error:e}");
    assert!(error < 1e-3);
}

#[test]
fn every_parameter_learns_and_the_loss_falls() {
    let device = Device::flex().autodiff();
    device.seed(7);
    let sample = sample();
    // Not the fresh weights: the zeros of the identity start would hide parameters behind them.
    let mut model = common::filled(Ipdrecon::new(&tiny(), &device));
    let first = loss(&model, &sample, [WIDTH, HEIGHT], &options(), &device);
    let gradients = first.total.backward();
    let mut idle = Vec::new();
    let mut check = Learns {
        gradients: &gradients,
        path: Vec::new(),
        idle: &mut idle,
    };
    model.visit(&mut check);
    assert!(idle.is_empty(), "no gradient: {idle:?}");

    model = Ipdrecon::new(&tiny(), &device);
    let mut optimizer = burn::optim::AdamConfig::new().init();
    let mut totals = Vec::new();
    for _ in 0..30 {
        let loss = loss(&model, &sample, [WIDTH, HEIGHT], &options(), &device);
        totals.push(loss.total.clone().into_data().iter::<f32>().next().unwrap());
        let gradients = burn::optim::GradientsParams::from_grads(loss.total.backward(), &model);
        model = optimizer.step(3e-3, model, gradients);
    }
    assert!(totals[29] < 0.5 * totals[0], "{totals:?}");
}

struct Learns<'a> {
    gradients: &'a burn::tensor::Gradients,
    path: Vec<String>,
    idle: &'a mut Vec<String>,
}

impl burn::module::ModuleVisitor for Learns<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(
        &mut self,
        param: &burn::module::Param<burn::tensor::Tensor<D>>,
    ) {
        let path = self.path.join(".");
        let gradient = param.val().grad(self.gradients);
        let moves = gradient.is_some_and(|g| g.into_data().iter::<f32>().any(|v| v != 0.0));
        if !moves && !path.contains("running_") {
            self.idle.push(path);
        }
    }
}
