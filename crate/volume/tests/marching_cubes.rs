//! Marching cubes: closed surfaces stay closed across bricks, and agree with scikit-image's.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use glam::{IVec3, Vec3};
use mesh::Mesh;
use serde::Deserialize;
use std::collections::{HashMap, HashSet};
use volume::{BRICK_EDGE, Brick, VolumeConfig};

/// All bricks of a box of lattice points, from -1 on.
fn bricks_over(size: IVec3) -> Vec<Brick> {
    let count = (size + 2) / BRICK_EDGE + 2;
    let cells = count.x * count.y * count.z;
    let at = |i: i32| IVec3::new(i % count.x, i / count.x % count.y, i / (count.x * count.y));
    (0..cells).map(|i| at(i) - 1).collect()
}

async fn surface(device: &Device, size: IVec3, distance: impl Fn(Vec3) -> Option<f32>) -> Mesh {
    // Voxels of 1 m: positions are lattice coordinates.
    let mut volume = VolumeConfig {
        truncation_m: 1e3,
        ..VolumeConfig::uniform(1.0)
    }
    .init(device)
    .unwrap();
    volume
        .fill(&bricks_over(size), |p| Some((distance(p)?, [10, 120, 250])))
        .unwrap();
    volume.mesh().await.unwrap()
}

/// Sides used in one direction only.
fn open_sides(mesh: &Mesh) -> usize {
    let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let count = sides.entry((from.min(to), from.max(to))).or_default();
            *count += if from < to { 1 } else { -1 };
        }
    }
    sides.values().filter(|&&count| count != 0).count()
}

fn enclosed_volume(mesh: &Mesh) -> f64 {
    let six: f64 = mesh
        .triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = mesh.corners(t).map(Vec3::as_dvec3);
            a.dot(b.cross(c))
        })
        .sum();
    six / 6.0
}

on_each_device! {
    /// A sphere over 3 x 3 x 3 bricks: closed, turned outwards, of the right size, with normals that point away from the centre.
    async fn sphere_is_closed_across_bricks(device: Device) {
        let centre = Vec3::splat(11.3);
        let mesh = surface(&device, IVec3::splat(24), |p| Some(p.distance(centre) - 9.0)).await;
        assert_eq!(open_sides(&mesh), 0);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 9f64.powi(3);
        let found = enclosed_volume(&mesh);
        assert!((found / exact - 1.0).abs() < 0.01, "volume {found}, expected {exact}");
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            let out = (*position - centre).normalize();
            assert!(out.dot(*normal) > 0.995, "normal {normal} at {position}");
            assert!((position.distance(centre) - 9.0).abs() < 0.05);
        }
        assert!(mesh.colors.iter().all(|&color| color == [10, 120, 250]));
    }
}

on_each_device! {
    /// Noise with many ambiguous faces, fenced in by free space: closed all the same.
    async fn rough_fields_are_closed(device: Device) {
        let noise = |p: Vec3| {
            let cell = p.as_ivec3();
            let mut h = (cell.x as u32).wrapping_mul(0x9E37_79B9)
                ^ (cell.y as u32).wrapping_mul(0x85EB_CA6B)
                ^ (cell.z as u32).wrapping_mul(0xC2B2_AE35);
            h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
            (h >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let size = 20;
        let fenced = |p: Vec3| {
            let inside = p.min_element() > 0.5 && p.max_element() < size as f32 - 0.5;
            Some(if inside { noise(p) } else { 0.5 })
        };
        let mesh = surface(&device, IVec3::splat(size), fenced).await;
        assert!(mesh.triangles.len() > 5_000, "{} triangles", mesh.triangles.len());
        assert_eq!(open_sides(&mesh), 0);
    }
}

/// What scikit-image's `marching_cubes(method="lorensen")` found, see `tests/reference/marching_cubes.py`.
#[derive(Deserialize)]
struct Golden {
    values_per_unit: f32,
    fields: Vec<GoldenField>,
}

#[derive(Deserialize)]
struct GoldenField {
    name: String,
    dims: [i32; 3],
    values: Vec<f32>,
    vertices: Vec<[f32; 3]>,
    area: f64,
    area_by_lewiner: f64,
    volume: Option<f64>,
    volume_by_lewiner: Option<f64>,
    euler: i64,
    open_edges: usize,
    ambiguous_faces: usize,
}

/// Vertices - edges + faces.
fn euler(mesh: &Mesh) -> i64 {
    let sides = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let edges: HashSet<(u32, u32)> = sides.map(|(a, b)| (a.min(b), a.max(b))).collect();
    mesh.positions.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64
}

on_each_device! {
    async fn agrees_with_scikit_image(device: Device) {
        let golden: Golden =
            serde_json::from_str(include_str!("../../../tests/golden/marching_cubes.json")).unwrap();
        for field in &golden.fields {
            let name = &field.name;
            let [nx, ny, nz] = field.dims;
            let mesh = surface(&device, field.dims.into(), |p| {
                let [x, y, z] = p.as_ivec3().to_array();
                let inside = x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz;
                let at = ((x * ny + y) * nz + z) as usize;
                inside.then(|| field.values[at] / golden.values_per_unit)
            })
            .await;

            // Every vertex of theirs is one of ours, and the other way round: as many, and each within 1e-4 of a voxel.
            assert_eq!(mesh.positions.len(), field.vertices.len(), "{name}: vertices");
            let worst = field.vertices.iter().map(|v| {
                let distances = mesh.positions.iter().map(|p| p.distance(Vec3::from(*v)));
                distances.fold(f32::INFINITY, f32::min)
            });
            let worst = worst.fold(0.0, f32::max);
            assert!(worst < 1e-4, "{name}: a vertex is off by {worst} voxels");

            // Polygons may be cut in other ways; scikit-image's two methods say how much that matters.
            let slack = (field.area - field.area_by_lewiner).abs() * 2.0 + field.area * 2e-3;
            assert!((mesh.area() - field.area).abs() < slack, "{name}: area {}, expected {}", mesh.area(), field.area);
            if let (Some(volume), Some(lewiner)) = (field.volume, field.volume_by_lewiner) {
                let slack = (volume - lewiner).abs() * 2.0 + volume.abs() * 1e-2;
                let found = enclosed_volume(&mesh);
                assert!((found - volume).abs() < slack, "{name}: volume {found}, expected {volume}");
            }
            if field.ambiguous_faces == 0 {
                assert_eq!(euler(&mesh), field.euler, "{name}: Euler characteristic");
                assert_eq!(open_sides(&mesh), field.open_edges, "{name}: open sides");
            }
        }
    }
}
