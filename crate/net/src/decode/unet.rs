//! The sparse U-Net of a level (method 1.7).

use super::UNetMaps;
use crate::ops::{
    batch_norm::{batch_norm, running_factors},
    cube,
    linear::of_rows,
    sparse_conv::{KernelMap, sparse_conv, sparse_conv_finished},
};
use burn::{
    Tensor,
    module::{Module, Param},
    nn::{BatchNorm, BatchNormConfig, Initializer, Linear, LinearConfig},
    tensor::{Device, activation::relu},
};

/// A sparse convolution's weight `[taps, inputs, outputs]`, without bias.
#[derive(Module, Debug)]
pub struct SparseConvolution {
    /// A matrix for each tap.
    pub weight: Param<Tensor<3>>,
}

impl SparseConvolution {
    /// He initialisation for `reached` taps that reach an output.
    fn new(shape: [usize; 3], reached: usize, device: &Device) -> Self {
        let fan_in = Some(reached * shape[1]);
        let gain = std::f64::consts::SQRT_2;
        let normal = Initializer::KaimingNormal {
            gain,
            fan_out_only: false,
        };
        Self {
            weight: normal.init_with(shape, fan_in, None, device),
        }
    }

    fn forward(&self, features: Tensor<2>, map: &KernelMap) -> Tensor<2> {
        sparse_conv(features, self.weight.val(), map)
    }

    /// The convolution, its normalisation `norm`, what comes from around it, and where asked a ReLU.
    fn normed(
        &self,
        features: Tensor<2>,
        map: &KernelMap,
        norm: &BatchNorm,
        around: Option<Tensor<2>>,
        end: bool,
    ) -> Tensor<2> {
        let device = features.device();
        if cube::runs_on(&device) {
            let (scale, shift) = running_factors(norm, &device);
            let weight = self.weight.val();
            return sparse_conv_finished(features, weight, map, [scale, shift], around, end);
        }
        let inner = self.forward(features, map);
        match around {
            None => batch_norm(norm, inner, end),
            Some(around) => {
                let sum = batch_norm(norm, inner, false) + around;
                if end { relu(sum) } else { sum }
            }
        }
    }
}

/// A convolution, normalised over the sites, then ReLU.
#[derive(Module, Debug)]
pub struct Step {
    /// The convolution.
    pub conv: SparseConvolution,
    /// Batch normalisation of its output.
    pub norm: BatchNorm,
}

impl Step {
    /// `taps` in all, of which `reached` reach an output.
    fn new(taps: usize, reached: usize, inputs: usize, outputs: usize, device: &Device) -> Self {
        Self {
            conv: SparseConvolution::new([taps, inputs, outputs], reached, device),
            norm: BatchNormConfig::new(outputs).init(device),
        }
    }

    fn forward(&self, features: Tensor<2>, map: &KernelMap) -> Tensor<2> {
        self.conv.normed(features, map, &self.norm, None, true)
    }
}

/// Two submanifold convolutions and a way around them.
#[derive(Module, Debug)]
pub struct Residual {
    /// The first, with its ReLU.
    pub first: Step,
    /// The second.
    pub second: SparseConvolution,
    /// Its normalisation.
    pub norm: BatchNorm,
    /// The way around where the width changes.
    pub around: Option<Around>,
}

/// A matrix for every site, normalised.
#[derive(Module, Debug)]
pub struct Around {
    /// Without bias.
    pub linear: Linear,
    /// Batch normalisation of its output.
    pub norm: BatchNorm,
}

impl Residual {
    /// From `inputs` to `outputs` channels.
    pub fn new(inputs: usize, outputs: usize, device: &Device) -> Self {
        let norm = || BatchNormConfig::new(outputs).init(device);
        Self {
            first: Step::new(27, 27, inputs, outputs, device),
            second: SparseConvolution::new([27, outputs, outputs], 27, device),
            norm: norm(),
            around: (inputs != outputs).then(|| Around {
                linear: LinearConfig::new(inputs, outputs)
                    .with_bias(false)
                    .init(device),
                norm: norm(),
            }),
        }
    }

    /// Rows `[N, inputs]` to `[N, outputs]`.
    pub fn forward(&self, features: Tensor<2>, map: &KernelMap) -> Tensor<2> {
        let inner = self.first.forward(features.clone(), map);
        let around = match &self.around {
            Some(around) => batch_norm(&around.norm, of_rows(&around.linear, features), false),
            None => features,
        };
        self.second
            .normed(inner, map, &self.norm, Some(around), true)
    }
}

/// A U-Net over sparse sites with three resolutions.
#[derive(Module, Debug)]
pub struct UNet {
    /// At full resolution, to b channels.
    pub stem: Step,
    /// To half resolution: stride 2, then to 2b channels and again.
    pub down1: Stage,
    /// To quarter resolution and 4b channels.
    pub down2: Stage,
    /// Back to half resolution and 3b channels.
    pub up1: Stage,
    /// Back to full resolution, 3b channels.
    pub up2: Stage,
}

/// A change of resolution and two residual blocks.
#[derive(Module, Debug)]
pub struct Stage {
    /// With stride 2 or transposed.
    pub change: Step,
    /// Changes the width; on the way up it takes the same resolution's features from the way down too.
    pub first: Residual,
    /// Keeps the width.
    pub second: Residual,
}

impl Stage {
    fn new(change: Step, inputs: usize, outputs: usize, device: &Device) -> Self {
        Self {
            change,
            first: Residual::new(inputs, outputs, device),
            second: Residual::new(outputs, outputs, device),
        }
    }

    fn forward(
        &self,
        features: Tensor<2>,
        change: &KernelMap,
        skip: Option<Tensor<2>>,
        same: &KernelMap,
    ) -> Tensor<2> {
        let mut features = self.change.forward(features, change);
        if let Some(skip) = skip {
            features = Tensor::cat(vec![features, skip], 1);
        }
        self.second
            .forward(self.first.forward(features, same), same)
    }
}

impl UNet {
    /// From `inputs` to `3 * base` channels.
    pub fn new(inputs: usize, base: usize, device: &Device) -> Self {
        let [b, b2, b3, b4] = [base, 2 * base, 3 * base, 4 * base];
        let down = |width| Step::new(8, 8, width, width, device);
        // An output of the transposed convolution has one input.
        let up = |inputs| Step::new(8, 1, inputs, b3, device);
        Self {
            stem: Step::new(27, 27, inputs, b, device),
            down1: Stage::new(down(b), b, b2, device),
            down2: Stage::new(down(b2), b2, b4, device),
            up1: Stage::new(up(b4), b3 + b2, b3, device),
            up2: Stage::new(up(b3), b3 + b, b3, device),
        }
    }

    /// Rows `[N, inputs]` to `[N, 3 * base]`, in the order of the sites that `maps` was made of. No rows give no rows.
    pub fn forward(&self, features: Tensor<2>, maps: &UNetMaps) -> Tensor<2> {
        if maps.is_empty() {
            let [width] = self.up2.change.norm.gamma.dims();
            return Tensor::zeros([0, width], &features.device());
        }
        let [full, half, quarter] = &maps.same;
        let [down1, down2] = &maps.down;
        let [up1, up2] = &maps.up;
        let stem = self.stem.forward(features, full);
        let first = self.down1.forward(stem.clone(), down1, None, half);
        let second = self.down2.forward(first.clone(), down2, None, quarter);
        let first = self.up1.forward(second, up2, Some(first), half);
        self.up2.forward(first, up1, Some(stem), full)
    }
}
