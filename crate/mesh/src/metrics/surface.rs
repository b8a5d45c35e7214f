//! 3D metrics: how far two surfaces, given as points, lie from each other.

use crate::nearest::PointIndex;
use glam::Vec3;
use serde::Serialize;

/// Figures of one scene, after Table 2 of the paper. Distances in metres, shares from 0 to 1.
///
/// With nothing predicted nothing is wrong and nothing is found: precision 1, recall 0, F-score 0, distances at the
/// clip (TransformerFusion's rule for a missing scene), NaN where distances are not clipped. The same the other way
/// round when there is no ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Surface3d {
    /// Mean distance from a predicted point to the ground truth ("Acc").
    pub accuracy_m: f64,
    /// Mean distance from a ground-truth point to the prediction ("Comp").
    pub completeness_m: f64,
    /// Mean of accuracy and completeness.
    pub chamfer_m: f64,
    /// Share of predicted points within the threshold of the ground truth.
    pub precision: f64,
    /// Share of ground-truth points within the threshold of the prediction.
    pub recall: f64,
    /// Harmonic mean of precision and recall.
    pub f_score: f64,
    /// The threshold in metres.
    pub threshold_m: f32,
    /// Predicted points that were compared.
    pub predicted_points: usize,
    /// Ground-truth points that were compared.
    pub ground_truth_points: usize,
}

/// Compares two point sets both ways: nearest-neighbour distances, cut at `clip_m` where given, and shares of them up
/// to and including `threshold_m` (the paper's 0.05).
pub fn compare_points(
    pred: &[Vec3],
    gt: &[Vec3],
    threshold_m: f32,
    clip_m: Option<f32>,
) -> Surface3d {
    let forth = Distances::new(pred, &PointIndex::new(gt), threshold_m, clip_m);
    let back = Distances::new(gt, &PointIndex::new(pred), threshold_m, clip_m);
    Surface3d::new(&forth, &back, threshold_m)
}

/// What one direction of a comparison comes to.
pub(crate) struct Distances {
    points: usize,
    mean_m: f64,
    share_within: f64,
}

impl Distances {
    /// From each of `points` to the nearest in `to`.
    pub(crate) fn new(
        points: &[Vec3],
        to: &PointIndex,
        threshold_m: f32,
        clip_m: Option<f32>,
    ) -> Self {
        let distances = to.distances(points);
        let clip = clip_m.unwrap_or(f32::INFINITY);
        let sum: f64 = distances.iter().map(|&d| f64::from(d.min(clip))).sum();
        let within = distances.iter().filter(|&&d| d <= threshold_m).count();
        let count = points.len() as f64;
        let (mean_m, share_within) = match points.is_empty() {
            true => (clip_m.map_or(f64::NAN, f64::from), 1.0),
            false if sum.is_infinite() => (f64::NAN, 0.0),
            false => (sum / count, within as f64 / count),
        };
        Self {
            points: points.len(),
            mean_m,
            share_within,
        }
    }
}

impl Surface3d {
    /// From prediction to ground truth, and back.
    pub(crate) fn new(forth: &Distances, back: &Distances, threshold_m: f32) -> Self {
        let (precision, recall) = (forth.share_within, back.share_within);
        let nothing = forth.points == 0 || back.points == 0 || precision + recall == 0.0;
        Self {
            accuracy_m: forth.mean_m,
            completeness_m: back.mean_m,
            chamfer_m: (forth.mean_m + back.mean_m) / 2.0,
            precision,
            recall,
            f_score: match nothing {
                true => 0.0,
                false => 2.0 * precision * recall / (precision + recall),
            },
            threshold_m,
            predicted_points: forth.points,
            ground_truth_points: back.points,
        }
    }
}
