//! A scan in a zip archive (PKWARE APPNOTE 6.3). Only the directory is kept in memory; each file is inflated when
//! it is read, so that an archive of any size can be dropped on a page.

mod directory;

use std::collections::HashMap;
use std::io::{self, Read};

use flate2::read::DeflateDecoder;

use self::directory::Member;
use super::{Entry, RandomRead, Source, SourceError};

/// A zip archive, read by ranges. Knows stored and deflated files, and zip64.
pub struct ZipSource<R: RandomRead> {
    reader: R,
    name: String,
    entries: Vec<Entry>,
    members: HashMap<String, Member>,
}

/// A picture or text of a scan is far smaller; a larger claim is a damaged or hostile archive.
const MAX_FILE_BYTES: u64 = 1 << 30;

impl<R: RandomRead> ZipSource<R> {
    /// Reads the archive's directory.
    ///
    /// # Errors
    /// `NotAZip`, `UnsafePath` (a name with `..`, an absolute one, or one with a drive letter) and `Unreadable`.
    pub fn open(reader: R) -> Result<Self, SourceError> {
        Self::open_named("the dropped file", reader)
    }

    /// The same; `archive` is what errors call it.
    ///
    /// # Errors
    /// As for [`ZipSource::open`].
    pub fn open_named(archive: &str, reader: R) -> Result<Self, SourceError> {
        let members = directory::read(&reader, archive)?;
        let mut entries: Vec<Entry> = members
            .keys()
            .map(|path| Entry { path: path.clone() })
            .collect();
        entries.sort_by(|a, b| a.path.cmp(&b.path));
        Ok(ZipSource {
            reader,
            name: archive.to_owned(),
            entries,
            members,
        })
    }

    fn member(&self, path: &str) -> Result<&Member, SourceError> {
        self.members.get(path).ok_or_else(|| SourceError::NotFound {
            path: path.to_owned(),
        })
    }

    fn bad(&self, path: &str, expected: &'static str, found: impl Into<String>) -> SourceError {
        SourceError::BadEntry {
            archive: self.name.clone(),
            entry: path.to_owned(),
            expected,
            found: found.into(),
        }
    }

    /// Up to `limit` bytes of a file's contents.
    fn unpack(&self, path: &str, member: &Member, limit: u64) -> Result<Vec<u8>, SourceError> {
        if member.encrypted {
            return Err(self.bad(path, "a file without a password", "an encrypted one"));
        }
        if member.size_bytes > MAX_FILE_BYTES {
            let found = format!("{} bytes", member.size_bytes);
            return Err(self.bad(path, "a file of at most 1 GiB", found));
        }
        let start = directory::data_offset(&self.reader, member)
            .map_err(|cause| self.bad(path, "the file's data", cause))?;
        let range = Range {
            reader: &self.reader,
            next: start,
            end: start.saturating_add(member.packed_bytes),
        };
        let mut bytes = Vec::new();
        match member.method {
            0 => range.take(limit).read_to_end(&mut bytes),
            8 => DeflateDecoder::new(range)
                .take(limit)
                .read_to_end(&mut bytes),
            other => {
                let found = format!("compression method {other}");
                return Err(self.bad(path, "a stored or deflated file", found));
            }
        }
        .map_err(|error| self.bad(path, "whole compressed data", error.to_string()))?;
        Ok(bytes)
    }
}

impl<R: RandomRead> Source for ZipSource<R> {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError> {
        let member = self.member(path)?;
        // One byte more than promised shows a file that is longer than it says.
        let bytes = self.unpack(path, member, member.size_bytes + 1)?;
        if bytes.len() as u64 != member.size_bytes || crc32fast::hash(&bytes) != member.crc32 {
            return Err(self.bad(
                path,
                "the bytes that were zipped",
                "damaged data (size or checksum differ)",
            ));
        }
        Ok(bytes)
    }

    fn read_head(&self, path: &str, len: usize) -> Result<Vec<u8>, SourceError> {
        let member = self.member(path)?;
        self.unpack(path, member, member.size_bytes.min(len as u64))
    }

    fn name(&self) -> &str {
        self.name.strip_suffix(".zip").unwrap_or(&self.name)
    }
}

/// A part of the archive as a stream.
struct Range<'a, R> {
    reader: &'a R,
    next: u64,
    end: u64,
}

impl<R: RandomRead> Read for Range<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(self.end - self.next).unwrap_or(usize::MAX);
        let length = left.min(buffer.len());
        buffer[..length].copy_from_slice(&self.reader.read_at(self.next, length)?);
        self.next += length as u64;
        Ok(length)
    }
}
