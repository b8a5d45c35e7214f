//! The lift of image-plane decoding to voxels (method 3.4).

use burn::module::Module;
use burn::nn::{Initializer, Linear, LinearConfig};
use burn::tensor::activation::silu;
use burn::tensor::{Device, Tensor};

/// Second layer of MLP_D: `token = base + W silu(hidden) + b`. Its first layer is made on the planes, where it costs a
/// pixel and not a pair: sampling and a linear layer may change places. Starts as zero, so that the token starts as
/// plain back-projection.
#[derive(Module, Debug)]
pub struct Lift {
    pub(super) linear: Linear,
}

impl Lift {
    /// For planes of `channels` channels.
    pub fn new(channels: usize, device: &Device) -> Self {
        let config = LinearConfig::new(channels, channels).with_initializer(Initializer::Zeros);
        Self {
            linear: config.init(device),
        }
    }

    /// Tokens `[P, C]` from what was sampled of the base and of the hidden planes, `[P, C]` each.
    pub fn forward(&self, base: Tensor<2>, hidden: Tensor<2>) -> Tensor<2> {
        base + self.linear.forward(silu(hidden))
    }
}
