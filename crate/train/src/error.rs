//! Why a training run cannot start or go on.

use std::path::{Path, PathBuf};

/// Everything that ends a run early.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Something the user gave does not fit.
    #[error("{place}: expected {expected}, found {found}; {advice}")]
    Unfit {
        /// Which file, scan or setting.
        place: String,
        /// What would have done.
        expected: String,
        /// What is there.
        found: String,
        /// What to do.
        advice: String,
    },
    /// A file that cannot be read or written.
    #[error("{}: expected to {action} it, found \"{error}\"; check the path, its permissions and the free space", path.display())]
    File {
        /// Read or write.
        action: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// A scan that cannot be opened.
    #[error("{scan}: {error}")]
    Scan {
        /// Which scan.
        scan: String,
        /// What is wrong with it.
        error: scan::ScanError,
    },
    /// A picture that cannot be read.
    #[error("{scan}: {error}")]
    Picture {
        /// Which scan.
        scan: String,
        /// What is wrong with it.
        error: scan::FrameError,
    },
    /// Stereo depth that cannot be made.
    #[error("{scan}: {error}")]
    Stereo {
        /// Of which scan.
        scan: String,
        /// What is wrong.
        error: stereo::StereoError,
    },
    /// Weights that cannot be read or written.
    #[error("{0}")]
    Weights(String),
    /// The numbers ran away.
    #[error(
        "step {step}: expected a finite loss, found {steps} steps in a row without; lower the learning rate or clip gradients, \
         and go on from an earlier checkpoint"
    )]
    Diverged {
        /// The last step.
        step: u64,
        /// How many in a row.
        steps: u64,
    },
    /// No thread to prepare samples on.
    #[error("expected a thread to prepare samples on, found \"{0}\"; lower data.threads")]
    Thread(std::io::Error),
    /// A thread that prepares samples ended by itself.
    #[error("a thread that prepares samples broke off; what it printed above says why")]
    Worker,
}

impl TrainError {
    /// Something the user gave does not fit.
    pub fn unfit(
        place: impl ToString,
        expected: impl ToString,
        found: impl ToString,
        advice: impl ToString,
    ) -> Self {
        Self::Unfit {
            place: place.to_string(),
            expected: expected.to_string(),
            found: found.to_string(),
            advice: advice.to_string(),
        }
    }

    /// The system refused to `action` a file or folder.
    pub fn file(action: &'static str, path: &Path, error: std::io::Error) -> Self {
        Self::File {
            action,
            path: path.to_owned(),
            error,
        }
    }
}
