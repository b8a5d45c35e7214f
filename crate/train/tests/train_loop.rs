//! The loop: learns, resumes exactly, writes what can be read, and says what is wrong.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::{Device, Tensor};
use common::ToyTask;
use std::path::Path;
use std::sync::Arc;
use train::TrainConfig;
use train::adam::Adam;
use train::checkpoint::Checkpoint;
use train::data::ScanSet;
use train::task::Task;
use train::trainer::{Ended, Trainer};

const TASK: ToyTask = ToyTask { size: [32, 32] };

fn set() -> Arc<ScanSet> {
    common::rooms(2, 8, 48, 48)
}

fn run(config: TrainConfig, resume: Option<Checkpoint>) -> (Trainer<ToyTask>, Ended) {
    let held_out = Some(set());
    let mut trainer = Trainer::new(TASK, config, resume, set(), held_out, Device::flex()).unwrap();
    let ended = trainer.run(|_| {}).unwrap();
    (trainer, ended)
}

fn numbers(model: &impl Module) -> Vec<(String, Vec<f32>)> {
    let tensors = net::named::tensors(model).into_iter();
    tensors
        .map(|(name, data)| (name, data.iter::<f32>().collect()))
        .collect()
}

#[test]
fn twenty_steps_are_ten_and_ten() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [whole, halves] = folders.each_ref().map(|f| f.path().to_owned());
    let (straight, ended) = run(common::settings(&whole, 20), None);
    assert_eq!((ended.step, ended.finished), (20, true));
    run(common::settings(&halves, 10), None);
    let kept = Checkpoint::read(&halves).unwrap();
    assert_eq!(kept.state.step, 10);
    let (resumed, ended) = run(common::settings(&halves, 20), Some(kept));
    assert_eq!(ended.step, 20);
    let (a, b) = (numbers(&straight.model()), numbers(&resumed.model()));
    assert_eq!(a, b, "weights and statistics");
    let (a, b) = (
        straight.checkpoint().unwrap(),
        resumed.checkpoint().unwrap(),
    );
    assert_eq!(a.adam, b.adam, "the optimiser's memory");
    assert!(a.adam.values().all(|moments| moments.time == 20));
    let steps = |folder: &Path| -> Vec<serde_json::Value> {
        let lines = train::log::read(folder).unwrap().into_iter();
        let numbers = ["step", "loss", "rate", "gradient"];
        lines
            .filter(|line| line["kind"] == "step")
            .map(|line| numbers.iter().map(|n| line[*n].clone()).collect())
            .collect()
    };
    assert_eq!(steps(&whole).len(), 20);
    assert_eq!(steps(&whole), steps(&halves), "the log");
}

#[test]
fn it_learns_keeps_the_last_and_the_best_and_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = common::settings(folder.path(), 60);
    config.train.fine_tune_from = 60;
    let (_, ended) = run(config, None);
    assert!(ended.waited_share < 1.0);
    let lines = train::log::read(folder.path()).unwrap();
    let losses: Vec<f64> = lines
        .iter()
        .filter(|line| line["kind"] == "step")
        .map(|line| line["loss"].as_f64().unwrap())
        .collect();
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    assert_eq!(losses.len(), 60);
    assert!(mean(&losses[50..]) < 0.5 * mean(&losses[..5]), "{losses:?}");
    for field in [
        "rate",
        "step_s",
        "waited_s",
        "samples_per_s",
        "gflops",
        "peak_share",
        "loss_share",
        "occupied_coarse_iou",
    ] {
        let step = lines.iter().find(|line| line["kind"] == "step").unwrap();
        assert!(step[field].as_f64().is_some(), "{field}");
    }
    let checks = lines.iter().filter(|line| line["kind"] == "validation");
    let checks: Vec<f64> = checks.map(|line| line["loss"].as_f64().unwrap()).collect();
    assert_eq!(checks.len(), 12);
    let best = Checkpoint::read(&folder.path().join("best")).unwrap();
    let least = checks.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(best.state.best, Some(least));
    let mut names: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|item| item.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "best",
            "plot.svg",
            "step-00000050",
            "step-00000060",
            "train.jsonl"
        ]
    );
    let plot = std::fs::read_to_string(folder.path().join("plot.svg")).unwrap();
    assert!(plot.starts_with("<svg") && plot.trim_end().ends_with("</svg>"));
    assert!(
        plot.contains("held out") && plot.matches("<circle").count() > 12,
        "no curve"
    );
    assert!(!plot.contains("NaN") && !plot.contains("inf"));
}

#[test]
fn a_time_limit_ends_with_a_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = common::settings(folder.path(), 1_000_000);
    config.train.minutes = Some(0.01);
    let (_, ended) = run(config, None);
    assert!(!ended.finished && ended.step > 0);
    assert_eq!(
        Checkpoint::read(folder.path()).unwrap().state.step,
        ended.step
    );
}

#[test]
fn fixed_statistics_stay_and_resume_exactly() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [whole, halves] = folders.each_ref().map(|f| f.path());
    let config = |folder: &Path, steps: u64| {
        let mut config = common::settings(folder, steps);
        config.train.statistics_fixed_from = Some(7);
        config
    };
    let before = numbers(&run(config(halves, 7), None).0.model());
    let (resumed, _) = run(config(halves, 14), Some(Checkpoint::read(halves).unwrap()));
    let (straight, _) = run(config(whole, 14), None);
    let after = numbers(&resumed.model());
    assert_eq!(after, numbers(&straight.model()));
    for ((name, before), (_, after)) in before.iter().zip(&after) {
        let statistics = name.contains("running");
        assert_eq!(before == after, statistics, "{name}");
    }
}

#[test]
fn the_rate_warms_up_and_falls() {
    let config = common::settings(Path::new("anywhere"), 20);
    let rates: Vec<f64> = [0, 1, 3, 8, 11, 12, 19]
        .map(|step| config.rate(step))
        .to_vec();
    assert_eq!(rates, [0.0025, 0.005, 0.01, 0.01, 0.01, 1e-4, 1e-4]);
    assert!(!config.fine_tunes(11) && config.fine_tunes(12));
}

#[test]
fn the_rate_can_fall_to_nothing() {
    let mut config = common::settings(Path::new("anywhere"), 20);
    config.train.rate_falls_from = Some(10);
    let expected = [0.005, 0.01, 0.01, 0.009, 0.8e-4, 0.1e-4, 0.0];
    for (step, expected) in [1, 9, 10, 11, 12, 19, 20].into_iter().zip(expected) {
        let found = config.rate(step);
        assert!((found - expected).abs() < 1e-12, "step {step}: {found}");
    }
}

#[test]
fn adam_is_burns() {
    let device = Device::flex().autodiff();
    let first = TASK.fresh(3, &device).unwrap();
    let mut burns = AdamConfig::new().with_epsilon(1e-8).init();
    let mut ours = Adam::default();
    let (mut a, mut b) = (first.clone(), first);
    let set = set();
    let mut sampler = train::data::Sampler::new(
        set,
        train::data::SampleOptions {
            views: [2; 2],
            size: [32, 32],
            crop: [16, 16, 16],
            ..common::plain(1)
        },
    );
    let moment = train::task::Moment {
        seed: 0,
        fine_tune: false,
        descent: train::task::Descent::Taught,
    };
    for step in 0..5 {
        let sample = sampler.sample(step).unwrap();
        // Both get the gradient of the one, so that rounding does not part them; ours gets it twice as long.
        let grads = |scale: f64| {
            let loss = TASK.look(&a, &sample, &moment, &device).total * scale;
            GradientsParams::from_grads(loss.backward(), &a)
        };
        let (once, twice) = (grads(1.0), grads(2.0));
        a = burns.step(0.01, a, once);
        b = ours.step(b, 0.01, 0.5, twice);
    }
    for ((name, x), (_, y)) in numbers(&a.valid()).iter().zip(&numbers(&b.valid())) {
        let off = x
            .iter()
            .zip(y)
            .map(|(x, y)| (x - y).abs())
            .fold(0.0, f32::max);
        assert!(off < 2e-6, "{name} differs by {off}");
    }
}

#[test]
fn the_gradients_length_is_that_of_all_together() {
    let device = Device::flex().autodiff();
    let model = TASK.fresh(3, &device).unwrap();
    let weights: f64 = numbers(&model)
        .iter()
        .filter(|(name, _)| !name.contains("running"))
        .map(|(_, values)| values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>())
        .sum();
    // The gradient of half the sum of squares is the weights themselves.
    let squares = Squares::of(&model);
    let grads = GradientsParams::from_grads((squares * 0.5).backward(), &model);
    let norm = train::adam::norm(&model, &grads);
    assert!(
        (norm - weights.sqrt()).abs() < 1e-4 * norm,
        "{norm} for {}",
        weights.sqrt()
    );
}

struct Squares(Option<Tensor<1>>);

impl Squares {
    fn of(model: &impl Module) -> Tensor<1> {
        let mut squares = Self(None);
        model.visit(&mut squares);
        squares.0.unwrap()
    }
}

impl burn::module::ModuleVisitor for Squares {
    fn visit_float<const D: usize>(&mut self, param: &burn::module::Param<Tensor<D>>) {
        if param.is_require_grad() {
            let square = param.val().square().sum();
            self.0 = Some(match self.0.take() {
                Some(sum) => sum + square,
                None => square,
            });
        }
    }
}

#[test]
fn damaged_and_foreign_checkpoints_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let said = Checkpoint::read(folder.path()).err().unwrap().to_string();
    assert!(
        said.contains("expected a checkpoint") && said.contains("without --resume"),
        "{said}"
    );
    run(common::settings(folder.path(), 2), None);
    let kept = folder.path().join("step-00000002");
    for name in ["adam.safetensors", "run.json"] {
        let file = kept.join(name);
        let bytes = std::fs::read(&file).unwrap();
        std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
        let said = Checkpoint::read(folder.path()).err().unwrap().to_string();
        assert!(
            said.contains(name) && said.contains("earlier checkpoint"),
            "{said}"
        );
        std::fs::write(&file, bytes).unwrap();
    }
    let checkpoint = Checkpoint::read(&kept).unwrap();
    let mut other = common::settings(folder.path(), 4);
    other.net.pce = Some(false);
    let made = Trainer::new(TASK, other, Some(checkpoint), set(), None, Device::flex());
    let said = made.err().unwrap().to_string();
    assert!(
        said.starts_with("--resume: expected a checkpoint of the network"),
        "{said}"
    );
}

#[test]
fn settings_that_cannot_be_say_so() {
    let good = toml::to_string(&common::settings(Path::new("runs/x"), 5)).unwrap();
    assert!(TrainConfig::parse(&good, "x.toml").is_ok());
    for (from, to, expected) in [
        ("views = 3", "wiews = 3", "unknown field `wiews`"),
        (
            "views = 3",
            "views = 0",
            "x.toml, data.views: expected a whole number above 0, found 0",
        ),
        (
            "size = [32, 32]",
            "size = [32, 30]",
            "x.toml, data.size: expected multiples of 16",
        ),
        (
            "crop = [16, 16, 16]",
            "crop = [16, 18, 16]",
            "x.toml, data.crop: expected multiples of 4",
        ),
        (
            "rate = 0.01",
            "rate = -1.0",
            "x.toml, train.rate: expected a number above 0, found -1",
        ),
        (
            "preset = \"small\"",
            "preset = \"huge\"",
            "unknown variant `huge`",
        ),
    ] {
        assert!(good.contains(from), "{good}");
        let said = TrainConfig::parse(&good.replacen(from, to, 1), "x.toml")
            .err()
            .unwrap()
            .to_string();
        assert!(said.contains(expected), "{said}");
    }
    let missing = Path::new("no/such/folder/*").to_owned();
    let said = ScanSet::from_paths(&[missing], 3, 3.0, None)
        .err()
        .unwrap()
        .to_string();
    assert!(
        said.contains("no/such/folder: expected to read it"),
        "{said}"
    );
    let empty = tempfile::tempdir().unwrap();
    let said = ScanSet::from_paths(&[empty.path().join("*")], 3, 3.0, None)
        .err()
        .unwrap()
        .to_string();
    assert!(
        said.contains("expected folders of scans, found none") && said.contains("ipdrecon synth"),
        "{said}"
    );
}
