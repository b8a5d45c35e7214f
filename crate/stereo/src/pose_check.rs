//! Is a frame where its pose says? If so, its picture agrees with its neighbours' where their depth says it should.

use crate::{
    depth::Raw,
    view::{View, warp},
};

/// A neighbour's depth is believed where its own match was this good and this unique.
const BELIEVED_ZNCC: f32 = 0.6;
const BELIEVED_UNIQUE: f32 = 0.1;
/// Every n-th pixel across and down is asked.
const STRIDE: usize = 3;
/// Windows compared are `2 RADIUS + 1` pixels wide.
const RADIUS: i32 = 3;
/// Variance of a camera's noise in squared grey levels; flat windows say nothing and count as no match.
const NOISE_VAR: f32 = 4.0;
/// A window whose grey varies less than this (squared levels) is not asked at all.
const LEAST_VARIANCE: f32 = 40.0;
/// With fewer answers than this there is no verdict.
const LEAST_ANSWERS: usize = 150;

/// The median correlation of `view` with its neighbours at their believed points; `None` where too few are seen.
pub(crate) fn correlation(view: &View, neighbours: &[(&View, &Raw)]) -> Option<f32> {
    let mut answers: Vec<f32> = Vec::new();
    for (neighbour, raw) in neighbours {
        ask(view, neighbour, raw, &mut answers);
    }
    if answers.len() < LEAST_ANSWERS {
        return None;
    }
    let middle = answers.len() / 2;
    let (_, median, _) = answers.select_nth_unstable_by(middle, f32::total_cmp);
    Some(*median)
}

fn ask(view: &View, neighbour: &View, raw: &Raw, answers: &mut Vec<f32>) {
    let to_view = warp(neighbour, view);
    let (width, height) = neighbour.size();
    let radius = RADIUS as usize;
    for y in (radius..height.saturating_sub(radius)).step_by(STRIDE) {
        for x in (radius..width.saturating_sub(radius)).step_by(STRIDE) {
            let at = y * width + x;
            if raw.zncc[at] < BELIEVED_ZNCC || raw.unique[at] < BELIEVED_UNIQUE {
                continue;
            }
            let window =
                (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy)));
            let pairs = window.map(|(dx, dy)| {
                let (x, y) = (x as i32 + dx, y as i32 + dy);
                let own = neighbour.gray[y as usize * width + x as usize];
                let (u, v, _) = to_view.apply(x as f32, y as f32, raw.rho[at])?;
                Some((own, sample(view, u, v)?))
            });
            // All of the window must be seen.
            if let Some(pairs) = pairs.collect::<Option<Vec<_>>>()
                && let Some(zncc) = zncc(&pairs)
            {
                answers.push(zncc);
            }
        }
    }
}

/// Bilinear; `None` outside the picture.
fn sample(view: &View, u: f32, v: f32) -> Option<f32> {
    let (width, height) = view.size();
    let inside = u >= 0.0 && v >= 0.0 && u < width as f32 - 1.0 && v < height as f32 - 1.0;
    inside.then(|| {
        let (column, row) = (u as usize, v as usize);
        let (fu, fv) = (u - column as f32, v - row as f32);
        let at = row * width + column;
        let across = |at: usize| view.gray[at] + (view.gray[at + 1] - view.gray[at]) * fu;
        across(at) + (across(at + width) - across(at)) * fv
    })
}

/// Zero-mean normalised cross-correlation of pairs; `None` where the first of them hardly vary.
fn zncc(pairs: &[(f32, f32)]) -> Option<f32> {
    let count = pairs.len() as f32;
    let (a, b) = pairs
        .iter()
        .fold((0.0, 0.0), |(a, b), p| (a + p.0, b + p.1));
    let (mean_a, mean_b) = (a / count, b / count);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        let (a, b) = (a - mean_a, b - mean_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    let noise = NOISE_VAR * count;
    (aa > LEAST_VARIANCE * count).then(|| ab / ((aa + noise) * (bb + noise)).sqrt())
}
