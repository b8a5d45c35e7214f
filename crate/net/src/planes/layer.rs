//! Layers that several parts of the planes share.

use burn::module::{Module, Param};
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, Initializer, PaddingConfig2d};
use burn::tensor::{Device, Tensor};

use crate::ops::batch_norm::{batch_norm, running_factors};
use crate::ops::channel_norm::channel_norm;
use crate::ops::cube;
use crate::ops::depthwise::depthwise;
use crate::ops::folded::{self, folded};
use crate::ops::planar;
use crate::ops::pointwise::pointwise as linear;

/// A linear layer of each pixel's channels, with bias, as a 1x1 convolution.
pub(super) fn pointwise(channels_in: usize, channels_out: usize) -> Conv2dConfig {
    Conv2dConfig::new([channels_in, channels_out], [1, 1])
}

/// A convolution without bias whose output pixel `i` is centred on input pixel `stride * i`; sides become
/// `ceil(side / stride)`.
pub(super) fn centred(channels: [usize; 2], kernel: usize, stride: usize) -> Conv2dConfig {
    let pad = kernel / 2;
    Conv2dConfig::new(channels, [kernel, kernel])
        .with_stride([stride, stride])
        .with_padding(PaddingConfig2d::Explicit(pad, pad, pad, pad))
        .with_bias(false)
}

/// Kaiming-normal for a ReLU that follows, of the inputs or of the outputs.
pub(super) fn kaiming(fan_out_only: bool) -> Initializer {
    Initializer::KaimingNormal {
        gain: std::f64::consts::SQRT_2,
        fan_out_only,
    }
}

/// What `conv` gives, by the operation that suits its shape.
pub(super) fn convolved(conv: &Conv2d, x: Tensor<4>) -> Tensor<4> {
    let weight = conv.weight.val();
    let device = x.device();
    if cube::runs_on(&device) {
        return planar::convolved(conv, None, false, x);
    }
    if cube::NO_OTHER || folded::runs_on(&device) {
        let [outputs, ..] = weight.dims();
        let bias = conv.bias.as_ref().map(|bias| bias.val());
        let shift = bias.unwrap_or_else(|| Tensor::zeros([outputs], &device));
        let scale = Tensor::ones([outputs], &device);
        return folded(x, weight, [scale, shift], conv.stride[0], false);
    }
    if conv.kernel_size == [1, 1] {
        linear(x, weight, conv.bias.as_ref().map(|bias| bias.val()))
    } else if conv.groups > 1 {
        depthwise(x, weight, conv.stride[0])
    } else {
        conv.forward(x)
    }
}

/// A convolution without bias, its batch normalisation and, where asked, a ReLU.
#[derive(Module, Debug)]
pub struct ConvNorm {
    /// The convolution.
    pub conv: Conv2d,
    /// Over views and pixels.
    pub norm: BatchNorm,
    relu: bool,
}

impl ConvNorm {
    /// Dense, and initialised as torchvision's MnasNet.
    pub(super) fn init(
        channels: [usize; 2],
        kernel: usize,
        stride: usize,
        relu: bool,
        device: &Device,
    ) -> Self {
        Self {
            conv: centred(channels, kernel, stride)
                .with_initializer(kaiming(true))
                .init(device),
            norm: BatchNormConfig::new(channels[1]).init(device),
            relu,
        }
    }

    /// One kernel a channel; always with a ReLU.
    pub(super) fn depthwise(
        channels: usize,
        kernel: usize,
        stride: usize,
        device: &Device,
    ) -> Self {
        Self {
            conv: centred([channels, channels], kernel, stride)
                .with_groups(channels)
                .with_initializer(kaiming(true))
                .init(device),
            norm: BatchNormConfig::new(channels).init(device),
            relu: true,
        }
    }

    pub(super) fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let device = x.device();
        if cube::runs_on(&device) {
            return planar::convolved(&self.conv, Some(&self.norm), self.relu, x);
        }
        if cube::NO_OTHER || folded::runs_on(&device) {
            let (scale, shift) = running_factors(&self.norm, &device);
            let (weight, stride) = (self.conv.weight.val(), self.conv.stride[0]);
            return folded(x, weight, [scale, shift], stride, self.relu);
        }
        batch_norm(&self.norm, convolved(&self.conv, x), self.relu)
    }
}

/// Normalises the channels of each pixel: `gamma * (x - mean) / sqrt(variance + 1e-5) + beta`.
#[derive(Module, Debug)]
pub struct ChannelNorm {
    /// Gain of each channel.
    pub gamma: Param<Tensor<1>>,
    /// Shift of each channel.
    pub beta: Param<Tensor<1>>,
}

impl ChannelNorm {
    pub(super) fn init(channels: usize, device: &Device) -> Self {
        Self {
            gamma: Initializer::Ones.init([channels], device),
            beta: Initializer::Zeros.init([channels], device),
        }
    }

    pub(super) fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        channel_norm(x, self.gamma.val(), self.beta.val())
    }
}

/// A value a channel, to be broadcast over views and pixels.
pub(super) fn of_channels(values: Tensor<1>) -> Tensor<4> {
    let [channels] = values.dims();
    values.reshape([1, channels, 1, 1])
}

/// Mean over the pixels: `[V, C, h, w]` to `[V, C]`.
pub(super) fn pooled(x: Tensor<4>) -> Tensor<2> {
    let [views, channels, height, width] = x.dims();
    x.reshape([views, channels, height * width])
        .mean_dim(2)
        .reshape([views, channels])
}
