//! The up direction from a room's patches: the direction for which most surfaces are level or upright, then the
//! common normal of the level planes.

use glam::{DMat3, DVec3};

use super::eigen;
use super::outer;
use super::patches::Patch;

/// How far from the cameras' guess up may lie: cameras that all look down one way mislead by about as much.
const SEARCH_DEG: f64 = 50.0;
const SEARCH_STEP_DEG: f64 = 2.0;
/// Patches used for the search; more would not change its winner.
const SEARCH_PATCHES: usize = 4000;
/// A patch counts as level or upright within this angle during the search.
const TOLERANCE_DEG: f64 = 8.0;
/// A level patch is rarer by chance than an upright one, which many a slanted direction also has.
const UPRIGHT_WEIGHT: f64 = 0.5;
/// How much level cameras count against surfaces.
const CAMERA_WEIGHT: f64 = 1.0;
/// Roll of a hand-held camera (standard deviation of its x axis out of level).
const CAMERA_ROLL_RAD: f64 = 0.2;
const GUESS_WEIGHT: f64 = 0.1;
/// About a quarter of a square metre of level surface.
const MIN_LEVEL_PATCHES: usize = 40;
/// About one and a half square metres of wall.
const MIN_WALL_PATCHES: f64 = 250.0;
/// Height noise of a patch on a perfect floor.
const NOISE_M: f64 = 0.005;
/// Lean of a patch on a perfect wall; generous, because all patches of a wall share the errors of their poses.
const NORMAL_NOISE_RAD: f64 = 0.03;

/// Refines the cameras' `guess`; `right` are the cameras' x axes. `None` when neither enough level surface nor
/// walls facing two ways are seen.
pub(super) fn refine(guess: DVec3, right: &[DVec3], patches: &[Patch]) -> Option<DVec3> {
    let sample = |list: usize, wanted: usize| list.div_ceil(wanted).max(1);
    let few: Vec<DVec3> = patches
        .iter()
        .step_by(sample(patches.len(), SEARCH_PATCHES))
        .map(|patch| patch.normal)
        .collect();
    let some_right: Vec<DVec3> = right
        .iter()
        .step_by(sample(right.len(), 200))
        .copied()
        .collect();
    let best = cone(guess)
        .map(|up| (score(up, guess, &some_right, &few), up))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(guess, |(_, up)| up);
    let up = by_normals(best, patches);
    by_planes(up, patches)
}

/// Directions around `axis`, about two degrees apart.
fn cone(axis: DVec3) -> impl Iterator<Item = DVec3> {
    let (side, other) = axis.any_orthonormal_pair();
    let rings = (SEARCH_DEG / SEARCH_STEP_DEG) as usize;
    (0..=rings).flat_map(move |ring| {
        let tilt = (ring as f64 * SEARCH_STEP_DEG).to_radians();
        let turn = std::f64::consts::TAU;
        let count = (turn * tilt.sin() / SEARCH_STEP_DEG.to_radians())
            .ceil()
            .max(1.0);
        (0..count as usize).map(move |index| {
            let (sin, cos) = (turn * index as f64 / count).sin_cos();
            axis * tilt.cos() + (side * cos + other * sin) * tilt.sin()
        })
    })
}

fn score(up: DVec3, guess: DVec3, right: &[DVec3], normals: &[DVec3]) -> f64 {
    let sin_limit = TOLERANCE_DEG.to_radians().sin();
    let mean = |sum: f64, count: usize| sum / count.max(1) as f64;
    let surface = |normal: &DVec3| {
        let across = normal.dot(up).abs();
        let out_of_level = (1.0 - across * across).max(0.0).sqrt();
        let level = (1.0 - (out_of_level / sin_limit).powi(2)).max(0.0);
        let upright = (1.0 - (across / sin_limit).powi(2)).max(0.0);
        level + UPRIGHT_WEIGHT * upright
    };
    let camera = |right: &DVec3| (-0.5 * (right.dot(up) / CAMERA_ROLL_RAD).powi(2)).exp();
    let off_guess = up.angle_between(guess).to_degrees() / SEARCH_DEG;
    mean(normals.iter().map(surface).sum(), normals.len())
        + CAMERA_WEIGHT * mean(right.iter().map(camera).sum(), right.len())
        - GUESS_WEIGHT * off_guess * off_guess
}

fn towards(up: DVec3, like: DVec3) -> DVec3 {
    if up.dot(like) < 0.0 { -up } else { up }
}

/// The direction most along level normals and least along upright ones, with a shrinking tolerance.
fn by_normals(mut up: DVec3, patches: &[Patch]) -> DVec3 {
    for tolerance_deg in [8.0_f64, 6.0, 5.0, 5.0] {
        let sin_limit = tolerance_deg.to_radians().sin();
        let mut spread = DMat3::ZERO;
        for patch in patches {
            let across = patch.normal.dot(up).abs();
            if 1.0 - across * across < sin_limit * sin_limit {
                spread -= outer(patch.normal);
            } else if across < sin_limit {
                spread += outer(patch.normal) * UPRIGHT_WEIGHT;
            }
        }
        up = towards(eigen::smallest(spread), up);
    }
    up
}

/// The common normal of the level planes: the direction along which their points scatter least about each plane's
/// own height. Points over metres say more than their noisy normals. Walls help where little floor is seen. Both
/// count by their variance, as in weighted least squares.
fn by_planes(mut up: DVec3, patches: &[Patch]) -> Option<DVec3> {
    let mut found = false;
    for band_m in [0.08, 0.06, 0.05, 0.04, 0.03, 0.03] {
        let cos_limit = 12.0_f64.to_radians().cos();
        let level: Vec<DVec3> = patches
            .iter()
            .filter(|patch| patch.normal.dot(up).abs() > cos_limit)
            .map(|patch| patch.point)
            .collect();
        let mut spread = DMat3::ZERO;
        let (mut count, mut weight_sum) = (0, 0.0);
        for height in plane_heights(&level, up, band_m) {
            let members: Vec<DVec3> = level
                .iter()
                .copied()
                .filter(|point| (point.dot(up) - height).abs() < band_m)
                .collect();
            let members_count = members.len() as f64;
            let centre = members.iter().sum::<DVec3>() / members_count.max(1.0);
            let scatter = members
                .iter()
                .fold(DMat3::ZERO, |sum, point| sum + outer(*point - centre));
            // Floors are flat and decide; cushions and cluttered tables are not.
            let variance_m2 = up.dot(scatter * up) / members_count.max(1.0) + NOISE_M * NOISE_M;
            spread += scatter * variance_m2.recip();
            weight_sum += members_count / variance_m2;
            count += members.len();
        }
        let walls = Walls::of(patches, up);
        if count < MIN_LEVEL_PATCHES && !walls.fix_up(up) {
            break;
        }
        found = true;
        spread += walls.spread * walls.variance.recip();
        // A strip a hand wide says nothing about its roll: there the direction so far is kept.
        let keep = (DMat3::IDENTITY - outer(up)) * (0.05 * 0.05 * weight_sum);
        up = towards(eigen::smallest(spread + keep), up);
    }
    found.then_some(up)
}

/// The normals of upright patches.
struct Walls {
    spread: DMat3,
    count: f64,
    /// Of their lean, in square radians.
    variance: f64,
}

impl Walls {
    fn of(patches: &[Patch], up: DVec3) -> Walls {
        let sin_limit = 6.0_f64.to_radians().sin();
        let normals = || {
            patches
                .iter()
                .map(|patch| patch.normal)
                .filter(|normal| normal.dot(up).abs() < sin_limit)
        };
        let spread = normals().fold(DMat3::ZERO, |sum, normal| sum + outer(normal));
        let count = normals().count() as f64;
        let lean = up.dot(spread * up) / count.max(1.0);
        Walls {
            spread,
            count,
            variance: lean + NORMAL_NOISE_RAD * NORMAL_NOISE_RAD,
        }
    }

    /// Walls that face two ways leave one direction for up, even where no level surface is seen.
    fn fix_up(&self, up: DVec3) -> bool {
        let rarest = eigen::smallest(self.spread + outer(up) * self.count);
        self.count >= MIN_WALL_PATCHES && rarest.dot(self.spread * rarest) > 0.05 * self.count
    }
}

/// Heights along `up` at which many points lie: peaks of a histogram, each refined to the mean around it.
fn plane_heights(points: &[DVec3], up: DVec3, band_m: f64) -> Vec<f64> {
    const BIN_M: f64 = 0.02;
    /// Bounds the histogram where a stray pose lies far away.
    const REACH_M: f64 = 20.0;
    let mut heights: Vec<f64> = points.iter().map(|point| point.dot(up)).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let middle = heights.get(heights.len() / 2).copied().unwrap_or(0.0);
    heights.retain(|height| (height - middle).abs() < REACH_M);
    let lowest = heights.first().copied().unwrap_or(0.0);
    let bin = |height: f64| ((height - lowest) / BIN_M) as usize;
    let mut counts: Vec<usize> = Vec::new();
    for &height in &heights {
        let index = bin(height);
        if index >= counts.len() {
            counts.resize(index + 1, 0);
        }
        counts[index] += 1;
    }
    let reach = (band_m / BIN_M).round() as usize;
    let window = |index: usize| {
        let end = (index + reach + 1).min(counts.len());
        counts[index.saturating_sub(reach)..end]
            .iter()
            .sum::<usize>()
    };
    let mut peaks: Vec<(usize, usize)> = (0..counts.len()).map(|i| (window(i), i)).collect();
    peaks.sort_unstable_by(|a, b| b.cmp(a));
    let least = peaks
        .first()
        .map_or(0, |(most, _)| most / 5)
        .max(MIN_LEVEL_PATCHES / 2);
    let mut chosen: Vec<usize> = Vec::new();
    for (_, index) in peaks.into_iter().filter(|(count, _)| *count >= least) {
        if chosen
            .iter()
            .all(|other| index.abs_diff(*other) > 3 * reach)
        {
            chosen.push(index);
        }
    }
    // The best window may hold the peak at its rim: move to the mean of what it holds until that stands still.
    let settle = |index: usize| {
        let start = lowest + (index as f64 + 0.5) * BIN_M;
        (0..8).fold(start, |centre, _| {
            let from = heights.partition_point(|height| *height < centre - band_m);
            let to = heights.partition_point(|height| *height <= centre + band_m);
            let near = &heights[from..to];
            near.iter().sum::<f64>() / near.len().max(1) as f64
        })
    };
    chosen.into_iter().map(settle).collect()
}
