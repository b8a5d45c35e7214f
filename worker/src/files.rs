//! The visitor's files as a scan's source: read in place when they are needed, never all at once.

use js_sys::{Array, Uint8Array};
use net::weights::WeightsFile;
use scan::{Entry, RandomRead, Source, SourceError};
use std::{collections::HashMap, io, ops::Range};
use wasm_bindgen::JsCast;
use web_sys::{Blob, File, FileReaderSync};

/// A dropped folder.
pub struct DroppedFolder {
    name: String,
    entries: Vec<Entry>,
    /// Where each path's file lies in `files`.
    places: HashMap<String, u32>,
    files: Array,
    /// Contents of text files, at the places of their files; nothing at other places.
    texts: Array,
}

impl DroppedFolder {
    /// The paths of a folder's files, one a line, the files, and what was read of them already.
    pub fn new(paths: &str, files: Array, texts: Array) -> Self {
        let paths: Vec<String> = paths.lines().map(str::to_owned).collect();
        let first = paths.first().and_then(|path| path.split_once('/'));
        let name = first.map_or("scan", |(folder, _)| folder).to_owned();
        let entries = paths.iter().map(|path| Entry { path: path.clone() });
        Self {
            name,
            entries: entries.collect(),
            places: paths.into_iter().zip(0..).collect(),
            files,
            texts,
        }
    }

    fn file(&self, path: &str) -> Result<File, SourceError> {
        let place = self.places.get(path);
        let file = place.and_then(|&place| self.files.get(place).dyn_into().ok());
        file.ok_or_else(|| SourceError::NotFound {
            path: path.to_owned(),
        })
    }
}

impl Source for DroppedFolder {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError> {
        let text = self.places.get(path).map(|&place| self.texts.get(place));
        if let Some(text) = text.and_then(|text| text.as_string()) {
            return Ok(text.into_bytes());
        }
        let file = self.file(path)?;
        read(&file).map_err(|error| unreadable(path, &error))
    }

    fn read_head(&self, path: &str, len: usize) -> Result<Vec<u8>, SourceError> {
        let file = self.file(path)?;
        read_range(&file, 0, len.min(file.size() as usize))
            .map_err(|error| unreadable(path, &error))
    }

    fn name(&self) -> &str {
        &self.name
    }
}

fn unreadable(path: &str, error: &io::Error) -> SourceError {
    SourceError::Unreadable {
        path: path.to_owned(),
        cause: error.to_string(),
    }
}

/// A dropped zip, read by ranges.
pub struct DroppedZip(pub File);

impl RandomRead for DroppedZip {
    fn len_bytes(&self) -> u64 {
        self.0.size() as u64
    }

    fn read_at(&self, offset: u64, len: usize) -> io::Result<Vec<u8>> {
        read_range(&self.0, offset, len)
    }
}

/// Weights as a file or a part of the browser's cache.
pub struct WeightsBlob(pub Blob);

impl WeightsFile for WeightsBlob {
    fn len(&self) -> usize {
        self.0.size() as usize
    }

    fn read(&self, range: Range<usize>) -> io::Result<Vec<u8>> {
        read_range(&self.0, range.start as u64, range.len())
    }
}

fn read_range(file: &Blob, offset: u64, len: usize) -> io::Result<Vec<u8>> {
    let end = offset as f64 + len as f64;
    let part = file.slice_with_f64_and_f64(offset as f64, end);
    let bytes = read(&part.map_err(|error| failed(&error))?)?;
    if bytes.len() == len {
        return Ok(bytes);
    }
    Err(io::Error::new(
        io::ErrorKind::UnexpectedEof,
        format!("{len} bytes at {offset} go beyond the file's end"),
    ))
}

/// The whole of a file or of a part of one. A worker may wait for it; a page may not.
pub fn read(blob: &Blob) -> io::Result<Vec<u8>> {
    let reader = FileReaderSync::new().map_err(|error| failed(&error))?;
    let buffer = reader.read_as_array_buffer(blob);
    let buffer = buffer.map_err(|error| failed(&error))?;
    Ok(Uint8Array::new(&buffer).to_vec())
}

fn failed(error: &wasm_bindgen::JsValue) -> io::Error {
    let message = js_sys::Reflect::get(error, &"message".into()).ok();
    let message = message.and_then(|message| message.as_string());
    io::Error::other(message.unwrap_or_else(|| "the browser refused to read it".to_owned()))
}
