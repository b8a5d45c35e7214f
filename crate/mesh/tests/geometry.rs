//! The mesh as such, points drawn on it, and nearest points.

use glam::{DAffine3, DVec3, Vec3};
use mesh::nearest::PointIndex;
use mesh::sample::{self, Uniform};
use mesh::{Bounds, Mesh, MeshError};

/// Two triangles in the plane z = 0 facing up; areas 0.5 and 1.5 square metres.
fn two_triangles() -> Mesh {
    Mesh {
        positions: vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::Y,
            Vec3::new(4.0, 0.0, 0.0),
            Vec3::new(1.0, 1.0, 0.0),
        ],
        normals: vec![Vec3::Z; 5],
        triangles: vec![[0, 1, 2], [1, 3, 4]],
        ..Mesh::default()
    }
}

fn facing(mesh: &Mesh, triangle: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(mesh.triangles[triangle]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn area_and_bounds() {
    let mesh = two_triangles();
    assert!((mesh.area() - 2.0).abs() < 1e-12);
    let bounds = mesh.bounds().unwrap();
    assert_eq!(
        (bounds.min, bounds.max),
        (Vec3::ZERO, Vec3::new(4.0, 1.0, 0.0))
    );
    assert_eq!(
        (bounds.size(), bounds.center()),
        (Vec3::new(4.0, 1.0, 0.0), Vec3::new(2.0, 0.5, 0.0))
    );
    assert_eq!(Bounds::of(&[]), None);
}

#[test]
fn a_mirrored_mesh_still_has_its_outside_outside() {
    let stretch = DAffine3::from_scale(DVec3::new(2.0, 1.0, -1.0));
    let turn = DAffine3::from_rotation_x(0.5);
    for by in [turn, stretch, turn * stretch] {
        let mut mesh = two_triangles();
        mesh.transform(&by);
        for triangle in 0..2 {
            let normal = mesh.normals[mesh.triangles[triangle][0] as usize];
            assert!(normal.distance(facing(&mesh, triangle)) < 1e-6, "{normal}");
        }
    }
    let mut mesh = two_triangles();
    mesh.transform(&DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(mesh.positions[1], Vec3::new(2.0, 2.0, 3.0));
}

#[test]
fn a_slanted_normal_stays_upright_on_its_surface_when_stretched() {
    // The plane x + z = 0, stretched to x / 3 + z = 0.
    let mut mesh = Mesh {
        positions: vec![Vec3::ZERO],
        normals: vec![Vec3::new(1.0, 0.0, 1.0).normalize()],
        ..Mesh::default()
    };
    mesh.transform(&DAffine3::from_scale(DVec3::new(3.0, 1.0, 1.0)));
    let expected = Vec3::new(1.0, 0.0, 3.0).normalize();
    assert!(mesh.normals[0].distance(expected) < 1e-6);
}

#[test]
fn faults_are_named() {
    assert_eq!(two_triangles().validate(), Ok(()));
    let mut mesh = two_triangles();
    mesh.triangles[1][2] = 5;
    assert_eq!(
        mesh.validate(),
        Err(MeshError::IndexRange {
            triangle: 1,
            vertices: 5,
            found: 5
        })
    );
    let mut mesh = two_triangles();
    mesh.colors = vec![[0; 3]; 4];
    let text = mesh.validate().unwrap_err().to_string();
    assert_eq!(
        text,
        "mesh: expected no colours or one for each of 5 vertices, found 4"
    );
    let mut mesh = two_triangles();
    mesh.positions[3].y = f32::NAN;
    let text = mesh.validate().unwrap_err().to_string();
    assert_eq!(
        text,
        "mesh: vertex 3: expected a finite position, found [4, NaN, 0]"
    );
}

#[test]
fn points_spread_by_area_and_evenly_within_a_triangle() {
    let mesh = two_triangles();
    let points = sample::surface(&mesh, 40_000, 1);
    assert_eq!(points.len(), 40_000);
    assert!(points.iter().all(|p| p.z == 0.0 && p.y >= 0.0));
    let (small, large): (Vec<Vec3>, Vec<Vec3>) = points.iter().partition(|p| p.x + p.y <= 1.0);
    // 0.25 +- 4 standard deviations.
    assert!(
        (small.len() as f64 / 40_000.0 - 0.25).abs() < 0.009,
        "{}",
        small.len()
    );
    let mean: Vec3 = large.iter().sum::<Vec3>() / large.len() as f32;
    let centroid = Vec3::new(2.0, 1.0 / 3.0, 0.0);
    assert!(mean.distance(centroid) < 0.02, "{mean}");
}

#[test]
fn a_seed_fixes_the_points_and_another_changes_them() {
    let mesh = two_triangles();
    assert_eq!(
        sample::surface(&mesh, 100, 5),
        sample::surface(&mesh, 100, 5)
    );
    assert_ne!(
        sample::surface(&mesh, 100, 5),
        sample::surface(&mesh, 100, 6)
    );
    assert!(sample::surface(&Mesh::default(), 100, 5).is_empty());
}

#[test]
fn nearest_distances_are_those_of_trying_all() {
    let mut uniform = Uniform::new(11);
    let mut anywhere =
        |scale: f64| Vec3::from_array([(); 3].map(|()| ((uniform.next() - 0.5) * scale) as f32));
    // Sheets, clusters, repetitions and lone points, as scans have them.
    let mut points: Vec<Vec3> = (0..700)
        .map(|_| anywhere(4.0) * Vec3::new(1.0, 1.0, 0.0))
        .collect();
    points.extend((0..300).map(|_| Vec3::splat(3.0) + anywhere(0.01)));
    points.extend([Vec3::ONE; 50]);
    points.push(Vec3::new(-80.0, 0.0, 5.0));
    let queries: Vec<Vec3> = (0..3000)
        .map(|i| anywhere(if i % 10 == 0 { 200.0 } else { 8.0 }))
        .collect();

    for count in [1, 2, 12, 13, 25, 700, points.len()] {
        let index = PointIndex::new(&points[..count]);
        for (query, found) in queries.iter().zip(index.distances(&queries)) {
            let distances = points[..count].iter().map(|point| point.distance(*query));
            let expected = distances.fold(f32::INFINITY, f32::min);
            assert!(
                (found - expected).abs() <= 1e-6 * expected,
                "{count} points, {query}: {found} {expected}"
            );
            assert_eq!(found, index.distance(*query));
        }
    }
    assert_eq!(PointIndex::new(&[]).distance(Vec3::ZERO), f32::INFINITY);
}
