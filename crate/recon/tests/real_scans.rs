//! Real scans: as good as an independent fusion of the same keyframes, on every device.
//!
//! They lie beside the repository and are not part of it; without them these tests say that they are skipped.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{Recorder, gpu, open_real, real};
use mesh::{Mesh, ply};
use recon::{
    Limits, Options,
    evaluate::{Protocol, evaluate},
};
use std::path::Path;

/// F at 5 cm that an independent fusion reaches, less a hair: plain, then TransformerFusion's protocol.
const HOLOLENS: [f64; 2] = [0.950, 0.970];
const LIVINGROOM: [f64; 2] = [0.983, 0.985];

fn fuse(folder: &Path, device: &Device) -> Mesh {
    let scan = open_real(folder);
    let plan = recon::plan(&scan, &Limits::default(), Options::default()).unwrap();
    let mut sink = Recorder::default();
    let outcome = pollster::block_on(recon::run(&scan, &plan, device, &mut sink)).unwrap();
    let mut mesh = pollster::block_on(outcome.volume.mesh()).unwrap();
    mesh.transform(&scan.scan_from_canonical());
    mesh
}

fn score(folder: &Path, mesh: &Mesh, protocol: Protocol) -> recon::evaluate::Report {
    let scan = open_real(folder);
    let gt = ply::read(&std::fs::read(folder.join("gt.ply")).unwrap()).unwrap();
    let device = Device::flex();
    let report = evaluate(mesh, &gt, Some(&scan), protocol, 0, &device, |_, _| ());
    pollster::block_on(report).unwrap()
}

fn check(name: &str, [plain, transformer_fusion]: [f64; 2], device: &Device) {
    let Some(folder) = real(name) else { return };
    let mesh = fuse(&folder, device);
    for (protocol, least) in [
        (Protocol::Plain, plain),
        (Protocol::TransformerFusion, transformer_fusion),
    ] {
        let surface = score(&folder, &mesh, protocol).surface;
        println!("{name}, {protocol:?}: {surface:?}");
        assert!(
            surface.f_score >= least,
            "{name}, {protocol:?}: F {}, at least {least} expected",
            surface.f_score
        );
    }
}

#[test]
fn hololens_on_the_cpu() {
    check("hololens", HOLOLENS, &Device::flex());
}

#[test]
fn hololens_on_the_gpu() {
    if let Some(device) = gpu() {
        check("hololens", HOLOLENS, &device);
    }
}

#[test]
fn livingroom_on_the_cpu() {
    check("livingroom", LIVINGROOM, &Device::flex());
}

#[test]
fn livingroom_on_the_gpu() {
    if let Some(device) = gpu() {
        check("livingroom", LIVINGROOM, &device);
    }
}

/// VoRTX's protocol from end to end: render, mask, fuse again, compare. What it trims and what its second fusion adds is
/// the same for every mesh, so the ground truth's own score under it is the most that can be had; a fusion of the same
/// depth comes close.
#[test]
fn livingroom_by_the_protocol_of_vortx() {
    let Some(folder) = real("livingroom") else {
        return;
    };
    let gt = ply::read(&std::fs::read(folder.join("gt.ply")).unwrap()).unwrap();
    let most = score(&folder, &gt, Protocol::Vortx).surface.f_score;
    let mesh = fuse(&folder, &Device::flex());
    let report = score(&folder, &mesh, Protocol::Vortx);
    println!("the ground truth itself: F {most}; the fusion: {report:?}");
    let found = report.surface.f_score;
    assert!(found > most - 0.02, "F {found}, {most} can be had");
    let depth = report.depth.unwrap();
    assert!(depth.abs_rel < 0.02 && depth.delta_1 > 0.97, "{depth:?}");
}
