//! Planes to voxels: pairs, sampling and fusion against the NumPy reference.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::devices::values;
use common::golden::{check, part};
use glam::{Affine3A, IVec3, Mat3, Vec3};
use mesh::camera::Pinhole;
use net::View;
use net::fusion::{Fusion, FusionConfig, PairTensors, Pairs, Pooling};
use net::ops::rows::sample;
use net::planes::Plane;
use serde_json::Value;

const CHANNELS: usize = 16;
const PLANE: [usize; 2] = [20, 15];
const STRIDE: usize = 8;
const VIEWS: usize = 6;

fn golden() -> Value {
    serde_json::from_str(include_str!("../../../tests/golden/net_fusion.json")).unwrap()
}

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

/// A box, and one voxel that nobody sees.
fn sites() -> Vec<IVec3> {
    let mut sites: Vec<IVec3> = (0..216)
        .map(|i| IVec3::new(i % 6, i / 6 % 6, i / 36))
        .collect();
    sites.insert(100, IVec3::new(0, 0, 1000));
    sites
}

fn pairs() -> Pairs {
    Pairs::find(
        &sites(),
        0.3,
        Vec3::new(-0.4, -0.2, 0.1),
        &views(VIEWS),
        PLANE,
        STRIDE,
    )
}

fn plane_of(name: &str, device: &Device) -> Tensor<4> {
    let shape = [VIEWS, CHANNELS, PLANE[1], PLANE[0]];
    let values = common::numbers(name, shape.iter().product(), 1.0);
    Tensor::from_data(TensorData::new(values, shape), device)
}

#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn pairs_are_those_of_the_reference() {
    let golden = golden();
    let expected = part(&golden, "pairs");
    let pairs = pairs();
    assert_eq!(Some(pairs.len() as u64), expected["count"].as_u64());
    assert_eq!(pairs.voxels(), 217);
    for (view, count) in expected["by_view"].as_array().unwrap().iter().enumerate() {
        let found = pairs.view.iter().filter(|v| **v as usize == view).count();
        assert_eq!(Some(found as u64), count.as_u64(), "pairs of view {view}");
    }
    let unseen = pairs.offsets.windows(2).filter(|o| o[0] == o[1]).count();
    assert_eq!(Some(unseen as u64), expected["voxels_unseen"].as_u64());
    check(&pairs.u, &expected["u"], 1e-5, "u");
    check(&pairs.v, &expected["v"], 1e-5, "v");
    check(&pairs.z_m, &expected["z"], 1e-5, "z");
    let sorted = pairs.offsets.windows(2).all(|o| {
        let views = &pairs.view[o[0] as usize..o[1] as usize];
        views.windows(2).all(|v| v[0] < v[1])
    });
    assert!(sorted, "a voxel's views are in order, each once");
}

#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn truth_of_pairs_is_that_of_the_reference() {
    let depth = common::numbers("depth", VIEWS * 120 * 160, 2.4);
    let depth: Vec<f32> = depth.iter().map(|d| (d + 2.0).max(0.0)).collect();
    let (rows, labels) = pairs().truth(&depth, [160, 120], STRIDE, 0.24);
    let golden = golden();
    let expected = part(&golden, "truth");
    assert_eq!(Some(rows.len() as u64), expected["known"].as_u64());
    assert_eq!(
        Some(labels.iter().sum::<f32>() as u64),
        expected["near"].as_u64()
    );
    let terms = rows
        .iter()
        .zip(&labels)
        .map(|(row, label)| *row as u64 * (1 + *label as u64));
    assert_eq!(Some(terms.sum::<u64>()), expected["checksum"].as_u64());
}

on_each_device! {
    /// Bilinear sampling of every view's plane at its pairs.
    async fn sampling_is_that_of_the_reference(device: Device) {
        let out = sample(plane_of("base", &device), &pairs().on(&device).places);
        check(&values(out).await, part(&golden(), "sample/out"), 1e-5, "sampled");
    }
}

#[cfg(not(target_family = "wasm"))]
on_each_device! {
    /// The transpose of sampling against differences of the reference.
    async fn gradient_of_sampling_is_that_of_the_reference(device: Device) {
        let device = device.autodiff();
        let plane = plane_of("base", &device).require_grad();
        let out = sample(plane.clone(), &pairs().on(&device).places);
        let shape = out.dims();
        let by = common::numbers("sampled", shape.iter().product(), 1.0);
        let grads = (out * Tensor::from_data(TensorData::new(by, shape), &device)).sum().backward();
        let golden = golden();
        let expected = part(&golden, "sample/slopes/base");
        common::golden::check_slopes(&values(plane.grad(&grads).unwrap()).await, expected, 1e-5, "planes");
    }
}

on_each_device! {
    /// A plane sampled at its last pixel, and planes of a single column or row.
    async fn edges_of_planes_are_sampled(device: Device) {
        for [width, height] in [[3, 2], [1, 2], [3, 1], [1, 1]] {
            let numbers: Vec<f32> = (0..width * height).map(|i| i as f32).collect();
            let last = (width * height - 1) as f32;
            let plane = Tensor::<4>::from_data(TensorData::new(numbers, [1, 1, height, width]), &device);
            let pairs = Pairs {
                u: vec![0.0, width as f32 - 1.0],
                v: vec![0.0, height as f32 - 1.0],
                z_m: vec![1.0; 2],
                view: vec![0; 2],
                offsets: vec![0, 2],
                plane: [width, height],
            };
            let out = values(sample(plane, &pairs.on(&device).places)).await;
            assert_eq!(out, [0.0, last], "{width} x {height}");
        }
    }
}

/// The module of a case of the golden file, its planes and its pooling.
fn case(name: &str, device: &Device) -> (Fusion, Plane, Pooling) {
    let config = FusionConfig {
        channels: CHANNELS,
        lift: name != "plain",
        matching: name == "full",
    };
    let plane = Plane {
        base: plane_of("base", device),
        hidden: config.lift.then(|| plane_of("hidden", device)),
        confidence: None,
    };
    let pooling = if name == "mean" {
        Pooling::Mean
    } else {
        Pooling::Softmax
    };
    (common::filled(config.init(device)), plane, pooling)
}

on_each_device! {
    /// All of fusion: with every part, as VoRTX, and with the mean of its first phase.
    async fn fusion_is_that_of_the_reference(device: Device) {
        let golden = golden();
        let pairs: PairTensors = pairs().on(&device);
        for name in ["full", "plain", "mean"] {
            let (fusion, plane, pooling) = case(name, &device);
            let fused = fusion.forward(&plane, &pairs, pooling);
            let expected = part(&golden, &format!("fusion/{name}"));
            check(&values(fused.features).await, &expected["features"], 1e-4, name);
            check(&values(fused.occupancy).await, &expected["occupancy"], 1e-4, name);
        }
    }
}

on_each_device! {
    /// Voxels that nobody sees have the features of nothing, all the same ones.
    async fn what_nobody_sees_is_fused_to_nothing(device: Device) {
        let (fusion, plane, pooling) = case("full", &device);
        let far = [IVec3::new(0, 0, 1000), IVec3::new(0, 0, -1000)];
        let pairs = Pairs::find(&far, 0.3, Vec3::ZERO, &views(VIEWS), PLANE, STRIDE);
        assert!(pairs.is_empty());
        let fused = fusion.forward(&plane, &pairs.on(&device), pooling);
        assert_eq!(fused.features.dims(), [2, CHANNELS]);
        assert_eq!(fused.occupancy.dims(), [0]);
        let beta = common::made_weight("norm.beta", &[CHANNELS]);
        assert_eq!(values(fused.features).await, [beta.clone(), beta].concat());
    }
}

#[cfg(not(target_family = "wasm"))]
on_each_device! {
    /// Backward passes through all of fusion against differences of the reference.
    async fn gradients_are_the_slopes_of_the_reference(device: Device) {
        let device = device.autodiff();
        let golden = golden();
        let pairs = pairs().on(&device);
        let floats = |name: &str, shape: [usize; 2], scale: f32| {
            let values = common::numbers(name, shape.iter().product(), scale);
            Tensor::<2>::from_data(TensorData::new(values, shape), &device)
        };
        for name in ["full", "plain"] {
            let (fusion, plane, pooling) = case(name, &device);
            let plane = Plane {
                base: plane.base.require_grad(),
                hidden: plane.hidden.map(Tensor::require_grad),
                confidence: None,
            };
            let fused = fusion.forward(&plane, &pairs, pooling);
            let [rows] = fused.occupancy.dims();
            let features = fused.features * floats("features", [217, CHANNELS], 1.0);
            let logits = fused.occupancy * floats("occupancies", [rows, 1], 0.3).flatten(0, 1);
            let grads = (features.sum() + logits.sum()).backward();
            let expected = part(&golden, &format!("fusion/{name}/slopes"));
            let mut found = Slopes { grads: &grads, path: Vec::new(), expected, checked: 0 };
            burn::module::Module::visit(&fusion, &mut found);
            found.check("base", &plane.base);
            if let Some(hidden) = &plane.hidden {
                found.check("hidden", hidden);
            }
            assert_eq!(found.checked, expected.as_object().unwrap().len(), "tensors of {name}");
        }
    }
}

#[cfg(not(target_family = "wasm"))]
struct Slopes<'a> {
    grads: &'a burn::tensor::Gradients,
    path: Vec<String>,
    expected: &'a Value,
    checked: usize,
}

#[cfg(not(target_family = "wasm"))]
impl Slopes<'_> {
    fn check<const D: usize>(&mut self, name: &str, tensor: &Tensor<D>) {
        let gradient = tensor
            .grad(self.grads)
            .unwrap_or_else(|| panic!("{name} has no gradient"));
        let gradient = gradient.into_data().try_to_vec::<f32>().unwrap();
        common::golden::check_slopes(&gradient, part(self.expected, name), 1e-4, name);
        self.checked += 1;
    }
}

#[cfg(not(target_family = "wasm"))]
impl burn::module::ModuleVisitor for Slopes<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }
    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }
    fn visit_float<const D: usize>(&mut self, param: &burn::module::Param<Tensor<D>>) {
        self.check(&self.path.join("."), &param.val());
    }
}

#[cfg(not(target_family = "wasm"))]
#[test]
fn parameters_are_those_of_the_method() {
    use net::{Level, NetConfig};
    let device = Device::flex();
    let count = |config: &NetConfig, level| {
        let fusion = FusionConfig::new(config, level).init(&device);
        burn::module::Module::num_params(&fusion)
    };
    let baseline = NetConfig::full().baseline();
    let transformers = [110_801, 28_201, 10_393];
    let norms = [160, 80, 48];
    for (i, level) in Level::ALL.into_iter().enumerate() {
        let channels = baseline.planes[i];
        let expected = transformers[i] + norms[i];
        assert_eq!(count(&baseline, level), expected, "{level:?}");
        let lift = channels * channels + channels;
        assert_eq!(
            count(&NetConfig::full(), level),
            expected + lift,
            "{level:?}"
        );
    }
}

/// With the lift's fresh weights the hidden planes say nothing: the full model starts as the baseline (method 3.8).
#[cfg(not(target_family = "wasm"))]
#[test]
fn a_fresh_lift_changes_nothing() {
    let device = Device::flex();
    let pairs = pairs().on(&device);
    let config = FusionConfig {
        channels: CHANNELS,
        lift: true,
        matching: false,
    };
    let fusion = config.init(&device);
    let fused = |hidden: Option<Tensor<4>>| {
        let plane = Plane {
            base: plane_of("base", &device),
            hidden,
            confidence: None,
        };
        fusion
            .forward(&plane, &pairs, Pooling::Softmax)
            .features
            .into_data()
    };
    fused(Some(plane_of("hidden", &device))).assert_eq(&fused(None), true);
}
