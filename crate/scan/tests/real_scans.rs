//! The two real scans, read in place: they open clean, and their floors lie flat at the bottom.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::rc::Rc;

use glam::{DVec2, DVec3};
use scan::doctor::{self, Look};
use scan::{FolderSource, Format, Scan};

fn shared(name: &str) -> Option<Scan> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/scans")
        .join(name)
        .join("scan");
    if !folder.is_dir() {
        println!("skipped: ../shared/scans/{name}/scan is absent");
        return None;
    }
    let source = FolderSource::open(&folder).unwrap();
    Some(scan::open(Rc::new(source)).unwrap())
}

/// Heights of all depth pixels, every fourth each way, in the canonical world, ascending.
fn heights(scan: &Scan) -> Vec<f64> {
    let mut heights = Vec::new();
    for (index, frame) in scan.frames().iter().enumerate() {
        let depth = scan.depth(index).unwrap().unwrap();
        for v in (0..depth.height).step_by(4) {
            for u in (0..depth.width).step_by(4) {
                let depth_m = f64::from(depth.depth_m[(v * depth.width + u) as usize]);
                if depth_m > 0.0 {
                    let pixel = DVec2::new(u.into(), v.into());
                    let point = frame.depth_camera.unproject(pixel, depth_m);
                    heights.push(frame.pose.transform_point3(point).z);
                }
            }
        }
    }
    heights.sort_by(f64::total_cmp);
    heights
}

/// The floor is the fullest 4 cm of height, hardly anything lies below it, and the cameras are above it.
fn assert_floor_is_flat_at_the_bottom(scan: &Scan, least_share: f64) {
    let heights = heights(scan);
    let below =
        |z: f64| heights.partition_point(|height| *height < z) as f64 / heights.len() as f64;
    let share = |z: f64| below(z + 0.04) - below(z);
    let lowest = heights[heights.len() / 1000];
    let floor = (0..100)
        .map(|step| lowest - 0.1 + 0.01 * f64::from(step))
        .max_by(|a, b| share(*a).total_cmp(&share(*b)))
        .unwrap();
    println!(
        "floor {floor:.2} m: {:.3} of the points in 4 cm, {:.4} below",
        share(floor),
        below(floor - 0.03)
    );
    assert!(share(floor) > least_share, "{}", share(floor));
    assert!(below(floor - 0.03) < 0.01, "{}", below(floor - 0.03));
    assert!(
        scan.frames()
            .iter()
            .all(|frame| frame.pose.translation.z > floor + 0.2)
    );
}

/// `up` is the floor's normal in the ground truth mesh, by RANSAC and least squares: tests/data/floor_normal.py.
fn assert_up(scan: &Scan, up: [f64; 3]) {
    let error_deg = scan
        .gravity()
        .up_in_scan
        .angle_between(DVec3::from(up))
        .to_degrees();
    println!("up is {error_deg:.3} degrees from the ground truth's floor");
    assert!(error_deg < 0.5, "{error_deg}");
}

#[test]
fn hololens() {
    let Some(scan) = shared("hololens") else {
        return;
    };
    assert_eq!(scan.format(), Format::SevenScenes);
    assert_eq!(scan.frames().len(), 100);
    assert_eq!(scan.findings(), []);
    assert_up(&scan, [0.00129308, 0.99999833, 0.00128963]);
    assert_floor_is_flat_at_the_bottom(&scan, 0.2);

    let report = doctor::examine(&scan, Look::All);
    assert_eq!(report.findings, []);
    assert_eq!((report.keyframes, report.frames_examined), (100, 100));
    assert!(report.depth_agreement_share.unwrap() > 0.95);
    assert!((report.path_length_m - 13.56).abs() < 0.01);
    let color = scan.color(99).unwrap();
    assert_eq!((color.width, color.height), (540, 360));
}

#[test]
fn livingroom() {
    let Some(scan) = shared("livingroom") else {
        return;
    };
    assert_eq!(scan.frames().len(), 33);
    assert_eq!(scan.findings(), []);
    assert_up(&scan, [-0.00359081, -0.99950057, -0.03139605]);
    assert_floor_is_flat_at_the_bottom(&scan, 0.05);
    let report = doctor::examine(&scan, Look::Sample(10));
    assert!(report.depth_agreement_share.unwrap() > 0.95);

    assert_eq!(report.findings, []);
}
