//! Stereo beside a network that wants it: where many views agree, the surface lies where they say.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;
#[path = "common/oracle.rs"]
mod oracle;

use burn::tensor::Device;
use common::{Recorder, color_alone, files, open};
use oracle::{Oracle, config, mesh_of, run_with};
use recon::{
    Stage,
    evaluate::{Protocol, evaluate},
};

#[test]
fn stereo_draws_a_network_that_is_off_towards_the_surface() {
    let scan = open(files(|_, bytes| Some(bytes)));
    let blind = open(color_alone(|_, bytes| bytes));
    let mut truth = Oracle::new(&blind).everywhere();
    truth.transform(&blind.scan_from_canonical());
    let accuracy_m = [false, true].map(|guided| {
        let oracle = Oracle {
            guided,
            off_m: 0.04,
            ..Oracle::new(&blind)
        };
        let mut sink = Recorder::default();
        let outcome = run_with(&blind, config(), &oracle, &mut sink).unwrap();
        assert_eq!(
            sink.stages
                .iter()
                .any(|(stage, _)| *stage == Stage::Matching),
            guided
        );
        let mut mesh = mesh_of(&outcome);
        mesh.transform(&blind.scan_from_canonical());
        let (device, protocol) = (Device::flex(), Protocol::TransformerFusion);
        let judged = evaluate(&mesh, &truth, Some(&scan), protocol, 0, &device, |_, _| ());
        pollster::block_on(judged).unwrap().surface.accuracy_m
    });
    println!("accuracy when off by 4 cm: {accuracy_m:?} m, without and with stereo");
    assert!(accuracy_m[0] > 0.03, "it is off indeed: {accuracy_m:?}");
    // Its cameras stand 1.5 to 3 m away, where maps weigh a quarter and more.
    assert!(accuracy_m[1] < 0.95 * accuracy_m[0], "{accuracy_m:?}");
}
