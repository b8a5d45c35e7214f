//! Planes to voxels, as a whole.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::{Device, Tensor, TensorData};
use glam::{Affine3A, IVec3, Mat3, Vec3};
use mesh::camera::Pinhole;
use net::fusion::{FusionConfig, Pairs, Pooling};
use net::planes::Plane;
use net::{Level, NetConfig, View};

/// A camera at `position` that looks at `target`; Z is up.
fn looking(position: Vec3, target: Vec3, camera: Pinhole) -> View {
    let forward = (target - position).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let rotation = Mat3::from_cols(right, forward.cross(right), forward);
    View {
        camera,
        world_from_camera: Affine3A::from_mat3_translation(rotation, position),
    }
}

/// Views around a small box of sites; the last looks away.
fn views(count: usize) -> Vec<View> {
    let camera = Pinhole {
        width: 160,
        height: 120,
        fx: 140.0,
        fy: 140.0,
        cx: 79.5,
        cy: 59.5,
    };
    (0..count)
        .map(|i| {
            let angle = i as f32 * 1.3;
            let position = Vec3::new(
                2.0 * angle.cos() + 0.3,
                2.0 * angle.sin() + 0.3,
                1.0 + 0.1 * i as f32,
            );
            let away = if i + 1 == count { -1.0 } else { 1.0 };
            let target = Vec3::new(0.3 * i as f32, 0.2, 0.4);
            looking(position, position + away * (target - position), camera)
        })
        .collect()
}

fn sites(size: i32) -> Vec<IVec3> {
    (0..size * size * size)
        .map(|i| IVec3::new(i % size, i / size % size, i / size / size))
        .collect()
}

#[cfg(not(target_family = "wasm"))]
#[test]
fn every_weight_has_a_gradient() {
    let device = Device::flex().autodiff();
    let config = NetConfig {
        matching: true,
        ..NetConfig::small()
    };
    let level = Level::Coarse;
    let fusion = common::filled(FusionConfig::new(&config, level).init(&device));
    let views = views(5);
    let pairs = Pairs::find(&sites(8), 0.16, Vec3::ZERO, &views, [10, 8], level.stride());
    assert!(pairs.len() > 500, "{} pairs", pairs.len());
    let channels = config.planes[0];
    let shape = [views.len(), channels, 8, 10];
    let made = |name: &str| {
        let values = common::numbers(name, shape.iter().product(), 1.0);
        Tensor::<4>::from_data(TensorData::new(values, shape), &device).require_grad()
    };
    let plane = Plane {
        base: made("base"),
        hidden: Some(made("hidden")),
        confidence: None,
    };
    let fused = fusion.forward(&plane, &pairs.on(&device), Pooling::Softmax);
    let loss = fused.features.powi_scalar(3).sum() + fused.occupancy.powi_scalar(2).sum();
    let grads = loss.backward();
    let largest = |t: Option<Tensor<4>>| t.unwrap().abs().max().into_scalar::<f32>();
    assert!(largest(plane.base.grad(&grads)) > 0.0);
    assert!(largest(plane.hidden.unwrap().grad(&grads)) > 0.0);
    let count = net::named::tensors(&fusion).len();
    let grads = burn::optim::GradientsParams::from_grads(grads, &fusion);
    assert_eq!(grads.len(), count);
}
