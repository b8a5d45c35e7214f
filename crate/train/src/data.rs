//! Samples out of scans with depth.

pub mod augment;
pub mod crop;
pub mod guide;
pub mod picture;
mod sample;
mod set;
pub mod views;
pub mod volume;

pub use sample::{Augment, SampleOptions, Sampler};
pub use set::{Opener, ScanEntry, ScanSet, scans_at};

use std::path::Path;

/// Writes a file of the cache. It has another name until it is whole: a run that is stopped leaves no half of it behind.
fn write_whole(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let part = file.with_extension("part");
    std::fs::write(&part, bytes)?;
    std::fs::rename(part, file)
}
