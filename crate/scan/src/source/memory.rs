//! A scan held in memory: for tests, for scans made by rule, and for small drops.

use std::collections::HashMap;

use super::{Entry, Source, SourceError};

/// Files in memory.
#[derive(Debug, Clone, Default)]
pub struct MemorySource {
    entries: Vec<Entry>,
    contents: HashMap<String, Vec<u8>>,
}

impl MemorySource {
    /// From paths (relative, forward slashes) and contents. A later file replaces an earlier one of the same path.
    pub fn new(files: impl IntoIterator<Item = (String, Vec<u8>)>) -> Self {
        let contents: HashMap<String, Vec<u8>> = files.into_iter().collect();
        let mut entries: Vec<Entry> = contents
            .keys()
            .map(|path| Entry { path: path.clone() })
            .collect();
        entries.sort_by(|a, b| a.path.cmp(&b.path));
        MemorySource { entries, contents }
    }

    fn bytes(&self, path: &str) -> Result<&[u8], SourceError> {
        match self.contents.get(path) {
            Some(bytes) => Ok(bytes),
            None => Err(SourceError::NotFound {
                path: path.to_owned(),
            }),
        }
    }
}

impl Source for MemorySource {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError> {
        self.bytes(path).map(<[u8]>::to_vec)
    }

    fn read_head(&self, path: &str, len: usize) -> Result<Vec<u8>, SourceError> {
        let bytes = self.bytes(path)?;
        Ok(bytes[..len.min(bytes.len())].to_vec())
    }
}
