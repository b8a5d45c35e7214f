//! `ipdrecon fuse`: the depth images of a scan to a mesh.

use crate::{failure::Failure, job::DepthJob};
use clap::Args;
use recon::DepthSource;

/// What `fuse` is told.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    job: DepthJob,
}

/// Runs `fuse`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    arguments.job.run(DepthSource::Sensor, None)
}
