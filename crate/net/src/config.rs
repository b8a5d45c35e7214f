//! What the network is made of: its widths and its switches. Stored inside the weights.

use serde::{Deserialize, Serialize};

/// A level of the coarse-to-fine pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Level {
    /// 16 cm voxels, planes at a sixteenth of the picture.
    Coarse,
    /// 8 cm voxels, planes at an eighth.
    Medium,
    /// 4 cm voxels, planes at a quarter.
    Fine,
}

impl Level {
    /// From coarse to fine.
    pub const ALL: [Self; 3] = [Self::Coarse, Self::Medium, Self::Fine];

    /// Edge of a voxel in metres.
    pub const fn voxel_size_m(self) -> f32 {
        [0.16, 0.08, 0.04][self as usize]
    }

    /// Pixels of the picture between two pixels of the plane.
    pub fn stride(self) -> usize {
        [16, 8, 4][self as usize]
    }
}

/// Widths and switches. Arrays go from coarse to fine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetConfig {
    /// Channels of the backbone: the stem before and after its projection, then at strides 4, 8 and 16.
    pub backbone: [usize; 5],
    /// Channels inside the pyramid.
    pub pyramid: usize,
    /// Channels of the feature planes and of the fused features.
    pub planes: [usize; 3],
    /// Base width of each level's 3D U-Net.
    pub unet: [usize; 3],
    /// Pixel-level confidence encoding (method 3.1).
    pub pce: bool,
    /// Affine compensation (method 3.2).
    pub acm: bool,
    /// Image-plane spatial decoding and its lift to voxels (method 3.3, 3.4).
    pub ipsd: bool,
    /// How alike the views' features are at a voxel, given to fusion.
    pub matching: bool,
    /// Stereo depth with its confidence, as a TSDF given to the 3D network.
    pub guide: bool,
}

/// A configuration that no network can have.
#[derive(Debug, thiserror::Error)]
#[error(
    "expected {expected} in the network's configuration, found {found}; start from `small` or `full`"
)]
pub struct ConfigError {
    expected: &'static str,
    found: String,
}

impl NetConfig {
    /// Says whether such a network can be made.
    ///
    /// # Errors
    /// Widths that do not fit each other.
    pub fn check(&self) -> Result<(), ConfigError> {
        let fault = |expected, found: String| Err(ConfigError { expected, found });
        let widths = self.backbone.iter().chain(&self.planes).chain(&self.unet);
        if widths
            .chain([&self.pyramid])
            .any(|&width| width == 0 || width > 1024)
        {
            return fault("widths of 1 to 1024 channels", format!("{self:?}"));
        }
        // The pyramid's top is the backbone's last stage, as it is.
        if self.pyramid != self.backbone[4] {
            let found = format!("{} and {}", self.pyramid, self.backbone[4]);
            return fault("as many channels in the pyramid as at stride 16", found);
        }
        // Two heads of attention; eight groups of channels for `matching`.
        let step = if self.matching { 8 } else { 2 };
        if self.planes.iter().any(|width| width % step != 0) {
            let found = format!("{:?}", self.planes);
            return fault(
                "plane widths that are multiples of 2, with `matching` of 8,",
                found,
            );
        }
        Ok(())
    }

    /// The paper's size with all of the paper's parts: 6.57 million parameters.
    pub fn full() -> Self {
        Self {
            backbone: [32, 16, 24, 40, 80],
            pyramid: 80,
            planes: [80, 40, 24],
            unet: [32, 16, 8],
            pce: true,
            acm: true,
            ipsd: true,
            matching: false,
            guide: false,
        }
    }

    /// About half of every width: for training on a processor, and for phones.
    pub fn small() -> Self {
        Self {
            backbone: [16, 8, 16, 24, 40],
            pyramid: 40,
            planes: [40, 24, 16],
            unet: [16, 12, 8],
            ..Self::full()
        }
    }

    /// Bytes of a voxel in the widest tensor of a level's 3D network: what it is given, or its last layers' halves side by
    /// side (method 1.7).
    pub fn row_bytes(&self, level: Level) -> usize {
        let channels = crate::model::inputs(self, level).max(6 * self.unet[level as usize]);
        channels * size_of::<f32>()
    }

    /// The same widths with none of the paper's parts: VoRTX.
    pub fn baseline(self) -> Self {
        Self {
            pce: false,
            acm: false,
            ipsd: false,
            ..self
        }
    }
}
