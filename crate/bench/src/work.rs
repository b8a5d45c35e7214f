//! What a part must compute and move at least: multiplications and additions of its convolutions and linear layers, each reading its
//! inputs and weights and writing its outputs once. Normalisations, activations, sampling and scans are not counted.

use std::ops::{Add, AddAssign};

use net::{Level, NetConfig, model::GUIDE_CHANNELS, planes::plane_size};
use serde::Serialize;

/// Channels of a viewing direction.
const RAYS: usize = net::planes::rays::CHANNELS;
/// Layers of the encoder that fuses views.
const LAYERS: usize = net::fusion::LAYERS;
/// Channels of `matching`.
const MATCHING: usize = net::fusion::GROUPS;

/// Operations and bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Work {
    /// Multiplications and additions.
    pub flops: f64,
    /// Bytes read and written, in 32-bit numbers.
    pub bytes: f64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            flops: self.flops + other.flops,
            bytes: self.bytes + other.bytes,
        }
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// `products` multiplications, each with an addition, that read and write so many numbers.
fn work(products: usize, numbers: usize) -> Work {
    Work {
        flops: 2.0 * products as f64,
        bytes: size_of::<f32>() as f64 * numbers as f64,
    }
}

/// A linear layer over `rows`.
fn linear(rows: usize, inputs: usize, outputs: usize) -> Work {
    work(
        rows * inputs * outputs,
        rows * (inputs + outputs) + inputs * outputs,
    )
}

/// A 2D convolution from `before` to `after` pixels.
fn dense([before, after]: [usize; 2], inputs: usize, outputs: usize, kernel: usize) -> Work {
    let weights = kernel * kernel * inputs * outputs;
    work(after * weights, before * inputs + after * outputs + weights)
}

/// A 2D convolution with one kernel a channel.
fn depthwise([before, after]: [usize; 2], channels: usize, kernel: usize) -> Work {
    let weights = kernel * kernel * channels;
    work(after * weights, (before + after) * channels + weights)
}

/// Backbone and pyramid for one picture.
pub fn pyramid(config: &NetConfig, (width, height): (u32, u32)) -> Work {
    let pixels = |stride: usize| {
        [width, height]
            .map(|side| (side as usize).div_ceil(stride))
            .iter()
            .product::<usize>()
    };
    let [stem, projected, quarter, eighth, sixteenth] = config.backbone;
    let half = pixels(2);
    let mut all = dense([pixels(1), half], 3, stem, 3);
    all += depthwise([half, half], stem, 3) + linear(half, stem, projected);
    let stages = [
        (projected, quarter, 3, 3),
        (quarter, eighth, 5, 3),
        (eighth, sixteenth, 5, 6),
    ];
    for (stage, (inputs, outputs, kernel, expand)) in stages.into_iter().enumerate() {
        let (before, after) = (pixels(2 << stage), pixels(4 << stage));
        for (from, inputs) in [(before, inputs), (after, outputs), (after, outputs)] {
            let wide = expand * inputs;
            all += linear(from, inputs, wide);
            all += depthwise([from, after], wide, kernel) + linear(after, wide, outputs);
        }
    }
    let inner = config.pyramid;
    all += linear(pixels(8), eighth, inner) + linear(pixels(4), quarter, inner);
    let [coarse, medium, fine] = config.planes;
    all + linear(pixels(16), inner, coarse)
        + dense([pixels(8); 2], inner, medium, 3)
        + dense([pixels(4); 2], inner, fine, 3)
}

/// All planes of one picture.
pub fn picture(config: &NetConfig, size: (u32, u32)) -> Work {
    let mut all = pyramid(config, size);
    for level in Level::ALL {
        let [columns, rows] = plane_size(size.0 as usize, size.1 as usize, level);
        let (pixels, c) = (columns * rows, config.planes[level as usize]);
        all += linear(pixels, c + RAYS, c);
        let compensated = if config.acm { 2 * c } else { c };
        if config.pce {
            all += linear(pixels, c, 2 * c) + linear(pixels, c, c) + linear(pixels, 2 * c, c + 1);
        }
        if config.ipsd {
            // In, out, and the plane half of the lift.
            all += linear(pixels, compensated, c) + linear(pixels, c, c) + linear(pixels, 2 * c, c);
        } else if config.acm {
            all += linear(pixels, 2 * c, c);
        }
    }
    all
}

/// Fusion of a level's views, seen by each voxel as `seen` says.
pub fn fusion(config: &NetConfig, level: Level, seen: impl Iterator<Item = usize>) -> Work {
    let c = config.planes[level as usize];
    let (mut pairs, mut squares, mut voxels) = (0, 0, 0);
    for views in seen {
        pairs += views;
        squares += views * views;
        voxels += 1;
    }
    let extra = 1 + if config.matching { MATCHING } else { 0 };
    let mut all = linear(pairs, c + extra, c) + linear(pairs, c, 1);
    if config.ipsd {
        all += linear(pairs, c, c);
    }
    for _ in 0..LAYERS {
        all += linear(pairs, c, 3 * c) + linear(pairs, c, c);
        all += linear(pairs, c, 2 * c) + linear(pairs, 2 * c, c);
        // Scores, then values.
        all += work(2 * squares * c, 4 * pairs * c);
    }
    all + work(pairs * c, (pairs + voxels) * c)
}

/// The 3D network of a level over a cube of `edge` sites, all occupied.
pub fn decoding(config: &NetConfig, level: Level, edge: usize) -> Work {
    let b = config.unet[level as usize];
    let above = match level {
        Level::Coarse => 0,
        _ => 3 * config.unet[level as usize - 1] + 1,
    };
    let guide = if config.guide { GUIDE_CHANNELS } else { 0 };
    let inputs = config.planes[level as usize] + above + guide;
    let edges = [edge, edge.div_ceil(2), edge.div_ceil(4)];
    let rows = edges.map(|edge| edge.pow(3));
    // A 3x3x3 convolution at a depth: sites at the rim have fewer neighbours.
    let around = |depth: usize, inputs: usize, outputs: usize| {
        let pairs = (3 * edges[depth] - 2).pow(3);
        work(
            pairs * inputs * outputs,
            rows[depth] * (inputs + outputs) + 27 * inputs * outputs,
        )
    };
    // Between two depths: each site of the finer is under one tap.
    let change = |finer: usize, inputs: usize, outputs: usize| {
        work(
            rows[finer] * inputs * outputs,
            rows[finer] * inputs + rows[finer + 1] * outputs + 8 * inputs * outputs,
        )
    };
    // Two residual blocks, the first with a linear layer around it.
    let blocks = |depth: usize, inputs: usize, outputs: usize| {
        linear(rows[depth], inputs, outputs)
            + around(depth, inputs, outputs)
            + around(depth, outputs, outputs)
            + around(depth, outputs, outputs)
            + around(depth, outputs, outputs)
    };
    around(0, inputs, b)
        + change(0, b, b)
        + blocks(1, b, 2 * b)
        + change(1, 2 * b, 2 * b)
        + blocks(2, 2 * b, 4 * b)
        + change(1, 4 * b, 3 * b)
        + blocks(1, 5 * b, 3 * b)
        + change(0, 3 * b, 3 * b)
        + blocks(0, 4 * b, 3 * b)
        + linear(rows[0], 3 * b, 1)
}
