//! Voxels to surface: the sparse 3D network of a level.

pub mod maps;
pub mod sites;
pub mod unet;

pub use maps::UNetMaps;
pub use sites::{children, halved};
pub use unet::UNet;

use crate::ops::linear::of_rows;
use burn::{
    Tensor,
    module::Module,
    nn::{Linear, LinearConfig},
    tensor::Device,
};

/// Widths of a [`Decoder`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DecoderConfig {
    /// Channels given at each site.
    pub inputs: usize,
    /// Base width b of the U-Net; features come out with 3b channels.
    pub base: usize,
}

/// A level's sparse U-Net and its head (method 1.7).
#[derive(Module, Debug)]
pub struct Decoder {
    /// The U-Net.
    pub unet: UNet,
    /// One logit a site.
    pub head: Linear,
}

impl DecoderConfig {
    /// With fresh weights.
    pub fn init(&self, device: &Device) -> Decoder {
        Decoder {
            unet: UNet::new(self.inputs, self.base, device),
            head: LinearConfig::new(3 * self.base, 1).init(device),
        }
    }
}

impl Decoder {
    /// Rows `[N, inputs]` to features `[N, 3 * base]` and logits `[N]`: of being occupied at the coarse and the medium
    /// level, and of the signed distance at the fine one. No sites give no rows.
    pub fn forward(&self, features: Tensor<2>, maps: &UNetMaps) -> (Tensor<2>, Tensor<1>) {
        let features = self.unet.forward(features, maps);
        if maps.is_empty() {
            let device = features.device();
            return (features, Tensor::zeros([0], &device));
        }
        let logit = of_rows(&self.head, features.clone()).squeeze_dim(1);
        (features, logit)
    }
}
