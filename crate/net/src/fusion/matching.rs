//! How alike the views' features are at a voxel: the switch `matching`.

use burn::tensor::Tensor;

use crate::ops::cube;
use crate::ops::pool::{Pooling, pool};
use crate::ops::segments::Segments;
use crate::ops::views::fused;

/// Groups of channels that are compared apart.
pub const GROUPS: usize = 8;

/// Below this length a group of features has no direction.
const SHORT: f32 = 1e-3;

/// Per pair and group the cosine between the view's features and the mean of the other views' at the voxel, `[P, 8]`;
/// 0 where no other view sees it. A voxel on a surface looks alike from everywhere, so all of its pairs are near 1;
/// a view that something hides it from stands apart from the others. (Group-wise correlation as in Guo et al. 2019,
/// normalised, and against the mean as plane sweeps of many views do, so that its cost is linear in the views.)
/// `features` is `[P, C]`; 8 divides `C`.
pub fn likeness(features: Tensor<2>, segments: &Segments) -> Tensor<2> {
    let [pairs, channels] = features.dims();
    let device = features.device();
    if cube::runs_on(&device) {
        let nothing = Tensor::zeros([pairs], &device);
        let mean = pool(features.clone(), nothing, segments, Pooling::Mean);
        return fused::likeness(features, mean, segments, GROUPS, SHORT);
    }
    let ones = Tensor::<2>::ones([pairs, 1], &device);
    let lengths = segments.lengths();
    let count = lengths.select(0, segments.of_row.clone()).unsqueeze_dim(1);
    let mean = pool(
        features.clone(),
        Tensor::zeros([pairs], &device),
        segments,
        Pooling::Mean,
    );
    let sum = mean.select(0, segments.of_row.clone()) * count.clone();
    let others = (sum - features.clone()) / (count.clone() - ones.clone()).clamp_min(1.0);
    // What is left of a sum of one is rounding, whose direction means nothing.
    let others = others * (count - ones).clamp_max(1.0);
    let grouped = |t: Tensor<2>| t.reshape([pairs * GROUPS, channels / GROUPS]);
    let [a, b] = [grouped(features), grouped(others)];
    let dot = (a.clone() * b.clone()).sum_dim(1);
    let lengths =
        (a.powi_scalar(2).sum_dim(1) * b.powi_scalar(2).sum_dim(1) + SHORT.powi(4)).sqrt();
    (dot / lengths).reshape([pairs, GROUPS])
}
