//! Poses that are missing or wrong: the text names the file (and line), what was expected, what was found
//! and what to do; the other frames go on where that is sensible.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Files, assert_tells, finding, refused};
use scan::{Scan, ScanError, Severity};

const POSE_1: &str = "frame-000001.pose.txt";

fn three_frames_with_pose(text: &str) -> Scan {
    let mut files = Files::seven_scenes(3);
    files.set(POSE_1, text);
    files.open().unwrap()
}

/// The second of three frames is left out with one finding; the others go on.
fn assert_left_out(scan: &Scan, code: &str, parts: &[&str]) {
    let names: Vec<&str> = scan
        .frames()
        .iter()
        .map(|frame| frame.name.as_str())
        .collect();
    assert_eq!(names, ["frame-000000", "frame-000002"]);
    let finding = finding(scan, code);
    assert_eq!(finding.severity, Severity::Error);
    assert_eq!(finding.frames_affected, 1);
    assert_tells(&finding.to_string(), parts);
    assert!(scan.color(1).is_ok() && scan.depth(1).is_ok());
}

#[test]
fn no_poses() {
    let mut files = Files::seven_scenes(3);
    files.0.retain(|(path, _)| !path.ends_with(".pose.txt"));
    let (error, text) = refused(files);
    assert!(matches!(error, ScanError::NoPoses(_)));
    assert_tells(
        &text,
        &[
            "frame-000000.pose.txt",
            "expected a camera-to-world pose",
            "found 3 pictures and no pose",
            "Add one text file",
        ],
    );
}

#[test]
fn no_poses_in_the_other_layouts() {
    let (error, text) = refused(common::scannet(2).without("room/pose/"));
    assert!(matches!(error, ScanError::NoPoses(_)));
    assert_tells(&text, &["room/pose/0.txt", "2 pictures and no pose"]);

    let (error, text) =
        refused(common::tum("freiburg3_room", 2).without("freiburg3_room/groundtruth.txt"));
    assert!(matches!(error, ScanError::NoPoses(_)));
    assert_tells(
        &text,
        &[
            "freiburg3_room/groundtruth.txt",
            "time tx ty tz qx qy qz qw",
            "no such file",
        ],
    );
}

#[test]
fn a_pose_with_nan() {
    let scan = three_frames_with_pose("1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1\n");
    assert_left_out(
        &scan,
        "pose-not-finite",
        &[
            "frame-000001.pose.txt:2:",
            "expected finite numbers",
            "found NaN",
            "correct its pose",
        ],
    );
}

#[test]
fn a_pose_with_infinity() {
    let scan = three_frames_with_pose("1 0 0 0\n0 1 0 0\n0 0 1 -inf\n0 0 0 1\n");
    assert_left_out(
        &scan,
        "pose-not-finite",
        &["frame-000001.pose.txt:3:", "found -inf"],
    );
}

#[test]
fn a_pose_that_is_no_rotation() {
    let scan = three_frames_with_pose("1 0 0 0\n0 1 0.2 0\n0 0 1 0\n0 0 0 1\n");
    assert_left_out(
        &scan,
        "pose-no-rotation",
        &[
            "frame-000001.pose.txt:1:",
            "expected a rotation",
            "found |R^T R - I| = 0.2",
            "correct its pose",
        ],
    );
}

#[test]
fn a_pose_with_scale() {
    let scan = three_frames_with_pose("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
    assert_left_out(
        &scan,
        "pose-no-rotation",
        &["a rotation scaled by 2.0000", "Divide the 3x3 part"],
    );
}

#[test]
fn a_pose_that_mirrors() {
    let scan = three_frames_with_pose("1 0 0 0\n0 -1 0 0\n0 0 1 0\n0 0 0 1\n");
    assert_left_out(
        &scan,
        "pose-mirrored",
        &[
            "frame-000001.pose.txt:1:",
            "determinant -1",
            "x right, y down, z forward",
        ],
    );
}

#[test]
fn a_pose_written_by_columns() {
    let scan = three_frames_with_pose("1 0 0 0\n0 1 0 0\n0 0 1 0\n0.5 0 0 1\n");
    assert_left_out(
        &scan,
        "pose-last-row",
        &["frame-000001.pose.txt:4:", "0.5 0 0 1", "transposed"],
    );
}

#[test]
fn a_pose_with_too_few_numbers() {
    let scan = three_frames_with_pose("1 0 0 0\n0 1 0 0\n0 0 1\n");
    assert_left_out(
        &scan,
        "pose-wrong-count",
        &["frame-000001.pose.txt:3:", "16 numbers", "found 11 numbers"],
    );
}

#[test]
fn a_pose_of_words() {
    let scan = three_frames_with_pose("# a comment\npose: unknown\n");
    assert_left_out(
        &scan,
        "pose-not-a-number",
        &["frame-000001.pose.txt:2:", "the word \"pose:\""],
    );
}

#[test]
fn all_poses_bad() {
    let mut files = Files::seven_scenes(2);
    for index in 0..2 {
        files.set(&format!("frame-{index:06}.pose.txt"), "nan ".repeat(16));
    }
    let (error, text) = refused(files);
    assert!(matches!(error, ScanError::NoUsableFrames(_)));
    assert_tells(
        &text,
        &[
            "frame-000000.pose.txt:1:",
            "found NaN (and no other frame is usable: 2 errors)",
            "No frame has both a picture and a usable pose",
        ],
    );
}

#[test]
fn many_bad_poses_are_told_in_few_lines() {
    let mut files = Files::seven_scenes(30);
    for index in 1..30 {
        files.set(&format!("frame-{index:06}.pose.txt"), "0");
    }
    let scan = files.open().unwrap();
    assert_eq!(scan.frames().len(), 1);
    let told: Vec<_> = scan
        .findings()
        .iter()
        .filter(|f| f.code == "pose-wrong-count")
        .collect();
    assert_eq!(told.len(), 9);
    assert_eq!(told.iter().map(|f| f.frames_affected).sum::<usize>(), 29);
    assert_tells(&told[8].found, &["21 more"]);
}

#[test]
fn findings_are_data_for_programs() {
    let scan = three_frames_with_pose("nan");
    let json = serde_json::to_value(finding(&scan, "pose-wrong-count")).unwrap();
    assert_eq!(json["severity"], "error");
    assert_eq!(json["file"], POSE_1);
    assert_eq!(json["line"], 1);
    assert_eq!(json["frames_affected"], 1);
}
