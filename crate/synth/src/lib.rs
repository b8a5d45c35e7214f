//! Rooms made by rule, and pictures of them: the sample that the page starts with, and scans with exact ground truth.
//!
//! A seed names a [`Room`]; [`path`] walks a camera through it; [`render`] draws what the camera sees; and
//! [`SampleScan`] hands all that out as a scan folder that is drawn while it is read.

mod builder;
mod bvh;
mod camera;
mod furniture;
mod palette;
mod random;
mod room;
mod seating;
mod shell;
mod solid;
mod texture;
mod things;
mod trace;

pub use camera::Camera;
pub use room::Room;
pub use trace::{Frame, render};
