//! MnasNet-B1 to stride 16 (method 1.2), torchvision's `mnasnet1_0` without its last stages.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use super::layer::ConvNorm;

/// The backbone's stages.
#[derive(Module, Debug)]
pub struct Backbone {
    stem: Stem,
    /// Strides 4, 8 and 16.
    stages: [Stage; 3],
}

impl Backbone {
    /// `widths`: of the stem before and after its projection, then at strides 4, 8 and 16.
    pub fn init(widths: [usize; 5], device: &Device) -> Self {
        let [stem, projected, quarter, eighth, sixteenth] = widths;
        Self {
            stem: Stem::init(stem, projected, device),
            stages: [
                Stage::init([projected, quarter], 3, 3, device),
                Stage::init([quarter, eighth], 5, 3, device),
                Stage::init([eighth, sixteenth], 5, 6, device),
            ],
        }
    }

    /// Normalised pictures `[V, 3, H, W]` to features at strides 16, 8 and 4.
    pub fn forward(&self, images: Tensor<4>) -> [Tensor<4>; 3] {
        let [first, second, third] = &self.stages;
        let quarter = first.forward(self.stem.forward(images));
        let eighth = second.forward(quarter.clone());
        let sixteenth = third.forward(eighth.clone());
        [sixteenth, eighth, quarter]
    }
}

/// 3x3 at stride 2, depthwise 3x3, 1x1 without ReLU.
#[derive(Module, Debug)]
struct Stem {
    first: ConvNorm,
    depth: ConvNorm,
    project: ConvNorm,
}

impl Stem {
    fn init(width: usize, projected: usize, device: &Device) -> Self {
        Self {
            first: ConvNorm::init([3, width], 3, 2, true, device),
            depth: ConvNorm::depthwise(width, 3, 1, device),
            project: ConvNorm::init([width, projected], 1, 1, false, device),
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let x = self.first.forward(x);
        self.project.forward(self.depth.forward(x))
    }
}

/// Three inverted residuals, the first at stride 2.
#[derive(Module, Debug)]
struct Stage {
    blocks: [InvertedResidual; 3],
}

impl Stage {
    fn init(channels: [usize; 2], kernel: usize, expand: usize, device: &Device) -> Self {
        let wide = [channels[1], channels[1]];
        Self {
            blocks: [
                InvertedResidual::init(channels, kernel, 2, expand, device),
                InvertedResidual::init(wide, kernel, 1, expand, device),
                InvertedResidual::init(wide, kernel, 1, expand, device),
            ],
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        self.blocks.iter().fold(x, |x, block| block.forward(x))
    }
}

/// 1x1 to `expand` times the channels, depthwise, 1x1 back without ReLU; the input is added where it has the same shape.
#[derive(Module, Debug)]
struct InvertedResidual {
    expand: ConvNorm,
    depth: ConvNorm,
    project: ConvNorm,
    residual: bool,
}

impl InvertedResidual {
    fn init(
        channels: [usize; 2],
        kernel: usize,
        stride: usize,
        expand: usize,
        device: &Device,
    ) -> Self {
        let [narrow, out] = channels;
        let wide = expand * narrow;
        Self {
            expand: ConvNorm::init([narrow, wide], 1, 1, true, device),
            depth: ConvNorm::depthwise(wide, kernel, stride, device),
            project: ConvNorm::init([wide, out], 1, 1, false, device),
            residual: stride == 1 && narrow == out,
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let y = self.depth.forward(self.expand.forward(x.clone()));
        let y = self.project.forward(y);
        if self.residual { y + x } else { y }
    }
}
