//! What is counted as work, against the weights themselves: each is multiplied once a pixel, a pair or a site.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use bench::work::{decoding, fusion, picture, pyramid};
use burn::tensor::Device;
use net::{Ipdrecon, Level, NetConfig, named};

/// Names and shapes of the weights that multiply.
fn weights(config: &NetConfig) -> Vec<(String, Vec<usize>)> {
    let model = Ipdrecon::new(config, &Device::flex());
    let all = named::tensors(&model).into_iter();
    let all = all.map(|(name, data)| (name, data.shape().to_vec()));
    all.filter(|(_, shape)| shape.len() > 1).collect()
}

fn configs() -> [NetConfig; 3] {
    let guided = NetConfig {
        matching: true,
        guide: true,
        ..NetConfig::small()
    };
    [NetConfig::full(), guided, NetConfig::small().baseline()]
}

/// The stride at which a convolution of backbone or pyramid writes.
fn stride(name: &str) -> usize {
    let parts: Vec<&str> = name.split('.').collect();
    match parts[1..] {
        ["backbone", "stem", ..] => 2,
        ["backbone", "stages", stage, "blocks", block, part, ..] => {
            let after = 4 << stage.parse::<usize>().unwrap();
            if (block, part) == ("0", "expand") {
                after / 2
            } else {
                after
            }
        }
        ["pyramid", "lateral", level, ..] => [8, 4][level.parse::<usize>().unwrap()],
        ["pyramid", "out", level, ..] => [16, 8, 4][level.parse::<usize>().unwrap()],
        _ => panic!("{name} is neither of backbone nor of pyramid"),
    }
}

#[test]
fn of_backbone_and_pyramid() {
    for config in configs() {
        let (width, height) = (200_u32, 120_u32);
        let (mut products, mut numbers) = (0, 0);
        for (name, shape) in weights(&config) {
            if name.starts_with("planes.backbone") || name.starts_with("planes.pyramid") {
                let pixels = |by: u32| (width.div_ceil(by) * height.div_ceil(by)) as usize;
                let by = stride(&name) as u32;
                let halves = name.contains("stem.first") || name.contains("blocks.0.depth");
                let before = if halves { by / 2 } else { by };
                // A channel of its own reads itself.
                let inputs = if name.contains("depth") {
                    shape[0]
                } else {
                    shape[1]
                };
                let held = shape.iter().product::<usize>();
                products += held * pixels(by);
                numbers += held + inputs * pixels(before) + shape[0] * pixels(by);
            }
        }
        let found = pyramid(&config, (width, height));
        assert_eq!(found.flops, 2.0 * products as f64, "{config:?}");
        assert_eq!(found.bytes, 4.0 * numbers as f64, "{config:?}");
        assert!(picture(&config, (width, height)).flops > found.flops);
    }
}

#[test]
fn of_fusion() {
    let seen = [3, 0, 7];
    let (pairs, squares) = (10, 9 + 49);
    for config in configs() {
        for level in Level::ALL {
            let of_level = format!("fusion.{}.", level as usize);
            let linear = weights(&config).into_iter();
            let linear = linear.filter(|(name, _)| name.starts_with(&of_level));
            let sizes = linear.map(
                |(name, shape)| match name.contains("lift") && !config.ipsd {
                    true => 0,
                    false => shape.iter().product::<usize>(),
                },
            );
            let channels = config.planes[level as usize];
            // Two layers of scores and values, then the mean of a voxel's tokens.
            let products =
                pairs * sizes.sum::<usize>() + 2 * 2 * squares * channels + pairs * channels;
            let found = fusion(&config, level, seen.into_iter());
            assert_eq!(
                found.flops,
                2.0 * products as f64,
                "{level:?} of {config:?}"
            );
        }
    }
}

#[test]
fn of_the_3d_networks() {
    let edges = [12_usize, 6, 3];
    // Pairs of neighbours in a cube: along an axis each of three steps, less what looks over the rim.
    let around = edges.map(|edge| {
        let along = (0..edge).map(|i| (i.saturating_sub(1)..=(i + 1).min(edge - 1)).count());
        along.sum::<usize>().pow(3)
    });
    for config in configs() {
        for level in Level::ALL {
            let of_level = format!("decoders.{}.", level as usize);
            let mut products = 0;
            for (name, shape) in weights(&config) {
                let Some(name) = name.strip_prefix(&of_level) else {
                    continue;
                };
                let depth = match name {
                    name if name.contains("down1") || name.contains("up1") => 1,
                    name if name.contains("down2") => 2,
                    _ => 0,
                };
                let finer = if name.starts_with("unet.down") {
                    depth.max(1) - 1
                } else {
                    depth
                };
                products += match shape[..] {
                    [27, inputs, outputs] => around[depth] * inputs * outputs,
                    // Each site of the finer lattice is under one of the eight taps.
                    [8, inputs, outputs] => edges[finer].pow(3) * inputs * outputs,
                    [inputs, outputs] => edges[depth].pow(3) * inputs * outputs,
                    _ => panic!("{name} of shape {shape:?}"),
                };
            }
            let found = decoding(&config, level, edges[0]);
            assert_eq!(
                found.flops,
                2.0 * products as f64,
                "{level:?} of {config:?}"
            );
        }
    }
}
