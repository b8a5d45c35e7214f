//! One sample after another, each decided by the run's seed and its own number alone.

use super::augment;
use super::crop::{Crop, CropChance};
use super::picture::{Fit, mirror_view, single};
use super::set::ScanSet;
use super::views::{self, Sight};
use super::volume::{TruthVolume, VOXEL_M};
use crate::error::TrainError;
use crate::random::Random;
use glam::{Affine3A, Quat, Vec3};
use net::View;
use net::sample::Sample;
use scan::Scan;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::Arc;

/// What is changed by chance, so that no sample comes twice.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Augment {
    /// Turn the crop about the vertical.
    pub rotate: bool,
    /// Mirror every other crop.
    pub mirror: bool,
    /// Change light, colour and sharpness.
    pub photometric: bool,
    /// Leave out keyframes of stereo's depth: between none and three quarters of them, the share drawn anew each time.
    pub thin_guide: bool,
    /// Shift cameras by noise of this standard deviation, in metres along each axis.
    pub pose_noise_m: f32,
    /// Turn cameras by noise of this standard deviation, in degrees about each axis.
    pub pose_noise_deg: f32,
}

impl Default for Augment {
    fn default() -> Self {
        Self {
            rotate: true,
            mirror: true,
            photometric: true,
            thin_guide: true,
            pose_noise_m: 0.0,
            pose_noise_deg: 0.0,
        }
    }
}

/// What a sample is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleOptions {
    /// Decides everything drawn by chance.
    pub seed: u64,
    /// Pictures in a sample: any number between these, both included.
    pub views: [usize; 2],
    /// Width and height of the pictures.
    pub size: [u32; 2],
    /// Fine points of the crop along x, y and z.
    pub crop: [usize; 3],
    /// Frames whose picture holds at least this share of the crop's known points are taken first.
    pub least_seen: f32,
    /// Whether samples come with stereo's depth.
    pub guide: bool,
    /// What is changed by chance.
    pub augment: Augment,
}

/// Makes samples on one thread.
pub struct Sampler {
    set: Arc<ScanSet>,
    options: SampleOptions,
    open: HashMap<usize, Scan>,
}

impl Sampler {
    /// Nothing is opened yet.
    pub fn new(set: Arc<ScanSet>, options: SampleOptions) -> Self {
        Self {
            set,
            options,
            open: HashMap::new(),
        }
    }

    /// The scan that sample `number` shows: every scan once before one comes again, in an order drawn each round.
    pub fn scan_of(&self, number: u64) -> usize {
        let count = self.set.entries.len();
        let round = number / count as u64;
        let mut order: Vec<usize> = (0..count).collect();
        Random::new(self.options.seed ^ ORDER, round).shuffle(&mut order);
        order[(number % count as u64) as usize]
    }

    /// Sample `number`, the same whenever and wherever it is made.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn sample(&mut self, number: u64) -> Result<Sample, TrainError> {
        let index = self.scan_of(number);
        if !self.open.contains_key(&index) {
            let scan = self.set.open(index)?;
            self.open.insert(index, scan);
        }
        let scan = &self.open[&index];
        let volume = self.set.truth(index, scan)?;
        let mut random = Random::new(self.options.seed, number);
        let crop = self.crop(&volume, &mut random);
        let truth = crop.truth(&volume);
        let points = known_points(&crop, &truth.tsdf);
        let chosen = self.choose(index, &points, &mut random);
        let changes = augment::draw(self.options.size[0], &mut random);
        let mut sample = Sample {
            truth,
            ..Sample::default()
        };
        for frame in chosen {
            self.add_view(&mut sample, index, scan, frame, &crop, &mut random)?;
        }
        if self.options.augment.photometric {
            let [width, height] = self.options.size.map(|n| n as usize);
            for image in sample.images.chunks_exact_mut(3 * width * height) {
                changes.iter().for_each(|change| change.apply(image, width));
            }
        }
        if self.options.guide {
            let maps = self.set.guide(index, scan)?;
            let thin = self.options.augment.thin_guide;
            let share = if thin { random.range(0.25, 1.0) } else { 1.0 };
            sample.guide = maps.of_crop(&crop, &points, share, &mut random);
        }
        Ok(sample)
    }

    /// A box around some point near a surface. What of it lies outside of the scan is unseen.
    fn crop(&self, volume: &TruthVolume, random: &mut Random) -> Crop {
        let SampleOptions { crop, augment, .. } = self.options;
        let anchor = volume.near_point_m(random.below(volume.near));
        let chance = CropChance {
            rotate: augment.rotate,
            mirror: augment.mirror,
        };
        Crop::draw(crop, anchor.unwrap_or_default(), chance, random)
    }

    /// Frames that see enough of the points.
    fn choose(&self, index: usize, points: &[Vec3], random: &mut Random) -> Vec<usize> {
        let entry = &self.set.entries[index];
        let see = |frame: usize| {
            let frame = &entry.frames[frame];
            let camera = super::picture::pinhole(&frame.color_camera);
            let seen = views::seen(&camera, single(&frame.pose), points);
            Sight::new(seen, points.len(), self.options.least_seen)
        };
        let all = entry.frames.len();
        let [least, most] = self.options.views;
        let count = if least < most {
            least + random.below(most - least + 1)
        } else {
            most
        };
        views::choose(count, all, &entry.keyframes, see, random)
    }

    fn add_view(
        &self,
        sample: &mut Sample,
        index: usize,
        scan: &Scan,
        frame: usize,
        crop: &Crop,
        random: &mut Random,
    ) -> Result<(), TrainError> {
        let entry = &self.set.entries[index];
        let number = entry.numbers[frame];
        let frame = &entry.frames[frame];
        let unreadable = |error| TrainError::Picture {
            scan: entry.name.clone(),
            error,
        };
        let color = scan.color(number).map_err(unreadable)?;
        let depth = scan.depth(number).map_err(unreadable)?;
        let fit = Fit::new(color.width, color.height, self.options.size);
        let mut camera = fit.camera(&frame.color_camera);
        let mut image = fit.color(&color);
        let mut depth = match &depth {
            Some(depth) => fit.depth(&frame.color_camera, depth, &frame.depth_camera),
            None => vec![0.0; camera.pixels()],
        };
        if crop.mirrored {
            mirror_view(&mut camera, [&mut image, &mut depth]);
        }
        let noise = self.pose_noise(random);
        sample.views.push(View {
            camera,
            world_from_camera: crop.pose(single(&frame.pose)) * noise,
        });
        sample.images.extend(image);
        sample.depth_m.extend(depth);
        Ok(())
    }

    fn pose_noise(&self, random: &mut Random) -> Affine3A {
        let mut bells = || Vec3::new(random.bell(), random.bell(), random.bell());
        let (shift, turn) = (bells(), bells());
        let Augment {
            pose_noise_m,
            pose_noise_deg,
            ..
        } = self.options.augment;
        Affine3A::from_rotation_translation(
            Quat::from_scaled_axis(turn * pose_noise_deg.to_radians()),
            shift * pose_noise_m,
        )
    }
}

/// Every hundredth known point of the crop, in the scan's world.
fn known_points(crop: &Crop, tsdf: &[f32]) -> Vec<Vec3> {
    const EVERY: usize = 100;
    let [nx, ny, _] = crop.size;
    let known = tsdf
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > -0.999);
    let world_from_crop = crop.crop_from_world.inverse();
    known
        .step_by(EVERY)
        .map(|(i, _)| [i % nx, i / nx % ny, i / (nx * ny)])
        .map(|site| Vec3::from_array(site.map(|n| n as f32)) * VOXEL_M)
        .map(|point| world_from_crop.transform_point3(point))
        .collect()
}

/// Keeps the order of scans apart from what happens in a sample.
const ORDER: u64 = 0x0DDE_5CA9;
