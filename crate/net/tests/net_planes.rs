//! Pictures to planes, against tests/reference/net_planes.py and against the method's counts.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::devices::values;
use common::digests::Digests;
use common::filled;
use glam::{Affine3A, EulerRot, Quat, Vec3};
use mesh::camera::Pinhole;
use net::ops::linrec::linrec;
use net::planes::affine::AffineCompensation;
use net::planes::backbone::Backbone;
use net::planes::confidence::ConfidenceEncoding;
use net::planes::decoding::SpatialDecoding;
use net::planes::pyramid::Pyramid;
use net::planes::rays::{RayEncoding, encoded};
use net::planes::{DEVIATION, MEAN, PlaneNet, PlanesError, check_size, plane_size};
use net::{Level, NetConfig, View};

// Sides that halve to odd numbers on the way.
const WIDTH: usize = 72;
const HEIGHT: usize = 56;

fn config() -> NetConfig {
    NetConfig {
        backbone: [8, 6, 10, 12, 20],
        pyramid: 20,
        planes: [20, 12, 8],
        ..NetConfig::full()
    }
}

fn views() -> Vec<View> {
    let camera = Pinhole {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        fx: 64.0,
        fy: 66.0,
        cx: 35.0,
        cy: 28.5,
    };
    [(0.3, 0.2, -0.1), (-1.1, 0.4, 0.7)]
        .map(|(yaw, pitch, roll)| View {
            camera,
            world_from_camera: Affine3A::from_rotation_translation(
                Quat::from_euler(EulerRot::ZYX, yaw, pitch, roll),
                Vec3::new(yaw, pitch, roll),
            ),
        })
        .to_vec()
}

fn tensor(values: Vec<f32>, shape: [usize; 4], device: &Device) -> Tensor<4> {
    Tensor::from_data(TensorData::new(values, shape), device)
}

fn made(name: &str, shape: [usize; 4], device: &Device) -> Tensor<4> {
    tensor(
        common::numbers(name, shape.iter().product(), 1.0),
        shape,
        device,
    )
}

fn images(device: &Device) -> Tensor<4> {
    let shape = [2, 3, HEIGHT, WIDTH];
    let values = common::numbers("images", shape.iter().product(), 127.0);
    tensor(values.iter().map(|v| v + 127.5).collect(), shape, device)
}

fn golden() -> Digests {
    let text = include_str!("../../../tests/golden/net_planes.json");
    Digests::read(text, 1e-4)
}

on_each_device! {
    async fn recurrence_is_the_reference_s(device: Device) {
        let golden = golden();
        let shape = [1, 2, 3, 161];
        let a = || made("factors", shape, &device) / 2.0 + 0.5;
        let x = || made("inputs", shape, &device);
        golden.assert("linrec.forward", linrec(a(), x(), false)).await;
        golden.assert("linrec.backward", linrec(a(), x(), true)).await;
    }
}

on_each_device! {
    async fn backbone_is_the_reference_s(device: Device) {
        let golden = golden();
        let of_channels = |values: [f32; 3]| tensor(values.to_vec(), [1, 3, 1, 1], &device);
        let images = (images(&device) - of_channels(MEAN)) / of_channels(DEVIATION);
        let backbone = filled(Backbone::init(config().backbone, &device));
        let [sixteenth, eighth, quarter] = backbone.forward(images);
        golden.assert("backbone.sixteenth", sixteenth).await;
        golden.assert("backbone.eighth", eighth).await;
        golden.assert("backbone.quarter", quarter).await;
    }
}

on_each_device! {
    async fn pyramid_is_the_reference_s(device: Device) {
        let golden = golden();
        let pyramid = filled(Pyramid::init(&config(), &device));
        let [coarse, medium, fine] = pyramid.forward([
            made("sixteenth", [2, 20, 4, 5], &device),
            made("eighth", [2, 12, 7, 9], &device),
            made("quarter", [2, 10, 14, 18], &device),
        ]);
        golden.assert("pyramid.coarse", coarse).await;
        golden.assert("pyramid.medium", medium).await;
        golden.assert("pyramid.fine", fine).await;
    }
}

on_each_device! {
    async fn each_part_of_a_level_is_the_reference_s(device: Device) {
        let golden = golden();
        let features = made("features", [2, 20, 9, 13], &device);

        let directions = tensor(encoded(&views(), 13, 9, 8), [2, 27, 9, 13], &device);
        golden.assert("rays.encoded", directions).await;
        let rays = filled(RayEncoding::init(20, &device));
        golden.assert("rays.features", rays.forward(features.clone(), &views(), Level::Medium)).await;

        let pce = filled(ConfidenceEncoding::init(20, &device));
        let (encoded, confidence) = pce.forward(features.clone());
        golden.assert("confidence.features", encoded).await;
        golden.assert("confidence.map", confidence).await;

        let acm = filled(AffineCompensation::init(20, &device));
        golden.assert("affine.planes", acm.forward(features.clone())).await;

        let ipsd = filled(SpatialDecoding::init(40, 20, &device));
        let compensated = made("compensated", [2, 40, 9, 13], &device);
        golden.assert("decoding.spatial", ipsd.spatial(compensated.clone())).await;
        golden.assert("decoding.hidden", ipsd.forward(compensated, features)).await;
    }
}

/// The switches' eight settings, with the names that the reference gives them.
fn settings() -> Vec<(String, NetConfig)> {
    (0..8)
        .map(|bits| {
            let [pce, acm, ipsd] = [4, 2, 1].map(|bit| bits & bit != 0);
            let on = [("pce", pce), ("acm", acm), ("ipsd", ipsd)];
            let on: Vec<&str> = on.iter().filter(|on| on.1).map(|on| on.0).collect();
            let name = if on.is_empty() {
                "baseline".to_owned()
            } else {
                on.join("+")
            };
            let config = NetConfig {
                pce,
                acm,
                ipsd,
                ..config()
            };
            (name, config)
        })
        .collect()
}

const LEVELS: [&str; 3] = ["coarse", "medium", "fine"];

on_each_device! {
    async fn the_whole_is_the_reference_s_for_all_settings(device: Device) {
        let golden = golden();
        for (setting, config) in settings() {
            let net = filled(PlaneNet::init(&config, &device));
            let planes = net.forward(images(&device), &views());
            for (level, plane) in LEVELS.iter().zip(planes) {
                let name = |part: &str| format!("{setting}.{level}.{part}");
                golden.assert(&name("base"), plane.base).await;
                assert_eq!(plane.hidden.is_some(), config.ipsd, "{setting}");
                if let Some(hidden) = plane.hidden {
                    golden.assert(&name("hidden"), hidden).await;
                }
                assert_eq!(plane.confidence.is_some(), config.pce, "{setting}");
                if let Some(confidence) = plane.confidence {
                    golden.assert(&name("confidence"), confidence).await;
                }
            }
        }
    }
}

on_each_device! {
    /// Method 3.8: fresh parts change nothing, so that they can be added to a trained baseline. With confidence encoding but
    /// no decoding, features start at sigmoid(2) of the baseline's.
    async fn fresh_parts_leave_the_baseline_s_planes(device: Device) {
        let baseline = filled(PlaneNet::init(&config().baseline(), &device));
        let expected = baseline.forward(images(&device), &views()).map(|plane| plane.base);
        for (setting, config) in settings() {
            let fresh = PlaneNet::init(&config, &device);
            let shared: Vec<String> = ["backbone", "pyramid", "rays"].map(str::to_owned).to_vec();
            let net = net::named::replace(fresh, |path, shape| {
                let shared = shared.iter().any(|part| path.split('.').any(|name| name == part));
                shared.then(|| common::made_weight(path, shape))
            });
            let gain = if config.pce && !config.ipsd { 1.0 / (1.0 + (-2.0_f32).exp()) } else { 1.0 };
            let planes = net.forward(images(&device), &views());
            for ((plane, expected), level) in planes.into_iter().zip(&expected).zip(LEVELS) {
                let expected: Vec<f32> = values(expected.clone()).await.iter().map(|v| v * gain).collect();
                let off = common::relative_error(&values(plane.base).await, &expected);
                assert!(off < 1e-6, "{setting}, {level}: {off:e}");
            }
        }
    }
}

/// Method 2.1, 3.7.
#[cfg(not(target_family = "wasm"))]
#[test]
fn parameters_are_as_many_as_the_method_s() {
    let device = Device::flex();
    let net = PlaneNet::init(&NetConfig::full(), &device);
    // Running statistics are no parameters.
    let learned = |part: &str| -> usize {
        net::named::tensors(&net)
            .iter()
            .filter(|(path, _)| path.contains(part) && !path.contains("running_"))
            .map(|(_, data)| data.num_elements())
            .sum()
    };
    assert_eq!(learned("backbone."), 264_072);
    assert_eq!(learned("pyramid."), 58_208);
    assert_eq!(learned(".rays."), 12_464);
    // MLP_D's second layer, C -> C with bias, is the lift's.
    let lifted = |channels: usize| channels * channels + channels;
    for (level, channels, expected) in [(0, 80, 89_700), (1, 40, 23_200), (2, 24, 8_700)] {
        let parts = ["pce", "acm", "ipsd"].map(|part| learned(&format!("levels.{level}.{part}.")));
        let found = parts.iter().sum::<usize>() + lifted(channels);
        let off = (found as f64 / f64::from(expected) - 1.0).abs();
        assert!(off < 0.02, "level {level}: {found}, {parts:?}");
    }
    let off_by_2_percent = |part: &str, of: usize, expected: f64| {
        let found = learned(&format!("levels.0.{part}.")) - of;
        assert!(
            (found as f64 / expected - 1.0).abs() < 0.02,
            "{part}: {found}"
        );
    };
    let plane_half_of_mlp = 160 * 80 + 80;
    off_by_2_percent("pce", 0, 34_500.0);
    assert_eq!(learned("levels.0.acm."), 81 * 6 + 80);
    off_by_2_percent("ipsd", plane_half_of_mlp, 35_300.0);
    let merge = NetConfig {
        ipsd: false,
        ..NetConfig::full()
    };
    assert!(PlaneNet::init(&merge, &device).levels[0].merge.is_some());
}

#[test]
fn small_pictures_are_refused_with_their_size() {
    assert_eq!(check_size(640, 480), Ok(()));
    assert_eq!(check_size(160, 120), Ok(()));
    let refused = check_size(640, 31).unwrap_err();
    assert_eq!(
        refused,
        PlanesError::TooSmall {
            width: 640,
            height: 31
        }
    );
    assert!(refused.to_string().contains("640 x 31"), "{refused}");
}

/// The smallest size that is allowed runs, and planes have the sizes that are promised.
#[test]
fn planes_have_the_size_that_is_promised() {
    let device = Device::flex();
    let net = PlaneNet::init(&config(), &device);
    for (width, height) in [(32, 32), (33, 47), (160, 120)] {
        let images = Tensor::<4>::zeros([2, 3, height, width], &device);
        let planes = net.forward(images, &views());
        for (level, plane) in Level::ALL.into_iter().zip(planes) {
            let [w, h] = plane_size(width, height, level);
            assert_eq!(plane.base.dims()[2..], [h, w], "{width} x {height}");
        }
    }
}

#[cfg(not(target_family = "wasm"))]
mod trained {
    use burn::module::{Module, ModuleVisitor, Param};
    use burn::tensor::Gradients;
    use net::planes::Plane;

    use super::*;

    fn loss(planes: [Plane; 3]) -> Tensor<1> {
        planes
            .into_iter()
            .flat_map(|plane| [Some(plane.base), plane.hidden, plane.confidence])
            .flatten()
            .map(|t| t.square().mean())
            .reduce(|a, b| a + b)
            .unwrap()
    }

    /// The gradient of every parameter, by path.
    struct Collected<'a> {
        grads: &'a Gradients,
        path: Vec<String>,
        found: Vec<(String, Option<Vec<f32>>)>,
    }

    impl ModuleVisitor for Collected<'_> {
        fn enter_module(&mut self, name: &str, _container: &str) {
            self.path.push(name.to_owned());
        }

        fn exit_module(&mut self, _name: &str, _container: &str) {
            self.path.pop();
        }

        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if param.is_require_grad() {
                let grad = param.val().grad(self.grads);
                let grad = grad.map(|grad| grad.into_data().try_to_vec::<f32>().unwrap());
                self.found.push((self.path.join("."), grad));
            }
        }
    }

    fn gradients(device: &Device) -> Vec<(String, Option<Vec<f32>>)> {
        let net = filled(PlaneNet::init(&config(), device));
        let grads = loss(net.forward(images(device), &views())).backward();
        let mut collected = Collected {
            grads: &grads,
            path: Vec::new(),
            found: Vec::new(),
        };
        net.visit(&mut collected);
        collected.found
    }

    #[test]
    fn every_parameter_has_a_gradient() {
        for (path, grad) in gradients(&Device::flex().autodiff()) {
            let grad = grad.unwrap_or_default();
            let largest = grad.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
            assert!(largest > 0.0, "{path}");
            assert!(grad.iter().all(|g| g.is_finite()), "{path}");
        }
    }

    /// Batch statistics and all: what the processor's loops give, the plain form on a GPU gives too.
    #[test]
    fn a_gpu_gives_the_processor_s_gradients() {
        let Some(gpu) = common::devices::gpu() else {
            println!("skipped: no Vulkan, Metal or DirectX adapter on this machine");
            return;
        };
        let expected = gradients(&Device::flex().autodiff());
        let found = gradients(&gpu.autodiff());
        assert_eq!(found.len(), expected.len());
        let largest = |grad: &Option<Vec<f32>>| {
            let grad = grad.as_ref().unwrap();
            grad.iter().fold(0.0_f32, |m, g| m.max(g.abs()))
        };
        let largest_of_all = expected.iter().map(|e| largest(&e.1)).fold(0.0, f32::max);
        for ((path, found), (_, expected)) in found.into_iter().zip(expected) {
            // A shift before a batch normalisation has no effect: its gradient is rounding.
            let scale = largest(&expected).max(1e-4 * largest_of_all);
            let pairs = found.unwrap().into_iter().zip(expected.unwrap());
            for (found, expected) in pairs {
                let off = (found - expected).abs() / scale;
                assert!(
                    off < 1e-3,
                    "{path}: {found} for {expected}, scale {scale:e}"
                );
            }
        }
    }
}
