//! `ipdrecon stereo`: the colour images of a scan to depth, and that to a mesh.

use crate::{failure::Failure, job::DepthJob};
use clap::Args;
use recon::DepthSource;
use std::{fmt, path::PathBuf, str::FromStr};
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

/// Width and height in pixels.
#[derive(Clone, Copy)]
struct Size((u32, u32));

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self((width, height)) = self;
        write!(f, "{width}x{height}")
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X']);
        let sides = sides.and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
        sides
            .map(Self)
            .ok_or_else(|| "expected width x height in pixels, such as 320x240".to_owned())
    }
}
