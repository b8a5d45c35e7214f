//! Scans to learn from: rooms of many kinds, walked through with a hand-held camera that is not perfect.

mod scan;

pub use scan::TrainingScan;
