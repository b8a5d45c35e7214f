//! A scan in a folder of the file system.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::{Entry, Source, SourceError};

/// A folder on disk, listed once when it is opened.
#[derive(Debug, Clone)]
pub struct FolderSource {
    root: PathBuf,
    name: String,
    entries: Vec<Entry>,
}

/// Scans are two or three folders deep; the limit keeps a wrong choice (a whole disk) from being walked.
const MAX_DEPTH: usize = 6;

impl FolderSource {
    /// Lists a folder and those inside it, up to six deep.
    ///
    /// # Errors
    /// `NotAFolder` and `Unreadable`.
    pub fn open(root: &Path) -> Result<Self, SourceError> {
        let shown = root.display().to_string();
        let metadata = fs::metadata(root).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => SourceError::NotAFolder {
                path: shown.clone(),
                found: "nothing",
            },
            _ => unreadable(shown.clone(), &error),
        })?;
        if !metadata.is_dir() {
            return Err(SourceError::NotAFolder {
                path: shown,
                found: "a file",
            });
        }
        let mut entries = Vec::new();
        list(root, "", 0, &mut entries).map_err(|error| unreadable(shown, &error))?;
        entries.sort_by(|a, b| a.path.cmp(&b.path));
        // `.` and `..` have no file name of their own.
        let named = root.file_name().map(|name| name.to_owned()).or_else(|| {
            let whole = root.canonicalize().ok()?;
            whole.file_name().map(|name| name.to_owned())
        });
        Ok(FolderSource {
            root: root.to_owned(),
            name: named.unwrap_or_default().to_string_lossy().into_owned(),
            entries,
        })
    }
}

fn unreadable(path: String, error: &io::Error) -> SourceError {
    SourceError::Unreadable {
        path,
        cause: error.to_string(),
    }
}

fn list(folder: &Path, prefix: &str, depth: usize, entries: &mut Vec<Entry>) -> io::Result<()> {
    for item in fs::read_dir(folder)? {
        let item = item?;
        // A name that is not Unicode cannot be one of a scan's files.
        let Ok(name) = item.file_name().into_string() else {
            continue;
        };
        let path = format!("{prefix}{name}");
        // Follows links; one that points nowhere is passed over.
        let Ok(metadata) = fs::metadata(item.path()) else {
            continue;
        };
        if metadata.is_file() {
            entries.push(Entry { path });
        } else if metadata.is_dir() && depth < MAX_DEPTH {
            list(&item.path(), &format!("{path}/"), depth + 1, entries)?;
        }
    }
    Ok(())
}

impl Source for FolderSource {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError> {
        fs::read(self.root.join(path)).map_err(|error| unreadable(path.to_owned(), &error))
    }

    fn read_head(&self, path: &str, len: usize) -> Result<Vec<u8>, SourceError> {
        let mut head = Vec::new();
        fs::File::open(self.root.join(path))
            .and_then(|file| file.take(len as u64).read_to_end(&mut head))
            .map_err(|error| unreadable(path.to_owned(), &error))?;
        Ok(head)
    }

    fn name(&self) -> &str {
        &self.name
    }
}
