//! Stereo's depth beside the samples.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use glam::{IVec3, Vec3};
use net::guide::guide_at;
use net::sample::Sample;
use train::data::guide::StereoMaps;
use train::data::{Augment, SampleOptions, Sampler};

fn options(augment: Augment) -> SampleOptions {
    SampleOptions {
        guide: true,
        augment,
        ..common::plain(3)
    }
}

fn turned(mirror: bool) -> Augment {
    Augment {
        mirror,
        thin_guide: false,
        ..Augment::default()
    }
}

/// The guide's signed distance against the truth's, where both are near a surface: mean difference and count.
fn off(sample: &Sample) -> (f64, usize) {
    let [nx, ny, nz] = sample.truth.size[2];
    let sites: Vec<IVec3> = (0..nx * ny * nz)
        .map(|i| {
            [i % nx, i / nx % ny, i / (nx * ny)]
                .map(|n| n as i32)
                .into()
        })
        .collect();
    let says = guide_at(&sites, 0.04, Vec3::ZERO, &sample.guide);
    let near = says
        .iter()
        .zip(&sample.truth.tsdf)
        .filter(|(said, truth)| said.weight > 0.5 && truth.abs() < 0.9);
    let differences: Vec<f64> = near
        .map(|(said, truth)| f64::from((said.distance - truth).abs()))
        .collect();
    let count = differences.len();
    (differences.iter().sum::<f64>() / count.max(1) as f64, count)
}

#[test]
fn the_guide_lies_where_the_truth_does_however_the_crop_is_turned() {
    let set = common::rooms(1, 24, 160, 120);
    let mut sampler = Sampler::new(set, options(turned(true)));
    let samples: Vec<Sample> = (0..6)
        .map(|number| sampler.sample(number).unwrap())
        .collect();
    let (mut sum, mut all) = (0.0, 0);
    for sample in &samples {
        let (mean, count) = off(sample);
        println!(
            "{} maps, {count} points, off by {mean:.3}",
            sample.guide.len()
        );
        sum += mean * count as f64;
        all += count;
    }
    assert!(all > 10_000, "{all} points");
    // In truncation distances of 12 cm.
    assert!(sum / (all as f64) < 0.35, "{}", sum / all as f64);
}

#[test]
fn a_thinned_guide_is_a_part_of_the_whole_one() {
    let set = common::rooms(1, 24, 80, 60);
    let still = |thin_guide| Augment {
        thin_guide,
        ..common::plain(3).augment
    };
    let mut whole = Sampler::new(set.clone(), options(still(false)));
    let mut thin = Sampler::new(set, options(still(true)));
    let mut fewer = 0;
    for number in 0..8 {
        let (whole, thin) = (whole.sample(number).unwrap(), thin.sample(number).unwrap());
        assert_eq!(whole.images, thin.images);
        let known = |map: &Vec<f32>| whole.guide.iter().any(|other| other.depth_m == *map);
        assert!(thin.guide.iter().all(|map| known(&map.depth_m)));
        fewer += usize::from(thin.guide.len() < whole.guide.len());
    }
    assert!(fewer >= 6, "{fewer} of 8");
}

#[test]
fn kept_depth_is_read_again_and_damaged_depth_is_not() {
    let scan = common::rooms(1, 12, 80, 60).open(0).unwrap();
    let keyframes: Vec<usize> = (0..12).collect();
    let maps = StereoMaps::make(&scan, &keyframes).unwrap();
    assert!(maps.len() > 6, "{} maps", maps.len());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("deep/room.stereo");
    maps.write(&file).unwrap();
    assert_eq!(StereoMaps::read(&file).as_ref(), Some(&maps));
    let bytes = std::fs::read(&file).unwrap();
    for broken in [&bytes[..bytes.len() - 1], &bytes[1..], &bytes[..20], &[]] {
        std::fs::write(&file, broken).unwrap();
        assert_eq!(StereoMaps::read(&file), None);
    }
}

#[test]
fn a_camera_that_only_turns_has_no_guide() {
    let scan = common::rooms(1, 12, 80, 60).open(0).unwrap();
    assert!(StereoMaps::make(&scan, &[3]).unwrap().is_empty());
}
