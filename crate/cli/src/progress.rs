//! Progress bars: on a terminal only, and on standard error, so that a pipe gets nothing but results.

use crate::{depth_folder::DepthFolder, failure::Failure};
use indicatif::{ProgressBar, ProgressStyle};
use recon::{Flow, Level, Sink, Stage};
use scan::{Finding, Severity};
use stereo::DepthMap;

/// Shows a run on the terminal.
pub struct Terminal {
    bar: ProgressBar,
    maps: Option<DepthFolder>,
    failed: Option<Failure>,
}

impl Terminal {
    /// Shows nothing yet. Depth maps of stereo will be written to `maps`.
    pub fn new(maps: Option<DepthFolder>) -> Self {
        Self {
            bar: bar("", 0),
            maps,
            failed: None,
        }
    }

    /// Ends the last bar.
    ///
    /// # Errors
    /// A depth map that could not be written, which also stopped the run.
    pub fn finish(self) -> Result<(), Failure> {
        self.bar.finish_and_clear();
        self.failed.map_or(Ok(()), Err)
    }
}

/// A bar with a label; hidden where standard error is no terminal.
pub fn bar(label: &'static str, total: usize) -> ProgressBar {
    let bar = ProgressBar::new(total as u64).with_message(label);
    if let Ok(style) = ProgressStyle::with_template("{msg:12} {bar:32} {pos}/{len}  {eta}") {
        bar.set_style(style);
    }
    bar
}

impl Sink for Terminal {
    fn stage(&mut self, stage: Stage, total: usize) {
        self.bar.finish_and_clear();
        let label = match stage {
            Stage::WarmingUp => "warming up",
            Stage::Matching => "matching",
            Stage::Fusing => "fusing",
            Stage::Features => "features",
            Stage::Decoding(Level::Coarse) => "16 cm voxels",
            Stage::Decoding(Level::Medium) => "8 cm voxels",
            Stage::Decoding(Level::Fine) => "4 cm voxels",
            Stage::Coloring => "colouring",
            Stage::Meshing => "meshing",
        };
        self.bar = bar(label, total);
    }

    fn progress(&mut self, done: usize) {
        self.bar.set_position(done as u64);
    }

    fn finding(&mut self, finding: Finding) {
        self.bar.suspend(|| print_finding(&finding));
    }

    fn depth_map(&mut self, map: &DepthMap) {
        let written = self.maps.as_ref().map(|maps| maps.write(map));
        if let Some(Err(failure)) = written {
            self.failed.get_or_insert(failure);
        }
    }

    async fn checkpoint(&mut self) -> Flow {
        match self.failed {
            Some(_) => Flow::Stop,
            None => Flow::Continue,
        }
    }
}

/// One finding on standard error.
pub fn print_finding(finding: &Finding) {
    let word = match finding.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Info => "note",
    };
    eprintln!("{word}: {finding}");
}
