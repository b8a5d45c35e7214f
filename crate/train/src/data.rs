//! Samples out of scans with depth.

pub mod augment;
pub mod crop;
pub mod picture;
mod sample;
mod set;
pub mod views;
pub mod volume;

pub use sample::{Augment, SampleOptions, Sampler};
pub use set::{Opener, ScanEntry, ScanSet};
