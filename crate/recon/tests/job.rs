//! The job from end to end on the sample room: the plan keeps its word, the run survives broken frames and can be stopped.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{Recorder, SEED, files, open, sample};
use glam::Vec3;
use mesh::Mesh;
use recon::{DepthSource, Limits, Options, Stage};
use scan::Scan;
use synth::Room;

fn run(scan: &Scan, options: Options, sink: &mut Recorder) -> recon::Outcome {
    let plan = recon::plan(scan, &Limits::default(), options).unwrap();
    pollster::block_on(recon::run(scan, &plan, &Device::flex(), sink)).unwrap()
}

fn mesh_in_scan_world(scan: &Scan, outcome: &recon::Outcome) -> Mesh {
    let mut mesh = pollster::block_on(outcome.volume.mesh()).unwrap();
    mesh.transform(&scan.scan_from_canonical());
    mesh
}

#[test]
fn the_sample_room_comes_out_where_it_stands() {
    let source = sample();
    let room = Room::new(SEED);
    let (turn, shift) = source.world_from_room();
    let scan = open(source);
    let mut sink = Recorder::default();
    let outcome = run(&scan, Options::default(), &mut sink);
    let mesh = mesh_in_scan_world(&scan, &outcome);
    mesh.validate().unwrap();
    // In the world of the scan's own files, against the room's exact surface.
    let error_m = |p: &Vec3| room.distance(turn.transpose() * (*p - shift)).abs();
    let mut errors_m: Vec<f32> = mesh.positions.iter().map(error_m).collect();
    errors_m.sort_by(f32::total_cmp);
    let right = errors_m.partition_point(|&error_m| error_m < 0.05) as f32 / errors_m.len() as f32;
    let median_m = errors_m[errors_m.len() / 2];
    println!(
        "{right} within 5 cm, median {median_m} m, {} m2",
        mesh.area()
    );
    assert!(right > 0.97, "{right} of the vertices lie within 5 cm");
    assert!(median_m < 0.01, "median error {median_m} m");
    assert!(mesh.area() > 40.0, "{} m2 of surface", mesh.area());
    let colored = mesh
        .colors
        .iter()
        .filter(|&&[r, g, b]| r != g || g != b)
        .count();
    assert!(
        colored * 2 > mesh.colors.len(),
        "{colored} of {} vertices have a hue",
        mesh.colors.len()
    );
}

#[test]
fn progress_is_a_count_of_known_work_and_surfaces_come_early() {
    let scan = open(sample());
    let mut sink = Recorder {
        watching: true,
        ..Recorder::default()
    };
    let outcome = run(&scan, Options::default(), &mut sink);
    let keyframes = outcome.frames_fused;
    assert_eq!(sink.stages[0].0, Stage::WarmingUp);
    assert_eq!(sink.stages[1], (Stage::Fusing, keyframes));
    assert_eq!(sink.stages[2].0, Stage::Meshing);
    // One step of warming up, then one for each keyframe.
    let fusing: Vec<usize> = sink.progress[1..=keyframes].to_vec();
    assert_eq!(fusing, (1..=keyframes).collect::<Vec<_>>());
    assert!(
        sink.surfaces[0] > 500,
        "{} triangles after the first frame",
        sink.surfaces[0]
    );
    let whole = pollster::block_on(outcome.volume.mesh()).unwrap();
    assert!(sink.surfaces.iter().sum::<usize>() >= whole.triangles.len());
}

#[test]
fn a_stopped_run_keeps_what_it_has() {
    let scan = open(sample());
    let mut sink = Recorder {
        stop_after: Some(5),
        ..Recorder::default()
    };
    let outcome = run(&scan, Options::default(), &mut sink);
    assert!(outcome.stopped);
    assert_eq!(outcome.frames_fused, 5);
    assert!(
        pollster::block_on(outcome.volume.mesh())
            .unwrap()
            .triangles
            .len()
            > 500
    );
}

#[test]
fn broken_pictures_are_reported_and_the_rest_goes_on() {
    let scan = open(files(|path, mut bytes| {
        if path.contains("000005.depth") || path.contains("000009.color") {
            bytes.truncate(bytes.len() / 2);
        }
        Some(bytes)
    }));
    let mut sink = Recorder::default();
    let outcome = run(&scan, Options::default(), &mut sink);
    let plan = recon::plan(&scan, &Limits::default(), Options::default()).unwrap();
    // Without its depth a frame is lost, without its colour it is not.
    assert_eq!(outcome.frames_fused, plan.keyframes.len() - 1);
    let files: Vec<&str> = sink
        .findings
        .iter()
        .filter_map(|f| f.file.as_deref())
        .collect();
    assert!(
        files.iter().any(|file| file.contains("000005.depth")),
        "{files:?}"
    );
    assert!(
        files.iter().any(|file| file.contains("000009.color")),
        "{files:?}"
    );
    for finding in &sink.findings {
        assert!(
            !finding.expected.is_empty() && !finding.found.is_empty() && !finding.advice.is_empty()
        );
    }
}

#[test]
fn the_plan_keeps_its_word() {
    let scan = open(sample());
    let plan = recon::plan(&scan, &Limits::default(), Options::default()).unwrap();
    let outcome = run(&scan, Options::default(), &mut Recorder::default());
    let ratio = plan.bricks as f64 / outcome.volume.brick_count() as f64;
    assert!(
        (0.7..1.4).contains(&ratio),
        "{} bricks planned, {} used",
        plan.bricks,
        outcome.volume.brick_count()
    );
    assert!(outcome.volume.device_bytes() <= plan.device_bytes);
    let half = Options {
        every: 2,
        ..Options::default()
    };
    let fewer = recon::plan(&scan, &Limits::default(), half).unwrap();
    assert_eq!(fewer.keyframes.len(), plan.keyframes.len().div_ceil(2));
}

#[test]
fn what_does_not_fit_gets_larger_voxels_and_a_remark() {
    let scan = open(sample());
    let tight = Limits {
        binding_bytes: 4 << 20,
        ..Limits::default()
    };
    let options = Options {
        voxel_size_m: 0.02,
        ..Options::default()
    };
    let plan = recon::plan(&scan, &tight, options).unwrap();
    assert!(plan.options.voxel_size_m > 0.02);
    assert!(
        plan.remarks[0].contains("voxels of 2.0 cm would need"),
        "{}",
        plan.remarks[0]
    );
    let outcome = pollster::block_on(recon::run(
        &scan,
        &plan,
        &Device::flex(),
        &mut Recorder::default(),
    ));
    assert!(outcome.is_ok(), "the plan said that it fits");
}

#[test]
fn nonsense_and_scans_without_depth_are_refused_in_words() {
    let scan = open(sample());
    let plan = |options| {
        recon::plan(&scan, &Limits::default(), options)
            .unwrap_err()
            .to_string()
    };
    let text = plan(Options {
        voxel_size_m: f32::NAN,
        ..Options::default()
    });
    assert!(text.contains("between 0.004 and 1 m"), "{text}");
    assert!(
        plan(Options {
            every: 0,
            ..Options::default()
        })
        .contains("0th")
    );
    assert!(
        plan(Options {
            max_depth_m: -1.0,
            ..Options::default()
        })
        .contains("-1 m")
    );

    let color_only = open(files(|path, bytes| {
        (!path.contains("depth")).then_some(bytes)
    }));
    let sensor = Options {
        depth: Some(DepthSource::Sensor),
        ..Options::default()
    };
    let error = recon::plan(&color_only, &Limits::default(), sensor)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("found none") && error.contains("RGB-D"),
        "{error}"
    );
}

#[test]
fn a_scan_of_broken_depth_says_so() {
    let scan = open(files(|path, mut bytes| {
        if path.contains("depth") {
            bytes.truncate(bytes.len() - 40);
        }
        Some(bytes)
    }));
    let plan = recon::plan(&scan, &Limits::default(), Options::default()).unwrap();
    let mut sink = Recorder::default();
    let result = pollster::block_on(recon::run(&scan, &plan, &Device::flex(), &mut sink));
    let error = result.err().unwrap().to_string();
    assert!(error.contains("found none that can be used"), "{error}");
    assert_eq!(sink.findings.len(), plan.keyframes.len());
}
