//! What fine voxels rest on: the views that have them in their picture, and the mean of the network's own confidence there.

use super::levels::read;
use burn::Tensor;
use net::fusion::{PairTensors, Pairs, Pooling};
use net::ops::{pool::pool, rows::sample};
use net::planes::Plane;
use volume::{Evidence, VolumeError};

/// Of some voxels, in their order.
pub struct Seen {
    /// How many of the tile's views have each voxel in their picture.
    pub views: Vec<u8>,
    /// The mean over these views of the confidence at the voxel's place in the picture (method 3.1), `[N]`; for networks that have
    /// one.
    pub confidence: Option<Tensor<1>>,
}

impl Seen {
    /// From a plane and the voxels' pairs with its views.
    pub(super) fn new(plane: &Plane, pairs: &Pairs, tensors: &PairTensors) -> Self {
        let counts = pairs.offsets.windows(2).map(|ends| ends[1] - ends[0]);
        let mean = |confidence: &Tensor<4>| {
            let sampled = sample(confidence.clone(), &tensors.places);
            let unused = sampled.clone().flatten::<1>(0, 1);
            pool(sampled, unused, &tensors.segments, Pooling::Mean).flatten::<1>(0, 1)
        };
        Self {
            views: counts.map(|count| count.min(255) as u8).collect(),
            confidence: plane.confidence.as_ref().map(mean),
        }
    }
}

/// Reads the confidence of all blocks at once, and joins it with their views.
pub(super) async fn joined(blocks: Vec<Seen>) -> Result<Vec<Evidence>, VolumeError> {
    let mut views = Vec::new();
    let mut confidence = Vec::new();
    for block in blocks {
        views.extend(block.views);
        confidence.extend(block.confidence);
    }
    let confidence = match confidence.is_empty() {
        true => Vec::new(),
        false => read(Tensor::cat(confidence, 0)).await?,
    };
    let of = |(site, &views): (usize, &u8)| {
        let sure = confidence.get(site).filter(|_| views > 0);
        Evidence::new(usize::from(views), sure.copied())
    };
    Ok(views.iter().enumerate().map(of).collect())
}
