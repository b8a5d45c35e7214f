//! Scans to learn from are sound: whatever the seed, the camera stands free, sees a furnished room without holes, and
//! moves so that pictures overlap.

use std::collections::HashSet;

use glam::{IVec3, Vec3};
use synth::{TrainingScan, View};

const SEEDS: std::ops::Range<u64> = 0..100;
const FRAMES: usize = 60;
const SIZE: [u32; 2] = [40, 30];

fn points<'a>(view: &'a View, depth_m: &'a [f32]) -> impl Iterator<Item = Vec3> + 'a {
    depth_m.iter().enumerate().map(|(i, z)| {
        let (u, v) = (i as u32 % view.camera.width, i as u32 / view.camera.width);
        view.position_m + view.ray(u as f32, v as f32) * *z
    })
}

/// Share of what `view` sees that the next view sees as well.
fn overlap(view: &View, depth_m: &[f32], next: &View, next_depth_m: &[f32]) -> f32 {
    let [width, height] = SIZE.map(|size| size as f32);
    let seen = points(view, depth_m).filter(|p| {
        let local = next.rotation.transpose() * (*p - next.position_m);
        let Some(pixel) = next.camera.project(local.as_dvec3()) else {
            return false;
        };
        let (u, v) = (pixel.x.round() as f32, pixel.y.round() as f32);
        let inside = u >= 0.0 && v >= 0.0 && u < width && v < height;
        // A pixel is wide at this size: what stands in front must stand well in front.
        inside && next_depth_m[(v * width + u) as usize] > 0.85 * local.z
    });
    seen.count() as f32 / depth_m.len() as f32
}

/// What is wrong with the scan of `seed`.
fn faults(seed: u64) -> Vec<String> {
    let scan = TrainingScan::new(seed, FRAMES, SIZE[0], SIZE[1]);
    let mut faults = Vec::new();
    let views = scan.views();
    if views.len() != FRAMES {
        return vec![format!("{} views", views.len())];
    }
    let depths: Vec<_> = (0..FRAMES).map(|i| scan.depth(i)).collect();
    let mut seen = HashSet::<IVec3>::new();
    for (i, (view, depth_m)) in views.iter().zip(&depths).enumerate() {
        let gap = scan.room().distance(view.position_m);
        if gap < 0.25 {
            faults.push(format!("view {i} is {gap} m from something"));
        }
        if depth_m.iter().any(|z| !(0.15..=14.0).contains(z)) {
            faults.push(format!("view {i} has a hole"));
        }
        seen.extend(points(view, depth_m).map(|p| (p * 10.0).floor().as_ivec3()));
    }
    let seen_m2 = seen.len() as f32 * 0.01;
    if seen_m2 < 8.0 {
        faults.push(format!("{seen_m2} m2 seen"));
    }
    let overlaps: Vec<_> = (1..FRAMES)
        .map(|i| overlap(&views[i - 1], &depths[i - 1], &views[i], &depths[i]))
        .collect();
    let worst = overlaps.iter().fold(1.0f32, |a, b| a.min(*b));
    let poor = overlaps.iter().filter(|share| **share < 0.6).count();
    if worst < 0.3 || poor > 3 {
        faults.push(format!("overlap {worst}, {poor} pairs below 0.6"));
    }
    let mut steps: Vec<_> = views
        .windows(2)
        .map(|w| (w[1].position_m - w[0].position_m).length())
        .collect();
    steps.sort_by(f32::total_cmp);
    if !(0.01..0.31).contains(&steps[FRAMES / 2]) || steps[FRAMES - 2] > 0.36 {
        faults.push(format!(
            "steps of {} m, up to {}",
            steps[FRAMES / 2],
            steps[FRAMES - 2]
        ));
    }
    let mut even = 0;
    for i in (0..FRAMES).step_by(6) {
        let greys: Vec<f32> = scan
            .frame(i)
            .color
            .iter()
            .map(|c| f32::from(c[1]))
            .collect();
        let mean = greys.iter().sum::<f32>() / greys.len() as f32;
        let spread =
            (greys.iter().map(|g| (g - mean).powi(2)).sum::<f32>() / greys.len() as f32).sqrt();
        if !(15.0..235.0).contains(&mean) {
            faults.push(format!("view {i} has a mean grey of {mean}"));
        }
        even += usize::from(spread < 8.0);
    }
    if even > 2 {
        faults.push(format!("{even} of 10 views are of one colour"));
    }
    faults
}

#[test]
fn no_seed_is_degenerate() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let found: Vec<String> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads as u64)
            .map(|k| {
                scope.spawn(move || {
                    let mine = SEEDS.filter(|seed| seed % threads as u64 == k);
                    mine.flat_map(|seed| {
                        faults(seed)
                            .into_iter()
                            .map(move |fault| format!("seed {seed}: {fault}"))
                    })
                    .collect::<Vec<_>>()
                })
            })
            .collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().expect("no panic"))
            .collect()
    });
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn depth_ends_on_the_surface() {
    for seed in 0..20 {
        let scan = TrainingScan::new(seed, 12, SIZE[0], SIZE[1]);
        for (i, view) in scan.views().iter().enumerate() {
            let depth_m = scan.depth(i);
            let worst = points(view, &depth_m)
                .map(|p| scan.room().distance(p).abs())
                .fold(0.0, f32::max);
            assert!(
                worst < 1e-3,
                "seed {seed}: a pixel's depth ends {worst} m off the surface"
            );
        }
    }
}

#[test]
fn a_seed_is_the_same_scan_again_and_seeds_differ() {
    let picture = |seed, frames| {
        let scan = TrainingScan::new(seed, frames, SIZE[0], SIZE[1]);
        (
            scan.frame(3),
            scan.views().to_vec(),
            scan.texts(scan.views()),
        )
    };
    assert_eq!(picture(5, 8), picture(5, 8));
    assert_ne!(picture(5, 8).0, picture(6, 8).0);
    // Geometry and way do not depend on how large pictures are.
    let large = TrainingScan::new(5, 8, 160, 120);
    for (a, b) in large.views().iter().zip(picture(5, 8).1) {
        assert_eq!((a.position_m, a.rotation), (b.position_m, b.rotation));
    }
}

#[test]
fn scans_differ_as_cameras_do() {
    let scans: Vec<_> = SEEDS
        .map(|seed| TrainingScan::new(seed, 2, SIZE[0], SIZE[1]))
        .collect();
    let across_deg = |scan: &TrainingScan| {
        let camera = scan.views()[0].camera;
        (2.0 * (0.5 * f64::from(camera.width) / camera.fx).atan()).to_degrees()
    };
    let across: Vec<f64> = scans.iter().map(across_deg).collect();
    assert!(
        across.iter().all(|deg| (50.0..85.1).contains(deg)),
        "{across:?}"
    );
    assert!(across.iter().any(|deg| *deg < 56.0) && across.iter().any(|deg| *deg > 79.0));
    let qualities: HashSet<u8> = scans.iter().map(TrainingScan::quality).collect();
    assert!(qualities.len() > 10, "{qualities:?}");
    let several = scans.iter().filter(|scan| scan.room().rooms() > 1).count();
    assert!(
        (20..80).contains(&several),
        "{several} of 100 scans have more than one room"
    );
    for scan in &scans {
        assert!(
            (9.0..120.0).contains(&scan.room().floor_m2()),
            "{} m2",
            scan.room().floor_m2()
        );
    }
}

#[test]
fn tracked_poses_are_off_by_what_a_phone_is() {
    let mut all = Vec::new();
    for seed in 0..6 {
        let scan = TrainingScan::new(seed, 24, 64, 48);
        let tracked = scan.tracked();
        assert_eq!(tracked.len(), scan.views().len());
        let mut offs = Vec::new();
        for (told, view) in tracked.iter().zip(scan.views()) {
            assert_eq!(told.camera, view.camera);
            let off = told.position_m - view.position_m;
            let turned = told.rotation * view.rotation.transpose();
            // The trace of a rotation by an angle is 1 + 2 cos.
            let trace = turned.x_axis.x + turned.y_axis.y + turned.z_axis.z;
            let angle = (0.5 * (trace - 1.0)).clamp(-1.0, 1.0).acos().to_degrees();
            assert!((turned.determinant() - 1.0).abs() < 1e-4);
            assert!(off.length() < 0.06 && angle < 2.0, "{off}, {angle} degrees");
            offs.push(off);
        }
        let mean = offs.iter().map(|off| off.length()).sum::<f32>() / offs.len() as f32;
        assert!((0.002..0.03).contains(&mean), "seed {seed}: {mean} m");
        all.push(mean);
        // The same whenever it is asked for.
        assert_eq!(tracked, scan.tracked());
        // Half of it goes with the frame before.
        let along: f32 = offs.windows(2).map(|two| two[0].dot(two[1])).sum();
        let squares: f32 = offs.iter().map(|off| off.length_squared()).sum();
        assert!(
            along > 0.1 * squares && along < 0.9 * squares,
            "seed {seed}: {along} of {squares}"
        );
    }
    all.sort_by(f32::total_cmp);
    assert!(all[5] > 1.5 * all[0], "scans differ: {all:?}");
}
