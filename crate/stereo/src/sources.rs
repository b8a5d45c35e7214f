//! Which other keyframes a keyframe is compared with: those that see the same from a little aside.

use glam::{DVec2, DVec3};
use scan::{Camera, Frame};

/// Cameras nearer to each other than this see no parallax, in metres.
pub const LEAST_BASELINE_M: f64 = 0.03;
/// Farther from each other than this, views differ too much to be compared.
const MOST_BASELINE_M: f64 = 2.0;
/// The distance between two cameras that does best: far enough for depth, near enough to look alike.
const BEST_BASELINE_M: f64 = 0.25;
/// How fast other distances get worse, as the standard deviation of their natural logarithm.
const BASELINE_SPREAD: f64 = 0.6;
/// A source sees at least this share of what the keyframe sees.
const LEAST_OVERLAP: f64 = 0.25;
/// Keyframes that [`mean_count`] looks at.
const LOOKED_AT: usize = 16;
/// Points at which overlap is asked for: a grid of pixels at two depths of a room.
const GRID: usize = 5;
const DEPTHS_M: [f64; 2] = [1.5, 3.0];

/// Up to `most` sources of each keyframe, best first, as indices into `keyframes`: by overlap times a preference for the
/// best baseline. `keyframes` index `frames`.
pub fn choose(frames: &[Frame], keyframes: &[usize], most: usize) -> Vec<Vec<usize>> {
    let best_of = |(at, &keyframe): (usize, &usize)| {
        let reference = &frames[keyframe];
        let others = keyframes
            .iter()
            .enumerate()
            .filter(|&(other, _)| other != at);
        let scored = others.filter_map(|(other, &k)| Some((score(reference, &frames[k])?, other)));
        let mut scored: Vec<(f64, usize)> = scored.collect();
        // The index breaks ties, so that the choice is the same everywhere.
        scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        scored.truncate(most);
        scored.into_iter().map(|(_, other)| other).collect()
    };
    keyframes.iter().enumerate().map(best_of).collect()
}

/// How many sources a keyframe has in the mean, of up to `most`: looked up for some keyframes, evenly spread, to plan by.
pub fn mean_count(frames: &[Frame], keyframes: &[usize], most: usize) -> f64 {
    let step = keyframes.len().div_ceil(LOOKED_AT).max(1);
    let looked_at: Vec<usize> = keyframes.iter().copied().step_by(step).collect();
    let count = |&reference: &usize| {
        let others = keyframes.iter().filter(|&&other| other != reference);
        let scored = others.filter(|&&other| score(&frames[reference], &frames[other]).is_some());
        scored.take(most).count()
    };
    let all: usize = looked_at.iter().map(count).sum();
    all as f64 / looked_at.len().max(1) as f64
}

fn score(reference: &Frame, source: &Frame) -> Option<f64> {
    let baseline_m = reference.pose.translation.distance(source.pose.translation);
    if !(LEAST_BASELINE_M..=MOST_BASELINE_M).contains(&baseline_m) {
        return None;
    }
    let overlap = overlap(reference, source);
    if overlap < LEAST_OVERLAP {
        return None;
    }
    let off = (baseline_m / BEST_BASELINE_M).ln() / BASELINE_SPREAD;
    Some(overlap * (-0.5 * off * off).exp())
}

/// The share of the reference's view volume that the source sees too.
fn overlap(reference: &Frame, source: &Frame) -> f64 {
    let source_from_reference = source.pose.inverse() * reference.pose;
    let camera = &reference.color_camera;
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let part = |i: usize| (i as f64 + 0.5) / GRID as f64;
    let mut seen = 0;
    for depth_m in DEPTHS_M {
        for cell in 0..GRID * GRID {
            let pixel = DVec2::new(part(cell % GRID) * width, part(cell / GRID) * height);
            let point = source_from_reference.transform_point3(camera.unproject(pixel, depth_m));
            seen += usize::from(sees(&source.color_camera, point));
        }
    }
    seen as f64 / (GRID * GRID * DEPTHS_M.len()) as f64
}

fn sees(camera: &Camera, point: DVec3) -> bool {
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    camera
        .project(point)
        .is_some_and(|p| p.cmpge(DVec2::ZERO).all() && p.cmplt(size).all())
}
