//! A scan of 5,000 frames opens at once: poses are read, pictures are not.
#![allow(clippy::unwrap_used)]

mod common;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Instant;

use common::Files;
use scan::{Entry, FolderSource, MemorySource, Source, SourceError};

const FRAMES: usize = 5000;

/// Counts reads by the file's ending.
struct Counting {
    inner: MemorySource,
    whole: RefCell<BTreeMap<String, usize>>,
    heads: RefCell<usize>,
}

impl Source for Counting {
    fn entries(&self) -> &[Entry] {
        self.inner.entries()
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, SourceError> {
        let ending = path.split_once('.').map_or("", |(_, ending)| ending);
        *self
            .whole
            .borrow_mut()
            .entry(ending.to_owned())
            .or_default() += 1;
        self.inner.read(path)
    }

    fn read_head(&self, path: &str, len: usize) -> Result<Vec<u8>, SourceError> {
        *self.heads.borrow_mut() += 1;
        self.inner.read_head(path, len)
    }
}

#[test]
fn opening_reads_each_pose_and_hardly_a_picture() {
    let source = Rc::new(Counting {
        inner: MemorySource::new(Files::seven_scenes(FRAMES).0),
        whole: RefCell::default(),
        heads: RefCell::default(),
    });
    let started = Instant::now();
    let scan = scan::open(Rc::clone(&source) as Rc<dyn Source>).unwrap();
    println!("5,000 frames from memory: {:?}", started.elapsed());
    assert_eq!(scan.frames().len(), FRAMES);
    let whole = source.whole.borrow();
    assert_eq!(whole.get("pose.txt"), Some(&FRAMES));
    assert_eq!(whole.get("color.jpg"), None, "no colour picture is read");
    assert_eq!(
        whole.get("depth.png"),
        Some(&16),
        "depth for the up direction only"
    );
    // Five of either kind vote on the pictures' size.
    assert_eq!(*source.heads.borrow(), 10);
}

#[test]
fn opening_a_folder_takes_less_than_three_seconds() {
    let folder = tempfile::tempdir().unwrap();
    for (path, bytes) in Files::seven_scenes(FRAMES).0 {
        std::fs::write(folder.path().join(path), bytes).unwrap();
    }
    // The fastest of three: the disk may still be writing.
    let times = [(); 3].map(|()| {
        let started = Instant::now();
        let scan = scan::open(Rc::new(FolderSource::open(folder.path()).unwrap())).unwrap();
        assert_eq!(scan.frames().len(), FRAMES);
        started.elapsed()
    });
    println!("5,000 frames from a folder: {times:?}");
    assert!(times.iter().min().unwrap().as_secs_f64() < 3.0, "{times:?}");
}
