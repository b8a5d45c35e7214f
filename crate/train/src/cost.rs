//! What a step costs and what the device could do: for the log. Counts of multiply-adds are estimates from the
//! configuration and the number of voxels (method 2); they leave out whatever is no matrix product.

use burn::tensor::{Device, Tensor};
use net::NetConfig;
use std::time::Instant;

/// Multiply-adds of running the network forward over `views` pictures of `size`.
pub fn forward_macs(
    config: &NetConfig,
    size: [u32; 2],
    views: usize,
    sites: [usize; 3],
    pairs: [usize; 3],
) -> f64 {
    let pixels = f64::from(size[0]) * f64::from(size[1]);
    let mut macs = views as f64 * planes_macs(config, pixels);
    let mut above = 0.0;
    for level in 0..3 {
        let width = config.planes[level] as f64;
        let seen_by = pairs[level] as f64 / sites[level].max(1) as f64;
        // Two layers of 8 d² and of attention over the voxel's views, the first linear, the lift.
        let lift = if config.ipsd { width * width } else { 0.0 };
        let token = 17.0 * width * width + 4.0 * width * seen_by + lift;
        macs += pairs[level] as f64 * token;
        let base = config.unet[level] as f64;
        macs += sites[level] as f64 * unet_macs(width + above, base, level);
        above = 3.0 * base + 1.0;
    }
    macs
}

/// Backbone and pyramid, and the planes of confidence and decoding, for a picture (method 1.2, 2.2, 3.7).
fn planes_macs(config: &NetConfig, pixels: f64) -> f64 {
    let [stem, half, quarter, eighth, sixteenth] = config.backbone.map(|width| width as f64);
    let at = |stride: f64| pixels / (stride * stride);
    // Three inverted residuals: expand, depthwise, project; the first comes from the stride before.
    let block = |from: f64, to: f64, expand: f64, kernel: f64, stride: f64| {
        let inner = |channels: f64| channels * expand;
        let first = at(stride / 2.0) * from * inner(from)
            + at(stride) * inner(from) * (kernel * kernel + to);
        let other = at(stride) * inner(to) * (2.0 * to + kernel * kernel);
        first + 2.0 * other
    };
    let backbone = at(2.0) * stem * (27.0 + 9.0 + half)
        + block(half, quarter, 3.0, 3.0, 4.0)
        + block(quarter, eighth, 3.0, 5.0, 8.0)
        + block(eighth, sixteenth, 6.0, 5.0, 16.0);
    let inside = config.pyramid as f64;
    let widths = config.planes.map(|width| width as f64);
    let pyramid = at(16.0) * sixteenth * widths[0]
        + at(8.0) * (eighth * inside + 9.0 * inside * widths[1])
        + at(4.0) * (quarter * inside + 9.0 * inside * widths[2]);
    let rays_and_parts: f64 = [16.0, 8.0, 4.0]
        .into_iter()
        .zip(widths)
        .map(|(stride, width)| {
            // In units of C²: confidence about 5, decoding about 4 and its lift 2.
            let parts =
                5.0 * f64::from(u8::from(config.pce)) + 6.0 * f64::from(u8::from(config.ipsd));
            at(stride) * width * (width + 27.0 + parts * width)
        })
        .sum();
    backbone + pyramid + rays_and_parts
}

/// A 3D network for a voxel of its level: `inputs` channels in, `base` width (method 1.7).
fn unet_macs(inputs: f64, base: f64, level: usize) -> f64 {
    // Neighbours that are there, of 27; voxels at half and quarter resolution for one at full: the coarse level is
    // dense, the others follow surfaces.
    let (near, half, quarter) = match level {
        0 => (22.0, 1.0 / 8.0, 1.0 / 64.0),
        _ => (17.5, 1.0 / 5.0, 1.0 / 22.0),
    };
    let square = base * base;
    let full = near * inputs * base
        + near * (12.0 + 9.0 + 9.0 + 9.0) * square
        + 12.0 * square
        + 9.0 * square;
    let middle = square
        * (1.0
            + near * (2.0 + 4.0 + 4.0 + 4.0)
            + 2.0
            + 12.0
            + near * (15.0 + 9.0 + 9.0 + 9.0)
            + 15.0);
    let bottom = square * (4.0 + near * (8.0 + 16.0 + 16.0 + 16.0) + 8.0);
    full + half * middle + quarter * bottom
}

/// What the device reaches on a matrix product of 1024, in GFLOP/s: the best of five.
pub fn peak_gflops(device: &Device) -> f64 {
    const SIDE: usize = 1024;
    // Not random numbers: the stream that gives the first weights is left alone.
    let a = Tensor::<2>::full([SIDE, SIDE], 0.5, device);
    let b = Tensor::<2>::full([SIDE, SIDE], 0.25, device);
    let seconds = (0..6).map(|_| {
        let started = Instant::now();
        let product = a.clone().matmul(b.clone());
        // Reading a number back waits for the product; a row of it costs nothing beside it.
        drop(product.slice([0..1, 0..1]).into_data());
        started.elapsed().as_secs_f64()
    });
    // The first one may compile a kernel.
    let best = seconds.skip(1).fold(f64::INFINITY, f64::min);
    2.0 * (SIDE as f64).powi(3) / best / 1e9
}
