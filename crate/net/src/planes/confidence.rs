//! Pixel-level confidence encoding, PCE (method 3.1, Eq. 3 and 4 of the paper).

use burn::module::{Module, Param};
use burn::nn::Initializer;
use burn::nn::conv::Conv2d;
use burn::tensor::{Device, Tensor, activation::sigmoid};

use super::layer::{ChannelNorm, convolved, pointwise};
use super::scan::{SeparableScan, driving, rank};
use crate::ops::silu::silu;

/// `R = conf * (F + val)`, where `[val, logit conf] = MLP_E(scan(w^T F))`.
#[derive(Module, Debug)]
pub struct ConfidenceEncoding {
    drive: Conv2d,
    scan: SeparableScan,
    norm: ChannelNorm,
    widen: Conv2d,
    readout: Conv2d,
}

impl ConfidenceEncoding {
    /// As many states as channels. Starts with `val` = 0 and the confidence at sigmoid(2) = 0.88 everywhere.
    pub fn init(channels: usize, device: &Device) -> Self {
        let mut readout = pointwise(2 * channels, channels + 1)
            .with_initializer(Initializer::Zeros)
            .init(device);
        let mut bias = vec![0.0_f32; channels + 1];
        bias[channels] = 2.0;
        readout.bias = Some(Param::from_tensor(Tensor::from_floats(
            bias.as_slice(),
            device,
        )));
        Self {
            drive: driving(channels, channels, device),
            scan: SeparableScan::init(channels, rank(channels), channels, device),
            norm: ChannelNorm::init(channels, device),
            widen: pointwise(channels, 2 * channels).init(device),
            readout,
        }
    }

    /// Features `[V, C, h, w]` to encoded features of that shape and their confidence `[V, 1, h, w]`.
    pub fn forward(&self, features: Tensor<4>) -> (Tensor<4>, Tensor<4>) {
        let channels = features.dims()[1];
        let states = self
            .scan
            .forward(convolved(&self.drive, features.clone()), features.clone());
        let wide = silu(convolved(&self.widen, self.norm.forward(states)));
        let read = convolved(&self.readout, wide);
        let value = read.clone().narrow(1, 0, channels);
        let confidence = sigmoid(read.narrow(1, channels, 1));
        ((features + value) * confidence.clone(), confidence)
    }
}
