//! Integration of depth: the surface lies where it was measured, and both forms of it agree on every device.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use glam::{Affine3A, Quat, Vec3};
use mesh::{Mesh, camera::Pinhole};
use volume::{DepthView, Volume, VolumeConfig};

const CAMERA: Pinhole = Pinhole {
    width: 160,
    height: 120,
    fx: 140.0,
    fy: 138.0,
    cx: 80.5,
    cy: 59.0,
};

/// Looks along world +y, image up is world +z.
fn upright() -> Quat {
    Quat::from_mat3(&glam::Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y))
}

/// Depth and colour of a wall at `y = wall_m` with a ball of 0.4 m in front of it, seen from `pose`.
fn look(pose: &Affine3A, wall_m: f32) -> (Vec<f32>, Vec<u8>) {
    let eye = Vec3::from(pose.translation);
    let ball = Vec3::new(0.1, wall_m - 0.6, 0.05);
    let mut depth = Vec::new();
    let mut rgb = Vec::new();
    for v in 0..CAMERA.height {
        for u in 0..CAMERA.width {
            let ray = CAMERA.ray(glam::Vec2::new(u as f32, v as f32));
            let ray = pose.transform_vector3(ray);
            let to_wall = (wall_m - eye.y) / ray.y;
            let b = ray.dot(ball - eye) / ray.length_squared();
            let miss = (eye + ray * b).distance_squared(ball);
            let half = ((0.16 - miss) / ray.length_squared()).max(0.0).sqrt();
            let hit_ball = miss < 0.16 && b > 0.0;
            depth.push(if hit_ball { b - half } else { to_wall });
            rgb.extend(if hit_ball {
                [220, 40, 30]
            } else {
                [40, 90, 200]
            });
        }
    }
    (depth, rgb)
}

fn poses() -> Vec<Affine3A> {
    let at = |x: f32, z: f32, turn: f32| {
        Affine3A::from_rotation_translation(
            Quat::from_rotation_z(turn) * upright(),
            Vec3::new(x, -0.3, z),
        )
    };
    vec![
        at(0.0, 0.0, 0.0),
        at(0.25, 0.1, 0.12),
        at(-0.3, -0.15, -0.15),
    ]
}

fn fuse(volume: &mut Volume, wall_m: f32) {
    for pose in poses() {
        let (depth_m, rgb) = look(&pose, wall_m);
        let view = DepthView {
            depth_m: &depth_m,
            depth_camera: CAMERA,
            confidence: None,
            color: Some((&rgb, CAMERA)),
            world_from_camera: pose,
        };
        volume.integrate(&view).unwrap();
    }
}

fn config() -> VolumeConfig {
    VolumeConfig::new(0.04)
}

on_each_device! {
    /// The wall comes out flat where it was measured, facing the camera, in its own colour. The depth of the nearest
    /// pixel is used: half a pixel of a wall seen aslant is some 3 mm.
    async fn a_wall_lies_where_it_was_measured(device: Device) {
        let mut volume = config().init(&device).unwrap();
        fuse(&mut volume, 2.013);
        let mesh = volume.mesh().await.unwrap();
        let mut wall = 0;
        for ((position, normal), color) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.colors) {
            // Well away from the ball and its shadow.
            if position.x.abs() > 0.75 {
                assert!((position.y - 2.013).abs() < 4e-3, "wall vertex at {position}");
                assert!(normal.dot(Vec3::NEG_Y) > 0.99, "wall normal {normal}");
                assert_eq!(*color, [40, 90, 200]);
                wall += 1;
            }
        }
        assert!(wall > 300, "{wall} vertices of wall");
        let red = mesh.colors.iter().filter(|color| color[0] > 200).count();
        assert!(red > 100, "{red} vertices of ball");
    }
}

on_each_device! {
    /// The device's own kernels and the tensor operations on `flex` make the same mesh.
    async fn every_device_makes_the_same_mesh(device: Device) {
        let mut reference = config().init(&Device::flex()).unwrap();
        fuse(&mut reference, 1.7);
        let reference = reference.mesh().await.unwrap();
        let mut volume = config().init(&device).unwrap();
        fuse(&mut volume, 1.7);
        assert_same(&reference, &volume.mesh().await.unwrap());
        // And so do the tensor operations on the device itself.
        let mut plain = config().init(&device).unwrap();
        plain.use_plain_form();
        fuse(&mut plain, 1.7);
        assert_same(&reference, &plain.mesh().await.unwrap());
    }
}

/// Rounding may move a projection across the border of a pixel, so a few vertices at depth edges may differ.
fn assert_same(expected: &Mesh, found: &Mesh) {
    let (a, b) = (
        expected.positions.len() as f64,
        found.positions.len() as f64,
    );
    assert!((a / b - 1.0).abs() < 2e-3, "{a} vertices, then {b}");
    let index = mesh::nearest::PointIndex::new(&expected.positions);
    let distances = index.distances(&found.positions);
    let mean = distances.iter().sum::<f32>() / distances.len() as f32;
    let far = distances.iter().filter(|&&d| d > 1e-4).count();
    assert!(mean < 1e-4, "mean distance {mean} m");
    assert!(
        (far as f64) < b * 5e-3,
        "{far} of {b} vertices differ by more than 0.1 mm"
    );
    let color = |mesh: &Mesh| {
        let sum = mesh.colors.iter().map(|c| c.map(f64::from));
        let sum = sum.fold([0.0; 3], |s, c| std::array::from_fn(|i| s[i] + c[i]));
        sum.map(|s| s / mesh.colors.len() as f64)
    };
    for (x, y) in color(expected).into_iter().zip(color(found)) {
        assert!((x - y).abs() < 0.5, "mean colour {x}, then {y}");
    }
}

on_each_device! {
    /// What was never observed gives no surface: nothing appears behind the wall or outside the pictures.
    async fn unseen_space_stays_empty(device: Device) {
        let mut volume = config().init(&device).unwrap();
        fuse(&mut volume, 2.0);
        let mesh = volume.mesh().await.unwrap();
        for position in &mesh.positions {
            assert!(position.y < 2.004, "surface behind the wall at {position}");
            let seen = poses().iter().any(|pose| {
                let p = pose.inverse().transform_point3(*position);
                let pixel = CAMERA.project(p);
                pixel.x > -1.5 && pixel.y > -1.5 && pixel.x < 161.5 && pixel.y < 121.5
            });
            assert!(seen, "surface outside every picture at {position}");
        }
    }
}

on_each_device! {
    /// Taking the changed bricks step by step gives every triangle that the whole mesh has.
    async fn streamed_bricks_add_up_to_the_mesh(device: Device) {
        let mut volume = config().init(&device).unwrap();
        fuse(&mut volume, 1.5);
        let whole = volume.mesh().await.unwrap();
        let mut triangles = 0;
        while volume.changed_count() > 0 {
            let bricks = volume.take_changed(7, Vec3::ZERO);
            let meshes = volume.extract(&bricks).await.unwrap();
            let rows: usize = meshes.ranges.iter().map(|(_, rows)| rows.len()).sum();
            assert_eq!(rows, meshes.vertices.dims()[0]);
            triangles += rows / 3;
        }
        assert_eq!(triangles, whole.triangles.len());
    }
}

on_each_device! {
    async fn too_many_bricks_and_wrong_sizes_are_errors_that_change_nothing(device: Device) {
        let small = VolumeConfig { binding_bytes: 40 << 13, ..config() };
        let mut volume = small.init(&device).unwrap();
        let pose = poses()[0];
        let (depth_m, rgb) = look(&pose, 2.0);
        let mut view = DepthView {
            depth_m: &depth_m,
            depth_camera: CAMERA,
            confidence: None,
            color: Some((&rgb, CAMERA)),
            world_from_camera: pose,
        };
        let error = volume.integrate(&view).unwrap_err().to_string();
        assert!(error.contains("39 bricks") && error.contains("larger voxels"), "{error}");
        assert_eq!(volume.brick_count(), 0);
        view.depth_m = &depth_m[1..];
        let error = volume.integrate(&view).unwrap_err().to_string();
        assert!(error.contains("19200 values (160 x 120), found 19199"), "{error}");
        assert!(VolumeConfig::new(0.0).init(&device).is_err());
        assert!(VolumeConfig::new(f32::NAN).init(&device).is_err());
    }
}

/// Fuses the first pose's picture with a confidence for each of its pixels.
fn fuse_one(volume: &mut Volume, wall_m: f32, confidence: Option<&[f32]>) {
    let pose = poses()[0];
    let (depth_m, rgb) = look(&pose, wall_m);
    let view = DepthView {
        depth_m: &depth_m,
        depth_camera: CAMERA,
        confidence,
        color: Some((&rgb, CAMERA)),
        world_from_camera: pose,
    };
    volume.integrate(&view).unwrap();
}

const PIXELS: usize = (CAMERA.width * CAMERA.height) as usize;

/// Largest distance between vertices of the same number.
fn largest_shift_m(a: &Mesh, b: &Mesh) -> f32 {
    assert_eq!(a.triangles, b.triangles);
    let pairs = a.positions.iter().zip(&b.positions);
    pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

on_each_device! {
    /// Half as sure twice is as good as sure once: the same surface, and enough weight for one only after the second time.
    async fn half_a_confidence_twice_is_one_confidence(device: Device) {
        let sure = [1.0; PIXELS];
        let half = [0.5; PIXELS];
        // Everything seen once from 2 m is enough, half of it is not.
        let mut config = config();
        config.surface.least_weight = 0.7 / (2.2 * 2.2);
        let mut once = config.init(&device).unwrap();
        fuse_one(&mut once, 1.9, None);
        let once = once.mesh().await.unwrap();
        assert!(once.triangles.len() > 500);

        let mut said = config.init(&device).unwrap();
        fuse_one(&mut said, 1.9, Some(&sure));
        assert_eq!(said.mesh().await.unwrap(), once, "1 everywhere is the same as none");

        let mut twice = config.init(&device).unwrap();
        fuse_one(&mut twice, 1.9, Some(&half));
        let wall = |mesh: &Mesh| mesh.positions.iter().filter(|p| p.y > 1.8).count();
        assert_eq!(wall(&twice.mesh().await.unwrap()), 0, "half a confidence is not enough");
        fuse_one(&mut twice, 1.9, Some(&half));
        let twice = twice.mesh().await.unwrap();
        assert!(largest_shift_m(&once, &twice) < 1e-5);
        assert_eq!(once.colors, twice.colors);
    }
}

on_each_device! {
    /// A wall seen at two distances comes out between them, nearer to the one that is surer.
    async fn the_surer_measurement_counts_for_more(device: Device) {
        let mut config = config();
        config.weigh_by_depth = false;
        let mut volume = config.init(&device).unwrap();
        fuse_one(&mut volume, 2.0, Some(&[0.9; PIXELS]));
        fuse_one(&mut volume, 2.05, Some(&[0.3; PIXELS]));
        let mesh = volume.mesh().await.unwrap();
        let wall = mesh.positions.iter().filter(|p| p.x < -0.7);
        let (sum, count) = wall.fold((0.0, 0), |(sum, count), p| (sum + p.y, count + 1));
        let found_m = sum / count as f32;
        // (0.9 * 2 + 0.3 * 2.05) / 1.2
        assert!((found_m - 2.0125).abs() < 1e-3, "the wall stands at {found_m} m");
    }
}

on_each_device! {
    /// What is worth nothing leaves no trace, not even room that was made for it, and does not spoil what is there.
    async fn a_confidence_of_nothing_changes_nothing(device: Device) {
        let mut volume = config().init(&device).unwrap();
        for worthless in [0.0, -1.0, f32::NAN] {
            fuse_one(&mut volume, 1.9, Some(&[worthless; PIXELS]));
            assert_eq!(volume.brick_count(), 0);
        }
        fuse_one(&mut volume, 1.9, None);
        let before = volume.mesh().await.unwrap();
        // The left half of the picture is sure to be somewhere else, the right half is not.
        let (left, right): (Vec<f32>, Vec<f32>) = (0..PIXELS)
            .map(|p| if p % (CAMERA.width as usize) < 80 { (1.0, 0.0) } else { (0.0, f32::NAN) })
            .unzip();
        fuse_one(&mut volume, 1.95, Some(&right));
        assert_eq!(volume.mesh().await.unwrap(), before);
        fuse_one(&mut volume, 1.95, Some(&left));
        let after = volume.mesh().await.unwrap();
        let side = |mesh: &Mesh, right: bool| -> Vec<Vec3> {
            let far = mesh.positions.iter().filter(|p| (p.x > 0.3) == right && p.x.abs() > 0.3);
            far.copied().collect()
        };
        assert_eq!(side(&after, true), side(&before, true));
        assert_ne!(side(&after, false), side(&before, false));
    }
}

on_each_device! {
    /// Both forms agree with confidences that differ from pixel to pixel, and are more than 1 here and there.
    async fn both_forms_agree_on_confidence(device: Device) {
        let confidence: Vec<f32> = (0..PIXELS).map(|p| (p * 7919 % 97) as f32 / 80.0).collect();
        let fused = |plain: bool, device: Device| {
            let mut volume = config().init(&device).unwrap();
            if plain {
                volume.use_plain_form();
            }
            for wall_m in [1.7, 1.72, 1.69] {
                fuse_one(&mut volume, wall_m, Some(&confidence));
            }
            volume
        };
        let reference = fused(true, Device::flex()).mesh().await.unwrap();
        for plain in [false, true] {
            assert_same(&reference, &fused(plain, device.clone()).mesh().await.unwrap());
        }
    }
}

on_each_device! {
    async fn confidence_of_another_size_is_an_error(device: Device) {
        let mut volume = config().init(&device).unwrap();
        let pose = poses()[0];
        let (depth_m, _) = look(&pose, 2.0);
        let view = DepthView {
            depth_m: &depth_m,
            depth_camera: CAMERA,
            confidence: Some(&[1.0; 3]),
            color: None,
            world_from_camera: pose,
        };
        let error = volume.integrate(&view).unwrap_err().to_string();
        assert!(error.contains("confidence image of 19200 values") && error.contains("found 3"), "{error}");
        assert_eq!(volume.brick_count(), 0);
    }
}
