//! A source seen as folders: which files lie in which, without the clutter that systems add.

use std::collections::{HashMap, HashSet};

use crate::image;
use crate::source::{Source, SourceError};

/// Pictures whose size is asked for when a scan is opened.
const VOTING_PICTURES: usize = 5;

/// All folders of a source.
pub(super) struct Listing<'a> {
    source: &'a dyn Source,
    paths: HashSet<&'a str>,
    /// A folder's path ("" for the root) to the names of its own files.
    folders: HashMap<&'a str, Vec<&'a str>>,
}

/// One folder of a [`Listing`].
#[derive(Clone, Copy)]
pub(super) struct Folder<'a> {
    listing: &'a Listing<'a>,
    path: &'a str,
}

fn is_clutter(path: &str) -> bool {
    path.split('/')
        .any(|part| part == "__MACOSX" || part.starts_with('.'))
}

fn depth(folder: &str) -> usize {
    if folder.is_empty() {
        0
    } else {
        1 + folder.matches('/').count()
    }
}

impl<'a> Listing<'a> {
    pub(super) fn new(source: &'a dyn Source) -> Self {
        let mut paths = HashSet::new();
        let mut folders: HashMap<&str, Vec<&str>> = HashMap::new();
        for entry in source.entries().iter().filter(|e| !is_clutter(&e.path)) {
            let path = entry.path.as_str();
            paths.insert(path);
            let (mut folder, name) = path.rsplit_once('/').unwrap_or(("", path));
            folders.entry(folder).or_default().push(name);
            while !folder.is_empty() {
                folder = folder.rsplit_once('/').map_or("", |(parent, _)| parent);
                folders.entry(folder).or_default();
            }
        }
        Listing {
            source,
            paths,
            folders,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    pub(super) fn len(&self) -> usize {
        self.paths.len()
    }

    /// The first few paths, for a message.
    pub(super) fn sample_paths(&self, count: usize) -> Vec<&str> {
        let mut paths: Vec<&str> = self.paths.iter().copied().collect();
        paths.sort_unstable();
        paths.truncate(count);
        paths
    }

    /// Every folder, outermost first.
    pub(super) fn folders(&'a self) -> impl Iterator<Item = Folder<'a>> {
        let mut paths: Vec<&str> = self.folders.keys().copied().collect();
        paths.sort_unstable_by_key(|path| (depth(path), *path));
        paths.into_iter().map(|path| Folder {
            listing: self,
            path,
        })
    }
}

impl<'a> Folder<'a> {
    /// Path inside the source; the source's name for its root.
    pub(super) fn path(&self) -> &'a str {
        match (self.path, self.listing.source.name()) {
            ("", "") => "the scan",
            ("", name) => name,
            (path, _) => path,
        }
    }

    /// The folder's own name.
    pub(super) fn name(&self) -> &'a str {
        let path = self.path();
        path.rsplit_once('/').map_or(path, |(_, name)| name)
    }

    /// Names of the files right in this folder.
    pub(super) fn files(&self) -> &'a [&'a str] {
        self.files_of(self.path)
    }

    /// Names of the files right in a folder inside this one.
    pub(super) fn files_in(&self, name: &str) -> &'a [&'a str] {
        self.files_of(&self.join(name))
    }

    fn files_of(&self, path: &str) -> &'a [&'a str] {
        let files = self.listing.folders.get(path);
        files.map_or(&[], Vec::as_slice)
    }

    /// Path inside the source of a file of this folder.
    pub(super) fn join(&self, name: &str) -> String {
        match self.path {
            "" => name.to_owned(),
            path => format!("{path}/{name}"),
        }
    }

    /// The folder around this one.
    pub(super) fn parent(&self) -> Option<Folder<'a>> {
        let path = match self.path {
            "" => return None,
            path => path.rsplit_once('/').map_or("", |(parent, _)| parent),
        };
        Some(Folder { path, ..*self })
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.listing.paths.contains(self.join(name).as_str())
    }

    /// A text file by its path inside the source.
    pub(super) fn read_text(&self, path: &str) -> Result<String, SourceError> {
        let bytes = self.listing.source.read(path)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Width and height that most of the first few pictures have whose header can be read: one odd picture must not
    /// decide for the others.
    pub(super) fn usual_size<'p>(
        &self,
        pictures: impl IntoIterator<Item = &'p str>,
    ) -> Option<(u32, u32)> {
        let source = self.listing.source;
        let size = |path: &str| {
            let head = source.read_head(path, image::HEAD_LEN).ok()?;
            image::size(&head)
                .or_else(|| image::size(&source.read(path).ok()?))
                .filter(|&(width, height)| width > 0 && height > 0)
        };
        let read = pictures.into_iter().take(50).filter_map(size);
        let sizes: Vec<(u32, u32)> = read.take(VOTING_PICTURES).collect();
        let votes = |size: &(u32, u32)| sizes.iter().filter(|other| *other == size).count();
        // Of equals the first, which is what `max_by_key` gives when it walks backwards.
        sizes.iter().rev().max_by_key(|size| votes(size)).copied()
    }
}
