//! The doctor sees what is wrong with a scan and names the usual mistakes.
#![allow(clippy::unwrap_used)]

mod common;

use common::room::{self, Noise, camera_at};
use common::{Files, assert_tells, flat_depth, png_u16, pose_text};
use glam::{DAffine3, DMat3, DVec3};
use scan::Camera;
use scan::doctor::{Look, Report, examine};

fn report(files: Files) -> Report {
    examine(&files.open().unwrap(), Look::All)
}

fn text(report: &Report, code: &str) -> String {
    let mut found = report
        .findings
        .iter()
        .filter(|finding| finding.code == code);
    match found.next() {
        Some(finding) => finding.to_string(),
        None => panic!("no {code} in {:#?}", report.findings),
    }
}

const CAMERA: Camera = Camera {
    width: 96,
    height: 72,
    fx: 80.0,
    fy: 80.0,
    cx: 47.5,
    cy: 35.5,
};

/// A walk through a furnished room; `change` spoils the poses as a user might.
fn walk(change: impl Fn(DAffine3) -> DAffine3, depth_factor: f64) -> Files {
    let mut room = room::shell(6.0, 4.0, 2.5, true);
    room.extend(room::block([3.0, 3.0, 0.0], [1.2, 0.8, 0.8], 25.0));
    let mut files = Files(Vec::new());
    files.set("camera-intrinsics.txt", "80 0 47.5 0 80 35.5 0 0 1");
    for index in 0..24 {
        let i = f64::from(index);
        let pose = camera_at(
            [1.5 + 0.12 * i, 1.2 + 0.02 * i, 1.5],
            60.0 + 3.0 * i,
            -12.0,
            2.0,
        );
        let depth = room::depth_mm(&room, &CAMERA, &pose, 0.003, &mut Noise(5));
        let depth: Vec<u16> = depth
            .iter()
            .map(|&d| (f64::from(d) * depth_factor) as u16)
            .collect();
        files.set(
            &format!("frame-{index:06}.depth.png"),
            png_u16(96, 72, &depth),
        );
        files.set(
            &format!("frame-{index:06}.pose.txt"),
            pose_text(&change(pose)),
        );
    }
    files
}

#[test]
fn a_healthy_scan_has_no_findings_and_right_figures() {
    let report = report(walk(|pose| pose, 1.0));
    assert_eq!(report.findings, []);
    assert_eq!(
        (report.frames, report.keyframes, report.frames_examined),
        (24, 24, 24)
    );
    assert_eq!((report.color_frames, report.depth_frames), (0, 24));
    assert_eq!(report.depth_camera, Some(CAMERA));
    assert_eq!(report.color_camera, None);
    let step_m = 0.12_f64.hypot(0.02);
    assert!((report.path_length_m - 23.0 * step_m).abs() < 1e-6);
    assert!((report.path_extent_m - 23.0 * step_m).abs() < 0.01);
    assert!((report.keyframe_baseline_m.unwrap() - step_m).abs() < 1e-9);
    assert!(report.height_spread_m < 0.03);
    assert!((report.gravity.camera_tilt_deg - 12.0).abs() < 3.0);
    assert!(report.depth_agreement_share.unwrap() > 0.9);
    assert_eq!(report.depth_measured_share, Some(1.0));
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["format"], "7-Scenes");
    assert_eq!(json["gravity"]["source"], "estimated");
}

#[test]
fn inverse_poses_are_named() {
    let report = report(walk(|pose| pose.inverse(), 1.0));
    assert_tells(
        &text(&report, "poses-disagree"),
        &["world-to-camera: store their inverses"],
    );
}

#[test]
fn opengl_axes_are_named() {
    let flip = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)));
    let report = report(walk(|pose| pose * flip, 1.0));
    assert_tells(
        &text(&report, "poses-disagree"),
        &[
            "OpenGL camera axes",
            "negate their second and third columns",
        ],
    );
}

#[test]
fn another_depth_unit_is_named() {
    let larger = report(walk(|pose| pose, 5.0));
    assert_tells(
        &text(&larger, "depth-unit-doubtful"),
        &["between 0.45 and 7 m", "a metre is stored as 1000"],
    );
    let smaller = report(walk(|pose| pose, 0.2));
    assert_tells(
        &text(&smaller, "poses-disagree"),
        &[
            "Depth seems to be 5 times too small",
            "stores a metre as 1000",
        ],
    );
}

#[test]
fn poses_in_millimetres_are_named() {
    let report = report(walk(
        |mut pose| {
            pose.translation *= 1000.0;
            pose
        },
        1.0,
    ));
    assert_tells(
        &text(&report, "scale-doubtful"),
        &["within 50 m", "are these millimetres"],
    );
}

#[test]
fn a_camera_that_never_moved() {
    let report = report(walk(
        |mut pose| {
            pose.translation = DVec3::ZERO;
            pose
        },
        1.0,
    ));
    assert_tells(
        &text(&report, "scale-doubtful"),
        &["at least 0.5 m apart", "0.000 m", "the camera has to move"],
    );
}

#[test]
fn lost_tracking_few_views_and_wide_steps() {
    let mut files = Files::seven_scenes(8);
    for index in 0..8 {
        let x = 0.5 * f64::from(index) + if index < 4 { 0.0 } else { 20.0 };
        files.set(
            &format!("frame-{index:06}.pose.txt"),
            pose_text(&DAffine3::from_translation(DVec3::X * x)),
        );
    }
    let report = report(files);
    assert_tells(
        &text(&report, "pose-jump"),
        &["frame-000004", "tracking was lost"],
    );
    assert_tells(&text(&report, "few-keyframes"), &["at least 10", "found 8"]);
    assert_tells(
        &text(&report, "frames-far-apart"),
        &["1 to 30 cm", "Move more slowly"],
    );
}

#[test]
fn a_staircase_of_cameras() {
    let mut files = Files::seven_scenes(12);
    for index in 0..12 {
        let up = DVec3::new(0.3, -0.2, 0.0) * f64::from(index); // image up is -y
        files.set(
            &format!("frame-{index:06}.pose.txt"),
            pose_text(&DAffine3::from_translation(up)),
        );
    }
    assert_tells(
        &text(&report(files), "height-spread"),
        &["within 1.5 m", "found 2.20 m"],
    );
}

#[test]
fn broken_pictures_are_listed_and_counted() {
    let mut files = Files::seven_scenes(12);
    files.set("frame-000003.color.jpg", "");
    files.set("frame-000005.depth.png", flat_depth(32, 24, 9));
    files.set("frame-000007.depth.png", flat_depth(64, 48, 0));
    let scan = files.open().unwrap();
    let report = examine(&scan, Look::All);
    assert_tells(
        &text(&report, "image-broken"),
        &["frame-000003.color.jpg", "found an empty file"],
    );
    assert_tells(
        &text(&report, "image-size"),
        &["frame-000005.depth.png", "found 32x24"],
    );
    assert_tells(
        &text(&report, "depth-empty"),
        &["frame-000007.depth.png", "found 0.0 %"],
    );
    assert!((report.depth_measured_share.unwrap() - 10.0 / 11.0).abs() < 1e-9);
    assert_eq!(report.depth_median_m, Some(2.0));

    // A sample of four frames (1, 4, 7, 10) meets only one of them.
    let sample = examine(&scan, Look::Sample(4));
    assert_eq!(sample.frames_examined, 4);
    assert!(
        sample
            .findings
            .iter()
            .all(|finding| finding.code != "image-broken" && finding.code != "image-size")
    );
    text(&sample, "depth-empty");
}
