//! Numbers that Rust and the Python reference make alike, so that golden files hold results only.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
pub mod devices;
pub mod digests;
pub mod golden;

/// `count` numbers in [-scale, scale) that `name` decides: FNV-1a of the name, then SplitMix64 of that plus the index.
/// The same as `numbers` in tests/reference/made_numbers.py.
pub fn numbers(name: &str, count: usize, scale: f32) -> Vec<f32> {
    let seed = name.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    });
    (0..count as u64)
        .map(|i| {
            let mut z = seed.wrapping_add((i + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^= z >> 31;
            let unit = (z >> 40) as f64 / f64::from(1_u32 << 24);
            (f64::from(scale) * (2.0 * unit - 1.0)) as f32
        })
        .collect()
}

/// A module whose every tensor is made by [`numbers`] from its path: weights of `fan_in` inputs within
/// `sqrt(3 / fan_in)`, vectors within 0.5, and the variances of normalisation between 0.5 and 1.5.
pub fn filled<M: burn::module::Module>(module: M) -> M {
    net::named::replace(module, |path, shape| Some(made_weight(path, shape)))
}

/// The tensor that [`filled`] puts at `path`.
pub fn made_weight(path: &str, shape: &[usize]) -> Vec<f32> {
    let count = shape.iter().product();
    match shape.len() {
        1 if path.ends_with("running_var") => {
            numbers(path, count, 0.5).iter().map(|v| v + 1.0).collect()
        }
        1 => numbers(path, count, 0.5),
        // Of a convolution all but the first axis feed an output; of a linear layer the first does.
        2 => numbers(path, count, (3.0 / shape[0] as f32).sqrt()),
        _ => numbers(path, count, (3.0 / (count / shape[0]) as f32).sqrt()),
    }
}

/// The largest absolute difference over the largest absolute value expected.
pub fn relative_error(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len(), "as many numbers as expected");
    let largest = expected.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    // A plain maximum would pass over NaN.
    let off = off.fold(0.0_f32, |m, d| if d <= m { m } else { d });
    off / largest.max(1e-12)
}

/// A network with all of its parts that is quick to run.
pub fn tiny() -> net::NetConfig {
    net::NetConfig {
        backbone: [8, 8, 8, 8, 16],
        pyramid: 16,
        planes: [16, 8, 8],
        unet: [4, 4, 4],
        ..net::NetConfig::full()
    }
}
