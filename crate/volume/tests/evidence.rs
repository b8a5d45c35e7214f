//! What a surface rests on: every place knows how many frames measured it, and how sure they were, on every device.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use glam::{Affine3A, IVec3, Quat, Vec3};
use mesh::camera::Pinhole;
use mesh::soup::{VERTEX_FLOATS, decode};
use volume::{DepthView, Evidence, Point, Volume, VolumeConfig};

const CAMERA: Pinhole = Pinhole {
    width: 160,
    height: 120,
    fx: 140.0,
    fy: 140.0,
    cx: 79.5,
    cy: 59.5,
};
const WALL_M: f32 = 2.31;

/// Three cameras beside each other before a wall, so many times: each sees 1.3 m of it to both sides.
fn see(volume: &mut Volume, confidence: Option<[f32; 3]>, times: usize) {
    let upright = Quat::from_mat3(&glam::Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y));
    let depth_m = vec![WALL_M; 160 * 120];
    for _ in 0..times {
        for (camera, x) in [-1.0, 0.0, 1.0].into_iter().enumerate() {
            let sure = confidence.map(|values| vec![values[camera]; depth_m.len()]);
            let view = DepthView {
                depth_m: &depth_m,
                depth_camera: CAMERA,
                confidence: sure.as_deref(),
                color: None,
                world_from_camera: Affine3A::from_rotation_translation(upright, Vec3::X * x),
            };
            volume.integrate(&view).unwrap();
        }
    }
}

/// Every vertex and its evidence.
async fn vertices(volume: &mut Volume) -> Vec<(Vec3, Evidence)> {
    let bricks = volume.take_changed(usize::MAX, Vec3::ZERO);
    let soup = volume.extract(&bricks).await.unwrap().vertices;
    let soup = soup.into_data_async().await.unwrap();
    let (vertices, _) = soup.as_slice::<f32>().unwrap().as_chunks::<VERTEX_FLOATS>();
    vertices
        .iter()
        .map(|vertex| (decode(vertex).0, Evidence::of(vertex)))
        .collect()
}

/// Which cameras see a place, unless it is at the border of what one sees.
fn seen_by(place: Vec3) -> Option<Vec<usize>> {
    let reach = WALL_M * 80.0 / 140.0;
    let away = [-1.0, 0.0, 1.0].map(|x| (place.x - x).abs() - reach);
    let border = away.iter().any(|away| away.abs() < 0.1);
    (!border).then(|| (0..3).filter(|&camera| away[camera] < 0.0).collect())
}

on_each_device! {
    /// A wall that three cameras see says three, elsewhere two and one.
    async fn a_wall_says_how_many_frames_saw_it(device: Device) {
        let mut volume = VolumeConfig::new(0.04).init(&device).unwrap();
        see(&mut volume, None, 1);
        let mut found = [0; 4];
        for (place, evidence) in vertices(&mut volume).await {
            let Some(cameras) = seen_by(place) else { continue };
            assert_eq!(evidence.views(), cameras.len(), "at {place}");
            assert_eq!(evidence.confidence(), None, "a sensor's depth has none");
            found[cameras.len()] += 1;
        }
        println!("vertices by number of frames: {found:?}");
        assert!(found[1..].iter().all(|&count| count > 500), "{found:?}");
    }
}

on_each_device! {
    /// Confidence is the mean over the frames that measured the place.
    async fn a_wall_says_how_sure_its_frames_were(device: Device) {
        let mut volume = VolumeConfig::new(0.04).init(&device).unwrap();
        let sure = [0.25, 0.5, 1.0];
        see(&mut volume, Some(sure), 2);
        let mut checked = 0;
        for (place, evidence) in vertices(&mut volume).await {
            let Some(cameras) = seen_by(place) else { continue };
            let mean = cameras.iter().map(|&camera| sure[camera]).sum::<f32>() / cameras.len() as f32;
            let found = evidence.confidence().unwrap();
            assert!((found - mean).abs() < 0.011, "{found} for {mean} at {place}");
            assert_eq!(evidence.views(), 2 * cameras.len());
            checked += 1;
        }
        assert!(checked > 1500, "{checked}");
    }
}

on_each_device! {
    /// Long scans count to the end of the scale and stay there, and their confidence with them.
    async fn many_frames_count_as_many(device: Device) {
        let mut volume = VolumeConfig::new(0.08).init(&device).unwrap();
        see(&mut volume, Some([0.5; 3]), 140);
        for (place, evidence) in vertices(&mut volume).await {
            assert_eq!(evidence.views(), usize::from(Evidence::MOST_VIEWS), "at {place}");
            let found = evidence.confidence().unwrap();
            assert!((found - 0.5).abs() < 0.011, "{found} at {place}");
        }
    }
}

on_each_device! {
    /// Points known one by one bring their own, and it comes out as it went in.
    async fn points_keep_what_they_rest_on(device: Device) {
        let cases = [Evidence::new(1, None), Evidence::new(20, Some(0.0)), Evidence::new(63, Some(1.0)), Evidence::default()];
        for evidence in cases {
            let mut volume = VolumeConfig::uniform(0.04).init(&device).unwrap();
            let all = (0..512).map(|i| IVec3::new(i % 8, i / 8 % 8, i / 64));
            let points: Vec<Point> = all
                .map(|place| Point {
                    place,
                    distance: (place.z as f32 - 3.5) / 3.0,
                    color: None,
                    evidence,
                })
                .collect();
            volume.set_points(&points).unwrap();
            let found = vertices(&mut volume).await;
            assert_eq!(found.len(), 7 * 7 * 6);
            assert!(found.iter().all(|(_, found)| *found == evidence), "{evidence:?}: {:?}", found[0]);
        }
    }
}
