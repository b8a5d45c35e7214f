//! Points known one by one, as a network gives them, make the same volume as a field known everywhere.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use burn::tensor::Device;
use glam::{IVec3, Vec3};
use mesh::Mesh;
use volume::{Evidence, Point, Volume, VolumeConfig, VolumeError};

const RADIUS_M: f32 = 0.5;

/// A ball, a third of it unknown and without colour where `y` is negative.
fn ball(point: Vec3) -> Option<(f32, [u8; 3])> {
    let distance_m = point.length() - RADIUS_M;
    (distance_m.abs() < 0.2 && point.z > -0.2).then_some((distance_m, [200, 100, 50]))
}

fn points(config: &VolumeConfig) -> Vec<Point> {
    let all = (0..48 * 48 * 48).map(|i| IVec3::new(i % 48, i / 48 % 48, i / 48 / 48) - 24);
    let known = all.filter_map(|place| {
        let at = place.as_vec3() * config.voxel_size_m;
        let (distance_m, color) = ball(at)?;
        Some(Point {
            place,
            distance: distance_m / config.truncation_m,
            color: (at.y >= 0.0).then_some(color),
            evidence: if at.x < 0.0 {
                Evidence::new(3, Some(0.25))
            } else {
                Evidence::new(20, None)
            },
        })
    });
    known.collect()
}

fn mesh(volume: &Volume) -> Mesh {
    pollster::block_on(volume.mesh()).unwrap()
}

#[test]
fn they_give_the_surface_of_the_whole_field() {
    let device = Device::flex();
    let config = VolumeConfig::uniform(0.04);
    let mut by_points = config.init(&device).unwrap();
    let mut points = points(&config);
    by_points.set_points(&points).unwrap();
    let mut filled = config.init(&device).unwrap();
    let bricks: Vec<IVec3> = (0..216)
        .map(|i| IVec3::new(i % 6, i / 6 % 6, i / 36) - 3)
        .collect();
    filled.fill(&bricks, ball).unwrap();
    let (found, expected) = (mesh(&by_points), mesh(&filled));
    assert!(expected.triangles.len() > 2_000);
    assert_eq!(found.triangles, expected.triangles);
    assert_eq!(found.positions, expected.positions);
    // Nothing below the cut: its cells have an unknown corner.
    assert!(found.positions.iter().all(|p| p.z > -0.2));
    let colored = |mesh: &Mesh, at: usize| mesh.colors[at] == [200, 100, 50];
    for (at, position) in found.positions.iter().enumerate() {
        if position.y.abs() > 0.04 {
            assert_eq!(colored(&found, at), position.y > 0.0, "{position}");
        }
    }
    assert!(by_points.changed_count() > 0);

    // Said again with colours everywhere, they replace what was there.
    for point in &mut points {
        point.color = Some([200, 100, 50]);
    }
    by_points.set_points(&points).unwrap();
    let again = mesh(&by_points);
    assert_eq!(again.positions, expected.positions);
    assert_eq!(again.colors, expected.colors);
}

#[test]
fn too_many_change_nothing() {
    let config = VolumeConfig {
        binding_bytes: 8 * 512 * 16,
        ..VolumeConfig::uniform(0.04)
    };
    let mut volume = config.init(&Device::flex()).unwrap();
    let error = volume.set_points(&points(&config)).err();
    assert!(matches!(error, Some(VolumeError::TooManyBricks { .. })));
    assert_eq!(volume.brick_count(), 0);
    assert!(mesh(&volume).triangles.is_empty());
}
