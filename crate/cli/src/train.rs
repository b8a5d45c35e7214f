//! `ipdrecon train`: rooms in, weights out.

use crate::failure::Failure;
use ::train::{
    TrainConfig, TrainError, checkpoint::Checkpoint, data::ScanSet, network::Network,
    trainer::Trainer,
};
use burn::tensor::Device;
use clap::{Args, ValueEnum};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// What `train` is told.
#[derive(Args)]
pub struct Arguments {
    /// The settings of the run, a TOML file; examples are in crate/train/configs.
    #[arg(long)]
    config: PathBuf,
    /// Go on from a checkpoint: its folder, or the run's folder for the last one in it.
    #[arg(long, value_name = "FOLDER")]
    resume: Option<PathBuf>,
    /// Begin with the weights of this file (.safetensors), but with fresh memory and at step 0.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    weights: Option<PathBuf>,
    /// Scans to learn from instead of those in the settings; FOLDER/* takes every scan in it.
    #[arg(long, value_name = "FOLDER", num_args = 1..)]
    scans: Vec<PathBuf>,
    /// Scans to look at instead of those in the settings.
    #[arg(long, value_name = "FOLDER", num_args = 1..)]
    validation: Vec<PathBuf>,
    /// The run's folder instead of that in the settings.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Stop after this many minutes, with a checkpoint.
    #[arg(long)]
    minutes: Option<f64>,
    /// Stop at this step.
    #[arg(long)]
    steps: Option<u64>,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t = TrainDevice::Flex)]
    device: TrainDevice,
}

/// Where to train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TrainDevice {
    /// The processor, on all cores.
    Flex,
    /// The graphics card.
    Wgpu,
}

/// Runs `train`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let config = settings(arguments)?;
    let resume = arguments
        .resume
        .as_deref()
        .map(Checkpoint::read)
        .transpose()?;
    let device = match arguments.device {
        TrainDevice::Flex => Device::flex(),
        TrainDevice::Wgpu => {
            let found = Device::wgpu_options().init_with_setup();
            found.map_err(|error| Failure::Gpu(error.to_string()))?.0
        }
    };
    let training = scans(&config, &config.data.scans)?;
    let held_out = match config.data.validation.as_slice() {
        [] => None,
        paths => Some(scans(&config, paths)?),
    };
    eprintln!(
        "{} scans to learn from, {} held out; {}",
        training.entries.len(),
        held_out.as_ref().map_or(0, |set| set.entries.len()),
        config.output.folder.display(),
    );
    let network = Network::new(&config, start_weights(arguments)?);
    let mut trainer = Trainer::new(network, config, resume, training, held_out, device)?;
    let ended = trainer.run(|said| eprintln!("{said}"))?;
    eprintln!(
        "{} at step {}; waited for samples {:.1} % of the time",
        if ended.finished {
            "finished"
        } else {
            "time is up"
        },
        ended.step,
        100.0 * ended.waited_share,
    );
    Ok(())
}

fn settings(arguments: &Arguments) -> Result<TrainConfig, TrainError> {
    let mut config = TrainConfig::read(&arguments.config)?;
    if !arguments.scans.is_empty() {
        config.data.scans.clone_from(&arguments.scans);
    }
    if !arguments.validation.is_empty() {
        config.data.validation.clone_from(&arguments.validation);
    }
    if let Some(output) = &arguments.output {
        config.output.folder.clone_from(output);
    }
    if let Some(steps) = arguments.steps {
        config.train.steps = steps;
    }
    if arguments.minutes.is_some() {
        config.train.minutes = arguments.minutes;
    }
    Ok(config)
}

fn scans(config: &TrainConfig, paths: &[PathBuf]) -> Result<Arc<ScanSet>, TrainError> {
    let data = &config.data;
    let set = ScanSet::from_paths(paths, data.views, data.max_depth_m, data.cache.clone())?;
    Ok(Arc::new(set))
}

fn start_weights(arguments: &Arguments) -> Result<Option<Vec<u8>>, TrainError> {
    let read = |path: &PathBuf| {
        std::fs::read(path).map_err(|error| TrainError::file("read", Path::new(path), error))
    };
    arguments.weights.as_ref().map(read).transpose()
}
