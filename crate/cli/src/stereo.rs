//! `ipdrecon stereo`: the colour images of a scan to depth, and that to a mesh.

use crate::{failure::Failure, job::DepthJob, size::Size};
use clap::Args;
use recon::DepthSource;
use std::path::PathBuf;
use stereo::StereoConfig;

/// What `stereo` is told.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    job: DepthJob,
    /// Pictures are scaled down to fit into this many pixels.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value_t = Size(StereoConfig::default().size))]
    size: Size,
    /// Write each keyframe's depth into this folder, as 16-bit PNG in millimetres: FRAME.depth.png, and FRAME.raw.png
    /// before it was filtered.
    #[arg(long, value_name = "FOLDER")]
    depth: Option<PathBuf>,
}

/// Runs `stereo`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let config = StereoConfig {
        size: arguments.size.0,
        ..StereoConfig::default()
    };
    let depth = DepthSource::Stereo(config);
    arguments.job.run(depth, arguments.depth.as_deref())
}
