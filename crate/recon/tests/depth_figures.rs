//! Depth maps against the sensor's depth: figures that can be worked out by hand.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{color_alone, open, sample};
use recon::evaluate::{compare_depth, mean_depth};
use scan::Camera;

#[test]
fn the_sensors_own_depth_is_perfect_and_what_is_left_out_is_counted() {
    let scan = open(sample());
    let camera = scan.frames()[2].depth_camera;
    let truth = scan.depth(2).unwrap().unwrap().depth_m;
    let compare = |depth_m: &[f32]| compare_depth(&scan, 2, &camera, depth_m).unwrap().unwrap();
    let same = compare(&truth);
    assert_eq!((same.errors.abs_rel, same.errors.rmse), (0.0, 0.0));
    assert_eq!((same.errors.delta_1, same.coverage), (1.0, 1.0));

    // A tenth too far, known in every second column only.
    let width = camera.width as usize;
    let far: Vec<f32> = truth.iter().map(|z| z * 1.1).collect();
    let half: Vec<f32> = (0..far.len())
        .map(|p| {
            if (p % width).is_multiple_of(2) {
                far[p]
            } else {
                0.0
            }
        })
        .collect();
    let half = compare(&half);
    assert!((half.errors.abs_rel - 0.1).abs() < 1e-6);
    assert_eq!(half.errors.delta_1, 1.0);
    assert!((half.coverage - 0.5).abs() < 0.01, "{}", half.coverage);
    assert_eq!(half.measured, same.measured);

    // Over two maps: the mean of the errors, all pixels together.
    let mean = mean_depth(&[same, half]).unwrap();
    assert!((mean.errors.abs_rel - 0.05).abs() < 1e-6);
    assert!((mean.coverage - 0.75).abs() < 0.005);
    assert_eq!(mean.maps, 2);
    assert_eq!(mean_depth(&[]), None);
}

#[test]
fn a_map_of_another_camera_is_looked_up_along_the_same_rays() {
    let scan = open(sample());
    let camera = scan.frames()[0].depth_camera;
    let truth = scan.depth(0).unwrap().unwrap();
    // The sensor's picture without its left 80 columns, at twice the pixels.
    let (left, width) = (80, truth.width - 80);
    let crop = Camera {
        width,
        cx: camera.cx - f64::from(left),
        ..camera
    };
    let double = crop.scaled(width * 2, truth.height * 2);
    let map: Vec<f32> = (0..double.width * double.height)
        .map(|p| {
            let (x, y) = (p % double.width / 2 + left, p / double.width / 2);
            truth.depth_m[(y * truth.width + x) as usize]
        })
        .collect();
    let found = compare_depth(&scan, 0, &double, &map).unwrap().unwrap();
    assert_eq!(found.errors.abs_rel, 0.0);
    assert!((found.coverage - 0.75).abs() < 0.01, "{}", found.coverage);
}

#[test]
fn without_a_sensor_there_is_nothing_and_a_wrong_size_is_an_error() {
    let scan = open(color_alone(|_, bytes| bytes));
    let camera = scan.frames()[0].color_camera;
    let map = vec![1.0; 320 * 240];
    assert_eq!(compare_depth(&scan, 0, &camera, &map).unwrap(), None);
    let error = compare_depth(&scan, 0, &camera, &map[5..]).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("76800 values (320 x 240), found 76795"),
        "{text}"
    );
}
