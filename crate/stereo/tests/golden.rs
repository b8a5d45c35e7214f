//! Every step of matching against numbers from NumPy and numba (tests/reference/stereo.py): a slanted wall and a box from
//! four poses under four exposures, through both sweeps, on the host and as kernels.

#![cfg(not(target_family = "wasm"))]
// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use burn::tensor::Device;
use glam::{DAffine3, DMat3, DVec3};
use scan::Camera;
use serde_json::Value;
use stereo::{
    consistency::judge,
    depth::{Raw, winners},
    fused::FusedMatcher,
    planes::{PlanesConfig, local_planes, weights},
    smooth::{SmoothConfig, smooth},
    sweep::{SweepConfig, sweep},
    view::View,
};

fn golden() -> Value {
    serde_json::from_str(include_str!("../../../tests/golden/stereo.json")).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn floats(value: &Value) -> Vec<f32> {
    let numbers = value.as_array().expect("a list").iter();
    numbers.map(|v| number(v) as f32).collect()
}

/// A list of lists, one after the other.
fn rows(value: &Value) -> Vec<f32> {
    value
        .as_array()
        .expect("rows")
        .iter()
        .flat_map(floats)
        .collect()
}

fn views(golden: &Value) -> Vec<View> {
    let view = |value: &Value| {
        let k = |name: &str| number(&value["camera"][name]);
        let row = |r: usize| {
            let numbers = [0, 1, 2, 3].map(|c| number(&value["pose"][r][c]));
            (DVec3::from_slice(&numbers[..3]), numbers[3])
        };
        let [(x, tx), (y, ty), (z, tz)] = [row(0), row(1), row(2)];
        View {
            camera: Camera {
                width: k("width") as u32,
                height: k("height") as u32,
                fx: k("fx"),
                fy: k("fy"),
                cx: k("cx"),
                cy: k("cy"),
            },
            pose: DAffine3 {
                matrix3: DMat3::from_cols(x, y, z).transpose(),
                translation: DVec3::new(tx, ty, tz),
            },
            gray: floats(&value["gray"]),
        }
    };
    let views = golden["views"].as_array().expect("views").iter();
    views.map(view).collect()
}

fn sweep_config(settings: &Value) -> SweepConfig {
    SweepConfig {
        radius: number(&settings["radius"]) as usize,
        noise_var: number(&settings["noise_var"]) as f32,
        best: number(&settings["best"]) as f32,
    }
}

fn smooth_config(settings: &Value) -> SmoothConfig {
    let number = |name: &str| number(&settings[name]) as f32;
    SmoothConfig {
        p1: number("p1"),
        p2: number("p2"),
        edge: number("edge"),
    }
}

fn planes_config(settings: &Value) -> PlanesConfig {
    let number = |name: &str| number(&settings[name]) as f32;
    PlanesConfig {
        radius: number("radius") as i32,
        stride: number("stride") as i32,
        gray: number("gray"),
        relative: number("relative"),
        ridge: number("ridge"),
    }
}

fn spaced(settings: &Value) -> Vec<f32> {
    let (far, near) = (
        1.0 / number(&settings["far_m"]),
        1.0 / number(&settings["near_m"]),
    );
    let count = number(&settings["planes"]) as usize;
    let share = |i: usize| i as f64 / (count - 1) as f64;
    (0..count)
        .map(|i| (far + (near - far) * share(i)) as f32)
        .collect()
}

fn fine_offsets(settings: &Value) -> Vec<f32> {
    let planes = spaced(settings);
    let step = (planes[1] - planes[0]) * number(&settings["fine_step"]) as f32;
    let reach = number(&settings["fine_reach"]) as i32;
    (-reach..=reach).map(|i| i as f32 * step).collect()
}

/// `share` of the numbers must lie within `tolerance`, absolute and relative to the expected: where two planes are equally
/// good, rounding decides.
fn assert_near(what: &str, found: &[f32], expected: &[f32], tolerance: (f32, f32), share: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let off = |(f, e): (&f32, &f32)| (f - e).abs() / (tolerance.0 + tolerance.1 * e.abs());
    let mut off: Vec<f32> = found.iter().zip(expected).map(off).collect();
    off.sort_by(f32::total_cmp);
    let near = off.iter().filter(|&&off| off <= 1.0).count();
    let typical = off[off.len() / 2] * tolerance.0.max(tolerance.1);
    let percent = 100.0 * near as f64 / off.len() as f64;
    println!("{what}: {percent:.2} % near, median difference {typical:.1e}");
    assert!(
        near as f64 >= share * off.len() as f64,
        "{what}: expected {:.2} % within {tolerance:?}, found {percent:.2} %",
        100.0 * share
    );
}

/// `share` of the pixels must be near.
fn assert_maps(what: &str, found: &Raw, expected: &Value, share: f64) {
    let check = |name: &str, found: &[f32], tolerance| {
        let what = format!("{what}, {name}");
        assert_near(&what, found, &floats(&expected[name]), tolerance, share);
    };
    check("rho", &found.rho, (0.0, 1e-3));
    check("zncc", &found.zncc, (1e-3, 0.0));
    check("unique", &found.unique, (2e-3, 0.0));
}

/// The cells of some pixels of a volume.
fn cells(volume: &[f32], planes: usize, pixels: &Value) -> Vec<f32> {
    let pixels = pixels.as_array().expect("pixels").iter();
    let at = pixels.map(|p| p.as_u64().expect("an index") as usize * planes);
    at.flat_map(|at| volume[at..at + planes].to_vec()).collect()
}

/// Costs, sums and winners of one sweep of the first view on the host, held against the file.
fn on_host(golden: &Value, name: &str, base: Option<&[f32]>, offsets: &[f32]) -> Raw {
    let (settings, expected) = (&golden["settings"], &golden[name]);
    let fine = if name == "fine" { "fine_" } else { "" };
    let views = views(golden);
    let sources: Vec<&View> = views[1..].iter().collect();
    let config = sweep_config(&settings[format!("{fine}sweep")]);
    let cost = sweep(&views[0], &sources, base, offsets, &config);
    let config = smooth_config(&settings[format!("{fine}smooth")]);
    let (size, planes) = (views[0].size(), offsets.len());
    let sum = smooth(&cost, &views[0].gray, size, planes, &config);
    let check = |key: &str, found: &[f32], within: f32| {
        let found = cells(found, planes, &golden["pixels"]);
        let what = format!("{name} on the host, {key}");
        assert_near(&what, &found, &rows(&expected[key]), (within, 0.0), 0.999);
    };
    check("cost", &cost, 1e-3);
    check("sum", &sum, 8e-3);
    let raw = winners(&cost, &sum, base, offsets);
    assert_maps(&format!("{name} on the host"), &raw, expected, 0.995);
    raw
}

#[test]
fn both_sweeps_on_the_host() {
    let golden = golden();
    let settings = &golden["settings"];
    let coarse = on_host(&golden, "coarse", None, &spaced(settings));

    let view = &views(&golden)[0];
    let config = planes_config(&settings["local_planes"]);
    let base = local_planes(
        &coarse.rho,
        &weights(&coarse.zncc),
        &view.gray,
        view.size(),
        &config,
    );
    let expected = floats(&golden["base"]);
    assert_near("local planes", &base, &expected, (0.0, 1e-3), 0.995);

    on_host(&golden, "fine", Some(&base), &fine_offsets(settings));
}

/// A driver that multiplies and adds in one has other samples now and then, by a step, which shows where the picture is blank.
#[test]
fn both_sweeps_as_kernels() {
    let Some(device) = Device::wgpu_options().init().ok() else {
        println!("skipped: no Vulkan, Metal or DirectX adapter on this machine");
        return;
    };
    let golden = golden();
    let settings = &golden["settings"];
    let views = views(&golden);
    let sources: Vec<(usize, &View)> = views[1..].iter().enumerate().collect();
    let mut matcher = FusedMatcher::new(&device).expect("a device that runs kernels");
    let base = floats(&golden["base"]);
    for (name, fine, base, offsets) in [
        ("coarse", "", None, spaced(settings)),
        (
            "fine",
            "fine_",
            Some(base.as_slice()),
            fine_offsets(settings),
        ),
    ] {
        let sweep = sweep_config(&settings[format!("{fine}sweep")]);
        let smooth = smooth_config(&settings[format!("{fine}smooth")]);
        let raw = matcher.match_view(&views[0], &sources, base, &offsets, &sweep, &smooth);
        let raw = pollster::block_on(raw).expect("maps");
        assert_maps(&format!("{name} as kernels"), &raw, &golden[name], 0.99);
    }
}

#[test]
fn verdict_of_the_other_views() {
    let golden = golden();
    let views = views(&golden);
    let others = golden["others_rho"].as_array().expect("lists").iter();
    let others: Vec<Vec<f32>> = others.map(floats).collect();
    let sources: Vec<(&View, &[f32])> = views[1..]
        .iter()
        .zip(&others)
        .map(|(view, rho)| (view, rho.as_slice()))
        .collect();
    let verdicts = judge(&views[0], &floats(&golden["fine"]["rho"]), &sources);
    let check = |name: &str, count: &dyn Fn(usize) -> u32| {
        let found: Vec<f32> = (0..verdicts.len()).map(|i| count(i) as f32).collect();
        assert_near(name, &found, &floats(&golden[name]), (0.1, 0.0), 0.995);
    };
    check("visible", &|i| verdicts[i].visible);
    check("agree", &|i| verdicts[i].agree);
    check("close", &|i| verdicts[i].close);

    let unique = floats(&golden["fine"]["unique"]);
    let confidence = verdicts.iter().zip(unique).map(|(v, u)| v.confidence(u));
    let confidence: Vec<f32> = confidence.collect();
    let expected = floats(&golden["confidence"]);
    assert_near("confidence", &confidence, &expected, (1e-2, 0.0), 0.995);
}
