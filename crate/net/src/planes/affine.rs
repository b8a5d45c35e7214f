//! Affine compensation, ACM (method 3.2, Eq. 5 of the paper).

use burn::module::{Module, Param};
use burn::nn::{Initializer, Linear, LinearConfig};
use burn::tensor::{Device, Tensor, activation::sigmoid};

use super::layer::{of_channels, pooled};
use crate::ops::{affine::affine_sample, linear::of_rows};

/// `AP(p) = bilinear(R, A p) * b_c`: the plane seen through an affine map that its own mean decides, per view.
#[derive(Module, Debug)]
pub struct AffineCompensation {
    /// Mean over the plane to the map's difference from the identity.
    map: Linear,
    /// Logit of each channel's gain.
    gain: Param<Tensor<1>>,
}

impl AffineCompensation {
    /// Starts with the identity map and gains of sigmoid(2) = 0.88.
    pub fn init(channels: usize, device: &Device) -> Self {
        Self {
            map: LinearConfig::new(channels, 6)
                .with_initializer(Initializer::Zeros)
                .init(device),
            gain: Initializer::Constant { value: 2.0 }.init([channels], device),
        }
    }

    /// Planes `[V, C, h, w]` to planes of that shape.
    pub fn forward(&self, planes: Tensor<4>) -> Tensor<4> {
        let identity = [[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]];
        let identity = Tensor::<2>::from_floats(identity, &planes.device());
        let maps = of_rows(&self.map, pooled(planes.clone())) + identity;
        affine_sample(planes, maps) * of_channels(sigmoid(self.gain.val()))
    }
}
