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
