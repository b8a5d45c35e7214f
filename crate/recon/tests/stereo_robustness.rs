//! Scans as people make them: standing still, blank walls, a wrong exposure, a blurred picture, a lost tracker. None may spoil
//! what the other pictures give; what cannot be used is told.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;
#[path = "common/walk.rs"]
mod walk;

use burn::tensor::Device;
use common::{Recorder, SEED, color_alone, open};
use glam::Vec3;
use recon::{DepthSource, Limits, Options, RunError};
use std::sync::OnceLock;
use stereo::{StereoConfig, StereoError};
use walk::{Quality, Ran, Shot, Walk};

const FRAMES: usize = 16;
/// The picture that is spoiled, in the middle of the walk.
const SPOILED: usize = 8;

/// Small, so that a run takes seconds.
fn config() -> StereoConfig {
    StereoConfig {
        size: (160, 120),
        planes: 64,
        ..StereoConfig::default()
    }
}

fn everywhere(_: Vec3) -> bool {
    true
}

/// The walk as it is.
fn clean() -> &'static Walk {
    static WALK: OnceLock<Walk> = OnceLock::new();
    WALK.get_or_init(|| Walk::new(SEED, FRAMES))
}

/// What comes of it: figures of all maps but the spoiled one's, and of that one.
fn clean_figures() -> (Quality, Quality) {
    static FIGURES: OnceLock<(Quality, Quality)> = OnceLock::new();
    *FIGURES.get_or_init(|| {
        let ran = clean().run(config());
        assert_eq!(ran.maps.len(), FRAMES);
        let figures = figures(clean(), &ran);
        println!("as it is: the others {}; itself {}", figures.0, figures.1);
        figures
    })
}

fn figures(walk: &Walk, ran: &Ran) -> (Quality, Quality) {
    let others = walk.quality_but(ran, &[SPOILED], everywhere);
    let spoiled = ran.map(SPOILED).expect("a map of the spoiled picture");
    (others, walk.quality(ran, spoiled, everywhere))
}

/// At most a tenth more error and 0.03 less coverage than before.
fn assert_near(what: &str, found: &Quality, before: &Quality) {
    println!("{what}: {found}");
    let near = found.abs_rel() <= 1.1 * before.abs_rel()
        && found.delta() >= before.delta() - 0.01
        && found.coverage() >= before.coverage() - 0.03;
    assert!(near, "{what}: {found}; without it {before}");
}

/// Spoils one picture and sees that the others do not suffer. What the spoiled one gives must be right as far as it goes;
/// at least `coverage` of the clean one's is left.
fn spoil(what: &str, coverage: f64, change: impl FnOnce(&mut Shot)) {
    let (others, own) = clean_figures();
    let walk = clean().with(SPOILED, change);
    let ran = walk.run(config());
    let found = figures(&walk, &ran);
    assert_near(&format!("{what}, the others"), &found.0, &others);
    println!("{what}, itself: {}", found.1);
    assert!(found.1.delta() >= own.delta() - 0.02);
    assert!(found.1.coverage() >= coverage * own.coverage());
    assert_eq!(told(&ran), [""; 0]);
}

/// Every finding in words.
fn told(ran: &Ran) -> Vec<String> {
    ran.findings.iter().map(ToString::to_string).collect()
}

#[test]
fn a_frame_that_is_there_twice_spoils_nothing() {
    let (others, own) = clean_figures();
    let mut twice = clean().clone();
    // Later in the scan, so that it is a keyframe of its own.
    let copy = twice.shots[&SPOILED].clone();
    twice.shots.insert(FRAMES, copy);
    let ran = twice.run(config());
    assert_eq!(ran.keyframes, FRAMES + 1);
    let found = figures(&twice, &ran);
    assert_near("twice, the others", &found.0, &others);
    assert_near("twice, itself", &found.1, &own);
    let copy = twice.quality(&ran, ran.map(FRAMES).unwrap(), everywhere);
    assert_near("twice, the copy", &copy, &own);
    assert_eq!(told(&ran), [""; 0]);
}

#[test]
fn a_scan_that_stands_twice_everywhere_is_as_good() {
    let (others, own) = clean_figures();
    let mut twice = clean().clone();
    let copies = twice.shots.clone().into_iter();
    twice
        .shots
        .extend(copies.map(|(number, shot)| (FRAMES + number, shot)));
    let ran = twice.run(config());
    assert_eq!(ran.keyframes, 2 * FRAMES);
    let found = figures(&twice, &ran);
    assert_near("all twice, the others", &found.0, &others);
    assert_near("all twice, one", &found.1, &own);
    assert_eq!(told(&ran), [""; 0]);
}

/// Turning pictures into depth takes steps aside; without any the user is told so.
#[test]
fn a_scan_from_one_place_is_refused_with_advice() {
    let plan = |walk: &Walk| {
        let options = Options {
            depth: Some(DepthSource::Stereo(config())),
            ..Options::default()
        };
        recon::plan(&walk.scan(), &Limits::default(), options)
    };
    let mut still = clean().clone();
    let place_m = still.shots[&0].told_position_m;
    for shot in still.shots.values_mut() {
        shot.told_position_m = place_m;
    }
    let run = |walk: &Walk, keyframes: Vec<usize>| {
        let mut plan = plan(clean()).unwrap();
        plan.keyframes = keyframes;
        let (mut sink, device) = (Recorder::default(), Device::flex());
        let scan = walk.scan();
        pollster::block_on(recon::run(&scan, &plan, &device, &mut sink)).err()
    };
    let refused = |error: Option<RunError>| {
        let text = error.as_ref().map(ToString::to_string);
        println!("{text:?}");
        assert!(
            matches!(
                error,
                Some(RunError::Stereo(StereoError::NoParallax { .. }))
            ),
            "{text:?}"
        );
        assert!(text.unwrap().contains("walk sideways"));
    };
    // Turning on the spot.
    let keyframes = plan(&still).unwrap().keyframes;
    assert!(keyframes.len() > 4);
    refused(run(&still, keyframes));
    // One pose in all frames: a plan of it says so, and a run without its plan too.
    let turned = still.shots[&0].told_rotation;
    for shot in still.shots.values_mut() {
        shot.told_rotation = turned;
    }
    let text = plan(&still).unwrap_err().to_string();
    println!("{text}");
    assert!(text.contains("at least 2 keyframes"), "{text}");
    refused(run(&still, (0..FRAMES).collect()));
}

#[test]
fn a_frame_of_wrong_exposure_spoils_nothing() {
    let gamma = |gamma: f32| move |_, v: f32| 0.4 * 255.0 * (v / 255.0).powf(gamma);
    spoil("dark, gamma 0.5", 0.95, |shot| shot.expose(gamma(0.5)));
    spoil("dark, gamma 2", 0.95, |shot| shot.expose(gamma(2.0)));
}

#[test]
fn a_frame_with_a_colour_cast_spoils_nothing() {
    spoil("cast", 0.95, |shot| {
        shot.expose(|channel, v| v * [1.3, 0.9, 0.5][channel]);
    });
}

#[test]
fn a_frame_with_motion_blur_spoils_nothing() {
    spoil("blur of 9 px", 0.75, |shot| shot.blur(9));
    spoil("blur of 21 px", 0.3, |shot| shot.blur(21));
}

/// The frame is named, nobody else is, and the rest is as if it were not there.
#[test]
fn a_frame_with_a_wrong_pose_is_left_out_and_named() {
    let mut failures = Vec::new();
    for spoiled in [0, SPOILED, FRAMES - 1] {
        let without = clean().without(spoiled).run(config());
        let before = clean().quality_but(&without, &[], everywhere);
        let (right, area_m2) = without.mesh(&clean().room);
        println!("without frame {spoiled}: {before}, mesh {right:.4} right, {area_m2:.2} m2");
        for (right_m, degrees) in [(0.4, 10.0), (-0.4, -10.0), (2.0, 10.0)] {
            let what = format!("frame {spoiled} off by {right_m} m and {degrees} degrees");
            let walk = clean().with(spoiled, |shot| shot.misplace(right_m, degrees));
            let ran = walk.run(config());
            let others = walk.quality_but(&ran, &[spoiled], everywhere);
            let mesh = ran.mesh(&walk.room);
            println!("{what}: {others}, mesh {mesh:?}, {:?}", told(&ran));
            let name = format!("frame-{spoiled:06}");
            let named = matches!(told(&ran).as_slice(), [one] if one.contains(&name));
            let silent = ran
                .map(spoiled)
                .is_none_or(|map| map.depth_m.iter().all(|&z| z == 0.0));
            let near = others.abs_rel() <= 1.1 * before.abs_rel()
                && others.coverage() >= before.coverage() - 0.03
                && mesh.0 > right - 0.02
                && (mesh.1 / area_m2 - 1.0).abs() < 0.05;
            if !(named && silent && near) {
                failures.push(format!(
                    "{what}: named {named}, silent {silent}, near {near}"
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// A tracker that is lost for a while, and now and then; and a picture that belongs to another place.
#[test]
fn several_wrong_frames_are_named_and_nobody_else() {
    let (others, _) = clean_figures();
    let named = |ran: &Ran, wrong: &[usize]| {
        let accused = |f: &scan::Finding| (f.code, f.file.clone().unwrap_or_default());
        let mut accused: Vec<_> = ran.findings.iter().map(accused).collect();
        accused.sort();
        let wrong = wrong.iter().map(|n| format!("frame-{n:06}.color.png"));
        let wrong: Vec<_> = wrong.map(|file| ("stereo-pose", file)).collect();
        assert_eq!(accused, wrong);
    };
    for wrong in [vec![7, 8], vec![3, 8, 12]] {
        let mut walk = clean().clone();
        for number in &wrong {
            let shot = walk.shots.get_mut(number).unwrap();
            shot.misplace(0.4, 10.0);
        }
        let ran = walk.run(config());
        named(&ran, &wrong);
        let found = walk.quality_but(&ran, &wrong, everywhere);
        assert_near(&format!("but {wrong:?}"), &found, &others);
    }
    let elsewhere = clean().shots[&2].rgb.clone();
    let walk = clean().with(SPOILED, |shot| shot.rgb = elsewhere);
    let ran = walk.run(config());
    named(&ran, &[SPOILED]);
    let found = walk.quality_but(&ran, &[SPOILED], everywhere);
    assert_near("but a picture of elsewhere", &found, &others);
}

#[test]
fn right_poses_are_not_called_wrong() {
    for seed in 1..=6 {
        let ran = Walk::new(seed, FRAMES).run(config());
        assert_eq!(told(&ran), [""; 0], "room {seed}");
        assert!(ran.outcome.is_ok());
    }
    // Pictures far apart: 30 degrees.
    let scan = open(color_alone(|_, bytes| bytes));
    let options = Options {
        depth: Some(DepthSource::Stereo(config())),
        ..Options::default()
    };
    let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
    let (mut sink, device) = (Recorder::default(), Device::flex());
    pollster::block_on(recon::run(&scan, &plan, &device, &mut sink)).unwrap();
    let accused = sink.findings.iter().filter(|f| f.code == "stereo-pose");
    assert_eq!(accused.count(), 0, "{:?}", sink.findings);
}

/// The walls of the room that are seen most, painted in one grey with a sensor's noise.
#[test]
fn a_wall_without_texture_gives_no_surface_elsewhere() {
    let half = 0.5 * clean().room.size_m();
    for (axis, side) in [(0, 1.0), (0, -1.0), (1, 1.0)] {
        let behind_m = move |p: Vec3| half[axis] - p[axis] * side;
        let on_wall = move |p: Vec3| behind_m(p).abs() < 0.02;
        for sigma in [1.5, 3.0] {
            let mut walk = clean().clone();
            for (number, shot) in &mut walk.shots {
                shot.paint(sigma, *number, on_wall);
            }
            let ran = walk.run(config());
            let whole = walk.quality_but(&ran, &[], everywhere);
            let wall = walk.quality_but(&ran, &[], on_wall);
            let inside = inside(&walk, &ran, on_wall);
            println!("wall {axis} {side}, noise {sigma}: all {whole}");
            println!("  on the wall {wall}\n  inside it {inside}");
            assert!(whole.precision() >= 0.8, "{whole}");
            let invented = inside.coverage() * (1.0 - inside.precision());
            assert!(invented < 0.08, "{invented} of the wall has wrong depth");
            assert_eq!(told(&ran), [""; 0]);
        }
    }
}

/// Figures of the pixels on a wall that have nothing but wall around them, as far as the matching's windows reach.
fn inside(walk: &Walk, ran: &Ran, on_wall: impl Fn(Vec3) -> bool) -> Quality {
    const REACH: usize = 4;
    let mut quality = Quality::default();
    for map in &ran.maps {
        let (view, truth_m) = walk.truth(ran, map);
        let (width, height) = (map.camera.width as usize, map.camera.height as usize);
        let wall: Vec<bool> = (0..width * height)
            .map(|i| {
                let ray = view.ray((i % width) as f32, (i / width) as f32);
                on_wall(view.position_m + ray * truth_m[i])
            })
            .collect();
        for y in REACH..height - REACH {
            for x in REACH..width - REACH {
                let mut rows = y - REACH..=y + REACH;
                if rows.all(|y| {
                    wall[y * width + x - REACH..=y * width + x + REACH]
                        .iter()
                        .all(|w| *w)
                }) {
                    quality.add(truth_m[y * width + x], map.depth_m[y * width + x]);
                }
            }
        }
    }
    quality
}

#[test]
fn pictures_of_nothing_but_a_blank_wall_give_nothing() {
    for sigma in [0.0, 2.0] {
        let mut walk = clean().clone();
        for (number, shot) in &mut walk.shots {
            shot.paint(sigma, *number, everywhere);
        }
        let ran = walk.run(config());
        let whole = walk.quality_but(&ran, &[], everywhere);
        println!(
            "nothing but a wall, noise {sigma}: {whole}, {:?}",
            told(&ran)
        );
        assert!(whole.coverage() < 0.04, "{whole}");
    }
}
