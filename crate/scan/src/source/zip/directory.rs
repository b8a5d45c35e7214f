//! The central directory at the end of a zip archive: which files there are and where their data lies.

use std::collections::HashMap;
use std::io;

use super::super::{RandomRead, SourceError};

/// Where a file lies in the archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Member {
    pub method: u16,
    pub encrypted: bool,
    pub crc32: u32,
    pub packed_bytes: u64,
    pub size_bytes: u64,
    header_offset: u64,
}

const END: &[u8] = b"PK\x05\x06";
const END_LEN: usize = 22;
const END64_LOCATOR: &[u8] = b"PK\x06\x07";
const END64_LOCATOR_LEN: u64 = 20;
const END64: &[u8] = b"PK\x06\x06";
const END64_LEN: usize = 56;
const CENTRAL: &[u8] = b"PK\x01\x02";
const CENTRAL_LEN: usize = 46;
const LOCAL: &[u8] = b"PK\x03\x04";
const LOCAL_LEN: usize = 30;
/// Room for half a million files.
const MAX_DIRECTORY_BYTES: u64 = 64 << 20;

/// Little-endian fields of a record.
struct Record<'a>(&'a [u8]);

impl Record<'_> {
    fn u16(&self, at: usize) -> Option<u16> {
        Some(u16::from_le_bytes(self.0.get(at..at + 2)?.try_into().ok()?))
    }

    fn u32(&self, at: usize) -> Option<u32> {
        Some(u32::from_le_bytes(self.0.get(at..at + 4)?.try_into().ok()?))
    }

    fn u64(&self, at: usize) -> Option<u64> {
        Some(u64::from_le_bytes(self.0.get(at..at + 8)?.try_into().ok()?))
    }
}

/// Reads the directory: path to place. Folders and what macOS and Windows add are left out by the caller.
pub(super) fn read(
    reader: &impl RandomRead,
    archive: &str,
) -> Result<HashMap<String, Member>, SourceError> {
    let no_zip = |found: String| SourceError::NotAZip {
        archive: archive.to_owned(),
        found,
    };
    let unreadable = |error: io::Error| SourceError::Unreadable {
        path: archive.to_owned(),
        cause: error.to_string(),
    };
    let (offset, length) = locate(reader)
        .map_err(unreadable)?
        .ok_or_else(|| no_zip(what_it_is(reader)))?;
    let fits = offset
        .checked_add(length)
        .is_some_and(|end| end <= reader.len_bytes());
    if !fits || length > MAX_DIRECTORY_BYTES {
        return Err(no_zip(
            "one whose directory is damaged or cut off".to_owned(),
        ));
    }
    let bytes = reader
        .read_at(offset, length as usize)
        .map_err(unreadable)?;

    let mut members = HashMap::new();
    let mut rest = bytes.as_slice();
    while !rest.is_empty() {
        let (name, member, next) = central_record(rest)
            .ok_or_else(|| no_zip("one whose directory is damaged".to_owned()))?;
        rest = next;
        // Some Windows programs write backslashes.
        let path = String::from_utf8_lossy(name).replace('\\', "/");
        if leaves_the_archive(&path) {
            return Err(SourceError::UnsafePath {
                archive: archive.to_owned(),
                entry: path,
            });
        }
        if !path.ends_with('/') {
            members.insert(path, member);
        }
    }
    Ok(members)
}

fn leaves_the_archive(path: &str) -> bool {
    let drive = matches!(path.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic());
    drive || path.starts_with('/') || path.split('/').any(|part| part == "..")
}

fn what_it_is(reader: &impl RandomRead) -> String {
    match reader.len_bytes() {
        0 => "an empty file".to_owned(),
        length => match reader.read_at(0, 4) {
            Ok(start) if start == LOCAL => {
                format!("one that is cut off ({length} bytes, no directory at its end)")
            }
            _ => format!("a file of another kind ({length} bytes)"),
        },
    }
}

/// Offset and length of the central directory; `None` when there is no end record.
fn locate(reader: &impl RandomRead) -> io::Result<Option<(u64, u64)>> {
    let total = reader.len_bytes();
    // The end record is followed by a comment of at most 65,535 bytes.
    let tail_len = total.min((END_LEN + usize::from(u16::MAX)) as u64);
    let tail = reader.read_at(total - tail_len, tail_len as usize)?;
    let Some(at) = tail
        .len()
        .checked_sub(END_LEN)
        .and_then(|last| (0..=last).rev().find(|&at| tail[at..].starts_with(END)))
    else {
        return Ok(None);
    };
    let end = Record(&tail[at..]);
    let (Some(length), Some(offset)) = (end.u32(12), end.u32(16)) else {
        return Ok(None);
    };
    let end_offset = total - tail_len + at as u64;
    let located = locate64(reader, end_offset)?;
    Ok(Some(located.unwrap_or((offset.into(), length.into()))))
}

fn locate64(reader: &impl RandomRead, end_offset: u64) -> io::Result<Option<(u64, u64)>> {
    let Some(locator_offset) = end_offset.checked_sub(END64_LOCATOR_LEN) else {
        return Ok(None);
    };
    let locator = reader.read_at(locator_offset, END64_LOCATOR_LEN as usize)?;
    if !locator.starts_with(END64_LOCATOR) {
        return Ok(None);
    }
    let Some(offset) = Record(&locator).u64(8) else {
        return Ok(None);
    };
    let end64 = reader.read_at(offset, END64_LEN)?;
    if !end64.starts_with(END64) {
        return Ok(None);
    }
    let record = Record(&end64);
    Ok(record.u64(48).zip(record.u64(40)))
}

/// Name, member and what follows of the first record.
fn central_record(bytes: &[u8]) -> Option<(&[u8], Member, &[u8])> {
    if !bytes.starts_with(CENTRAL) {
        return None;
    }
    let record = Record(bytes);
    let name_end = CENTRAL_LEN + usize::from(record.u16(28)?);
    let extra_end = name_end + usize::from(record.u16(30)?);
    let end = extra_end + usize::from(record.u16(32)?);
    let name = bytes.get(CENTRAL_LEN..name_end)?;
    let mut large = Large::in_extra(bytes.get(name_end..extra_end)?);
    // The order is the standard's: size, packed size, offset, each only when its short field is full.
    let size_bytes = large.or(record.u32(24)?)?;
    let packed_bytes = large.or(record.u32(20)?)?;
    let header_offset = large.or(record.u32(42)?)?;
    let member = Member {
        method: record.u16(10)?,
        encrypted: record.u16(8)? & 1 == 1,
        crc32: record.u32(16)?,
        packed_bytes,
        size_bytes,
        header_offset,
    };
    Some((name, member, bytes.get(end..)?))
}

/// The zip64 values of a record, in order.
struct Large<'a>(&'a [u8]);

impl<'a> Large<'a> {
    const ID: u16 = 1;

    fn in_extra(mut extra: &'a [u8]) -> Self {
        while let (Some(id), Some(length)) = (Record(extra).u16(0), Record(extra).u16(2)) {
            let end = 4 + usize::from(length);
            if id == Self::ID {
                return Large(extra.get(4..end).unwrap_or_default());
            }
            extra = extra.get(end..).unwrap_or_default();
        }
        Large(&[])
    }

    fn or(&mut self, short: u32) -> Option<u64> {
        if short != u32::MAX {
            return Some(short.into());
        }
        let value = Record(self.0).u64(0)?;
        self.0 = &self.0[8..];
        Some(value)
    }
}

/// Where a file's data starts: behind its local header, whose length may differ from the directory's record.
pub(super) fn data_offset(reader: &impl RandomRead, member: &Member) -> Result<u64, String> {
    let header = reader
        .read_at(member.header_offset, LOCAL_LEN)
        .map_err(|error| error.to_string())?;
    let record = Record(&header);
    match (header.starts_with(LOCAL), record.u16(26), record.u16(28)) {
        (true, Some(name), Some(extra)) => {
            Ok(member.header_offset + LOCAL_LEN as u64 + u64::from(name) + u64::from(extra))
        }
        _ => Err("no file header where the directory points".to_owned()),
    }
}
