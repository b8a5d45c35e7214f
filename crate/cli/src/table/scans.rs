//! Which scans a table is about.

use crate::failure::Failure;
use std::path::{Path, PathBuf};

/// Scans under one name.
pub struct Set {
    /// What `generalization` calls it.
    pub name: String,
    /// Folders and zips.
    pub scans: Vec<PathBuf>,
}

/// `NAME=REST` in its two halves.
pub fn named(text: &str) -> Option<(&str, &str)> {
    let halves = text.split_once('=')?;
    (!halves.0.is_empty() && !halves.1.is_empty()).then_some(halves)
}

/// The sets that the arguments name.
pub fn sets(arguments: &[String]) -> Result<Vec<Set>, Failure> {
    if arguments.is_empty() {
        return Err(Failure::NoScans);
    }
    arguments.iter().map(|argument| set(argument)).collect()
}

fn set(argument: &str) -> Result<Set, Failure> {
    let (name, path) = match named(argument) {
        // A path may have an equals sign of its own.
        Some((name, path)) if !name.contains(['/', '\\']) => (Some(name), path),
        _ => (None, argument),
    };
    let path = Path::new(path);
    let stem = match path.file_stem() {
        Some(stem) if stem != "*" => Some(stem),
        _ => path.parent().and_then(Path::file_name),
    };
    let name = match (name, stem) {
        (Some(name), _) => name.to_owned(),
        (None, Some(stem)) => stem.to_string_lossy().into_owned(),
        (None, None) => argument.to_owned(),
    };
    Ok(Set {
        name,
        scans: train::data::scans_at(path)?,
    })
}
