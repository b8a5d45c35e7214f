//! What a run is told, as TOML.

use crate::data::Augment;
use crate::error::TrainError;
use net::NetConfig;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A training run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainConfig {
    /// Decides the first weights and everything drawn by chance.
    #[serde(default)]
    pub seed: u64,
    /// The network.
    pub net: NetChoice,
    /// What it learns from.
    pub data: DataConfig,
    /// What is changed by chance.
    #[serde(default)]
    pub augment: Augment,
    /// How it learns.
    pub train: ScheduleConfig,
    /// What is written and when.
    pub output: OutputConfig,
}

/// A ready configuration of the network, with what is different.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetChoice {
    /// `small` or `full`.
    pub preset: Preset,
    /// Pixel-level confidence encoding.
    pub pce: Option<bool>,
    /// Affine compensation.
    pub acm: Option<bool>,
    /// Image-plane spatial decoding.
    pub ipsd: Option<bool>,
    /// Likeness of the views' features.
    pub matching: Option<bool>,
    /// Stereo's depth, given to the 3D networks.
    pub guide: Option<bool>,
    /// Widths of the backbone.
    pub backbone: Option<[usize; 5]>,
    /// Channels inside the pyramid.
    pub pyramid: Option<usize>,
    /// Channels of the planes.
    pub planes: Option<[usize; 3]>,
    /// Base widths of the 3D networks.
    pub unet: Option<[usize; 3]>,
}

/// The network's sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// About half of every width.
    Small,
    /// The paper's.
    Full,
}

impl NetChoice {
    /// The network's configuration.
    pub fn config(&self) -> NetConfig {
        let preset = match self.preset {
            Preset::Small => NetConfig::small(),
            Preset::Full => NetConfig::full(),
        };
        NetConfig {
            pce: self.pce.unwrap_or(preset.pce),
            acm: self.acm.unwrap_or(preset.acm),
            ipsd: self.ipsd.unwrap_or(preset.ipsd),
            matching: self.matching.unwrap_or(preset.matching),
            guide: self.guide.unwrap_or(preset.guide),
            backbone: self.backbone.unwrap_or(preset.backbone),
            pyramid: self.pyramid.unwrap_or(preset.pyramid),
            planes: self.planes.unwrap_or(preset.planes),
            unet: self.unet.unwrap_or(preset.unet),
        }
    }
}

/// Scans, and samples of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataConfig {
    /// Folders or zips of scans with depth; `folder/*` is every one in it, `list.txt` names one on each line. From the
    /// working directory.
    pub scans: Vec<PathBuf>,
    /// The same for scans that are only looked at, never learnt from. May be empty.
    #[serde(default)]
    pub validation: Vec<PathBuf>,
    /// Pictures in a sample.
    pub views: usize,
    /// Where given, a sample has any number of pictures from this to `views`.
    pub least_views: Option<usize>,
    /// Width and height of the pictures: multiples of 16.
    pub size: [u32; 2],
    /// Fine voxels (4 cm) of a sample along x, y and z: multiples of 4.
    pub crop: [usize; 3],
    /// Frames whose picture holds at least this share of a sample's known points are taken first; VoRTX asks for one point.
    #[serde(default = "least_seen")]
    pub least_seen: f32,
    /// Depth beyond this many metres makes no truth. VoRTX's 3 m teaches a network that nothing lies farther from every
    /// camera.
    #[serde(default = "max_depth_m")]
    pub max_depth_m: f32,
    /// A folder in which the truth and stereo's depth of each scan are kept for the next run.
    pub cache: Option<PathBuf>,
    /// Threads that prepare samples.
    #[serde(default = "threads")]
    pub threads: usize,
    /// Samples prepared ahead.
    #[serde(default = "ahead")]
    pub ahead: usize,
}

fn least_seen() -> f32 {
    0.2
}

fn max_depth_m() -> f32 {
    5.0
}

fn threads() -> usize {
    2
}

fn ahead() -> usize {
    8
}

/// Steps and rates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduleConfig {
    /// Steps in all.
    pub steps: u64,
    /// The first step with weighted pooling and the lower rate (phase 2 of method 1.11).
    pub fine_tune_from: u64,
    /// Learning rate before that.
    #[serde(default = "rate")]
    pub rate: f64,
    /// Learning rate after that.
    #[serde(default = "fine_tune_rate")]
    pub fine_tune_rate: f64,
    /// Steps over which the rate grows from 0 to its value.
    pub warm_up: u64,
    /// The first step from which the rate falls, evenly, to 0 at the last step. Without: never.
    pub rate_falls_from: Option<u64>,
    /// Samples whose gradients make a step.
    #[serde(default = "one")]
    pub batch: usize,
    /// The first step from which normalisation goes by its running statistics, which then stay: training sees what use
    /// sees. Without: never.
    pub statistics_fixed_from: Option<u64>,
    /// The longest gradient; longer ones are shortened to it. Without: any.
    pub clip: Option<f64>,
    /// The most medium and fine sites of a sample.
    #[serde(default = "most_sites")]
    pub most_sites: [usize; 2],
    /// Stop after this many minutes, with a checkpoint.
    pub minutes: Option<f64>,
}

fn rate() -> f64 {
    1e-3
}

fn fine_tune_rate() -> f64 {
    1e-4
}

fn one() -> usize {
    1
}

fn most_sites() -> [usize; 2] {
    [1 << 14, 1 << 16]
}

/// Checkpoints, log and plot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputConfig {
    /// The run's folder.
    pub folder: PathBuf,
    /// A line in the log every so many steps.
    #[serde(default = "log_every")]
    pub log_every: u64,
    /// Steps between two looks at the held-out scans.
    pub validate_every: u64,
    /// Samples of the held-out scans that are looked at.
    #[serde(default = "validation_samples")]
    pub validation_samples: usize,
    /// Steps between two checkpoints.
    pub checkpoint_every: u64,
    /// Minutes between two checkpoints.
    #[serde(default = "checkpoint_minutes")]
    pub checkpoint_minutes: f64,
    /// The last checkpoints that are kept.
    #[serde(default = "keep")]
    pub keep: usize,
}

fn log_every() -> u64 {
    1
}

fn validation_samples() -> usize {
    16
}

fn checkpoint_minutes() -> f64 {
    15.0
}

fn keep() -> usize {
    3
}

impl TrainConfig {
    /// Reads a configuration.
    ///
    /// # Errors
    /// A file that cannot be read, is no TOML, or says what no run can do.
    pub fn read(path: &Path) -> Result<Self, TrainError> {
        let text =
            std::fs::read_to_string(path).map_err(|error| TrainError::file("read", path, error))?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Reads a configuration from text that comes from `place`.
    ///
    /// # Errors
    /// Text that is no TOML, or says what no run can do.
    pub fn parse(text: &str, place: &str) -> Result<Self, TrainError> {
        let config: Self = toml::from_str(text).map_err(|error| {
            TrainError::unfit(
                place,
                "the settings of a training run",
                error.to_string().trim_end(),
                "see crate/train/configs for examples",
            )
        })?;
        config.check(place)?;
        Ok(config)
    }

    fn check(&self, place: &str) -> Result<(), TrainError> {
        let unfit = |name: &str, expected: &str, found: String| {
            let place = format!("{place}, {name}");
            Err(TrainError::unfit(place, expected, found, "change it"))
        };
        let data = &self.data;
        if data.size.iter().any(|side| *side == 0 || side % 16 != 0) {
            let found = format!("{:?}", data.size);
            return unfit("data.size", "multiples of 16 above 0", found);
        }
        if data.crop.iter().any(|side| *side < 8 || side % 4 != 0) {
            let found = format!("{:?}", data.crop);
            return unfit("data.crop", "multiples of 4 of at least 8", found);
        }
        if data.max_depth_m.is_nan() || data.max_depth_m <= 0.0 {
            let found = data.max_depth_m.to_string();
            return unfit("data.max_depth_m", "a length above 0", found);
        }
        if data
            .least_views
            .is_some_and(|least| least == 0 || least > data.views)
        {
            let found = format!("{:?}", data.least_views);
            return unfit("data.least_views", "from 1 to data.views", found);
        }
        let counts = [
            ("data.views", data.views),
            ("data.threads", data.threads),
            ("data.ahead", data.ahead),
            ("train.batch", self.train.batch),
            ("output.keep", self.output.keep),
            ("output.log_every", self.output.log_every as usize),
            ("output.validate_every", self.output.validate_every as usize),
            (
                "output.checkpoint_every",
                self.output.checkpoint_every as usize,
            ),
        ];
        for (name, count) in counts {
            if count == 0 {
                return unfit(name, "a whole number above 0", "0".to_owned());
            }
        }
        let rates = [
            ("train.rate", self.train.rate),
            ("train.fine_tune_rate", self.train.fine_tune_rate),
            ("train.clip", self.train.clip.unwrap_or(1.0)),
        ];
        for (name, rate) in rates {
            if !(rate > 0.0 && rate.is_finite()) {
                return unfit(name, "a number above 0", rate.to_string());
            }
        }
        Ok(())
    }

    /// Whether step `step` belongs to phase 2: weighted pooling and the lower rate.
    pub fn fine_tunes(&self, step: u64) -> bool {
        step >= self.train.fine_tune_from
    }

    /// The learning rate of step `step`, counted from 0.
    pub fn rate(&self, step: u64) -> f64 {
        let train = &self.train;
        let left = train.rate_falls_from.map_or(1.0, |from| {
            let falling = train.steps.saturating_sub(from).max(1);
            train.steps.saturating_sub(step) as f64 / falling as f64
        });
        if self.fine_tunes(step) {
            return train.fine_tune_rate * left.min(1.0);
        }
        let warmed = (step + 1) as f64 / train.warm_up.max(1) as f64;
        train.rate * warmed.min(left).min(1.0)
    }
}
