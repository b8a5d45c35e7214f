//! Why a scan, or one frame of it, cannot be used.

use thiserror::Error;

use crate::finding::Finding;
use crate::source::SourceError;

/// Why a scan cannot be opened at all. The text names the file, what was expected, what was found and what to do.
#[derive(Debug, Clone, Error)]
pub enum ScanError {
    /// The bytes cannot be reached.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// There are no files.
    #[error("{0}")]
    Empty(Box<Finding>),
    /// The files are in no layout that is known.
    #[error("{0}")]
    Unrecognised(Box<Finding>),
    /// There is not one pose.
    #[error("{0}")]
    NoPoses(Box<Finding>),
    /// Poses are there, but no frame has a usable pose and a picture.
    #[error("{0}")]
    NoUsableFrames(Box<Finding>),
    /// The calibration is missing or unusable.
    #[error("{0}")]
    Intrinsics(Box<Finding>),
}

impl ScanError {
    /// The same as a finding, for a list; `None` when the bytes could not be reached.
    pub fn finding(&self) -> Option<&Finding> {
        match self {
            ScanError::Source(_) => None,
            ScanError::Empty(finding)
            | ScanError::Unrecognised(finding)
            | ScanError::NoPoses(finding)
            | ScanError::NoUsableFrames(finding)
            | ScanError::Intrinsics(finding) => Some(finding),
        }
    }
}

/// Why one picture of one frame cannot be used; the other frames are not touched by it.
#[derive(Debug, Clone, Error)]
pub enum FrameError {
    /// There is no such frame, or it has no colour picture.
    #[error("{0}")]
    Missing(Box<Finding>),
    /// The file cannot be read.
    #[error("{0}")]
    Unreadable(Box<Finding>),
    /// The file is no picture of the expected kind, or is cut short.
    #[error("{0}")]
    Undecodable(Box<Finding>),
    /// The picture's size is not the camera's.
    #[error("{0}")]
    WrongSize(Box<Finding>),
}

impl FrameError {
    /// The same as a finding, for a list.
    pub fn finding(&self) -> &Finding {
        match self {
            FrameError::Missing(finding)
            | FrameError::Unreadable(finding)
            | FrameError::Undecodable(finding)
            | FrameError::WrongSize(finding) => finding,
        }
    }
}
