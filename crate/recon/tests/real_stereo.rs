//! Real scans from colour alone: as good as was asked for, with many views and with few, on every device.
//!
//! They lie beside the repository and are not part of it; without them these tests say that they are skipped. Their depth is
//! not used but to judge.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{Recorder, gpu, open_real, real};
use mesh::ply;
use recon::{
    DepthSource, Limits, Options,
    evaluate::{DepthFigures, Protocol, compare_depth, evaluate, mean_depth},
};
use std::sync::OnceLock;
use stereo::StereoConfig;

/// What a run gave.
struct Figures {
    /// F at 5 cm in TransformerFusion's protocol.
    f_score: f64,
    /// Of the filtered maps, against the sensor's depth.
    depth: DepthFigures,
    /// Frames whose pose was called wrong.
    accused: Vec<String>,
}

/// Runs stereo as it is by default and judges it; `None` where the scan is absent.
fn run(name: &str, views: Option<usize>, device: &Device) -> Option<Figures> {
    let folder = real(name)?;
    let scan = open_real(&folder);
    let options = Options {
        views,
        depth: Some(DepthSource::Stereo(StereoConfig::default())),
        ..Options::default()
    };
    let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
    let mut sink = Recorder::default();
    let outcome = pollster::block_on(recon::run(&scan, &plan, device, &mut sink)).unwrap();
    let maps = |raw: bool| {
        let figures = sink.maps.iter().map(|map| {
            let depth_m = if raw { &map.raw_depth_m } else { &map.depth_m };
            compare_depth(&scan, map.frame, &map.camera, depth_m).unwrap()
        });
        mean_depth(&figures.flatten().collect::<Vec<_>>()).unwrap()
    };
    let mut mesh = pollster::block_on(outcome.volume.mesh()).unwrap();
    mesh.transform(&scan.scan_from_canonical());
    let gt = ply::read(&std::fs::read(folder.join("gt.ply")).unwrap()).unwrap();
    let (protocol, judge) = (Protocol::TransformerFusion, Device::flex());
    let report = evaluate(&mesh, &gt, Some(&scan), protocol, 0, &judge, |_, _| ());
    let surface = pollster::block_on(report).unwrap().surface;
    let accused = sink.findings.iter().filter(|f| f.code == "stereo-pose");
    let figures = Figures {
        f_score: surface.f_score,
        depth: maps(false),
        accused: accused.map(ToString::to_string).collect(),
    };
    println!(
        "{name}, {} keyframes: {surface:?}\n  raw      {:?}\n  filtered {:?}",
        plan.keyframes.len(),
        maps(true),
        figures.depth,
    );
    for finding in &sink.findings {
        println!("  {finding}");
    }
    Some(figures)
}

/// A run that more than one test looks at.
fn livingroom() -> Option<&'static Figures> {
    static FIGURES: OnceLock<Option<Figures>> = OnceLock::new();
    let run = || run("livingroom", None, &Device::flex());
    FIGURES.get_or_init(run).as_ref()
}

fn check(figures: &Figures, f_score: f64, [abs_rel, delta, coverage]: [f64; 3]) {
    let Figures { depth, .. } = figures;
    assert!(
        figures.f_score >= f_score,
        "F {}, at least {f_score} expected",
        figures.f_score
    );
    assert!(
        depth.errors.abs_rel <= abs_rel
            && depth.errors.delta_1 >= delta
            && depth.coverage >= coverage,
        "expected Abs Rel of at most {abs_rel}, {delta} within a factor of 1.25, a coverage of {coverage}; found {depth:?}"
    );
    // Their poses are all right.
    assert_eq!(figures.accused, [""; 0]);
}

#[test]
fn hololens_with_all_keyframes() {
    if let Some(figures) = run("hololens", None, &Device::flex()) {
        check(&figures, 0.66, [0.049, 0.952, 0.73]);
    }
}

#[test]
fn livingroom_with_all_keyframes() {
    if let Some(figures) = livingroom() {
        check(figures, 0.88, [0.025, 0.976, 0.90]);
    }
}

/// Few views must not cost a tenth of the quality.
#[test]
fn hololens_with_sixty_views() {
    if let Some(figures) = run("hololens", Some(60), &Device::flex()) {
        check(&figures, 0.60, [f64::MAX, 0.0, 0.0]);
    }
}

#[test]
fn livingroom_is_the_same_on_the_gpu() {
    let Some(device) = gpu() else { return };
    let (Some(cpu), Some(gpu)) = (livingroom(), run("livingroom", None, &device)) else {
        return;
    };
    let apart = (cpu.f_score - gpu.f_score).abs();
    println!("F on the CPU and the GPU: {apart} apart");
    assert!(apart < 0.005, "F {} and {}", cpu.f_score, gpu.f_score);
}
