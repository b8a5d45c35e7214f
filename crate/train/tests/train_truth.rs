//! The dense truth against a plain loop, and against the rooms' own distance.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use glam::{DVec3, Vec3};
use std::rc::Rc;
use train::data::ScanSet;
use train::data::volume::{SATURATED, TruthVolume, VOXEL_M};

fn volume_of(seed: u64, frames: usize) -> (std::sync::Arc<TruthVolume>, scan::Scan) {
    let set = common::rooms(seed + 1, frames, 160, 120);
    let scan = set.open(seed as usize).unwrap();
    (set.truth(seed as usize, &scan).unwrap(), scan)
}

/// Method 1.8, one point after another in double precision.
fn plain_value(scan: &scan::Scan, depths: &[Vec<f32>], point: DVec3) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (frame, depth) in scan.frames().iter().zip(depths) {
        let local = frame.pose.inverse().transform_point3(point);
        let Some(pixel) = frame.depth_camera.project(local) else {
            continue;
        };
        let (u, v) = (pixel.x.round(), pixel.y.round());
        let (width, height) = (frame.depth_camera.width, frame.depth_camera.height);
        if u < 0.0 || v < 0.0 || u >= f64::from(width) || v >= f64::from(height) {
            continue;
        }
        let measured = f64::from(depth[u as usize + width as usize * v as usize]);
        let distance = (measured - local.z) / 0.12;
        if measured > 0.0 && measured <= f64::from(common::MAX_DEPTH_M) && distance >= -1.0 {
            sum += distance.min(1.0);
            count += 1.0;
        }
    }
    if count == 0.0 { -1.0 } else { sum / count }
}

#[test]
fn the_field_is_that_of_a_plain_loop() {
    let (volume, scan) = volume_of(1, 8);
    let depths: Vec<Vec<f32>> = (0..scan.frames().len())
        .map(|i| scan.depth(i).unwrap().unwrap().depth_m)
        .collect();
    let [nx, ny, _] = volume.size;
    let mut compared = 0;
    let mut off = Vec::new();
    for (i, &stored) in volume.values.iter().enumerate().step_by(37) {
        let site = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f32);
        let point = volume.origin_m() + Vec3::from_array(site) * VOXEL_M;
        let expected = plain_value(&scan, &depths, point.as_dvec3());
        let found = f64::from(stored) / f64::from(SATURATED);
        compared += 1;
        if (found - expected).abs() > 0.006 {
            off.push((point, found, expected));
        }
    }
    assert!(compared > 20_000, "{compared}");
    // A point that falls between two pixels may take the other one in single precision.
    let few = off.len() < compared / 2000;
    assert!(
        few,
        "{} of {compared}, such as {:?}",
        off.len(),
        off.first()
    );
    assert!(volume.near > 20_000, "{}", volume.near);
}

#[test]
fn the_field_is_the_rooms_distance() {
    let (volume, _) = volume_of(2, 40);
    let sample = common::room(2, 40, 160, 120);
    let (turn, shift) = sample.world_from_room();
    let [nx, ny, _] = volume.size;
    let mut surface: Vec<f32> = Vec::new();
    let (mut free, mut free_but_solid) = (0, 0);
    for (i, &stored) in volume.values.iter().enumerate() {
        let site = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f32);
        let point = volume.origin_m() + Vec3::from_array(site) * VOXEL_M;
        let distance_m = sample.room().distance(turn.transpose() * (point - shift));
        match stored {
            SATURATED => {
                free += 1;
                free_but_solid += usize::from(distance_m < -0.01);
            }
            // Within a tenth of the truncation distance of the surface as the views see it.
            -12..=12 => surface.push(distance_m.abs()),
            _ => {}
        }
    }
    assert!(
        free > 100_000 && surface.len() > 3000,
        "{free}, {}",
        surface.len()
    );
    assert!(free_but_solid * 1000 < free, "{free_but_solid} of {free}");
    surface.sort_by(f32::total_cmp);
    let at = |share: f32| surface[(share * surface.len() as f32) as usize];
    // A tenth of 12 cm along the ray, less across the surface; the tail is at the rims of things.
    assert!(at(0.5) < 0.01, "median {}", at(0.5));
    assert!(at(0.9) < 0.04, "nine tenths within {}", at(0.9));
}

#[test]
fn a_kept_truth_is_read_again_and_a_damaged_one_is_not() {
    let (volume, _) = volume_of(0, 6);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("deep/room.tsdf");
    volume.write(&file).unwrap();
    assert_eq!(TruthVolume::read(&file).as_ref(), Some(volume.as_ref()));
    let bytes = std::fs::read(&file).unwrap();
    for broken in [&bytes[..bytes.len() - 1], &bytes[1..], &bytes[..20], &[]] {
        std::fs::write(&file, broken).unwrap();
        assert_eq!(TruthVolume::read(&file), None);
    }
}

#[test]
fn a_scan_without_depth_says_so() {
    let files = common::room(0, 6, 64, 48);
    let color_only: Vec<(String, Vec<u8>)> = files
        .files()
        .filter(|(path, _)| !path.contains("depth/"))
        .map(|(path, bytes)| (path.to_owned(), bytes))
        .collect();
    let open = move |_: usize| {
        let source = scan::MemorySource::new(color_only.clone());
        Ok(scan::open(Rc::new(source)).unwrap())
    };
    let made = ScanSet::new(&["attic".to_owned()], std::sync::Arc::new(open), 4, 3.0);
    let said = made.err().unwrap().to_string();
    assert!(
        said.starts_with("attic: expected depth images") && said.contains("leave it out"),
        "{said}"
    );
}

#[test]
fn scans_in_a_folder_are_found_and_their_truth_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    for seed in [3, 1] {
        for (path, bytes) in common::room(seed, 6, 64, 48).files() {
            let file = folder.path().join(format!("rooms/room-{seed}")).join(path);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, bytes).unwrap();
        }
    }
    let cache = folder.path().join("cache");
    let paths = [folder.path().join("rooms/*")];
    let set = || ScanSet::from_paths(&paths, 6, 8.0, Some(cache.clone())).unwrap();
    let first = set();
    let names: Vec<&str> = first
        .entries
        .iter()
        .map(|entry| entry.name.as_str())
        .collect();
    assert!(names[0].ends_with("room-1") && names[1].ends_with("room-3") && names.len() == 2);
    let truth = first.truth(1, &first.open(1).unwrap()).unwrap();
    let kept: Vec<_> = std::fs::read_dir(&cache).unwrap().collect();
    assert_eq!(kept.len(), 1);
    // Another run takes what is kept: even a truth that was made to differ.
    let file = kept[0].as_ref().unwrap().path();
    let mut other = truth.as_ref().clone();
    other.values[0] = 5;
    other.near += 1;
    other.write(&file).unwrap();
    let second = set();
    assert_eq!(*second.truth(1, &second.open(1).unwrap()).unwrap(), other);
    // Scans with fewer frames than asked are told by name.
    let said = ScanSet::from_paths(&paths, 7, 8.0, None)
        .err()
        .unwrap()
        .to_string();
    assert!(
        said.contains("room-1: expected at least 7 frames") && said.contains("found 6"),
        "{said}"
    );
}
