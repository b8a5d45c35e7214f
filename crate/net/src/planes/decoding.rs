//! Image-plane spatial decoding, IPSD (method 3.3), and the plane half of its lift to voxels (method 3.4). Eq. 6 and 7 of
//! the paper.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{Initializer, Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use super::layer::{ChannelNorm, convolved, pointwise, pooled};
use super::scan::{SeparableScan, rank};
use crate::ops::linear::of_rows;

/// `State = scan(project(CR)) + B(CR)`, `S = out(State)`, `Q = W_s S + W_f F + b`.
#[derive(Module, Debug)]
pub struct SpatialDecoding {
    norm: ChannelNorm,
    project: Conv2d,
    scan: SeparableScan,
    /// The dynamic bias: mean over the plane to a shift of every state.
    shift: Linear,
    out: Conv2d,
    /// `[W_s, W_f]` and `b`: the first layer of MLP_D, which commutes with the sampling at voxels.
    lift: Conv2d,
}

impl SpatialDecoding {
    /// From planes of `channels_in` (with affine compensation twice `channels`) to `channels`, with as many states.
    pub fn init(channels_in: usize, channels: usize, device: &Device) -> Self {
        Self {
            norm: ChannelNorm::init(channels_in, device),
            project: pointwise(channels_in, channels).init(device),
            scan: SeparableScan::init(channels_in, rank(channels), channels, device),
            shift: LinearConfig::new(channels_in, channels)
                .with_initializer(Initializer::Zeros)
                .init(device),
            out: pointwise(channels, channels).init(device),
            lift: pointwise(2 * channels, channels).init(device),
        }
    }

    /// `compensated` `[V, C or 2C, h, w]` and the features before all parts `[V, C, h, w]` to `Q` `[V, C, h, w]`.
    pub fn forward(&self, compensated: Tensor<4>, features: Tensor<4>) -> Tensor<4> {
        let spatial = self.spatial(compensated);
        convolved(&self.lift, Tensor::cat(vec![spatial, features], 1))
    }

    /// `S`, `[V, C, h, w]`.
    pub fn spatial(&self, compensated: Tensor<4>) -> Tensor<4> {
        let shift = of_rows(&self.shift, pooled(compensated.clone()));
        let [views, states] = shift.dims();
        let input = convolved(&self.project, self.norm.forward(compensated.clone()));
        let state = self.scan.forward(input, compensated) + shift.reshape([views, states, 1, 1]);
        convolved(&self.out, state)
    }
}
