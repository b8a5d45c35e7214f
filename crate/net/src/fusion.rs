//! Planes to voxels: what each view says of a voxel, and what they say together.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use crate::ops::cube;
use crate::ops::linear::{normed_rows, of_rows};
use crate::ops::pool::pool;
use crate::ops::rows::sample;
use crate::ops::views::{self, ViewsShape, view_tokens};
use crate::planes::Plane;
use crate::{Level, NetConfig};

mod encoder;
mod lift;
mod matching;
mod pairs;

pub use crate::ops::pool::Pooling;
use encoder::flat;
pub use encoder::{EncoderLayer, HEADS};
pub use lift::Lift;
pub use matching::{GROUPS, likeness};
pub use pairs::{PairTensors, Pairs};

/// Depth in metres that becomes 0, and the step that becomes 1 (method 1.5).
const DEPTH_MEAN_M: f32 = 1.85;
const DEPTH_STEP_M: f32 = 0.85;
/// Layers of the encoder.
pub const LAYERS: usize = 2;

/// What the fusion of a level is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FusionConfig {
    /// Channels of the planes and of the fused features.
    pub channels: usize,
    /// With the lift of image-plane decoding.
    pub lift: bool,
    /// With the views' likeness.
    pub matching: bool,
}

impl FusionConfig {
    /// Of a level of the network.
    pub fn new(config: &NetConfig, level: Level) -> Self {
        Self {
            channels: config.planes[level as usize],
            lift: config.ipsd,
            matching: config.matching,
        }
    }

    /// With fresh weights.
    pub fn init(&self, device: &Device) -> Fusion {
        let channels = self.channels;
        let extra = 1 + if self.matching { GROUPS } else { 0 };
        Fusion {
            lift: self.lift.then(|| Lift::new(channels, device)),
            embed: LinearConfig::new(channels + extra, channels).init(device),
            layers: (0..LAYERS)
                .map(|_| EncoderLayer::new(channels, device))
                .collect(),
            occupancy: LinearConfig::new(channels, 1).init(device),
            norm: LayerNormConfig::new(channels).init(device),
            matching: self.matching,
        }
    }
}

/// The fusion of a level's views (method 1.5, 1.6, 3.4).
#[derive(Module, Debug)]
pub struct Fusion {
    lift: Option<Lift>,
    embed: Linear,
    layers: Vec<EncoderLayer>,
    occupancy: Linear,
    norm: LayerNorm,
    matching: bool,
}

/// What the views say of the voxels together.
#[derive(Clone, Debug)]
pub struct Fused {
    /// Features of the voxels, `[N, C]`.
    pub features: Tensor<2>,
    /// Logit of each pair that a surface of the view is near the voxel, `[P]`.
    pub occupancy: Tensor<1>,
}

impl Fusion {
    /// Fuses a level's planes at the voxels of `pairs`. A voxel that nobody sees has the features of none. Tables of pairs
    /// are `[P, 2C]` at the widest: the caller hands the voxels in blocks that fit the device.
    pub fn forward(&self, plane: &Plane, pairs: &PairTensors, pooling: Pooling) -> Fused {
        let segments = &pairs.segments;
        let [_, channels, _, _] = plane.base.dims();
        if segments.rows == 0 {
            let device = plane.base.device();
            let nothing = Tensor::zeros([segments.count, channels], &device);
            return Fused {
                features: self.norm.forward(nothing),
                occupancy: Tensor::zeros([0], &device),
            };
        }
        let depth = ((pairs.z_m.clone() - DEPTH_MEAN_M) / DEPTH_STEP_M).unsqueeze_dim(1);
        let tokens = if views::runs_on(&plane.base) {
            self.tokens_in_blocks(plane, pairs, depth)
        } else if cube::NO_OTHER || cube::runs_on(&plane.base.device()) {
            self.tokens_by_kernels(plane, pairs, depth)
        } else {
            self.tokens(plane, pairs, depth)
        };
        let occupancy = of_rows(&self.occupancy, tokens.clone()).flatten::<1>(0, 1);
        let pooled = pool(tokens, occupancy.clone(), segments, pooling);
        Fused {
            features: normed_rows(&self.norm, pooled),
            occupancy,
        }
    }

    /// Tokens `[P, C]` of the pairs in tensor operations, on any device; `depth` is `[P, 1]`.
    pub fn tokens(&self, plane: &Plane, pairs: &PairTensors, depth: Tensor<2>) -> Tensor<2> {
        let base = sample(plane.base.clone(), &pairs.places);
        let mut inputs = Vec::with_capacity(3);
        let alike = self
            .matching
            .then(|| likeness(base.clone(), &pairs.segments));
        inputs.push(match (&self.lift, &plane.hidden) {
            (Some(lift), Some(hidden)) => lift.forward(base, sample(hidden.clone(), &pairs.places)),
            _ => base,
        });
        inputs.push(depth);
        inputs.extend(alike);
        let mut tokens = self.embed.forward(Tensor::cat(inputs, 1));
        for layer in &self.layers {
            tokens = layer.forward(tokens, &pairs.segments);
        }
        tokens
    }

    /// The same in kernels for WebGPU.
    fn tokens_by_kernels(&self, plane: &Plane, pairs: &PairTensors, depth: Tensor<2>) -> Tensor<2> {
        let base = sample(plane.base.clone(), &pairs.places);
        let extra = match self.matching {
            true => Tensor::cat(vec![depth, likeness(base.clone(), &pairs.segments)], 1),
            false => depth,
        };
        let lifted = self.lift.as_ref().zip(plane.hidden.as_ref());
        let hidden = lifted.map(|(_, hidden)| sample(hidden.clone(), &pairs.places));
        let shape = self.shape(plane, &extra);
        views::fused::tokens(
            base,
            hidden,
            extra,
            self.weights(plane),
            &pairs.segments,
            shape,
        )
    }

    /// All weights that make tokens, in the order of [`view_tokens`].
    fn weights(&self, plane: &Plane) -> Vec<Tensor<1>> {
        let lifted = self.lift.as_ref().filter(|_| plane.hidden.is_some());
        let first = lifted.map(|lift| flat(&lift.linear)).into_iter();
        let first = first.chain([flat(&self.embed)]).flatten().flatten();
        first
            .chain(self.layers.iter().flat_map(EncoderLayer::weights))
            .collect()
    }

    /// Widths, with `extra` numbers a pair `[P, E]`.
    fn shape(&self, plane: &Plane, extra: &Tensor<2>) -> ViewsShape {
        ViewsShape {
            channels: plane.base.dims()[1],
            extra: extra.dims()[1],
            lift: self.lift.is_some() && plane.hidden.is_some(),
            layers: self.layers.len(),
            heads: HEADS,
        }
    }

    /// The same in loops for the processor.
    fn tokens_in_blocks(&self, plane: &Plane, pairs: &PairTensors, depth: Tensor<2>) -> Tensor<2> {
        let extra = if self.matching {
            let base = sample(plane.base.clone(), &pairs.places);
            Tensor::cat(vec![depth, likeness(base, &pairs.segments)], 1)
        } else {
            depth
        };
        let lifted = self.lift.as_ref().zip(plane.hidden.as_ref());
        let shape = self.shape(plane, &extra);
        view_tokens(
            plane.base.clone(),
            lifted.map(|(_, hidden)| hidden.clone()),
            extra,
            Tensor::cat(self.weights(plane), 0),
            (&pairs.places, &pairs.segments),
            shape,
        )
    }
}
