//! Archives and folders as sources: the right bytes, little read, nothing trusted.
#![allow(clippy::unwrap_used)]

mod common;

use std::cell::Cell;
use std::rc::Rc;

use common::zip::{self, Member};
use common::{Files, assert_tells};
use scan::{FolderSource, MemorySource, RandomRead, Source, SourceError, ZipSource};

fn paths(source: &dyn Source) -> Vec<&str> {
    source
        .entries()
        .iter()
        .map(|entry| entry.path.as_str())
        .collect()
}

#[test]
fn archives_of_another_program_stored_deflated_and_zip64() {
    let text = b"expected by the test\n".repeat(20);
    for archive in [
        include_bytes!("data/plain.zip").as_slice(),
        include_bytes!("data/zip64.zip"),
    ] {
        let source = ZipSource::open(archive.to_vec()).unwrap();
        assert_eq!(paths(&source), ["deep/er/deflated.txt", "stored.txt"]);
        for entry in source.entries() {
            assert_eq!(source.read(&entry.path).unwrap(), text);
            assert_eq!(source.read_head(&entry.path, 30).unwrap(), text[..30]);
            assert_eq!(source.read_head(&entry.path, 9999).unwrap(), text);
        }
        let missing = source.read("other.txt").unwrap_err();
        assert_tells(&missing.to_string(), &["other.txt", "found none"]);
    }
}

#[test]
fn a_scan_in_an_archive_is_the_scan() {
    let files = Files::seven_scenes(4).under("my scan");
    let members: Vec<Member<'_>> = files
        .0
        .iter()
        .map(|(path, bytes)| Member::deflated(path, bytes))
        .collect();
    let archive = zip::write(&members);
    let source = ZipSource::open_named("my scan.zip", archive).unwrap();
    let zipped = scan::open(Rc::new(source)).unwrap();
    let plain = Files::seven_scenes(4).open().unwrap();
    assert_eq!(zipped.name(), "my scan");
    assert_eq!(zipped.frames().len(), 4);
    for index in 0..4 {
        assert_eq!(zipped.frames()[index].pose, plain.frames()[index].pose);
        assert_eq!(zipped.color(index).unwrap(), plain.color(index).unwrap());
        assert_eq!(zipped.depth(index).unwrap(), plain.depth(index).unwrap());
    }
}

#[test]
fn a_file_that_is_no_zip() {
    let long = vec![7; 100_000];
    for (bytes, found) in [
        (Vec::new(), "an empty file"),
        (
            b"%PDF-1.4 and so on".to_vec(),
            "a file of another kind (18 bytes)",
        ),
        (long, "a file of another kind (100000 bytes)"),
    ] {
        let error = ZipSource::open_named("scan.zip", bytes).err().unwrap();
        assert!(matches!(error, SourceError::NotAZip { .. }));
        assert_tells(
            &error.to_string(),
            &[
                "scan.zip",
                "expected a zip archive",
                found,
                "Give a .zip of the scan's folder",
            ],
        );
    }
}

#[test]
fn a_zip_cut_anywhere_is_refused() {
    let whole = include_bytes!("data/zip64.zip");
    for length in 4..whole.len() - b"a comment behind the directory".len() {
        let error = ZipSource::open(whole[..length].to_vec()).err();
        assert!(
            matches!(error, Some(SourceError::NotAZip { .. })),
            "{length}: {error:?}"
        );
    }
    let error = ZipSource::open(whole[..200].to_vec()).err().unwrap();
    assert_tells(
        &error.to_string(),
        &["cut off (200 bytes, no directory at its end)"],
    );
}

#[test]
fn a_zip_whose_names_lead_out_of_it() {
    for name in [
        "../evil.txt",
        "scan/../../evil.txt",
        "/etc/passwd",
        "C:/evil.txt",
        "c:evil.txt",
        "..\\evil.txt",
        "\\evil.txt",
        "a/..",
    ] {
        let archive = zip::write(&[
            Member::deflated("fine.txt", b"1"),
            Member::deflated(name, b"2"),
        ]);
        let error = ZipSource::open_named("scan.zip", archive).err().unwrap();
        assert!(
            matches!(error, SourceError::UnsafePath { .. }),
            "{name}: {error}"
        );
        let shown = name.replace('\\', "/");
        assert_tells(
            &error.to_string(),
            &[
                "scan.zip",
                "expected paths inside the archive",
                &shown,
                "Do not trust this archive",
            ],
        );
    }
    // Dots in names are fine.
    let archive = zip::write(&[Member::deflated("a..b/...c.txt", b"1")]);
    assert!(ZipSource::open(archive).is_ok());
}

#[test]
fn backslashes_of_windows_programs_are_folders() {
    let archive = zip::write(&[Member::deflated("scan\\pose\\0.txt", b"1")]);
    let source = ZipSource::open(archive).unwrap();
    assert_eq!(source.read("scan/pose/0.txt").unwrap(), b"1");
}

#[test]
fn entries_that_cannot_be_unpacked() {
    let secret = Member {
        flags: 1,
        ..Member::deflated("a.txt", b"secret")
    };
    let source = ZipSource::open_named("scan.zip", zip::write(&[secret])).unwrap();
    assert_tells(
        &source.read("a.txt").unwrap_err().to_string(),
        &[
            "a.txt in scan.zip",
            "expected a file without a password",
            "an encrypted one",
            "Zip the scan's folder again",
        ],
    );

    let mut damaged = zip::write(&[Member {
        deflate: false,
        ..Member::deflated("a.txt", b"content")
    }]);
    let at = damaged
        .windows(7)
        .position(|part| part == b"content")
        .unwrap();
    damaged[at] ^= 1;
    let source = ZipSource::open_named("scan.zip", damaged).unwrap();
    assert_tells(
        &source.read("a.txt").unwrap_err().to_string(),
        &["a.txt in scan.zip", "damaged data"],
    );

    // Says 7 bytes, unpacks to more: only one byte more is unpacked before it is refused.
    let bomb = vec![0; 10_000_000];
    let mut lying = zip::write(&[Member::deflated("a.txt", &bomb)]);
    let size = (bomb.len() as u32).to_le_bytes();
    while let Some(at) = lying.windows(4).position(|part| part == size) {
        lying[at..at + 4].copy_from_slice(&7_u32.to_le_bytes());
    }
    let source = ZipSource::open(lying).unwrap();
    assert_tells(
        &source.read("a.txt").unwrap_err().to_string(),
        &["damaged data (size or checksum differ)"],
    );
}

/// Counts what is read.
struct Counting {
    bytes: Vec<u8>,
    read_bytes: Rc<Cell<usize>>,
}

impl RandomRead for Counting {
    fn len_bytes(&self) -> u64 {
        self.bytes.len_bytes()
    }

    fn read_at(&self, offset: u64, len: usize) -> std::io::Result<Vec<u8>> {
        self.read_bytes.set(self.read_bytes.get() + len);
        self.bytes.read_at(offset, len)
    }
}

#[test]
fn only_what_is_asked_for_is_read_of_an_archive() {
    let picture: Vec<u8> = (0..1_000_000_u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let names: Vec<String> = (0..20).map(|i| format!("{i}.bin")).collect();
    let members: Vec<Member<'_>> = names
        .iter()
        .map(|name| Member::deflated(name, &picture))
        .collect();
    let read_bytes = Rc::new(Cell::new(0));
    let counting = Counting {
        bytes: zip::write(&members),
        read_bytes: Rc::clone(&read_bytes),
    };
    let source = ZipSource::open(counting).unwrap();
    assert!(read_bytes.get() < 70_000, "{} to open", read_bytes.get());
    read_bytes.set(0);
    source.read_head("7.bin", 1000).unwrap();
    assert!(read_bytes.get() < 70_000, "{} for a head", read_bytes.get());
    read_bytes.set(0);
    assert_eq!(source.read("7.bin").unwrap(), picture);
    assert!(
        read_bytes.get() < 1_100_000,
        "{} for one file",
        read_bytes.get()
    );
}

#[test]
fn a_file_on_disk_reads_like_memory() {
    let path = tempfile::tempdir().unwrap();
    let path = path.path().join("plain.zip");
    std::fs::write(&path, include_bytes!("data/plain.zip")).unwrap();
    let source = ZipSource::open(std::fs::File::open(&path).unwrap()).unwrap();
    assert_eq!(source.read("stored.txt").unwrap().len(), 420);
}

#[test]
fn a_folder_is_listed_with_its_folders() {
    let folder = tempfile::tempdir().unwrap();
    let files = Files::seven_scenes(2).under("inner");
    for (path, bytes) in &files.0 {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let source = FolderSource::open(folder.path()).unwrap();
    let memory = MemorySource::new(files.0);
    assert_eq!(source.entries(), memory.entries());
    for entry in memory.entries() {
        assert_eq!(
            source.read(&entry.path).unwrap(),
            memory.read(&entry.path).unwrap()
        );
        assert_eq!(
            source.read_head(&entry.path, 5).unwrap(),
            memory.read_head(&entry.path, 5).unwrap()
        );
    }
    assert!(matches!(
        source.read("nothing"),
        Err(SourceError::Unreadable { .. })
    ));
    // Opened right at the scan, the folder's own name is the scan's.
    let inner = FolderSource::open(&folder.path().join("inner")).unwrap();
    assert_eq!(scan::open(Rc::new(inner)).unwrap().name(), "inner");

    let file = folder.path().join("inner/camera-intrinsics.txt");
    assert_tells(
        &FolderSource::open(&file).unwrap_err().to_string(),
        &["camera-intrinsics.txt", "expected a folder, found a file"],
    );
    let nowhere = folder.path().join("nowhere");
    assert_tells(
        &FolderSource::open(&nowhere).unwrap_err().to_string(),
        &["nowhere", "expected a folder, found nothing"],
    );
}
