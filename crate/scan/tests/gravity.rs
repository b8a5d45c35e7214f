//! Up is found in rooms seen by level, tilted, rolled and one-sided cameras, whatever the scan's own world is.
#![allow(clippy::unwrap_used)]

mod common;

use common::room::{self, Noise, Surface};
use common::{Files, finding, flat_depth, png_u16, pose_text};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use scan::{Camera, GravitySource, Scan};

const CAMERA: Camera = Camera {
    width: 160,
    height: 120,
    fx: 130.0,
    fy: 130.0,
    cx: 79.5,
    cy: 59.5,
};

/// A world turned by any rotation, repeatable by `seed`.
fn any_turn(seed: u64) -> DQuat {
    let mut noise = Noise(seed);
    let mut part = || noise.normal();
    DQuat::from_xyzw(part(), part(), part(), part()).normalize()
}

/// Renders a room, turns its world and opens the scan.
fn scan_of(room: &[Surface], poses: &[DAffine3], turn: DQuat, noise_at_1m_m: f64) -> Scan {
    let mut noise = Noise(7);
    let mut files = Files(vec![(
        "camera-intrinsics.txt".to_owned(),
        b"130 0 79.5 0 130 59.5 0 0 1".to_vec(),
    )]);
    for (index, pose) in poses.iter().enumerate() {
        let depth = room::depth_mm(room, &CAMERA, pose, noise_at_1m_m, &mut noise);
        files.set(
            &format!("frame-{index:06}.depth.png"),
            png_u16(CAMERA.width, CAMERA.height, &depth),
        );
        let turned = DAffine3::from_quat(turn) * *pose;
        files.set(&format!("frame-{index:06}.pose.txt"), pose_text(&turned));
    }
    files.open().unwrap()
}

/// Opens the room in several worlds; up must be right to half a degree in each.
fn assert_up_is_found(what: &str, room: &[Surface], poses: &[DAffine3], noise_at_1m_m: f64) {
    for seed in 1..=3 {
        let turn = any_turn(seed);
        let scan = scan_of(room, poses, turn, noise_at_1m_m);
        let gravity = scan.gravity();
        assert_eq!(gravity.source, GravitySource::Estimated);
        let error_deg = gravity
            .up_in_scan
            .angle_between(turn * DVec3::Z)
            .to_degrees();
        println!("{what}, world {seed}: {error_deg:.3} degrees off");
        assert!(error_deg < 0.5, "{what}: {error_deg} degrees");
        assert!(gravity.planes_from_cameras_deg.is_some());
        let canonical_up = scan.frames()[0].pose.matrix3 * poses[0].matrix3.transpose() * DVec3::Z;
        assert!(canonical_up.angle_between(DVec3::Z).to_degrees() < 0.5);
    }
}

/// Sixteen views round a 5 x 4 m room from its middle.
fn around(pitch_deg: f64, roll_deg: f64) -> Vec<DAffine3> {
    let mut noise = Noise(3);
    (0..16)
        .map(|i| {
            let place = [
                2.5 + 0.8 * noise.next(),
                2.0 + 0.6 * noise.next(),
                1.5 + 0.2 * noise.next(),
            ];
            let roll = roll_deg * noise.next();
            room::camera_at(
                place,
                22.5 * f64::from(i),
                pitch_deg + 8.0 * noise.next(),
                roll,
            )
        })
        .collect()
}

fn furnished() -> Vec<Surface> {
    let mut room = room::shell(5.0, 4.0, 2.5, true);
    room.extend(room::block([1.2, 1.0, 0.0], [1.4, 0.8, 0.75], 20.0));
    room.extend(room::block([4.0, 3.2, 0.0], [0.9, 0.9, 0.45], -35.0));
    room.extend(room::block([4.6, 0.4, 0.0], [0.6, 0.5, 1.9], 0.0));
    room
}

#[test]
fn a_furnished_room_seen_all_round() {
    assert_up_is_found("level cameras", &furnished(), &around(-10.0, 5.0), 0.003);
}

#[test]
fn noisy_depth_and_rolled_cameras() {
    assert_up_is_found("rolled, noisy", &furnished(), &around(-15.0, 25.0), 0.006);
}

#[test]
fn a_tilted_head_that_looks_one_way_only() {
    // The cameras' mean up is 45 degrees off here.
    let poses: Vec<DAffine3> = (0..12)
        .map(|i| {
            room::camera_at(
                [0.8 + 0.1 * f64::from(i), 2.0, 1.6],
                2.0 * f64::from(i) - 12.0,
                -45.0,
                0.0,
            )
        })
        .collect();
    assert_up_is_found("looking down one way", &furnished(), &poses, 0.003);
}

#[test]
fn a_table_that_fills_the_view() {
    let mut room = room::shell(5.0, 4.0, 2.5, false);
    room.extend(room::block([2.5, 2.0, 0.0], [3.0, 2.0, 0.74], 10.0));
    room.extend(room::block([2.2, 1.8, 0.74], [0.3, 0.2, 0.25], 40.0));
    room.extend(room::block([2.9, 2.3, 0.74], [0.25, 0.35, 0.08], 75.0));
    let poses: Vec<DAffine3> = (0..12)
        .map(|i| {
            let heading = 20.0 * f64::from(i) - 60.0;
            let (sin, cos) = heading.to_radians().sin_cos();
            room::camera_at([2.5 - 1.6 * cos, 2.0 - 1.6 * sin, 1.5], heading, -35.0, 3.0)
        })
        .collect();
    assert_up_is_found("a big table", &room, &poses, 0.004);
}

#[test]
fn an_attic_with_sloped_ceilings() {
    // Two slopes of 45 degrees from knee walls to a ridge: more slope than floor in view.
    let mut room = vec![
        room::surface([0.0; 3], [5.0, 0.0, 0.0], [0.0, 4.0, 0.0]),
        room::surface([0.0; 3], [5.0, 0.0, 0.0], [0.0, 0.0, 0.8]),
        room::surface([0.0, 4.0, 0.0], [5.0, 0.0, 0.0], [0.0, 0.0, 0.8]),
        room::surface([0.0, 0.0, 0.8], [5.0, 0.0, 0.0], [0.0, 2.0, 2.0]),
        room::surface([0.0, 4.0, 0.8], [5.0, 0.0, 0.0], [0.0, -2.0, 2.0]),
        room::surface([0.0; 3], [0.0, 4.0, 0.0], [0.0, 0.0, 2.8]),
        room::surface([5.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.8]),
    ];
    room.extend(room::block([1.5, 1.0, 0.0], [1.0, 0.6, 0.5], 15.0));
    assert_up_is_found("an attic", &room, &around(-12.0, 5.0), 0.003);
}

#[test]
fn walls_alone_decide_where_no_floor_is_seen() {
    let walls: Vec<Surface> = room::shell(5.0, 4.0, 3.0, false)
        .into_iter()
        .skip(1)
        .collect();
    assert_up_is_found("walls", &walls, &around(5.0, 25.0), 0.003);
}

#[test]
fn without_depth_the_cameras_decide_and_it_is_said() {
    let turn = any_turn(9);
    let mut files = Files::seven_scenes(0);
    for (index, pose) in around(-20.0, 0.0).iter().enumerate() {
        let stem = format!("frame-{index:06}");
        files.set(
            &format!("{stem}.color.png"),
            common::png_rgb(64, 48, &common::texture(64, 48)),
        );
        files.set(
            &format!("{stem}.pose.txt"),
            pose_text(&(DAffine3::from_quat(turn) * *pose)),
        );
    }
    let scan = files.open().unwrap();
    let error_deg = scan
        .gravity()
        .up_in_scan
        .angle_between(turn * DVec3::Z)
        .to_degrees();
    assert!(error_deg < 0.5, "{error_deg}"); // level x axes say it exactly
    assert_eq!(scan.gravity().planes_from_cameras_deg, None);
    let told = finding(&scan, "gravity-from-cameras");
    common::assert_tells(&told.to_string(), &["found no depth", "Up is taken from"]);
}

#[test]
fn a_wall_alone_is_no_floor() {
    // Upright cameras that see nothing but a wall: the wall must not become the floor.
    let room = vec![room::surface(
        [3.0, -5.0, -5.0],
        [0.0, 10.0, 0.0],
        [0.0, 0.0, 10.0],
    )];
    let poses: Vec<DAffine3> = (0..8)
        .map(|i| {
            room::camera_at(
                [0.1 * f64::from(i), 0.0, 1.5],
                10.0 * f64::from(i) - 35.0,
                0.0,
                0.0,
            )
        })
        .collect();
    let scan = scan_of(&room, &poses, DQuat::IDENTITY, 0.0);
    assert!(
        scan.gravity()
            .up_in_scan
            .angle_between(DVec3::Z)
            .to_degrees()
            < 1.0
    );
    finding(&scan, "gravity-from-cameras");
}

#[test]
fn scan_from_canonical_is_a_rotation_that_brings_poses_back() {
    let turn = any_turn(4);
    let poses = around(-10.0, 5.0);
    let scan = scan_of(&furnished(), &poses, turn, 0.0);
    let back = scan.scan_from_canonical();
    assert_eq!(back.translation, DVec3::ZERO);
    assert!((back.matrix3.determinant() - 1.0).abs() < 1e-9);
    for (frame, pose) in scan.frames().iter().zip(&poses) {
        let original = DAffine3::from_quat(turn) * *pose;
        assert!((back * frame.pose).abs_diff_eq(original, 1e-6));
    }
}

#[test]
fn a_scan_that_already_stands_upright_is_hardly_turned() {
    let scan = scan_of(&furnished(), &around(-10.0, 5.0), DQuat::IDENTITY, 0.0);
    assert!(scan.gravity().rotated_deg < 0.2);
    assert!(
        scan.scan_from_canonical()
            .matrix3
            .abs_diff_eq(DMat3::IDENTITY, 5e-3)
    );
}

#[test]
fn useless_depth_falls_back_to_the_cameras() {
    let mut files = Files::seven_scenes(3);
    for index in 0..3 {
        files.set(
            &format!("frame-{index:06}.depth.png"),
            flat_depth(64, 48, 0),
        );
    }
    let scan = files.open().unwrap();
    assert!(scan.gravity().up_in_scan.distance(DVec3::NEG_Y) < 1e-9);
    common::assert_tells(
        &finding(&scan, "gravity-from-cameras").found,
        &["neither a level surface"],
    );
}
