//! The kernels give what the host's form gives: on a GPU natively and, in wasm, on WebGPU under Node.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use burn::tensor::Device;
use glam::{DAffine3, DQuat, DVec2, DVec3};
use scan::Camera;
use stereo::{
    StereoError,
    depth::{Raw, winners},
    fused::{FusedMatcher, most_planes, most_sources, work, work_by_kernel},
    smooth::{SmoothConfig, smooth},
    sweep::{SweepConfig, sweep},
    view::View,
};

/// Declares a test of an async body on a GPU, natively and in wasm.
macro_rules! on_gpu {
    ($(#[$doc:meta])* async fn $name:ident($device:ident: Device) $body:block) => {
        $(#[$doc])*
        #[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
        #[cfg(target_family = "wasm")]
        async fn $name() {
            let $device = gpu().await;
            $body
        }

        $(#[$doc])*
        #[cfg(not(target_family = "wasm"))]
        #[test]
        fn $name() {
            match gpu() {
                Some($device) => pollster::block_on(async move { $body }),
                None => println!("skipped: no Vulkan, Metal or DirectX adapter on this machine"),
            }
        }
    };
}

#[cfg(not(target_family = "wasm"))]
fn gpu() -> Option<Device> {
    use std::sync::OnceLock;
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    DEVICE
        .get_or_init(|| Device::wgpu_options().init().ok())
        .clone()
}

#[cfg(target_family = "wasm")]
async fn gpu() -> Device {
    use std::cell::RefCell;
    thread_local!(static DEVICE: RefCell<Option<Device>> = const { RefCell::new(None) });
    if let Some(device) = DEVICE.with_borrow(Clone::clone) {
        return device;
    }
    let device = Device::wgpu_options().init_async().await;
    let device = device.expect("WebGPU in the test runner");
    DEVICE.set(Some(device.clone()));
    device
}

/// The wall: z = 2 + 0.3 x + 0.2 y, in metres.
const SLOPE: (f64, f64) = (0.3, 0.2);
const WALL_M: f64 = 2.0;

/// Grey values of the wall: waves down to 0.08 m and a flat patch, where nothing can be matched.
fn shade(x: f64, y: f64) -> f32 {
    if (x - 0.5).hypot(y + 0.3) < 0.12 {
        return 90.0;
    }
    let waves = [
        (7.0, 3.0, 25.0),
        (-11.0, 17.0, 20.0),
        (23.0, 29.0, 18.0),
        (41.0, -37.0, 14.0),
        (3.0, 61.0, 10.0),
        (77.0, 13.0, 10.0),
    ];
    let waves = waves
        .iter()
        .enumerate()
        .map(|(i, (fx, fy, a))| a * (x * fx + y * fy + i as f64).sin());
    (128.0 + waves.sum::<f64>()) as f32
}

/// Depth of the wall at a pixel.
fn depth_m(pose: &DAffine3, camera: &Camera, u: u32, v: u32) -> f64 {
    let pixel = DVec2::new(f64::from(u), f64::from(v));
    let ray = pose.transform_vector3(camera.unproject(pixel, 1.0));
    let eye = pose.translation;
    (WALL_M + SLOPE.0 * eye.x + SLOPE.1 * eye.y - eye.z)
        / (ray.z - SLOPE.0 * ray.x - SLOPE.1 * ray.y)
}

/// The wall from (x, y, 0), turned by some radians around y.
fn look(x_m: f64, y_m: f64, turn: f64, width: u32, height: u32) -> View {
    let focal = f64::from(width) * 0.9;
    let camera = Camera {
        width,
        height,
        fx: focal,
        fy: focal * 1.01,
        cx: f64::from(width) / 2.0 - 0.7,
        cy: f64::from(height) / 2.0 + 0.3,
    };
    let turn = DQuat::from_rotation_y(turn);
    let pose = DAffine3::from_rotation_translation(turn, DVec3::new(x_m, y_m, 0.0));
    let mut gray = Vec::new();
    for v in 0..height {
        for u in 0..width {
            let pixel = DVec2::new(f64::from(u), f64::from(v));
            let point = camera.unproject(pixel, depth_m(&pose, &camera, u, v));
            let point = pose.transform_point3(point);
            gray.push(shade(point.x, point.y));
        }
    }
    View { camera, pose, gray }
}

fn reference() -> View {
    look(0.0, 0.0, 0.0, 83, 61)
}

/// Four views, one of them of another size; each leaves a part of the reference unseen.
fn sources() -> Vec<View> {
    vec![
        look(0.2, 0.0, -0.04, 83, 61),
        look(-0.15, 0.1, 0.05, 83, 61),
        look(0.05, -0.2, 0.0, 70, 64),
        look(-0.1, -0.1, 0.3, 83, 61),
    ]
}

/// Inverse depth of the wall at every pixel of the reference, in 1/m.
fn truth() -> Vec<f32> {
    let view = reference();
    let pixels = view.camera.width * view.camera.height;
    let at = |i: u32| (i % view.camera.width, i / view.camera.width);
    let rho = |(u, v)| 1.0 / depth_m(&view.pose, &view.camera, u, v) as f32;
    (0..pixels).map(|i| rho(at(i))).collect()
}

fn spaced(from: f32, to: f32, count: usize) -> Vec<f32> {
    let step = (to - from) / (count - 1) as f32;
    (0..count).map(|i| from + step * i as f32).collect()
}

const SMOOTH: SmoothConfig = SmoothConfig {
    p1: 0.1,
    p2: 1.0,
    edge: 10.0,
};

fn on_host(base: Option<&[f32]>, offsets: &[f32], config: &SweepConfig) -> Raw {
    let (reference, views) = (reference(), sources());
    let views: Vec<&View> = views.iter().collect();
    let (width, height) = (reference.camera.width, reference.camera.height);
    let cost = sweep(&reference, &views, base, offsets, config);
    let sum = smooth(
        &cost,
        &reference.gray,
        (width as usize, height as usize),
        offsets.len(),
        &SMOOTH,
    );
    winners(&cost, &sum, base, offsets)
}

async fn on_device(
    device: &Device,
    base: Option<&[f32]>,
    offsets: &[f32],
    config: &SweepConfig,
) -> Raw {
    let (reference, views) = (reference(), sources());
    let views: Vec<(usize, &View)> = views.iter().enumerate().collect();
    let mut matcher = FusedMatcher::new(device).expect("a device that runs kernels");
    let raw = matcher.match_view(&reference, &views, base, offsets, config, &SMOOTH);
    raw.await.expect("maps")
}

/// Where a driver multiplies and adds in one, samples differ by a step now and then, and where two planes are equally good, that decides: one pixel in a
/// thousand, and the margin of two. A driver that does neither gives the very same numbers.
fn assert_same(fused: &Raw, host: &Raw) {
    let pixels = host.rho.len();
    let differing = |a: &[f32], b: &[f32], within: &dyn Fn(f32) -> f32| {
        assert_eq!(a.len(), pixels);
        let near = |(a, b): &(&f32, &f32)| (*a - *b).abs() <= within(**b);
        pixels - a.iter().zip(b).filter(near).count()
    };
    let rho = differing(&fused.rho, &host.rho, &|v| 1e-3 * v.abs());
    let zncc = differing(&fused.zncc, &host.zncc, &|_| 1e-3);
    let unique = differing(&fused.unique, &host.unique, &|_| 1e-3);
    println!("of {pixels} pixels differ in inverse depth {rho}, score {zncc}, margin {unique}");
    assert!(rho * 1000 <= pixels, "{rho} inverse depths differ");
    assert!(zncc * 1000 <= pixels, "{zncc} scores differ");
    assert!(unique * 500 <= pixels, "{unique} margins differ");
}

on_gpu! {
    /// 80 planes: some of the last group only fill up. Half of four sources counts.
    async fn kernels_match_the_host(device: Device) {
        let config = SweepConfig { radius: 2, noise_var: 1.0, best: 0.5 };
        let offsets = spaced(1.0 / 6.0, 2.0, 80);
        let fused = on_device(&device, None, &offsets, &config).await;
        assert_same(&fused, &on_host(None, &offsets, &config));

        // And it is the wall: to 2 % of its depth for 19 pixels in 20.
        let truth = truth();
        let near = |(truth, rho): &(&f32, &f32)| (*truth - *rho).abs() < 0.02 * *truth;
        let near = truth.iter().zip(&fused.rho).filter(near).count();
        assert!(near * 20 > truth.len() * 19, "{near} of {} pixels lie on the wall", truth.len());
    }
}

on_gpu! {
    /// Planes around a guess for each pixel, larger windows, all sources.
    async fn kernels_match_the_host_around_a_base(device: Device) {
        let config = SweepConfig { radius: 3, noise_var: 4.0, best: 1.0 };
        let wrong_by = |i: usize| 0.02 * (i as f32 * 0.01).sin();
        let base: Vec<f32> = truth().iter().enumerate().map(|(i, rho)| rho + wrong_by(i)).collect();
        let offsets = spaced(-0.1, 0.1, 17);
        let fused = on_device(&device, Some(&base), &offsets, &config).await;
        assert_same(&fused, &on_host(Some(&base), &offsets, &config));
    }
}

on_gpu! {
    /// Sources stay on the device until others need their place, and are brought again then.
    async fn kept_pictures_change_nothing(device: Device) {
        let config = SweepConfig { radius: 1, noise_var: 1.0, best: 0.5 };
        let offsets = spaced(0.2, 1.0, 48);
        let (view, views) = (reference(), sources());
        let few: Vec<(usize, &View)> = views.iter().enumerate().collect();
        let turned: Vec<(usize, &View)> = few.iter().rev().copied().collect();
        let mut matcher = FusedMatcher::new(&device).expect("a device that runs kernels");
        let mut maps = Vec::new();
        let others = |from: usize| (from..from + 20).map(|key| (key, &views[key % 4])).collect();
        for sources in [few.clone(), turned, others(100), others(200), few] {
            let raw = matcher.match_view(&view, &sources, None, &offsets, &config, &SMOOTH);
            maps.push(raw.await.expect("maps"));
        }
        assert_same(&maps[0], &on_host(None, &offsets, &config));
        assert_eq!(maps[0].rho, maps[1].rho);
        assert_eq!(maps[0].rho, maps[4].rho);
    }
}

on_gpu! {
    /// What does not fit or makes no sense is refused in words, before the device is asked.
    async fn refusals(device: Device) {
        let config = SweepConfig { radius: 2, noise_var: 1.0, best: 0.5 };
        let mut matcher = FusedMatcher::new(&device).expect("a device that runs kernels");
        let (view, views) = (reference(), sources());
        let views: Vec<(usize, &View)> = views.iter().enumerate().collect();
        let mut refused = |sources: &[(usize, &View)], offsets: &[f32]| {
            let costs = matcher.sweep(&view, sources, None, offsets, &config);
            matches!(costs, Err(StereoError::Setting { .. }))
        };
        assert!(refused(&views, &spaced(0.1, 2.0, most_planes(83, 61) + 1)));
        assert!(refused(&views, &[]));
        assert!(refused(&[], &spaced(0.1, 2.0, 32)));
        assert!(refused(&views, &[0.1, 0.2, 0.4, 0.8]));
    }
}

#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn a_device_without_kernels_is_refused() {
    assert!(!FusedMatcher::runs_on(&Device::flex()));
    let refused = FusedMatcher::new(&Device::flex());
    assert!(matches!(refused, Err(StereoError::Device(_))));
}

/// The default size takes all planes that a configuration may ask for, 640x480 takes 96.
#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn limits_and_work() {
    assert!(most_planes(320, 240) >= 256);
    assert_eq!(most_planes(640, 480), 96);
    assert!(most_sources(640, 480, 2) >= 32);
    let kernels = work_by_kernel(320, 240, 128, 12, 2);
    let flops: f64 = kernels.iter().map(|(_, work)| work.flops).sum();
    let all = work(320, 240, 128, 12, 2);
    assert_eq!(all.flops, flops);
    assert!(all.bytes > 0.0);
}
