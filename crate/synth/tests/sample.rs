//! The sample is a scan like any other to those who read scans.

use std::rc::Rc;

use glam::{DAffine3, DMat3, Vec3};
use scan::{Format, MemorySource, Severity, Source};
use synth::{Layout, SampleScan, depth};

fn sample() -> SampleScan {
    SampleScan::new(3, 12, 80, 60)
}

const LAYOUTS: [(Layout, Format); 3] = [
    (Layout::SevenScenes, Format::SevenScenes),
    (Layout::ScanNet, Format::ScanNet),
    (Layout::Tum, Format::TumRgbd),
];

#[test]
fn every_layout_opens_with_the_true_poses() {
    for (layout, format) in LAYOUTS {
        let truth = sample().with_layout(layout);
        let scan = scan::open(Rc::new(sample().with_layout(layout))).expect("a scan");
        assert_eq!(scan.format(), format);
        assert_eq!(scan.frames().len(), 12, "{layout:?}");
        let told = scan.findings();
        assert!(
            told.iter()
                .all(|finding| finding.severity == Severity::Info),
            "{layout:?}: {told:?}"
        );
        let (turn, shift) = truth.world_from_room();
        for (frame, view) in scan.frames().iter().zip(truth.views()) {
            let pose = scan.scan_from_canonical() * frame.pose;
            let expected = DAffine3 {
                matrix3: DMat3::from_cols_array(
                    &(turn * view.rotation).to_cols_array().map(f64::from),
                ),
                translation: (turn * view.position_m + shift).as_dvec3(),
            };
            assert!(
                pose.abs_diff_eq(expected, 1e-4),
                "{layout:?}, {}: {pose} for {expected}",
                frame.name
            );
            let (found, given) = (frame.depth_camera, view.camera);
            assert_eq!((found.width, found.height), (given.width, given.height));
            for (a, b) in [
                (found.fx, given.fx),
                (found.fy, given.fy),
                (found.cx, given.cx),
                (found.cy, given.cy),
            ] {
                assert!((a - b).abs() < 1e-4, "{layout:?}: {found:?} for {given:?}");
            }
        }
    }
}

#[test]
fn up_is_found_in_the_first_cameras_world() {
    let truth = SampleScan::first();
    let up = (truth.world_from_room().0 * Vec3::Z).as_dvec3();
    assert!(
        up.z < 0.5,
        "the world must not be upright already, or this proves nothing"
    );
    let scan = scan::open(Rc::new(truth)).expect("a scan");
    let off_deg = scan.gravity().up_in_scan.angle_between(up).to_degrees();
    assert!(off_deg < 0.5, "up is {off_deg} degrees off");
}

#[test]
fn the_first_sample_covers_most_of_the_room() {
    let sample = SampleScan::first();
    let depths: Vec<Vec<f32>> = sample
        .views()
        .iter()
        .map(|view| depth(sample.room(), view))
        .collect();
    // Of all surface that free space touches, so backs and undersides count as well: of 0.82 in reach of any eye.
    let surface = mesh::sample::surface(&sample.room().mesh(), 20_000, 1);
    let below = surface.iter().filter(|p| p.z < 2.2);
    let is_seen = |p: &&Vec3| {
        sample.views().iter().zip(&depths).any(|(view, depth_m)| {
            let local = view.rotation.transpose() * (**p - view.position_m);
            let Some(pixel) = view.camera.project(local.as_dvec3()) else {
                return false;
            };
            let (u, v) = (pixel.x.round(), pixel.y.round());
            let inside = u >= 0.0 && v >= 0.0 && u < 320.0 && v < 240.0;
            inside && (depth_m[v as usize * 320 + u as usize] - local.z).abs() < 0.03
        })
    };
    let seen = below.clone().filter(is_seen).count() as f64 / below.count() as f64;
    assert!(seen > 0.65, "{seen} of the surface is seen");
}

#[test]
fn pictures_are_what_the_camera_saw() {
    for (layout, unit_m) in [
        (Layout::SevenScenes, 1e-3),
        (Layout::ScanNet, 1e-3),
        (Layout::Tum, 2e-4),
    ] {
        let truth = sample();
        let scan =
            scan::open(Rc::new(sample().with_layout(layout).without_noise())).expect("a scan");
        let exact = depth(truth.room(), &truth.views()[5]);
        let read = scan
            .depth(5)
            .expect("depth")
            .expect("a depth picture")
            .depth_m;
        for (a, b) in read.iter().zip(&exact) {
            assert!((a - b).abs() < 0.51 * unit_m, "{layout:?}: {a} m for {b} m");
        }
        let drawn = synth::render(truth.room(), &truth.views()[5]);
        assert_eq!(
            scan.color(5).expect("colour").rgb,
            drawn.color.as_flattened()
        );
    }
}

#[test]
fn noise_grows_with_distance_and_has_no_bias() {
    let truth = SampleScan::new(3, 8, 160, 120);
    let scan = scan::open(Rc::new(SampleScan::new(3, 8, 160, 120))).expect("a scan");
    let mut errors = [Vec::new(), Vec::new()];
    for (i, view) in truth.views().iter().enumerate() {
        let read = scan
            .depth(i)
            .expect("depth")
            .expect("a depth picture")
            .depth_m;
        for (a, b) in read.iter().zip(depth(truth.room(), view)) {
            if !(1.5..=3.0).contains(&b) {
                errors[usize::from(b > 3.0)].push(a - b);
            }
        }
    }
    let [near, far] = errors.map(|e| {
        let mean = e.iter().sum::<f32>() / e.len() as f32;
        assert!(mean.abs() < 3e-4, "bias {mean} m");
        (e.iter().map(|v| v * v).sum::<f32>() / e.len() as f32).sqrt()
    });
    assert!(near > 5e-4 && near < 3e-3, "{near} m near");
    assert!(far > 6e-3 && far < 2e-2, "{far} m far");
}

#[test]
fn every_listed_file_can_be_read() {
    for (layout, _) in LAYOUTS {
        let scan = sample().with_layout(layout);
        for entry in scan.entries() {
            let bytes = scan.read(&entry.path).expect("a listed file");
            assert!(!bytes.is_empty(), "{}", entry.path);
        }
        assert!(scan.read("no-such-file").is_err());
    }
}

#[test]
fn written_files_are_the_scan() {
    let files: Vec<(String, Vec<u8>)> = sample()
        .files()
        .map(|(path, bytes)| (path.to_owned(), bytes))
        .collect();
    assert_eq!(files.len(), 1 + 3 * 12);
    let scan = scan::open(Rc::new(MemorySource::new(files))).expect("a scan");
    assert_eq!(scan.frames().len(), 12);
}
