//! A walk through a training room, as the files of a scan.

use glam::{Mat3, Quat, Vec3};

use crate::layout::{Content, seven_scenes_upright};
use crate::path::View;
use crate::random::{Random, hash_unit};
use crate::trace::Frame;
use crate::training::camera::{Sensor, mean_color, pinhole};
use crate::training::render::{Linear, depth, trace};
use crate::training::room::TrainingRoom;
use crate::training::walk::walk;

/// A scan to learn from. Its world is the room's: metres, Z up, the floor at z = 0.
pub struct TrainingScan {
    room: TrainingRoom,
    views: Vec<View>,
    sensor: Sensor,
    /// Mean colour over the scan, linear.
    mean: Vec3,
    seed: u64,
}

/// Rooms of a seed that are tried until one has space to walk in.
const ATTEMPTS: u64 = 16;
const USUAL_WIDTH: u32 = 320;

impl TrainingScan {
    /// The rooms named by `seed`, walked through in `frames` pictures of `width` by `height` pixels.
    pub fn new(seed: u64, frames: usize, width: u32, height: u32) -> Self {
        let mut attempt = 0;
        loop {
            let room = TrainingRoom::new(seed.wrapping_add(attempt << 40));
            let mut r = Random::new(seed.rotate_left(17) ^ attempt);
            // The way is the same for every size of pictures of one shape.
            let usual = pinhole(&mut r, USUAL_WIDTH, USUAL_WIDTH * height / width.max(1));
            let sensor = Sensor::new(&mut r);
            let views = walk(&room, &mut r, frames, usual);
            if views.is_none() && attempt + 1 < ATTEMPTS {
                attempt += 1;
                continue;
            }
            let mut views = views.unwrap_or_default();
            let camera = usual.scaled(width, height);
            for view in &mut views {
                view.camera = camera;
            }
            let mean = walk_color(&room, &views);
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
        self.developed(index, trace(&self.room, view))
    }

    /// [`TrainingScan::frame`] from rays that a GPU has cast.
    #[cfg(feature = "gpu")]
    pub fn frame_of(&self, gathered: &crate::training::gpu::Gathered) -> Frame {
        use crate::training::render::{finish, paint};
        let view = &self.views[gathered.index];
        let (mut points, light) = gathered.read(&self.room, view);
        for point in points.iter_mut().filter(|point| point.t > 0.0) {
            paint(&self.room, view, point);
        }
        self.developed(gathered.index, finish(&self.room, view, &points, light))
    }

    fn developed(&self, index: usize, linear: Linear) -> Frame {
        let view = &self.views[index];
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

    /// The views as a tracker would tell them: off by up to some 15 mm and half a degree, a scan more than another; half of
    /// that changes slowly over the walk, half from frame to frame.
    pub fn tracked(&self) -> Vec<View> {
        const KNOT: usize = 12;
        let seed = self.seed as u32 ^ 0x70A5;
        // Nearly a normal distribution of deviation 1.
        let bell = |at: usize, k: i32| {
            let draw = |part: i32| hash_unit(at as i32, k, part, seed);
            2.0 * (draw(0) + draw(1) + draw(2)) - 3.0
        };
        let [shift_m, turn] = [
            0.002 + 0.008 * hash_unit(0, 0, 7, seed),
            0.001 + 0.004 * hash_unit(0, 0, 8, seed),
        ];
        let off = |frame: usize, k: i32| {
            let share = (frame % KNOT) as f32 / KNOT as f32;
            let [from, to] = [frame / KNOT, frame / KNOT + 1].map(|knot| bell(knot, k));
            0.7 * (from + share * (to - from)) + 0.7 * bell(frame, k + 6)
        };
        let vector =
            |frame: usize, k: i32| Vec3::new(off(frame, k), off(frame, k + 1), off(frame, k + 2));
        let told = |(frame, view): (usize, &View)| {
            let turned = Quat::from_scaled_axis(turn * vector(frame, 3));
            View {
                rotation: Mat3::from_quat(turned) * view.rotation,
                position_m: view.position_m + shift_m * vector(frame, 0),
                ..*view
            }
        };
        self.views.iter().enumerate().map(told).collect()
    }

    /// The scan's text files in the 7-Scenes layout, calibration and poses of `views`, by name.
    pub fn texts(&self, views: &[View]) -> Vec<(String, String)> {
        seven_scenes_upright(views)
            .into_iter()
            .filter_map(|(name, content)| match content {
                Content::Text(text) => Some((name, text)),
                Content::Color(_) | Content::Depth(_) => None,
            })
            .collect()
    }
}

/// Mean colour over the whole walk, from a few tiny pictures.
fn walk_color(room: &TrainingRoom, views: &[View]) -> Vec3 {
    const LOOKS: usize = 8;
    let step = views.len().div_ceil(LOOKS).max(1);
    let tiny = |view: &View| View {
        camera: view.camera.scaled(32, 24),
        ..*view
    };
    let looks: Vec<Vec3> = views
        .iter()
        .step_by(step)
        .map(|view| mean_color(&trace(room, &tiny(view)).color))
        .collect();
    let mean = looks.iter().sum::<Vec3>() / looks.len().max(1) as f32;
    mean.max(Vec3::splat(1e-4))
}
