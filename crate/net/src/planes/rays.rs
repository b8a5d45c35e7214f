//! Viewing directions mixed into the features (method 1.2).

use std::f32::consts::PI;

use burn::module::Module;
use burn::nn::Initializer;
use burn::nn::conv::Conv2d;
use burn::tensor::{Device, Tensor, TensorData};
use glam::Vec2;
use rayon::prelude::*;

use super::layer::{convolved, pointwise};
use crate::ops::flex::pieces;
use crate::{Level, View};

/// Octaves of the encoding.
const OCTAVES: i32 = 4;
/// Channels of an encoded direction: itself, then sine and cosine of three coordinates in each octave.
pub const CHANNELS: usize = 3 + 2 * 3 * OCTAVES as usize;

/// `[F, gamma(d)] -> F`: a 1x1 convolution without bias.
#[derive(Module, Debug)]
pub struct RayEncoding {
    mix: Conv2d,
}

impl RayEncoding {
    /// Xavier-normal.
    pub fn init(channels: usize, device: &Device) -> Self {
        Self {
            mix: pointwise(channels + CHANNELS, channels)
                .with_bias(false)
                .with_initializer(Initializer::XavierNormal { gain: 1.0 })
                .init(device),
        }
    }

    /// Features `[V, C, h, w]` of a level, seen by `views`.
    pub fn forward(&self, features: Tensor<4>, views: &[View], level: Level) -> Tensor<4> {
        let [_, _, height, width] = features.dims();
        let encoded = encoded(views, width, height, level.stride());
        let shape = [views.len(), CHANNELS, height, width];
        let encoded = Tensor::from_data(TensorData::new(encoded, shape), &features.device());
        convolved(&self.mix, Tensor::cat(vec![features, encoded], 1))
    }
}

/// `gamma(d) = [d, sin(2^l pi d), cos(2^l pi d)]` for octaves `l` = 0 to 3, of the unit ray `d` in world coordinates through
/// each pixel of a plane: `[V, 27, height, width]`, row by row. In channels: x, y, z; then for each octave the sines of x, y,
/// z, then their cosines. Plane pixel `i` is picture pixel `stride * i`.
pub fn encoded(views: &[View], width: usize, height: usize, stride: usize) -> Vec<f32> {
    let pixels = width * height;
    let mut all = vec![0.0; views.len() * CHANNELS * pixels];
    pieces(&mut all, CHANNELS, pixels, width)
        .into_par_iter()
        .enumerate()
        .for_each(|(row, mut channels)| {
            let (view, y) = (&views[row / height], row % height);
            // Across the channels: no one of them can be walked instead.
            #[allow(clippy::needless_range_loop)]
            for x in 0..width {
                let at = Vec2::new(x as f32, y as f32) * stride as f32;
                let ray = view
                    .world_from_camera
                    .transform_vector3(view.camera.ray(at))
                    .normalize()
                    .to_array();
                for (axis, d) in ray.into_iter().enumerate() {
                    channels[axis][x] = d;
                    for octave in 0..OCTAVES {
                        let (sine, cosine) = (2.0_f32.powi(octave) * PI * d).sin_cos();
                        let channel = 3 + 6 * octave as usize + axis;
                        channels[channel][x] = sine;
                        channels[channel + 3][x] = cosine;
                    }
                }
            }
        });
    all
}
