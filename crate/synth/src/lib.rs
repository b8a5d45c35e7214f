//! Rooms made by rule, and pictures of them: the sample that the page starts with, and scans with exact ground truth.
//!
//! A seed names a [`Room`]; [`path`] walks a camera through it; [`render`] draws what the camera sees; and
//! [`SampleScan`] hands all that out as a scan folder that is drawn while it is read.

mod builder;
mod bvh;
mod furniture;
mod layout;
mod material;
mod palette;
mod path;
mod picture;
mod point;
mod random;
mod room;
mod sample;
mod scene;
mod seating;
mod shell;
mod solid;
mod surface;
mod texture;
mod things;
mod trace;
mod training;

pub use layout::Layout;
pub use path::{CLEARANCE_M, View, path};
pub use room::Room;
pub use sample::SampleScan;
pub use trace::{Frame, depth, render};
#[cfg(feature = "gpu")]
pub use training::{Gathered, GpuError, GpuTracer};
pub use training::{TrainingRoom, TrainingScan};
