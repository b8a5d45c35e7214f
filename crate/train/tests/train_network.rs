//! The real network, made small, under the trainer.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use safetensors::tensor::SafeTensors;
use std::sync::Arc;
use train::TrainConfig;
use train::checkpoint::Checkpoint;
use train::data::ScanSet;
use train::network::Network;
use train::task::Task;
use train::trainer::Trainer;

fn settings(folder: &std::path::Path, steps: u64) -> TrainConfig {
    let mut config = common::settings(folder, steps);
    config.net.backbone = Some([4, 4, 6, 6, 8]);
    config.net.pyramid = Some(8);
    config.net.planes = Some([8, 6, 4]);
    config.net.unet = Some([4, 4, 4]);
    config.train.most_sites = [512, 1024];
    config.train.rate = 3e-3;
    config
}

fn set() -> Arc<ScanSet> {
    common::rooms(2, 12, 48, 48)
}

fn run(config: TrainConfig, resume: Option<Checkpoint>) -> Trainer<Network> {
    let network = Network::new(&config, None);
    let mut trainer =
        Trainer::new(network, config, resume, set(), Some(set()), Device::flex()).unwrap();
    trainer.run(|_| {}).unwrap();
    trainer
}

/// The tensors of a file, bit by bit; the header may name its entries in any order.
fn numbers(file: &[u8]) -> Vec<(String, Vec<u8>)> {
    let file = SafeTensors::deserialize(file).unwrap();
    let mut tensors: Vec<(String, Vec<u8>)> = file
        .tensors()
        .into_iter()
        .map(|(name, view)| (name, view.data().to_vec()))
        .collect();
    tensors.sort();
    tensors
}

#[test]
fn the_seed_alone_decides_the_first_weights() {
    let config = settings(std::path::Path::new("anywhere"), 1);
    let network = Network::new(&config, None);
    let device = Device::flex().autodiff();
    let weights = |seed: u64| {
        let model = network.fresh(seed, &device).unwrap();
        numbers(&network.save(&model).unwrap())
    };
    assert!(
        weights(1) == weights(1),
        "the same seed gives other weights"
    );
    assert!(
        weights(1) != weights(2),
        "another seed gives the same weights"
    );
}

#[test]
fn twenty_steps_of_the_network_are_ten_and_ten() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [whole, halves] = folders.each_ref().map(|f| f.path());
    let straight = run(settings(whole, 20), None);
    run(settings(halves, 10), None);
    let resumed = run(
        settings(halves, 20),
        Some(Checkpoint::read(halves).unwrap()),
    );
    let (a, b) = (
        straight.checkpoint().unwrap(),
        resumed.checkpoint().unwrap(),
    );
    assert_eq!(a.state.step, 20);
    assert!(
        numbers(&a.weights) == numbers(&b.weights),
        "weights and statistics differ"
    );
    assert!(a.adam == b.adam, "the optimiser's memory differs");
    let untrained = run(settings(halves, 0), None).checkpoint().unwrap();
    assert!(
        numbers(&a.weights) != numbers(&untrained.weights),
        "nothing was learnt"
    );
    let first = a.adam.values().next().unwrap();
    assert!(first.first.iter().any(|v| *v != 0.0), "no gradient came");
}

#[test]
fn the_network_learns_the_rooms() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = settings(folder.path(), 60);
    config.train.fine_tune_from = 1000;
    config.train.warm_up = 5;
    run(config, None);
    let lines = train::log::read(folder.path()).unwrap();
    let losses: Vec<f64> = lines
        .iter()
        .filter(|line| line["kind"] == "step")
        .map(|line| line["loss"].as_f64().unwrap())
        .collect();
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let (before, after) = (mean(&losses[..6]), mean(&losses[54..]));
    assert!(after < 0.9 * before, "loss {before} before, {after} after");
    let check = lines
        .iter()
        .rev()
        .find(|line| line["kind"] == "validation")
        .unwrap();
    for part in [
        "loss_view_coarse",
        "loss_occupancy_medium",
        "occupied_medium_recall",
        "distance_error_m",
    ] {
        assert!(
            check[part].as_f64().is_some_and(f64::is_finite),
            "{part}: {check}"
        );
    }
}

#[test]
fn weights_of_another_network_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let weights = run(settings(folder.path(), 1), None)
        .checkpoint()
        .unwrap()
        .weights;
    let mut other = settings(folder.path(), 1);
    other.net.planes = Some([8, 6, 6]);
    let made = |bytes: Vec<u8>| {
        let network = Network::new(&other, Some(bytes));
        let made = Trainer::new(network, other.clone(), None, set(), None, Device::flex());
        made.err().unwrap().to_string()
    };
    let said = made(weights.clone());
    assert!(
        said.starts_with("weights: expected those of the network that the settings name"),
        "{said}"
    );
    let said = made(weights[..weights.len() / 2].to_vec());
    assert!(said.contains("cut short"), "{said}");
}
