//! The network's driver without its network: an oracle that knows the room stands in for it, so that tiles, views, levels,
//! volume and colours are seen to be right before anything is learnt.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;
#[path = "common/oracle.rs"]
mod oracle;

use burn::tensor::Device;
use common::{Recorder, SEED, color_alone, files, open, sample};
use glam::DAffine3;
use mesh::Mesh;
use oracle::{Oracle, config, mesh_of, options, run_with};
use recon::{
    Level, Limits, NetworkConfig, Options, PlanError, RunError, Stage, ViewChoice,
    evaluate::{Protocol, evaluate},
};
use synth::Room;

#[test]
fn an_oracle_reconstructs_the_room() {
    // Its depth is there to judge by; the driver has colour alone.
    let scan = open(files(|_, bytes| Some(bytes)));
    let blind = open(color_alone(|_, bytes| bytes));
    let oracle = Oracle::new(&blind);
    let mut sink = Recorder {
        watching: true,
        ..Recorder::default()
    };
    let outcome = run_with(&blind, config(), &oracle, &mut sink).unwrap();
    let mut mesh = mesh_of(&outcome);
    mesh.validate().unwrap();
    mesh.transform(&blind.scan_from_canonical());
    let mut best = oracle.everywhere();
    best.transform(&blind.scan_from_canonical());
    let mut truth = Room::new(SEED).mesh();
    let (turn, shift) = sample().world_from_room();
    truth.transform(&DAffine3::from_mat3_translation(
        turn.as_dmat3(),
        shift.as_dvec3(),
    ));
    let (device, protocol) = (Device::flex(), Protocol::TransformerFusion);
    let judge = |mesh: &Mesh, truth: &Mesh| {
        let judged = evaluate(mesh, truth, Some(&scan), protocol, 0, &device, |_, _| ());
        pollster::block_on(judged).unwrap()
    };
    let report = judge(&mesh, &truth);
    let depth = report.depth.unwrap();
    let (f, f_best) = (report.surface.f_score, judge(&best, &truth).surface.f_score);
    let f_between = judge(&mesh, &best).surface.f_score;
    println!(
        "F {f}, of the densely sampled room {f_best}, against that {f_between}; depth {depth:?}"
    );
    // Truth has backs of furniture that no picture shows and legs thinner than a voxel.
    assert!(f > 0.94 && f > f_best - 0.005);
    assert!(f_between > 0.99);
    assert!(depth.abs_rel < 0.02, "rendered where the sensor saw it");

    // The plan's guess is no less than what was needed, and not absurdly more.
    let plan = recon::plan(&blind, &Limits::default(), options(config())).unwrap();
    let ratio = plan.bricks as f64 / outcome.volume.brick_count() as f64;
    println!("{} bricks planned, {ratio} of the real ones", plan.bricks);
    assert!((1.0..6.0).contains(&ratio), "{ratio} of the bricks used");

    // Every level in its turn, all work counted, the surface handed over.
    let order: Vec<Stage> = sink.stages.iter().map(|(stage, _)| *stage).collect();
    let levels = Level::ALL.map(Stage::Decoding);
    let expected = [&[Stage::WarmingUp, Stage::Features], &levels[..]].concat();
    let expected = [expected, vec![Stage::Coloring, Stage::Meshing]].concat();
    assert_eq!(order, expected);
    for (stage, total) in &sink.stages[..6] {
        let progress = &sink.progress_of[stage];
        assert!(progress.is_sorted());
        assert_eq!(progress.last(), Some(total), "{stage:?}");
    }
    assert!(sink.surfaces.iter().sum::<usize>() >= mesh.triangles.len());
    assert!(sink.findings.is_empty(), "{:?}", sink.findings);
    let blocks = oracle.blocks.borrow();
    for &(level, views, sites) in blocks.iter() {
        assert!(views <= 12 && views * sites <= 200_000, "{level:?}");
    }
}

#[test]
fn colours_are_those_that_the_pictures_show() {
    let with_depth = open(files(|_, bytes| Some(bytes)));
    let scan = open(color_alone(|_, bytes| bytes));
    let oracle = Oracle::new(&scan);
    let outcome = run_with(&scan, config(), &oracle, &mut Recorder::default()).unwrap();
    let mut mesh = mesh_of(&outcome);
    mesh.transform(&scan.scan_from_canonical());
    // At vertices that a frame sees, as its sensor says.
    let mut errors: Vec<u8> = Vec::new();
    for index in (0..with_depth.frames().len()).step_by(5) {
        let frame = &with_depth.frames()[index];
        let (color, depth) = (with_depth.color(index), with_depth.depth(index));
        let (color, depth) = (color.unwrap(), depth.unwrap().unwrap());
        let camera_from_scan = (with_depth.scan_from_canonical() * frame.pose).inverse();
        for (position, found) in mesh.positions.iter().zip(&mesh.colors) {
            let point = camera_from_scan.transform_point3(position.as_dvec3());
            let Some(pixel) = frame.depth_camera.project(point).map(|p| p.round()) else {
                continue;
            };
            let (width, height) = (f64::from(depth.width), f64::from(depth.height));
            if pixel.cmplt(glam::DVec2::ZERO).any() || pixel.x >= width || pixel.y >= height {
                continue;
            }
            let at = pixel.y as usize * depth.width as usize + pixel.x as usize;
            if (f64::from(depth.depth_m[at]) - point.z).abs() < 0.02 {
                let shown = &color.rgb[at * 3..][..3];
                errors.extend(found.iter().zip(shown).map(|(a, b)| a.abs_diff(*b)));
            }
        }
    }
    errors.sort_unstable();
    let part = |share: f64| errors[(errors.len() as f64 * share) as usize];
    println!(
        "{} numbers: {} at half, {} at nine tenths",
        errors.len(),
        part(0.5),
        part(0.9)
    );
    assert!(errors.len() > 20_000);
    assert!(part(0.5) < 8 && part(0.9) < 40);
}

#[test]
fn the_same_seed_gives_the_same_mesh() {
    let scan = open(color_alone(|_, bytes| bytes));
    let oracle = Oracle::new(&scan);
    let mesh = |seed, choice| {
        let config = NetworkConfig {
            seed,
            choice,
            views_a_tile: 6,
            ..config()
        };
        let outcome = run_with(&scan, config, &oracle, &mut Recorder::default()).unwrap();
        (mesh_of(&outcome), outcome.frames_fused)
    };
    for choice in [ViewChoice::Coverage, ViewChoice::Random] {
        let (first, frames) = mesh(1, choice);
        let (again, frames_again) = mesh(1, choice);
        assert_eq!(frames, frames_again);
        assert_eq!(first.positions, again.positions);
        assert_eq!(first.triangles, again.triangles);
        assert_eq!(first.colors, again.colors);
    }
}

#[test]
fn chosen_views_see_more_of_a_tile_than_random_ones() {
    let scan = open(color_alone(|_, bytes| bytes));
    let of = |choice, seed| {
        let mut oracle = Oracle::new(&scan);
        oracle.empty = true;
        let config = NetworkConfig {
            seed,
            choice,
            views_a_tile: 6,
            ..config()
        };
        let result = run_with(&scan, config, &oracle, &mut Recorder::default());
        assert!(matches!(result, Err(RunError::NothingOccupied { .. })));
        (oracle.lonely.into_inner(), oracle.cameras.into_inner())
    };
    let chosen = [1, 2, 3].map(|seed| of(ViewChoice::Coverage, seed));
    let random = [1, 2, 3].map(|seed| of(ViewChoice::Random, seed));
    let most = chosen.iter().map(|(lonely, _)| *lonely).max().unwrap();
    let least = random.iter().map(|(lonely, _)| *lonely).min().unwrap();
    println!("at most {most} sites seen by one or none, at random at least {least}");
    assert!(most < least);
    assert_ne!(random[0].1, random[1].1, "another seed, other views");
    assert_ne!(chosen[0].1, chosen[1].1, "another seed, other views");
}

#[test]
fn broken_pictures_are_reported_and_the_rest_goes_on() {
    let scan = open(color_alone(|path, mut bytes| {
        if path.contains("000009.color") {
            bytes.truncate(bytes.len() / 2);
        }
        bytes
    }));
    let mut sink = Recorder::default();
    let outcome = run_with(&scan, config(), &Oracle::new(&scan), &mut sink).unwrap();
    let plan = recon::plan(&scan, &Limits::default(), options(config())).unwrap();
    assert_eq!(outcome.frames_fused, plan.keyframes.len() - 1);
    let files = sink.findings.iter().filter_map(|f| f.file.as_deref());
    let files: Vec<&str> = files.collect();
    assert!(files.iter().all(|file| file.contains("000009.color")));
    assert_eq!(files.len(), 1, "told once: {files:?}");
}

#[test]
fn it_can_be_stopped_at_any_step() {
    let scan = open(color_alone(|_, bytes| bytes));
    let oracle = Oracle::new(&scan);
    let mut sink = Recorder::default();
    run_with(&scan, config(), &oracle, &mut sink).unwrap();
    let steps = sink.checkpoints;
    assert!(steps > 40, "{steps} places to stop at");
    for stop_after in [0, steps / 4, steps / 2, steps - 2] {
        let mut sink = Recorder {
            stop_after: Some(stop_after),
            ..Recorder::default()
        };
        let outcome = run_with(&scan, config(), &oracle, &mut sink).unwrap();
        assert!(outcome.stopped, "after {stop_after} of {steps}");
        assert!(sink.checkpoints <= stop_after + 1);
        // Once distances are there, so is a surface, however few colours it has.
        assert_eq!(
            stop_after == steps - 2,
            !mesh_of(&outcome).triangles.is_empty()
        );
    }
}

#[test]
fn what_was_wrong_is_said() {
    let scan = open(color_alone(|_, bytes| bytes));
    let mut oracle = Oracle::new(&scan);
    oracle.empty = true;
    let mut sink = Recorder::default();
    let error = run_with(&scan, config(), &oracle, &mut sink).err().unwrap();
    let words = error.to_string();
    assert!(matches!(error, RunError::NothingOccupied { .. }), "{words}");
    for word in ["found none", "scale", "up", "degrees", "weights"] {
        assert!(words.contains(word), "{word}: {words}");
    }

    // Each camera in a place of its own.
    let apart = open(color_alone(|path, bytes| {
        if !path.ends_with("pose.txt") {
            return bytes;
        }
        let digits: String = path.chars().filter(char::is_ascii_digit).collect();
        let frame: f64 = digits.parse().unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let mut numbers: Vec<f64> = text
            .split_whitespace()
            .map(|n| n.parse().unwrap())
            .collect();
        numbers[3] += 50.0 * frame;
        let rows = numbers
            .chunks(4)
            .map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" "));
        rows.collect::<Vec<_>>().join("\n").into_bytes()
    }));
    let error = run_with(&apart, config(), &oracle, &mut sink)
        .err()
        .unwrap();
    let words = error.to_string();
    assert!(matches!(error, RunError::NoOverlap { .. }), "{words}");
    assert!(
        words.contains("metres") && words.contains("overlap"),
        "{words}"
    );

    // A plan for the network, and none at hand.
    let plan = recon::plan(&scan, &Limits::default(), options(config())).unwrap();
    let result = pollster::block_on(recon::run(&scan, &plan, &Device::flex(), &mut sink));
    assert!(matches!(result.err(), Some(RunError::NoWeights)));
}

#[test]
fn the_plan_says_what_it_cannot_grant() {
    let scan = open(color_alone(|_, bytes| bytes));
    let asked = Options {
        voxel_size_m: 0.02,
        ..options(NetworkConfig::default())
    };
    let plan = recon::plan(&scan, &Limits::default(), asked).unwrap();
    assert_eq!(plan.options.voxel_size_m, 0.04);
    let remarks = plan.remarks.join("\n");
    let keyframes = plan.keyframes.len().to_string();
    for word in ["60 views", &keyframes, "all of them", "4.0 cm", "2.0 cm"] {
        assert!(remarks.contains(word), "{word}: {remarks}");
    }
    let wrong = [
        NetworkConfig {
            size: (16, 12),
            ..config()
        },
        NetworkConfig {
            views_a_tile: 1,
            ..config()
        },
        NetworkConfig {
            tile: [96, 97, 48],
            ..config()
        },
        NetworkConfig {
            reach_m: 0.0,
            ..config()
        },
    ];
    for config in wrong {
        let result = recon::plan(&scan, &Limits::default(), options(config));
        assert!(
            matches!(result, Err(PlanError::Setting { .. })),
            "{config:?}"
        );
    }
    let none = open(files(|path, bytes| {
        (!path.contains("color")).then_some(bytes)
    }));
    let result = recon::plan(&none, &Limits::default(), options(config()));
    assert!(matches!(
        result,
        Err(PlanError::TooFewPictures { found: 0, .. })
    ));
}
