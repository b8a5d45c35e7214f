//! Scans to learn from: rooms of many kinds, walked through with a hand-held camera that is not perfect.

mod camera;
mod colors;
mod furnish;
#[cfg(feature = "gpu")]
mod gpu;
mod light;
mod pieces;
mod place;
mod plan;
mod render;
mod room;
mod scan;
mod shell;
mod site;
mod walk;
mod walls;
mod wishes;

#[cfg(feature = "gpu")]
pub use gpu::{Gathered, GpuError, GpuTracer};
pub use room::TrainingRoom;
pub use scan::TrainingScan;
