//! The feature pyramid (method 1.2): top down, pre-activation blocks.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{BatchNorm, BatchNormConfig};
use burn::tensor::{Device, Tensor};

use super::layer::{centred, convolved, kaiming};
use crate::NetConfig;
use crate::ops::batch_norm::batch_norm;
use crate::ops::upsample::upsample2;

/// Features at strides 16, 8, 4 to planes of `config.planes` channels.
#[derive(Module, Debug)]
pub struct Pyramid {
    /// From the backbone at strides 8 and 4 to the pyramid's channels.
    lateral: [NormConv; 2],
    /// From the pyramid's channels to the planes', coarse to fine.
    out: [NormConv; 3],
}

impl Pyramid {
    /// Takes the widths of backbone, pyramid and planes from `config`. The pyramid's channels are the backbone's at stride
    /// 16.
    pub fn init(config: &NetConfig, device: &Device) -> Self {
        let [_, _, quarter, eighth, _] = config.backbone;
        let inner = config.pyramid;
        let [coarse, medium, fine] = config.planes;
        Self {
            lateral: [
                NormConv::init([eighth, inner], 1, device),
                NormConv::init([quarter, inner], 1, device),
            ],
            out: [
                NormConv::init([inner, coarse], 1, device),
                NormConv::init([inner, medium], 3, device),
                NormConv::init([inner, fine], 3, device),
            ],
        }
    }

    /// From [`super::backbone::Backbone::forward`]'s features to planes, coarse to fine.
    pub fn forward(&self, [sixteenth, eighth, quarter]: [Tensor<4>; 3]) -> [Tensor<4>; 3] {
        let [to_medium, to_fine] = &self.lateral;
        let [coarse, medium, fine] = &self.out;
        let x16 = sixteenth;
        let x8 = enlarged(x16.clone(), to_medium.forward(eighth));
        let x4 = enlarged(x8.clone(), to_fine.forward(quarter));
        [coarse.forward(x16), medium.forward(x8), fine.forward(x4)]
    }
}

/// `x` at twice the size, cut to that of `lateral` (an odd side halves to one that doubles to a pixel too many), plus
/// `lateral`.
fn enlarged(x: Tensor<4>, lateral: Tensor<4>) -> Tensor<4> {
    let [views, channels, height, width] = lateral.dims();
    let x = upsample2(x);
    let fits = x.dims()[2..] == [height, width];
    let x = if fits {
        x
    } else {
        x.slice([0..views, 0..channels, 0..height, 0..width])
    };
    x + lateral
}

/// Batch normalisation, ReLU, convolution without bias.
#[derive(Module, Debug)]
struct NormConv {
    norm: BatchNorm,
    conv: Conv2d,
}

impl NormConv {
    fn init(channels: [usize; 2], kernel: usize, device: &Device) -> Self {
        Self {
            norm: BatchNormConfig::new(channels[0]).init(device),
            conv: centred(channels, kernel, 1)
                .with_initializer(kaiming(false))
                .init(device),
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        convolved(&self.conv, batch_norm(&self.norm, x, true))
    }
}
