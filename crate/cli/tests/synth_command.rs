//! `ipdrecon synth` writes scans that the rest of the program opens.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use scan::{FolderSource, Format, Scan, Severity};
use std::{
    fs,
    path::Path,
    process::{Command, Output},
    rc::Rc,
};
use tempfile::TempDir;

fn synth(folder: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_ipdrecon");
    let output = folder.to_str().unwrap();
    let command = ["synth", "--frames", "8", "--device", "cpu", "-o", output];
    Command::new(program)
        .args(command)
        .args(arguments)
        .output()
        .unwrap()
}

fn told(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn open(folder: &Path) -> Scan {
    scan::open(Rc::new(FolderSource::open(folder).unwrap())).unwrap()
}

#[test]
fn scans_open_with_z_up_and_depth_that_fits_the_poses() {
    let folder = TempDir::new().unwrap();
    let done = synth(folder.path(), &["--seeds", "3..6", "--size", "64x48,80x60"]);
    assert!(done.status.success(), "{}", told(&done.stderr));
    assert!(
        told(&done.stdout).contains("scans a minute"),
        "{}",
        told(&done.stdout)
    );
    for (seed, width) in [(3, 80), (4, 64), (5, 80)] {
        let scan = open(&folder.path().join(format!("room-{seed:06}")));
        assert_eq!(scan.format(), Format::SevenScenes);
        assert_eq!(scan.frames().len(), 8);
        assert!(
            scan.findings()
                .iter()
                .all(|found| found.severity != Severity::Error)
        );
        let up = scan.gravity().up_in_scan;
        assert!(up.z > 0.99, "up is {up} in a world whose Z is up");
        for (i, frame) in scan.frames().iter().enumerate() {
            assert_eq!(frame.color_camera.width, width);
            let pose = scan.scan_from_canonical() * frame.pose;
            let height = pose.translation.z;
            assert!((0.7..2.6).contains(&height), "the camera is {height} m up");
            // No surface lies below the floor.
            let depth = scan.depth(i).unwrap().unwrap();
            for (pixel, z) in depth.depth_m.iter().enumerate() {
                let at = glam::DVec2::new(
                    f64::from(pixel as u32 % depth.width),
                    f64::from(pixel as u32 / depth.width),
                );
                let point = pose.transform_point3(frame.depth_camera.unproject(at, f64::from(*z)));
                assert!(*z > 0.0 && point.z > -0.01, "a pixel shows {point}");
            }
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_files_and_is_not_made_twice() {
    let (one, two) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    for (folder, threads) in [(&one, "1"), (&two, "3")] {
        let done = synth(
            folder.path(),
            &["--seeds", "7..8", "--size", "48x36", "--threads", threads],
        );
        assert!(done.status.success(), "{}", told(&done.stderr));
    }
    let room = Path::new("room-000007");
    let mut names: Vec<_> = fs::read_dir(one.path().join(room))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names.len(), 1 + 3 * 8);
    for name in &names {
        let [a, b] =
            [&one, &two].map(|folder| fs::read(folder.path().join(room).join(name)).unwrap());
        assert_eq!(a, b, "{name:?}");
    }
    let again = synth(one.path(), &["--seeds", "7..8", "--size", "48x36"]);
    assert!(
        told(&again.stdout).contains("1 were there already"),
        "{}",
        told(&again.stdout)
    );
    let noisy = synth(
        two.path(),
        &["--seeds", "8..9", "--size", "48x36", "--noisy-depth"],
    );
    assert!(noisy.status.success());
    let exact = synth(one.path(), &["--seeds", "8..9", "--size", "48x36"]);
    assert!(exact.status.success());
    let [a, b] = [&one, &two]
        .map(|folder| fs::read(folder.path().join("room-000008/frame-000003.depth.png")).unwrap());
    assert_ne!(a, b, "a sensor's depth is not exact depth");
}

#[test]
fn wrong_arguments_are_told() {
    let folder = TempDir::new().unwrap();
    for (arguments, expected) in [
        (
            ["--seeds", "5..5", "--size", "64x48"],
            "two whole numbers, the second larger",
        ),
        (
            ["--seeds", "x", "--size", "64x48"],
            "two whole numbers, the second larger",
        ),
        (
            ["--seeds", "0..1", "--size", "64"],
            "a width and a height from 16 to 4096",
        ),
        (
            ["--seeds", "0..1", "--size", "8x8"],
            "a width and a height from 16 to 4096",
        ),
    ] {
        let refused = synth(folder.path(), &arguments);
        assert!(!refused.status.success());
        assert!(
            told(&refused.stderr).contains(expected),
            "{}",
            told(&refused.stderr)
        );
    }
    let file = folder.path().join("file");
    fs::write(&file, "no folder").unwrap();
    let refused = synth(&file, &["--seeds", "0..1", "--size", "64x48"]);
    assert!(!refused.status.success());
    assert!(
        told(&refused.stderr).contains("check the path"),
        "{}",
        told(&refused.stderr)
    );
}
