//! Folders, calibrations and pictures that are wrong: the text names the file (and line), what was expected, what was found
//! and what to do; the other frames go on where that is sensible.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Files, HEIGHT, WIDTH, assert_tells, finding, flat_depth, jpeg, refused, texture};
use scan::{FrameError, MemorySource, ScanError};

#[test]
fn an_empty_folder() {
    let (error, text) = refused(Files(Vec::new()));
    assert!(matches!(error, ScanError::Empty(_)));
    assert_tells(
        &text,
        &[
            "expected a folder with pictures and poses",
            "found no files",
            "Choose the folder",
        ],
    );
}

#[test]
fn a_folder_with_only_what_the_system_left_there() {
    let files = [
        ".DS_Store",
        "__MACOSX/._frame-000000.pose.txt",
        "scan/.git/HEAD",
    ];
    let files = files.map(|path| (path.to_owned(), Vec::new()));
    let (error, _) = refused(Files(files.into()));
    assert!(matches!(error, ScanError::Empty(_)));
}

#[test]
fn a_folder_of_something_else() {
    let files = ["holiday/IMG_1.jpg", "holiday/IMG_2.jpg", "notes.txt"];
    let files = files.map(|path| (path.to_owned(), b"x".to_vec()));
    let (error, text) = refused(Files(files.into()));
    assert!(matches!(error, ScanError::Unrecognised(_)));
    assert_tells(
        &text,
        &[
            "7-Scenes",
            "ScanNet",
            "TUM RGB-D",
            "holiday/IMG_1.jpg",
            "Choose the folder",
        ],
    );
}

#[test]
fn missing_intrinsics() {
    let mut files = Files::seven_scenes(2);
    files.remove("camera-intrinsics.txt");
    let (error, text) = refused(files.under("office"));
    assert!(matches!(error, ScanError::Intrinsics(_)));
    assert_tells(
        &text,
        &[
            "office/camera-intrinsics.txt",
            "expected a 3x3 calibration matrix in pixels: fx 0 cx, 0 fy cy, 0 0 1",
            "found no such file",
            "Write the colour camera's focal lengths",
        ],
    );

    let (error, text) = refused(common::scannet(2).without("room/intrinsic/"));
    assert!(matches!(error, ScanError::Intrinsics(_)));
    assert_tells(
        &text,
        &["room/intrinsic/intrinsic_color.txt", "found no such file"],
    );
}

#[test]
fn unusable_intrinsics() {
    let cases = [
        ("0 0 31.5\n0 60 23.5\n0 0 1", ":1:", "found fx = 0"),
        ("60 0 31.5\n0 -60 23.5\n0 0 1", ":2:", "found fy = -60"),
        ("60 0 31.5\n0 nan 23.5\n0 0 1", ":2:", "found NaN"),
        ("60 0 inf\n0 60 23.5\n0 0 1", ":1:", "found inf"),
        ("60 60 31.5", ":1:", "found 3 numbers"),
        ("", ":1:", "found 0 numbers"),
        ("fx = 60", ":1:", "found the word \"fx\""),
    ];
    for (text, line, found) in cases {
        let mut files = Files::seven_scenes(2);
        files.set("camera-intrinsics.txt", text);
        let (error, told) = refused(files);
        assert!(matches!(error, ScanError::Intrinsics(_)));
        assert_tells(
            &told,
            &[
                "camera-intrinsics.txt",
                line,
                "expected a 3x3 calibration matrix",
                found,
                "Write the colour camera's",
            ],
        );
    }
}

#[test]
fn intrinsics_of_another_picture_size() {
    let mut files = Files::seven_scenes(2);
    files.set("camera-intrinsics.txt", "600 0 319.5\n0 600 239.5\n0 0 1");
    let scan = files.open().unwrap();
    assert_tells(
        &finding(&scan, "intrinsics-doubtful").to_string(),
        &[
            "a principal point inside 64x48",
            "found 319.5, 239.5",
            "scale it",
        ],
    );
}

#[test]
fn a_truncated_jpeg() {
    let whole = jpeg(WIDTH, HEIGHT, &texture(WIDTH, HEIGHT));
    let mut files = Files::seven_scenes(3);
    files.set("frame-000001.color.jpg", &whole[..whole.len() / 2]);
    let scan = files.open().unwrap();
    let error = scan.color(1).unwrap_err();
    assert!(matches!(error, FrameError::Undecodable(_)));
    assert_tells(
        &error.to_string(),
        &[
            "frame-000001.color.jpg",
            "expected a complete JPEG",
            "cut short after",
            "copy or export it again",
        ],
    );
    assert!(scan.color(0).is_ok() && scan.color(2).is_ok() && scan.depth(1).is_ok());
}

#[test]
fn a_truncated_png() {
    let whole = flat_depth(WIDTH, HEIGHT, 1000);
    let mut files = Files::seven_scenes(3);
    files.set("frame-000001.depth.png", &whole[..whole.len() / 2]);
    let scan = files.open().unwrap();
    let error = scan.depth(1).unwrap_err();
    assert!(matches!(error, FrameError::Undecodable(_)));
    assert_tells(
        &error.to_string(),
        &[
            "frame-000001.depth.png",
            "expected a complete 16-bit grey PNG",
            "cut short after",
            "copy or export it again",
        ],
    );
    assert!(scan.depth(0).is_ok() && scan.color(1).is_ok());
}

#[test]
fn depth_of_another_size_than_the_first() {
    let mut files = Files::seven_scenes(3);
    files.set("frame-000001.depth.png", flat_depth(32, 24, 1000));
    let scan = files.open().unwrap();
    let error = scan.depth(1).unwrap_err();
    assert!(matches!(error, FrameError::WrongSize(_)));
    assert_tells(
        &error.to_string(),
        &[
            "frame-000001.depth.png",
            "expected 64x48 pixels",
            "found 32x24",
            "export it in the size of the others",
        ],
    );
    assert!(scan.depth(0).is_ok() && scan.depth(2).is_ok());
}

#[test]
fn all_depth_of_another_shape_than_colour() {
    let mut files = Files::seven_scenes(2);
    for index in 0..2 {
        files.set(
            &format!("frame-{index:06}.depth.png"),
            flat_depth(64, 36, 1000),
        );
    }
    let scan = files.open().unwrap();
    assert_tells(
        &finding(&scan, "depth-aspect").to_string(),
        &[
            "64x48 colour pictures",
            "found 64x36",
            "registered to colour",
        ],
    );
}

#[test]
fn colour_of_another_size_than_the_first() {
    let mut files = Files::seven_scenes(2);
    files.set("frame-000001.color.jpg", jpeg(48, 64, &texture(48, 64)));
    let error = files.open().unwrap().color(1).unwrap_err();
    assert_tells(
        &error.to_string(),
        &["frame-000001.color.jpg", "expected 64x48", "found 48x64"],
    );
}

#[test]
fn counts_that_do_not_match() {
    let mut files = Files::seven_scenes(5);
    files.remove("frame-000001.pose.txt");
    files.remove("frame-000002.depth.png");
    files.remove("frame-000003.color.jpg");
    files.remove("frame-000004.color.jpg");
    files.remove("frame-000004.depth.png");
    let scan = files.open().unwrap();
    assert_eq!(scan.frames().len(), 3);
    let told: Vec<String> = scan
        .findings()
        .iter()
        .filter(|f| f.code == "counts-differ")
        .map(ToString::to_string)
        .collect();
    assert_eq!(told.len(), 4, "{told:#?}");
    assert_tells(
        &told[0],
        &[
            "frame-000001.color.jpg",
            "a pose for each frame (3 colour and 3 depth pictures, 4 poses)",
            "1 without a pose",
            "left out",
        ],
    );
    assert_tells(
        &told[1],
        &[
            "frame-000004.pose.txt",
            "a picture for each pose",
            "left out",
        ],
    );
    assert_tells(
        &told[2],
        &[
            "frame-000002.color.jpg",
            "depth for each colour picture",
            "give colour only",
        ],
    );
    assert_tells(
        &told[3],
        &[
            "frame-000003.depth.png",
            "colour for each depth picture",
            "give depth only",
        ],
    );
    assert!(scan.frames()[1].depth.is_none() && scan.depth(1).unwrap().is_none());
    assert!(matches!(scan.color(2).unwrap_err(), FrameError::Missing(_)));
}

#[test]
fn a_frame_that_is_not_there() {
    let scan = Files::seven_scenes(2).open().unwrap();
    assert_tells(
        &scan.color(2).unwrap_err().to_string(),
        &["expected a frame index below 2", "found 2"],
    );
}

#[test]
fn a_picture_that_vanished() {
    struct Vanishing(MemorySource);
    impl scan::Source for Vanishing {
        fn entries(&self) -> &[scan::Entry] {
            self.0.entries()
        }
        fn read(&self, path: &str) -> Result<Vec<u8>, scan::SourceError> {
            match path {
                "frame-000001.color.jpg" => Err(scan::SourceError::NotFound {
                    path: path.to_owned(),
                }),
                path => self.0.read(path),
            }
        }
    }
    let source = Vanishing(MemorySource::new(Files::seven_scenes(2).0));
    let scan = scan::open(std::rc::Rc::new(source)).unwrap();
    assert!(matches!(
        scan.color(1).unwrap_err(),
        FrameError::Unreadable(_)
    ));
    assert!(scan.color(0).is_ok());
}
