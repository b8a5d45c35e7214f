//! Scans to learn from: rooms of many kinds, walked through with a hand-held camera that is not perfect.

mod camera;
mod colors;
mod furnish;
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

pub use room::TrainingRoom;
pub use scan::TrainingScan;
