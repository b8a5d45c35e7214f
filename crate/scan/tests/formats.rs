//! Each layout is recognised by its content and comes out in the same canonical form.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Files, assert_tells, finding, flat_depth, png_rgb, pose_text, room, texture};
use glam::{DAffine3, DMat3, DVec3};
use scan::{Camera, Format, Gravity, GravitySource, Severity};

fn camera(width: u32, height: u32, [fx, fy, cx, cy]: [f64; 4]) -> Camera {
    Camera {
        width,
        height,
        fx,
        fy,
        cx,
        cy,
    }
}

#[test]
fn seven_scenes_layout() {
    let scan = Files::seven_scenes(12)
        .under("export/office")
        .open()
        .unwrap();
    assert_eq!(scan.format(), Format::SevenScenes);
    assert_eq!(scan.format().to_string(), "7-Scenes");
    assert_eq!(scan.name(), "office");
    assert!(scan.has_color() && scan.has_depth());
    assert_eq!(scan.frames().len(), 12);
    let frame = &scan.frames()[10];
    assert_eq!(frame.name, "frame-000010");
    assert_eq!(
        frame.color.as_ref().unwrap().path,
        "export/office/frame-000010.color.jpg"
    );
    assert_eq!(frame.timestamp_s, None);
    let expected = camera(64, 48, [60.0, 60.0, 31.5, 23.5]);
    assert_eq!(
        (frame.color_camera, frame.depth_camera),
        (expected, expected)
    );
    assert!(
        scan.depth(10)
            .unwrap()
            .unwrap()
            .depth_m
            .iter()
            .all(|&d| d == 2.0)
    );
    assert_eq!(scan.gravity().source, GravitySource::Estimated);
}

#[test]
fn seven_scenes_calibration_one_folder_up_and_smaller_depth() {
    let mut files = Files::seven_scenes(2).under("room/frames");
    files.remove("room/frames/camera-intrinsics.txt");
    files.set(
        "room/camera-intrinsics.txt",
        "\u{feff}60, 0, 31.5\r\n0, 60, 23.5\r\n0, 0, 1\r\n",
    );
    for index in 0..2 {
        files.set(
            &format!("room/frames/frame-{index:06}.depth.png"),
            flat_depth(32, 24, 1500),
        );
    }
    let scan = files.open().unwrap();
    assert_eq!(
        scan.frames()[0].color_camera,
        camera(64, 48, [60.0, 60.0, 31.5, 23.5])
    );
    // (31.5 + 0.5) / 2 - 0.5: the centre of the picture stays its centre.
    assert_eq!(
        scan.frames()[0].depth_camera,
        camera(32, 24, [30.0, 30.0, 15.5, 11.5])
    );
    assert_eq!(scan.depth(0).unwrap().unwrap().depth_m[0], 1.5);
}

#[test]
fn original_seven_scenes_data_has_its_published_calibration() {
    let mut files = Files(Vec::new());
    files.set(
        "chess/seq-01/frame-000000.color.png",
        png_rgb(640, 480, &texture(640, 480)),
    );
    let mut depth = vec![1234; 640 * 480];
    depth[0] = u16::MAX;
    depth[1] = 0;
    files.set(
        "chess/seq-01/frame-000000.depth.png",
        common::png_u16(640, 480, &depth),
    );
    files.set(
        "chess/seq-01/frame-000000.pose.txt",
        pose_text(&DAffine3::IDENTITY),
    );
    let scan = files.open().unwrap();
    let frame = &scan.frames()[0];
    assert_eq!(
        frame.depth_camera,
        camera(640, 480, [585.0, 585.0, 320.0, 240.0])
    );
    assert_eq!(
        frame.color_camera,
        camera(640, 480, [525.0, 525.0, 320.0, 240.0])
    );
    let told = finding(&scan, "published-calibration");
    assert_eq!(told.severity, Severity::Info);
    assert_tells(
        &told.to_string(),
        &[
            "chess/seq-01/camera-intrinsics.txt",
            "published calibration",
            "2.5 cm",
        ],
    );
    assert_eq!(
        scan.depth(0).unwrap().unwrap().depth_m[..3],
        [0.0, 0.0, 1.234]
    );
}

#[test]
fn scannet_export() {
    let mut files = common::scannet(12);
    files.set("room/pose/3.txt", "-inf -inf -inf -inf\n".repeat(4));
    files.set("room/pose/11.txt", "-inf -inf -inf -inf\n".repeat(4));
    let scan = files.open().unwrap();
    assert_eq!(scan.format().to_string(), "ScanNet");
    assert_eq!(scan.name(), "room");
    let names: Vec<&str> = scan
        .frames()
        .iter()
        .map(|frame| frame.name.as_str())
        .collect();
    assert_eq!(names, ["0", "1", "2", "4", "5", "6", "7", "8", "9", "10"]);
    assert_eq!(
        scan.frames()[0].color_camera,
        camera(128, 96, [120.0, 121.0, 63.5, 47.5])
    );
    assert_eq!(
        scan.frames()[0].depth_camera,
        camera(64, 48, [60.0, 61.0, 31.5, 23.5])
    );
    assert_eq!(scan.depth(0).unwrap().unwrap().depth_m[5], 2.5);
    let lost = finding(&scan, "tracking-lost");
    assert_eq!((lost.severity, lost.frames_affected), (Severity::Info, 2));
    assert_tells(
        &lost.to_string(),
        &[
            "room/pose/3.txt",
            "2 frames where tracking was lost",
            "left out",
        ],
    );
    // Z is up already: nothing is turned.
    assert_eq!(
        scan.gravity(),
        &Gravity {
            source: GravitySource::Format,
            up_in_scan: DVec3::Z,
            rotated_deg: 0.0,
            planes_from_cameras_deg: None
        }
    );
    assert_eq!(scan.scan_from_canonical(), DAffine3::IDENTITY);
    let second = &scan.frames()[1].pose;
    assert!(second.translation.distance(DVec3::new(0.2, 0.0, 1.5)) < 1e-12);
    assert!(second.matrix3.z_axis.distance(DVec3::Y) < 1e-12);
}

#[test]
fn scannet_with_cameras_on_their_side_is_doubted() {
    let mut files = common::scannet(3);
    for index in 0..3 {
        let pose = room::camera_at([index as f64, 0.0, 1.5], 90.0, 0.0, 180.0);
        files.set(&format!("room/pose/{index}.txt"), pose_text(&pose));
    }
    let scan = files.open().unwrap();
    assert_tells(
        &finding(&scan, "gravity-doubtful").to_string(),
        &["cameras held upright", "found -1.00", "camera-to-world"],
    );
}

#[test]
fn scannet_with_one_calibration_derives_the_other() {
    let scan = common::scannet(2)
        .without("room/intrinsic/intrinsic_depth.txt")
        .open()
        .unwrap();
    assert_eq!(
        scan.frames()[0].depth_camera,
        camera(64, 48, [60.0, 60.5, 31.5, 23.5])
    );
    assert_tells(
        &finding(&scan, "intrinsics-derived").to_string(),
        &[
            "room/intrinsic/intrinsic_depth.txt",
            "no such file",
            "colour camera's calibration is scaled",
        ],
    );
}

#[test]
fn tum_rgbd() {
    let scan = common::tum("rgbd_dataset_freiburg3_room", 5)
        .open()
        .unwrap();
    assert_eq!(scan.format().to_string(), "TUM RGB-D");
    assert_eq!(scan.frames().len(), 5);
    assert_eq!(scan.gravity().source, GravitySource::Format);
    assert_eq!(scan.scan_from_canonical(), DAffine3::IDENTITY);
    let frame = &scan.frames()[2];
    assert_eq!(frame.name, "100.200000");
    assert_eq!(frame.timestamp_s, Some(100.2));
    assert_eq!(scan.depth(2).unwrap().unwrap().depth_m[0], 2.0);
    // At 1 m/s, 8 ms after the colour picture: the pose is taken at the depth picture's moment, between two others.
    assert!(
        (frame.pose.translation.x - 0.208).abs() < 1e-6,
        "{}",
        frame.pose.translation
    );
    assert!(frame.pose.matrix3.z_axis.distance(DVec3::Y) < 1e-5);
    assert_tells(
        &finding(&scan, "matched-by-time").to_string(),
        &["8.0 ms apart", "interpolated"],
    );
    // Freiburg 3 at a tenth of its size.
    let expected = camera(640, 480, [535.4, 539.2, 320.1, 247.6]).scaled(64, 48);
    assert_eq!(frame.color_camera, expected);
}

#[test]
fn tum_calibration_of_unknown_cameras_is_assumed_or_given() {
    let scan = common::tum("my_room", 2).open().unwrap();
    assert_eq!(scan.frames()[0].color_camera.fx, 52.5);
    let told = finding(&scan, "calibration-assumed");
    assert_eq!(told.severity, Severity::Warning);
    assert_tells(
        &told.to_string(),
        &[
            "my_room/camera-intrinsics.txt",
            "525, 525, 319.5, 239.5",
            "add the file",
        ],
    );

    let mut files = common::tum("my_room", 2);
    files.set("my_room/camera-intrinsics.txt", "50 0 31\n0 51 22\n0 0 1");
    let scan = files.open().unwrap();
    assert_eq!(
        scan.frames()[0].depth_camera,
        camera(64, 48, [50.0, 51.0, 31.0, 22.0])
    );
}

#[test]
fn tum_pictures_and_poses_that_do_not_match() {
    let mut files = common::tum("fr3", 4);
    files.remove("fr3/depth/100.108000.png");
    let rgb = String::from_utf8(files.get("fr3/rgb.txt").to_vec()).unwrap();
    files.set(
        "fr3/rgb.txt",
        format!("{rgb}150.0 rgb/100.000000.png\nnonsense\n"),
    );
    let poses = String::from_utf8(files.get("fr3/groundtruth.txt").to_vec()).unwrap();
    files.set(
        "fr3/groundtruth.txt",
        format!("{poses}1 2 3\n200 0 0 0 0 0 0 0\n"),
    );
    let scan = files.open().unwrap();
    assert_eq!(scan.frames().len(), 4);
    assert!(scan.frames()[1].depth.is_none());
    assert_tells(
        &finding(&scan, "picture-missing").to_string(),
        &["fr3/depth.txt:3:", "depth/100.108000.png", "no such file"],
    );
    assert_tells(
        &finding(&scan, "pose-no-rotation").to_string(),
        &[
            "fr3/groundtruth.txt:13:",
            "length 1",
            "length 0.0000",
            "line is left out",
        ],
    );
    let texts: Vec<String> = scan.findings().iter().map(ToString::to_string).collect();
    let all = texts.join("\n");
    assert_tells(
        &all,
        &[
            "fr3/rgb.txt:7: expected a time and a picture's path, found \"nonsense\"",
            "fr3/groundtruth.txt:12: expected 8 numbers",
            "fr3/rgb/100.000000.png: expected a pose within 20 ms of each picture, found 1 without",
            "expected depth within 20 ms of each picture, found 2 without",
        ],
    );
}

#[test]
fn icl_nuim_is_mirrored_back_and_stands_upright() {
    // One camera at (1, 1.5, 2) of the left-handed, Y-up world, looking along its +z, level.
    let mut files = Files(Vec::new());
    files.set(
        "living_room/rgb/0.png",
        png_rgb(640, 480, &texture(640, 480)),
    );
    files.set("living_room/depth/0.png", flat_depth(640, 480, 5000));
    files.set(
        "living_room/associations.txt",
        "0 depth/0.png 0 rgb/0.png\n",
    );
    files.set("living_room/livingRoom0.gt.freiburg", "0 1 1.5 2 0 0 0 1\n");
    let scan = files.open().unwrap();
    let frame = &scan.frames()[0];
    assert_eq!(frame.color.as_ref().unwrap().path, "living_room/rgb/0.png");
    assert_eq!(
        frame.depth.as_ref().unwrap().path,
        "living_room/depth/0.png"
    );
    assert_eq!(
        frame.depth_camera,
        camera(640, 480, [481.2, 480.0, 319.5, 239.5])
    );
    assert!(
        frame.pose.matrix3.y_axis.distance(DVec3::NEG_Z) < 1e-12,
        "image down is down"
    );
    assert!((frame.pose.matrix3.determinant() - 1.0).abs() < 1e-12);
    assert!(
        (frame.pose.translation.z - 1.5).abs() < 1e-12,
        "1.5 m above the floor"
    );
    // The pixel in the picture's upper half is above the camera, in the user's own coordinates too (+y is up there).
    let seen = frame
        .depth_camera
        .unproject(glam::DVec2::new(319.5, 139.5), 3.0);
    let canonical = frame.pose.transform_point3(seen);
    assert!((canonical.z - (1.5 + 3.0 * 100.0 / 480.0)).abs() < 1e-9);
    let back = scan.scan_from_canonical();
    let expected = DVec3::new(1.0, 1.5 + 3.0 * 100.0 / 480.0, 5.0);
    assert!(back.transform_point3(canonical).distance(expected) < 1e-9);
    assert!(
        (back.matrix3.determinant() + 1.0).abs() < 1e-12,
        "a mirror, and it says so"
    );
    assert_eq!(scan.gravity().up_in_scan, DVec3::Y);
    assert!((back.matrix3.transpose() * back.matrix3).abs_diff_eq(DMat3::IDENTITY, 1e-12));
}

#[test]
fn the_first_of_several_scans_is_taken_and_the_others_named() {
    let mut files = Files::seven_scenes(3).under("chess/seq-02");
    files
        .0
        .extend(Files::seven_scenes(2).under("chess/seq-01").0);
    let scan = files.open().unwrap();
    assert_eq!((scan.name(), scan.frames().len()), ("seq-01", 2));
    assert_tells(
        &finding(&scan, "several-scans").to_string(),
        &[
            "chess/seq-01",
            "chess/seq-02 is another",
            "choose a single folder",
        ],
    );
}

#[test]
fn pictures_without_poses_beside_a_whole_scan_do_not_win() {
    let mut files = Files::seven_scenes(3).under("b/scan");
    files.set("a/frame-000000.color.jpg", "");
    assert_eq!(files.open().unwrap().name(), "scan");
}
