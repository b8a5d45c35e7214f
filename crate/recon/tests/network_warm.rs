//! Kernels that were compiled ahead are not compiled again when the pictures come.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{Recorder, color_alone, gpu, open};
use net::weights;
use recon::{DepthSource, Limits, Options, Preset, Stage, warm_up_network};
use std::time::Instant;

#[test]
fn the_first_run_after_warming_up_is_as_fast_as_the_second() {
    let Some(device) = gpu() else { return };
    let scan = open(color_alone(|_, bytes| bytes));
    let config = Preset::Small.config();
    let options = Options {
        depth: Some(DepthSource::Network(config)),
        views: Some(4),
        ..Options::default()
    };
    let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
    let file = std::fs::read(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../weights/ipdrecon.safetensors"
    ));
    let network = weights::load(file.unwrap().as_slice(), &device).unwrap();
    let began = Instant::now();
    pollster::block_on(warm_up_network(&config, &device)).unwrap();
    let warming_s = began.elapsed().as_secs_f64();
    let mut runs_s = Vec::new();
    for _ in 0..2 {
        let mut sink = Recorder::default();
        let began = Instant::now();
        let processor = Device::flex();
        let run = recon::reconstruct(&scan, &plan, &network, &processor, &mut sink);
        pollster::block_on(run).unwrap();
        assert!(sink.stages.iter().any(|s| s.0 == Stage::Coloring));
        runs_s.push(began.elapsed().as_secs_f64());
    }
    println!(
        "warming up {warming_s:.1} s, then {:.1} s and {:.1} s",
        runs_s[0], runs_s[1]
    );
    // Without warming up it is 2.3 times the second on lavapipe.
    assert!(runs_s[0] < 1.5 * runs_s[1], "{runs_s:?} s");
}
