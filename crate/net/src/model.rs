//! The whole network: planes once a frame, then at each level fusion and decoding. The order of work, tiles and blocks
//! are the caller's.

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor};
use glam::IVec3;

use crate::decode::{Decoder, DecoderConfig, UNetMaps};
use crate::fusion::{Fused, Fusion, FusionConfig, PairTensors, Pooling};
use crate::planes::{Plane, PlaneNet};
use crate::{Level, NetConfig, View};

/// Channels of the guide: signed distance and weight (see [`crate::guide`]).
pub const GUIDE_CHANNELS: usize = 2;
/// Network output times this is the truncated signed distance before it is cut to -1..1 (method 1.4).
pub const TSDF_SCALE: f32 = 1.05;

/// IPDRecon (or, with its switches off, VoRTX).
#[derive(Module, Debug)]
pub struct Ipdrecon {
    planes: PlaneNet,
    fusion: Vec<Fusion>,
    decoders: Vec<Decoder>,
    #[module(skip)]
    config: NetConfig,
}

/// What a level's 3D network says.
#[derive(Debug)]
pub struct Decoded {
    /// Features `[N, 3 * unet]`, for the level below.
    pub features: Tensor<2>,
    /// Coarse and medium: occupied where above 0. Fine: `TSDF_SCALE * tanh` of it is the signed distance over the
    /// truncation distance, positive in free space. `[N]`.
    pub logit: Tensor<1>,
}

impl Ipdrecon {
    /// The network with fresh weights.
    pub fn new(config: &NetConfig, device: &Device) -> Self {
        let level = |level: Level| {
            let decoder = DecoderConfig {
                inputs: inputs(config, level),
                base: config.unet[level as usize],
            };
            (
                FusionConfig::new(config, level).init(device),
                decoder.init(device),
            )
        };
        let (fusion, decoders) = Level::ALL.map(level).into_iter().unzip();
        Self {
            planes: PlaneNet::init(config, device),
            fusion,
            decoders,
            config: *config,
        }
    }

    /// What it is made of.
    pub fn config(&self) -> &NetConfig {
        &self.config
    }

    /// Planes of each level from pictures `[V, 3, H, W]` (sRGB, 0 to 255, H and W multiples of 16) and their cameras.
    pub fn planes(&self, images: Tensor<4>, views: &[View]) -> [Plane; 3] {
        self.planes.forward(images, views)
    }

    /// The first part of [`Ipdrecon::planes`], which knows no camera: backbone and pyramid, coarse to fine. For comparisons with other
    /// programs that run the same layers.
    pub fn pyramid(&self, images: Tensor<4>) -> [Tensor<4>; 3] {
        self.planes.features(images)
    }

    /// Fused features `[N, C]` of a level's voxels, and each pair's projective occupancy.
    pub fn fuse(
        &self,
        level: Level,
        plane: &Plane,
        pairs: &PairTensors,
        pooling: Pooling,
    ) -> Fused {
        self.fusion[level as usize].forward(plane, pairs, pooling)
    }

    /// The 3D network over all sites of a scene at once. `features` is what [`Ipdrecon::input`] gives.
    pub fn decode(&self, level: Level, features: Tensor<2>, sites: &[IVec3]) -> Decoded {
        let maps = UNetMaps::new(sites, &features.device());
        let (features, logit) = self.decoders[level as usize].forward(features, &maps);
        Decoded { features, logit }
    }

    /// What a level's 3D network is given, `[N, inputs]`: features and logit of the parent, where there is one, around the
    /// fused features, and the guide where the network wants one. `parent` holds each site's row in the level above.
    pub fn input(
        &self,
        fused: Tensor<2>,
        above: Option<(&Decoded, Tensor<1, Int>)>,
        guide: Option<Tensor<2>>,
    ) -> Tensor<2> {
        let mut parts = Vec::with_capacity(4);
        match above {
            None => parts.push(fused),
            Some((decoded, parent)) => {
                parts.push(decoded.features.clone().select(0, parent.clone()));
                parts.push(fused);
                parts.push(decoded.logit.clone().select(0, parent).unsqueeze_dim(1));
            }
        }
        if self.config.guide {
            let [sites, _] = parts[0].dims();
            let device = parts[0].device();
            parts.push(guide.unwrap_or_else(|| Tensor::zeros([sites, GUIDE_CHANNELS], &device)));
        }
        Tensor::cat(parts, 1)
    }
}

/// Channels that a level's 3D network is given (method 1.7).
pub(crate) fn inputs(config: &NetConfig, level: Level) -> usize {
    let fused = config.planes[level as usize];
    let above = match level {
        Level::Coarse => 0,
        _ => 3 * config.unet[level as usize - 1] + 1,
    };
    fused + above + if config.guide { GUIDE_CHANNELS } else { 0 }
}
