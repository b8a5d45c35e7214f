//! The job on a scan without depth, from end to end on the sample room: depth is made from colour, the surface comes
//! early and grows, broken pictures and full volumes do not end it.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{Recorder, SEED, color_alone, open, sample};
use glam::Vec3;
use recon::{
    DepthSource, Limits, Options, Outcome, RunError, Stage,
    evaluate::{compare_depth, mean_depth},
};
use scan::Scan;
use stereo::StereoConfig;
use synth::Room;

/// Small, so that a test takes seconds.
fn options() -> Options {
    let config = StereoConfig {
        size: (160, 120),
        planes: 64,
        sources: 8,
        ..StereoConfig::default()
    };
    Options {
        depth: Some(DepthSource::Stereo(config)),
        ..Options::default()
    }
}

fn run_with(
    scan: &Scan,
    options: Options,
    limits: Limits,
    sink: &mut Recorder,
) -> Result<Outcome, RunError> {
    let plan = recon::plan(scan, &limits, options).unwrap();
    pollster::block_on(recon::run(scan, &plan, &Device::flex(), sink))
}

fn run(scan: &Scan, sink: &mut Recorder) -> Outcome {
    run_with(scan, options(), Limits::default(), sink).unwrap()
}

fn triangles(outcome: &Outcome) -> usize {
    let mesh = pollster::block_on(outcome.volume.mesh()).unwrap();
    mesh.triangles.len()
}

#[test]
fn a_scan_without_depth_gets_stereo_by_itself() {
    let with = recon::plan(&open(sample()), &Limits::default(), Options::default()).unwrap();
    assert_eq!(with.depth, DepthSource::Sensor);
    let scan = open(color_alone(|_, bytes| bytes));
    let without = recon::plan(&scan, &Limits::default(), Options::default()).unwrap();
    let usual = StereoConfig::default();
    assert_eq!(without.depth, DepthSource::Stereo(usual));
    assert_eq!(without.keyframes, with.keyframes);
    // Two volumes of costs, a number for each pixel and plane.
    let costs = 2 * 320 * 240 * usual.planes * 4;
    assert!(without.device_bytes > costs);
    assert!(without.heap_bytes > without.keyframes.len() * 320 * 240 * 4);
}

#[test]
fn colour_alone_makes_the_room_where_it_stands() {
    let source = sample();
    let room = Room::new(SEED);
    let (turn, shift) = source.world_from_room();
    let scan = open(color_alone(|_, bytes| bytes));
    let mut sink = Recorder {
        watching: true,
        ..Recorder::default()
    };
    let outcome = run(&scan, &mut sink);
    let mut mesh = pollster::block_on(outcome.volume.mesh()).unwrap();
    mesh.transform(&scan.scan_from_canonical());
    mesh.validate().unwrap();
    let error_m = |p: &Vec3| room.distance(turn.transpose() * (*p - shift)).abs();
    let mut errors_m: Vec<f32> = mesh.positions.iter().map(error_m).collect();
    errors_m.sort_by(f32::total_cmp);
    let right = errors_m.partition_point(|&error_m| error_m < 0.05) as f32 / errors_m.len() as f32;
    let median_m = errors_m[errors_m.len() / 2];
    println!(
        "{right} within 5 cm, median {median_m} m, {} m2",
        mesh.area()
    );
    assert!(right > 0.6, "{right} of the vertices lie within 5 cm");
    assert!(median_m < 0.04, "median error {median_m} m");
    assert!(mesh.area() > 15.0, "{} m2 of surface", mesh.area());

    // The plan's guess is no less than what was needed, and not absurdly more.
    let plan = recon::plan(&scan, &Limits::default(), options()).unwrap();
    let ratio = plan.bricks as f64 / outcome.volume.brick_count() as f64;
    println!("{} bricks planned, {ratio} of the real ones", plan.bricks);
    assert!((1.0..6.0).contains(&ratio), "{ratio} of the bricks used");
    assert!(outcome.volume.device_bytes() <= plan.device_bytes);

    // Each stage in its turn, each keyframe counted once, the surface long before the last of them.
    assert_eq!(sink.stages[0].0, Stage::WarmingUp);
    assert_eq!(sink.stages[1], (Stage::Matching, plan.keyframes.len()));
    assert_eq!(sink.stages[2].0, Stage::Meshing);
    let matching = &sink.progress_of[&Stage::Matching];
    assert!(matching.is_sorted());
    assert_eq!(matching.last(), Some(&plan.keyframes.len()));
    assert!(
        matching.len() >= plan.keyframes.len(),
        "progress at every keyframe"
    );
    let (first, rest) = sink.surfaces.split_first().unwrap();
    assert!(*first > 100, "{first} triangles at first");
    assert!(!rest.is_empty());
    let at = sink.first_surface_at.unwrap();
    assert!(
        at * 3 <= plan.keyframes.len() * 2,
        "the first surface came after {at} of {} keyframes",
        plan.keyframes.len()
    );
    assert!(sink.surfaces.iter().sum::<usize>() >= mesh.triangles.len());
    assert!(sink.maps.len() >= outcome.frames_fused);
    assert!(outcome.frames_fused * 10 >= plan.keyframes.len() * 9);
}

#[test]
fn the_depth_of_a_keyframe_is_near_the_sensors_and_the_filter_makes_it_better() {
    let scan = open(sample());
    let mut sink = Recorder::default();
    run(&scan, &mut sink);
    let figures = |raw: bool| {
        let maps = sink.maps.iter().map(|map| {
            let depth_m = if raw { &map.raw_depth_m } else { &map.depth_m };
            let found = compare_depth(&scan, map.frame, &map.camera, depth_m);
            found.unwrap().expect("the sample has depth")
        });
        mean_depth(&maps.collect::<Vec<_>>()).unwrap()
    };
    let (raw, filtered) = (figures(true), figures(false));
    println!("raw {raw:?}\nfiltered {filtered:?}");
    assert_eq!(raw.maps, sink.maps.len());
    assert_eq!(raw.measured, filtered.measured);
    assert!(raw.coverage > 0.95 && filtered.coverage < raw.coverage);
    assert!(filtered.errors.abs_rel < raw.errors.abs_rel);
    assert!(filtered.errors.delta_1 > raw.errors.delta_1);
}

#[test]
fn a_stopped_run_keeps_what_it_has() {
    let scan = open(color_alone(|_, bytes| bytes));
    let mut whole = Recorder::default();
    let all = run(&scan, &mut whole).frames_fused;
    let mut sink = Recorder {
        stop_after: Some(whole.checkpoints * 3 / 4),
        ..Recorder::default()
    };
    let outcome = run(&scan, &mut sink);
    assert!(outcome.stopped);
    assert!(
        (1..all).contains(&outcome.frames_fused),
        "{} of {all} keyframes",
        outcome.frames_fused
    );
    assert!(triangles(&outcome) > 300);
    assert!(sink.findings.is_empty(), "{:?}", sink.findings);

    // Stopped before anything was there, it is stopped, not failed.
    let mut sink = Recorder {
        stop_after: Some(1),
        ..Recorder::default()
    };
    let outcome = run(&scan, &mut sink);
    assert!(outcome.stopped && outcome.frames_fused == 0);
}

#[test]
fn broken_pictures_are_reported_and_the_rest_goes_on() {
    let scan = open(color_alone(|path, mut bytes| {
        if path.contains("000009.color") || path.contains("000010.color") {
            bytes.truncate(bytes.len() / 2);
        }
        bytes
    }));
    let mut sink = Recorder::default();
    let outcome = run(&scan, &mut sink);
    let plan = recon::plan(&scan, &Limits::default(), options()).unwrap();
    assert!(outcome.frames_fused * 10 >= (plan.keyframes.len() - 2) * 9);
    assert!(triangles(&outcome) > 500);
    for file in ["000009.color", "000010.color"] {
        let about = |f: &&scan::Finding| f.file.as_deref().is_some_and(|path| path.contains(file));
        let said = sink.findings.iter().filter(about).count();
        assert_eq!(said, 1, "{file}: {:?}", sink.findings);
    }
    // Not told a second time as a keyframe without depth.
    let silent = sink.findings.iter().filter(|f| f.code == "stereo-no-depth");
    assert_eq!(silent.count(), 0, "{:?}", sink.findings);
    let matching = &sink.progress_of[&Stage::Matching];
    assert_eq!(matching.last(), Some(&plan.keyframes.len()));
}

#[test]
fn keyframes_without_depth_are_told_in_one_finding() {
    // The walk's second half looks at nothing: pictures of one grey.
    let source = sample();
    let grey = grey_like(&source);
    let scan = open(color_alone(|path, bytes| {
        let blank = (12..24).any(|n| path.contains(&format!("{n:06}.color")));
        if blank { grey.clone() } else { bytes }
    }));
    let mut sink = Recorder::default();
    let outcome = run(&scan, &mut sink);
    let plan = recon::plan(&scan, &Limits::default(), options()).unwrap();
    assert!(outcome.frames_fused > 0);
    let told: usize = sink.findings.iter().map(|f| f.frames_affected).sum();
    assert_eq!(
        told,
        plan.keyframes.len() - outcome.frames_fused,
        "{:?}",
        sink.findings
    );
    let finding = sink.findings.iter().find(|f| f.code == "stereo-no-depth");
    let finding = finding.expect("a finding about keyframes without depth");
    let text = finding.to_string();
    assert!(
        text.contains("frame-000") && text.contains("Walk sideways"),
        "{text}"
    );
}

/// A picture of the sample's size in one grey.
fn grey_like(source: &synth::SampleScan) -> Vec<u8> {
    let camera = source.views()[0].camera;
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, camera.width, camera.height);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    let pixels = vec![128; camera.width as usize * camera.height as usize];
    writer.write_image_data(&pixels).unwrap();
    writer.finish().unwrap();
    png
}

#[test]
fn a_full_volume_ends_fusing_and_loses_nothing() {
    let scan = open(color_alone(|_, bytes| bytes));
    let limits = Limits::default();
    let mut plan = recon::plan(&scan, &limits, options()).unwrap();
    // Room for some keyframes, not for all: as if the guess had been far too low.
    plan.volume.binding_bytes = 1000 * 512 * 4 * 4;
    let mut sink = Recorder {
        watching: true,
        ..Recorder::default()
    };
    let outcome = pollster::block_on(recon::run(&scan, &plan, &Device::flex(), &mut sink)).unwrap();
    assert!(!outcome.stopped);
    assert!((1..plan.keyframes.len()).contains(&outcome.frames_fused));
    assert!(triangles(&outcome) > 300);
    let full: Vec<_> = sink
        .findings
        .iter()
        .filter(|f| f.code == "volume-full")
        .collect();
    let [full] = full.as_slice() else {
        panic!("{:?}", sink.findings);
    };
    assert_eq!(
        full.frames_affected,
        plan.keyframes.len() - outcome.frames_fused
    );
    assert!(full.to_string().contains("larger voxels"), "{full}");
    assert_eq!(sink.stages.last().unwrap().0, Stage::Meshing);
}

#[test]
fn what_may_not_fit_gets_larger_voxels_and_a_remark() {
    let scan = open(color_alone(|_, bytes| bytes));
    let tight = Limits {
        binding_bytes: 8 << 20,
        ..Limits::default()
    };
    let plan = recon::plan(&scan, &tight, options()).unwrap();
    assert!(plan.options.voxel_size_m > 0.04);
    assert!(plan.remarks[0].contains("voxels of 4.0 cm would need"));
    let outcome = run_with(&scan, options(), tight, &mut Recorder::default());
    assert!(triangles(&outcome.unwrap()) > 300);
}

#[test]
fn views_are_spread_evenly_from_the_first_to_the_last() {
    let scan = open(color_alone(|_, bytes| bytes));
    let plan = |every, views| {
        let options = Options {
            every,
            views,
            ..options()
        };
        recon::plan(&scan, &Limits::default(), options)
            .unwrap()
            .keyframes
    };
    let all = plan(1, None);
    let five = plan(1, Some(5));
    assert_eq!(five.len(), 5);
    assert_eq!((five[0], five[4]), (all[0], all[all.len() - 1]));
    let at: Vec<usize> = five
        .iter()
        .map(|frame| all.iter().position(|f| f == frame).unwrap())
        .collect();
    for pair in at.windows(2) {
        let fair = (all.len() - 1) as f64 / 4.0;
        assert!(((pair[1] - pair[0]) as f64 - fair).abs() <= 1.0, "{at:?}");
    }
    assert_eq!(plan(1, Some(1000)), all);
    assert_eq!(plan(1, Some(all.len())), all);
    assert_eq!(plan(2, Some(3)).len(), 3);
}

#[test]
fn what_stereo_cannot_do_is_refused_in_words() {
    let scan = open(color_alone(|_, bytes| bytes));
    let refused = |options| {
        recon::plan(&scan, &Limits::default(), options)
            .unwrap_err()
            .to_string()
    };
    let text = refused(Options {
        views: Some(1),
        ..options()
    });
    assert!(text.contains("at least 2 keyframes"), "{text}");
    let text = refused(Options {
        every: 1000,
        ..options()
    });
    assert!(
        text.contains("at least 2") && text.contains("found 1"),
        "{text}"
    );
    let tiny = StereoConfig {
        size: (4, 3),
        ..StereoConfig::default()
    };
    let text = refused(Options {
        depth: Some(DepthSource::Stereo(tiny)),
        ..Options::default()
    });
    assert!(text.contains("4x3"), "{text}");
}
