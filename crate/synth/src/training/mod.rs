//! Scans to learn from: rooms of many kinds, walked through with a hand-held camera that is not perfect.

mod camera;
mod colors;
mod furnish;
mod pieces;
mod plan;
mod render;
mod room;
mod scan;
mod shell;
mod site;
mod walk;

pub use room::TrainingRoom;
pub use scan::TrainingScan;
