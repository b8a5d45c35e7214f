//! Progress bars: on a terminal only, and on standard error, so that a pipe gets nothing but results.

use indicatif::{ProgressBar, ProgressStyle};
use recon::{Flow, Sink, Stage};
use scan::{Finding, Severity};

/// Shows a run on the terminal.
pub struct Terminal {
    bar: ProgressBar,
}

impl Terminal {
    /// Shows nothing yet.
    pub fn new() -> Self {
        Self { bar: bar("", 0) }
    }

    /// Ends the last bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
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
        self.finish();
        let label = match stage {
            Stage::WarmingUp => "warming up",
            Stage::Fusing => "fusing",
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

    async fn checkpoint(&mut self) -> Flow {
        Flow::Continue
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
