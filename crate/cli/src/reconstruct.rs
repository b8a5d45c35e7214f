//! `ipdrecon reconstruct`: the colour images of a scan to a mesh, by a trained network.

use crate::{
    failure::Failure,
    job::{Job, Opened},
    progress::Terminal,
    size::Size,
    weights::Weights,
};
use clap::{Args, ValueEnum};
use net::{Ipdrecon, weights};
use recon::{DepthSource, NetworkConfig, Options, Preset, ViewChoice};
use std::path::PathBuf;

/// What `reconstruct` is told.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    job: Job,
    /// Trained weights, as `ipdrecon train` writes them (safetensors with the configuration inside); without it those that
    /// come with the program.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Settings that go together; without it those that suit the weights.
    #[arg(long, value_enum)]
    preset: Option<PresetName>,
    /// Make each tile of the room (3.84 x 3.84 x 1.92 m) from at most this many keyframes: the paper's number of views.
    #[arg(long)]
    views: Option<usize>,
    /// Take at most this many keyframes of the scan as a whole, evenly spread.
    #[arg(long)]
    keyframes: Option<usize>,
    /// Seed of the choice of views: the same seed gives the same mesh.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// How a tile's views are chosen, when more than --views see it.
    #[arg(long, value_enum, default_value_t = Choice::Coverage)]
    choice: Choice,
    /// Pictures are scaled down to fit into this many pixels.
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    size: Option<Size>,
    /// The room is expected up to this many metres from the cameras.
    #[arg(long, value_name = "METRES", default_value_t = NetworkConfig::default().reach_m)]
    reach: f32,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetName {
    /// Pictures of 160x120, 20 views a tile: for small networks on a processor.
    Small,
    /// Pictures of 320x240, 60 views a tile.
    Medium,
    /// Pictures of 640x480, 100 views a tile: the paper's.
    Full,
}

#[derive(Clone, Copy, ValueEnum)]
enum Choice {
    /// Those that together see the most of the tile.
    Coverage,
    /// At random, as VoRTX does.
    Random,
}

/// Runs `reconstruct`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = Weights::read(arguments.weights.as_deref())?;
    // Before the scan is opened: that may take long.
    file.get(weights::config)?;
    let opened = arguments.job.open()?;
    let network = file.get(|bytes| weights::load(bytes, &opened.device))?;
    arguments.reconstruct(&opened, &network)
}

impl Arguments {
    fn preset(&self, config: &net::NetConfig) -> Preset {
        match self.preset {
            None => Preset::of(config),
            Some(PresetName::Small) => Preset::Small,
            Some(PresetName::Medium) => Preset::Medium,
            Some(PresetName::Full) => Preset::Full,
        }
    }

    fn reconstruct(&self, opened: &Opened, network: &Ipdrecon) -> Result<(), Failure> {
        let usual = self.preset(network.config()).config();
        let config = NetworkConfig {
            size: self.size.map_or(usual.size, |size| size.0),
            views_a_tile: self.views.unwrap_or(usual.views_a_tile),
            reach_m: self.reach,
            seed: self.seed,
            net: *network.config(),
            choice: match self.choice {
                Choice::Coverage => ViewChoice::Coverage,
                Choice::Random => ViewChoice::Random,
            },
            ..usual
        };
        let plan = opened.plan(Options {
            views: self.keyframes,
            ..self.job.options(DepthSource::Network(config))
        })?;
        let mut terminal = Terminal::new(None);
        let Opened { scan, device, .. } = opened;
        let outcome = recon::reconstruct(scan, &plan, network, device, &mut terminal);
        let outcome = pollster::block_on(outcome);
        terminal.finish()?;
        self.job.write(opened, &outcome?)
    }
}
