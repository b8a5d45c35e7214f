//! A walk through a training room, as the files of a scan.

use crate::layout::{Content, seven_scenes_upright};
use crate::path::View;
use crate::random::{Random, hash_unit};
use crate::trace::Frame;
use crate::training::camera::{Sensor, brightness, pinhole};
use crate::training::render::{depth, trace};
use crate::training::room::TrainingRoom;
use crate::training::walk::walk;

/// A scan to learn from. Its world is the room's: metres, Z up, the floor at z = 0.
pub struct TrainingScan {
    room: TrainingRoom,
    views: Vec<View>,
    sensor: Sensor,
    /// Mean brightness over the scan, linear.
    mean: f32,
    seed: u64,
}

/// Rooms of a seed that are tried until one has space to walk in.
const ATTEMPTS: u64 = 16;

impl TrainingScan {
    /// The rooms named by `seed`, walked through in `frames` pictures of `width` by `height` pixels.
    pub fn new(seed: u64, frames: usize, width: u32, height: u32) -> Self {
        let mut attempt = 0;
        loop {
            let room = TrainingRoom::new(seed.wrapping_add(attempt << 40));
            let mut r = Random::new(seed.rotate_left(17) ^ attempt);
            let camera = pinhole(&mut r, width, height);
            let sensor = Sensor::new(&mut r);
            let views = walk(&room, &mut r, frames, camera);
            if views.is_none() && attempt + 1 < ATTEMPTS {
                attempt += 1;
                continue;
            }
            let views = views.unwrap_or_default();
            let mean = mean_brightness(&room, &views);
            return Self {
                room,
                views,
                sensor,
                mean,
                seed,
            };
        }
    }

    /// What is walked through.
    pub fn room(&self) -> &TrainingRoom {
        &self.room
    }

    /// The views of the frames, in order.
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// JPEG quality of this scan's camera, 1 to 100.
    pub fn quality(&self) -> u8 {
        self.sensor.quality
    }

    /// Colour as the camera saves it, and exact depth, of frame `index`.
    pub fn frame(&self, index: usize) -> Frame {
        let view = &self.views[index];
        let linear = trace(&self.room, view);
        let next = self.views.get(index + 1);
        Frame {
            width: view.camera.width,
            height: view.camera.height,
            color: self.sensor.develop(&linear, index, self.mean, view, next),
            depth_m: linear.depth_m,
        }
    }

    /// The exact depth of [`TrainingScan::frame`] alone.
    pub fn depth(&self, index: usize) -> Vec<f32> {
        depth(&self.room, &self.views[index])
    }

    /// Depth as a sensor would measure it: noise that grows with the square of the distance (Nguyen et al., 3DIMPVT
    /// 2012), nothing beyond 5 m.
    pub fn sensed(&self, index: usize, depth_m: &[f32]) -> Vec<f32> {
        let draw =
            |pixel: usize, k| hash_unit(pixel as i32, index as i32, k, self.seed as u32 ^ 0x5EED);
        let noisy = |(pixel, &z): (usize, &f32)| {
            if z > 5.0 {
                return 0.0;
            }
            let bell = 2.0 * (draw(pixel, 0) + draw(pixel, 1) + draw(pixel, 2)) - 3.0;
            z + (0.0012 + 0.0019 * (z - 0.4) * (z - 0.4)) * bell
        };
        depth_m.iter().enumerate().map(noisy).collect()
    }

    /// The scan's text files in the 7-Scenes layout, calibration and poses, by name.
    pub fn texts(&self) -> Vec<(String, String)> {
        seven_scenes_upright(&self.views)
            .into_iter()
            .filter_map(|(name, content)| match content {
                Content::Text(text) => Some((name, text)),
                Content::Color(_) | Content::Depth(_) => None,
            })
            .collect()
    }
}

/// Brightness over the whole walk, from a few tiny pictures.
fn mean_brightness(room: &TrainingRoom, views: &[View]) -> f32 {
    const LOOKS: usize = 8;
    let step = views.len().div_ceil(LOOKS).max(1);
    let tiny = |view: &View| View {
        camera: view.camera.scaled(32, 24),
        ..*view
    };
    let levels: Vec<f32> = views
        .iter()
        .step_by(step)
        .map(|view| brightness(&trace(room, &tiny(view)).color))
        .collect();
    (levels.iter().sum::<f32>() / levels.len().max(1) as f32).max(1e-4)
}
