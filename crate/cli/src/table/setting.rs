//! What all figures of a table share.

use burn::tensor::Device;
use clap::ValueEnum;
use recon::{Limits, evaluate};
use std::{num::NonZeroUsize, path::PathBuf};

/// What a number of views bounds.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Of {
    /// The scan: so many keyframes, evenly spread, for every row alike.
    Scan,
    /// Each tile of a network, as in VoRTX and the paper; the scan has all of its keyframes, and rows without tiles do not
    /// change.
    Tile,
}

/// What all cells share.
pub struct Setting {
    /// The most views; `None` for all.
    pub views: Vec<Option<usize>>,
    /// What has no more views than that.
    pub of: Of,
    /// The most views of a tile.
    pub tile_views: Option<usize>,
    /// Random choice of a tile's views with the seeds below this.
    pub seeds: Option<u64>,
    /// How meshes are compared.
    pub protocol: evaluate::Protocol,
    /// Where true meshes lie.
    pub truth: Option<PathBuf>,
    /// How far depth counts, in metres.
    pub reach_m: f32,
    /// The most pixels of a picture.
    pub size: Option<(u32, u32)>,
    /// Where to compute.
    pub device: Device,
    /// That in words.
    pub device_name: String,
    /// What it allows.
    pub limits: Limits,
    /// Scans at a time.
    pub jobs: NonZeroUsize,
}
