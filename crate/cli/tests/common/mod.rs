//! The command, and a network for it.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used)]

use burn::tensor::Device;
use net::{
    Ipdrecon, NetConfig, named,
    weights::{Precision, save},
};
use std::{
    path::Path,
    process::{Command, Output},
};

/// Runs the command.
pub fn ipdrecon(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_ipdrecon");
    Command::new(program).args(arguments).output().unwrap()
}

/// What a program said.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A path as an argument.
pub fn str(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A tiny network with random weights that finds a surface everywhere (or, below 0, nowhere) at the coarse and medium level.
pub fn network(guide: bool, sure: f32) -> Vec<u8> {
    let config = NetConfig {
        backbone: [8, 4, 8, 8, 16],
        pyramid: 16,
        planes: [16, 8, 8],
        unet: [4, 4, 4],
        guide,
        ..NetConfig::small()
    };
    let device = Device::flex();
    device.seed(7);
    let mut changed = 0;
    let model = named::replace(Ipdrecon::new(&config, &device), |path, shape| {
        let heads = ["decoders.0.head.bias", "decoders.1.head.bias"];
        heads.contains(&path).then(|| {
            changed += 1;
            vec![sure; shape[0]]
        })
    });
    assert_eq!(changed, 2);
    save(&model, Precision::F16).unwrap()
}
