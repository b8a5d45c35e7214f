//! Where a scan's bytes come from. Everything is synchronous: the command line has `std::fs`, a web worker has
//! `FileReaderSync`, and a scan reads one small file at a time.

#[cfg(not(target_family = "wasm"))]
mod folder;
mod memory;
mod zip;

use thiserror::Error;

#[cfg(not(target_family = "wasm"))]
pub use folder::FolderSource;
pub use memory::MemorySource;
pub use zip::ZipSource;

/// One file of a source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Path relative to the source's root, with forward slashes.
    pub path: String,
}

/// A set of files that can be read one by one.
pub trait Source {
    /// Every file, in any order.
    fn entries(&self) -> &[Entry];

    /// All bytes of one file.
    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError>;

    /// The first `len` bytes of one file, or all of a shorter one.
    fn read_head(&self, path: &str, len: usize) -> Result<Vec<u8>, SourceError> {
        let mut bytes = self.read(path)?;
        bytes.truncate(len);
        Ok(bytes)
    }

    /// What the user calls it: the folder's or the archive's name; empty when there is none.
    fn name(&self) -> &str {
        ""
    }
}

/// Bytes that can be read from any position: a file, a `Blob`, a vector.
pub trait RandomRead {
    /// Length in bytes.
    fn len_bytes(&self) -> u64;

    /// Exactly `len` bytes from `offset` on; an error of kind `UnexpectedEof` beyond the end.
    fn read_at(&self, offset: u64, len: usize) -> std::io::Result<Vec<u8>>;
}

impl RandomRead for Vec<u8> {
    fn len_bytes(&self) -> u64 {
        self.len() as u64
    }

    fn read_at(&self, offset: u64, len: usize) -> std::io::Result<Vec<u8>> {
        usize::try_from(offset)
            .ok()
            .and_then(|start| self.get(start..start.checked_add(len)?))
            .map(<[u8]>::to_vec)
            .ok_or_else(|| std::io::ErrorKind::UnexpectedEof.into())
    }
}

#[cfg(not(target_family = "wasm"))]
impl RandomRead for std::fs::File {
    fn len_bytes(&self) -> u64 {
        self.metadata().map_or(0, |metadata| metadata.len())
    }

    fn read_at(&self, offset: u64, len: usize) -> std::io::Result<Vec<u8>> {
        use std::io::{Read, Seek, SeekFrom};
        let mut file = self;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = vec![0; len];
        file.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

/// Why bytes cannot be reached.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SourceError {
    /// No file of that name.
    #[error(
        "{path}: expected a file of this name, found none. Check that the whole scan was given"
    )]
    NotFound {
        /// Path inside the source.
        path: String,
    },
    /// The system refused to read.
    #[error(
        "{path}: expected to read it, found \"{cause}\". Check that it still exists and may be read"
    )]
    Unreadable {
        /// Path inside the source, or of the source itself.
        path: String,
        /// What the system said.
        cause: String,
    },
    /// A folder was asked for.
    #[error(
        "{path}: expected a folder, found {found}. Give the folder that holds the scan, or a .zip of it"
    )]
    NotAFolder {
        /// The path that was given.
        path: String,
        /// What is there.
        found: &'static str,
    },
    /// The file is no zip archive.
    #[error(
        "{archive}: expected a zip archive, found {found}. Give a .zip of the scan's folder, or the folder itself"
    )]
    NotAZip {
        /// The archive's name.
        archive: String,
        /// What was found instead.
        found: String,
    },
    /// An entry of an archive that would land outside of it.
    #[error(
        "{archive}: expected paths inside the archive, found the entry \"{entry}\". Do not trust this archive; zip the scan's folder again"
    )]
    UnsafePath {
        /// The archive's name.
        archive: String,
        /// The entry's name as stored.
        entry: String,
    },
    /// An entry of an archive that cannot be unpacked.
    #[error(
        "{entry} in {archive}: expected {expected}, found {found}. Zip the scan's folder again, without a password"
    )]
    BadEntry {
        /// The archive's name.
        archive: String,
        /// The entry's path.
        entry: String,
        /// What was expected.
        expected: &'static str,
        /// What was found instead.
        found: String,
    },
}
