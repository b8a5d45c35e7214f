//! A scan as the user has it, brought to one canonical form.
//!
//! Every format stores posed pictures a little differently: other file names, other depth units, other axes, no
//! gravity. [`open`] recognises the layout by its content and gives a [`Scan`] in which those differences are
//! gone: camera-to-world poses with OpenCV camera axes (x right, y down, z forward), metres, world Z up, pixel
//! centres at integers. Pictures stay where they are and are decoded one by one when asked for.
//!
//! What is odd about a scan is told as [`Finding`]s; what makes it unusable is a [`ScanError`].

mod camera;
pub mod doctor;
mod error;
mod finding;
mod format;
mod frame;
mod gravity;
mod image;
mod keyframe;
mod numbers;
mod pose;
mod scan;
mod source;

pub use camera::Camera;
pub use error::{FrameError, ScanError};
pub use finding::{Finding, Severity};
pub use format::Format;
pub use frame::{Frame, ImageRef};
pub use gravity::{Gravity, GravitySource};
pub use image::{ColorImage, DepthImage};
pub use keyframe::{KeyframeRule, keyframes};
pub use scan::{Scan, open};
#[cfg(not(target_family = "wasm"))]
pub use source::FolderSource;
pub use source::{Entry, MemorySource, RandomRead, Source, SourceError, ZipSource};
