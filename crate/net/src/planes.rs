//! Pictures to feature planes: everything that is computed once a frame.
//!
//! `images -> backbone -> pyramid -> ray directions -> F`, then per level, each part only where it is switched on
//! (method 3.5): confidence encoding `R` ([`confidence`]), affine compensation `AP` ([`affine`]), spatial decoding `S` and
//! the plane half of its lift to voxels `Q` ([`decoding`]).

pub mod affine;
pub mod backbone;
pub mod confidence;
pub mod decoding;
mod layer;
pub mod pyramid;
pub mod rays;
pub mod scan;

use burn::module::{Module, Param};
use burn::nn::conv::Conv2d;
use burn::tensor::{Device, Tensor};

use crate::ops::batch_norm::scaled;
use crate::{Level, NetConfig, View};
use affine::AffineCompensation;
use backbone::Backbone;
use confidence::ConfidenceEncoding;
use decoding::SpatialDecoding;
use pyramid::Pyramid;
use rays::RayEncoding;

/// Mean of ScanNet's pictures, red, green, blue (method 1.1).
pub const MEAN: [f32; 3] = [127.71, 114.66, 99.32];
/// Standard deviation of ScanNet's pictures, red, green, blue (method 1.1).
pub const DEVIATION: [f32; 3] = [75.31, 73.53, 71.66];
/// The shortest side of a picture, in pixels: two pixels of the coarse plane.
pub const SMALLEST_SIDE: usize = 32;

/// Why pictures cannot be given to the network.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanesError {
    /// A side is shorter than two pixels of the coarse plane.
    #[error(
        "pictures of {width} x {height} pixels are too small: the network needs {SMALLEST_SIDE} in both directions; give \
         larger pictures, 640 x 480 is what it is made for"
    )]
    TooSmall {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
}

/// Whether the network takes pictures of this size: any from [`SMALLEST_SIDE`] up.
pub fn check_size(width: usize, height: usize) -> Result<(), PlanesError> {
    if width.min(height) < SMALLEST_SIDE {
        return Err(PlanesError::TooSmall { width, height });
    }
    Ok(())
}

/// Columns and rows of a level's plane: the picture's over the stride, rounded up. Plane pixel `i` lies at picture pixel
/// `i * stride` (method 1.2).
pub fn plane_size(width: usize, height: usize, level: Level) -> [usize; 2] {
    [width, height].map(|side| side.div_ceil(level.stride()))
}

/// What the views' pictures say at one level.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Features `[V, C, h, w]` that voxels sample.
    pub base: Tensor<4>,
    /// `Q = W_s S + W_f F + b` of method 3.4, `[V, C, h, w]`; with spatial decoding only. A voxel's token is
    /// `sample(base) + W_2 SiLU(sample(hidden))`.
    pub hidden: Option<Tensor<4>>,
    /// How likely each pixel's feature is of use, in (0, 1), `[V, 1, h, w]`; with confidence encoding only.
    pub confidence: Option<Tensor<4>>,
}

/// Pictures to planes at the three levels.
#[derive(Module, Debug)]
pub struct PlaneNet {
    /// MnasNet to stride 16.
    pub backbone: Backbone,
    /// The feature pyramid.
    pub pyramid: Pyramid,
    /// What follows at each level, coarse to fine.
    pub levels: [LevelPlanes; 3],
}

/// The parts of one level.
#[derive(Module, Debug)]
pub struct LevelPlanes {
    /// Viewing directions mixed into the features.
    pub rays: RayEncoding,
    /// Method 3.1.
    pub pce: Option<ConfidenceEncoding>,
    /// Method 3.2.
    pub acm: Option<AffineCompensation>,
    /// Method 3.3 and the plane half of 3.4.
    pub ipsd: Option<SpatialDecoding>,
    /// With affine compensation but without decoding: `[R, AP]` back to `C` channels (method 3.5). Starts as `R`.
    pub merge: Option<Conv2d>,
}

impl PlaneNet {
    /// Fresh weights, all parts at their identity (method 3.8). Random numbers come from `device`.
    pub fn init(config: &NetConfig, device: &Device) -> Self {
        Self {
            backbone: Backbone::init(config.backbone, device),
            pyramid: Pyramid::init(config, device),
            levels: Level::ALL
                .map(|level| LevelPlanes::init(config, config.planes[level as usize], device)),
        }
    }

    /// Planes of `images` `[V, 3, H, W]`, sRGB from 0 to 255, seen by `views`, as many; [`check_size`] says which sizes
    /// there are. Planes are `ceil(H / stride)` by `ceil(W / stride)`.
    pub fn forward(&self, images: Tensor<4>, views: &[View]) -> [Plane; 3] {
        let [coarse, medium, fine] = self.features(images);
        let [c, m, f] = &self.levels;
        [
            c.forward(coarse, views, Level::Coarse),
            m.forward(medium, views, Level::Medium),
            f.forward(fine, views, Level::Fine),
        ]
    }

    /// What the pyramid makes of `images`, coarse to fine: `[V, C, h, w]` each.
    pub fn features(&self, images: Tensor<4>) -> [Tensor<4>; 3] {
        self.pyramid
            .forward(self.backbone.forward(normalised(images)))
    }
}

/// Pictures with ScanNet's mean at 0 and its standard deviation at 1.
fn normalised(images: Tensor<4>) -> Tensor<4> {
    let device = images.device();
    let of_channels = |values: [f32; 3]| Tensor::<1>::from_floats(values, &device);
    let scale = of_channels(DEVIATION.map(|d| 1.0 / d));
    let shift = of_channels([0, 1, 2].map(|c| -MEAN[c] / DEVIATION[c]));
    scaled(images, scale, shift, false)
}

impl LevelPlanes {
    fn init(config: &NetConfig, channels: usize, device: &Device) -> Self {
        let compensated = if config.acm { 2 * channels } else { channels };
        Self {
            rays: RayEncoding::init(channels, device),
            pce: config
                .pce
                .then(|| ConfidenceEncoding::init(channels, device)),
            acm: config
                .acm
                .then(|| AffineCompensation::init(channels, device)),
            ipsd: config
                .ipsd
                .then(|| SpatialDecoding::init(compensated, channels, device)),
            merge: (config.acm && !config.ipsd).then(|| first_half(channels, device)),
        }
    }

    /// The plane of a level from the pyramid's features `[V, C, h, w]`.
    pub fn forward(&self, features: Tensor<4>, views: &[View], level: Level) -> Plane {
        let features = self.rays.forward(features, views, level);
        let (encoded, confidence) = match &self.pce {
            Some(pce) => {
                let (encoded, confidence) = pce.forward(features.clone());
                (encoded, Some(confidence))
            }
            None => (features.clone(), None),
        };
        let compensated = match &self.acm {
            Some(acm) => Tensor::cat(vec![encoded.clone(), acm.forward(encoded)], 1),
            None => encoded,
        };
        let (base, hidden) = match (&self.ipsd, &self.merge) {
            (Some(ipsd), _) => {
                let hidden = ipsd.forward(compensated, features.clone());
                (features, Some(hidden))
            }
            (None, Some(merge)) => (layer::convolved(merge, compensated), None),
            (None, None) => (compensated, None),
        };
        Plane {
            base,
            hidden,
            confidence,
        }
    }
}

/// A 1x1 convolution from `2 * channels` to `channels` that passes the first half on.
fn first_half(channels: usize, device: &Device) -> Conv2d {
    let mut conv = layer::pointwise(2 * channels, channels).init(device);
    let identity = Tensor::<2>::eye(channels, device);
    let nothing = Tensor::zeros([channels, channels], device);
    let weight = Tensor::cat(vec![identity, nothing], 1).reshape([channels, 2 * channels, 1, 1]);
    conv.weight = Param::from_tensor(weight);
    conv.bias = Some(Param::from_tensor(Tensor::zeros([channels], device)));
    conv
}
