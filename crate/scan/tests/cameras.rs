//! Cameras under resizing and projection, and the choice of keyframes.

mod common;

use common::room::camera_at;
use glam::{DAffine3, DVec2, DVec3};
use scan::{Camera, Frame, KeyframeRule, keyframes};

const CAMERA: Camera = Camera {
    width: 640,
    height: 480,
    fx: 500.0,
    fy: 510.0,
    cx: 310.0,
    cy: 245.0,
};

#[test]
fn projection_undoes_unprojection_and_knows_what_is_behind() {
    let pixel = DVec2::new(12.25, 470.5);
    let point = CAMERA.unproject(pixel, 2.5);
    assert_eq!(point.z, 2.5);
    assert!(CAMERA.project(point).unwrap().distance(pixel) < 1e-9);
    assert_eq!(CAMERA.project(DVec3::new(0.0, 0.0, -1.0)), None);
    // x right, y down.
    let pixel = CAMERA.project(DVec3::new(0.1, 0.2, 1.0)).unwrap();
    assert_eq!(pixel, DVec2::new(360.0, 347.0));
}

#[test]
fn resizing_keeps_every_point_of_the_picture_in_its_place() {
    let small = CAMERA.scaled(320, 160);
    // The left edge of the picture is at -0.5 in any size, the right one at width - 0.5.
    for (large_u, small_u) in [(-0.5, -0.5), (639.5, 319.5)] {
        let ray = CAMERA.unproject(DVec2::new(large_u, 100.0), 1.0);
        assert!((small.project(ray).unwrap().x - small_u).abs() < 1e-9);
    }
    let ray = CAMERA.unproject(DVec2::new(0.0, 479.5), 1.0);
    assert!((small.project(ray).unwrap().y - 159.5).abs() < 1e-9);
    let back = small.scaled(640, 480);
    assert!((back.cx - CAMERA.cx).abs() < 1e-9 && (back.fy - CAMERA.fy).abs() < 1e-9);
}

fn frames(poses: impl IntoIterator<Item = DAffine3>) -> Vec<Frame> {
    poses
        .into_iter()
        .map(|pose| Frame {
            name: String::new(),
            pose,
            color: None,
            depth: None,
            color_camera: CAMERA,
            depth_camera: CAMERA,
            timestamp_s: None,
        })
        .collect()
}

#[test]
fn keyframes_by_distance_from_the_last_kept_one() {
    let at = |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
    let frames = frames([0.0, 0.06, 0.099, 0.12, 0.20, 0.23].map(at));
    assert_eq!(keyframes(&frames, KeyframeRule::default()), [0, 3, 5]);
}

#[test]
fn keyframes_by_angle_of_the_optical_axis_only() {
    // Turning: 16 degrees is a new view, 14 is not. Rolling about the axis shows nothing new.
    let turned = |heading, roll| camera_at([0.0; 3], heading, 0.0, roll);
    let frames = frames([
        turned(0.0, 0.0),
        turned(14.0, 0.0),
        turned(0.0, 80.0),
        turned(16.0, 0.0),
        turned(40.0, 0.0),
    ]);
    assert_eq!(keyframes(&frames, KeyframeRule::default()), [0, 3, 4]);
    let coarse = KeyframeRule {
        translation_m: 0.1,
        rotation_deg: 35.0,
    };
    assert_eq!(keyframes(&frames, coarse), [0, 4]);
    assert!(keyframes(&[], coarse).is_empty());
}
