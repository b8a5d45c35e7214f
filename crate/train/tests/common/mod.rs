//! Scans to learn from, and a network small enough to test a trainer with.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used)]

use burn::module::Module;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, Linear, LinearConfig};
use burn::tensor::{Device, Tensor, TensorData};
use net::sample::Sample;
use scan::MemorySource;
use std::rc::Rc;
use std::sync::Arc;
use synth::{Layout, SampleScan};
use train::data::{Augment, SampleOptions, ScanSet};
use train::task::{Moment, Outcome, Task, seeded};
use train::{TrainConfig, TrainError};

/// Depth cut of the tests: far enough that a room's walls are all measured.
pub const MAX_DEPTH_M: f32 = 8.0;

/// The made-up room `seed` in the ScanNet layout, whose world is the room's own, with exact depth.
pub fn room(seed: u64, frames: usize, width: u32, height: u32) -> SampleScan {
    SampleScan::new(seed, frames, width, height)
        .with_layout(Layout::ScanNet)
        .without_noise()
}

/// A set of rooms with the seeds `0..count`, each drawn once.
pub fn rooms(count: u64, frames: usize, width: u32, height: u32) -> Arc<ScanSet> {
    let names: Vec<String> = (0..count).map(|seed| format!("room {seed}")).collect();
    let drawn: Vec<Vec<(String, Vec<u8>)>> = (0..count)
        .map(|seed| {
            let scan = room(seed, frames, width, height);
            let files = scan.files().map(|(path, bytes)| (path.to_owned(), bytes));
            files.collect()
        })
        .collect();
    let open = move |i: usize| {
        let scan = scan::open(Rc::new(MemorySource::new(drawn[i].clone())));
        scan.map_err(|error| TrainError::Scan {
            scan: format!("room {i}"),
            error,
        })
    };
    Arc::new(ScanSet::new(&names, Arc::new(open), 1, MAX_DEPTH_M).unwrap())
}

/// Samples without any change by chance but the crop's place.
pub fn plain(seed: u64) -> SampleOptions {
    SampleOptions {
        seed,
        views: [8; 2],
        size: [160, 112],
        crop: [48, 48, 32],
        least_seen: 0.2,
        guide: false,
        augment: Augment {
            rotate: false,
            mirror: false,
            photometric: false,
            thin_guide: false,
            pose_noise_m: 0.0,
            pose_noise_deg: 0.0,
        },
    }
}

/// Settings of a short run into `folder`.
pub fn settings(folder: &std::path::Path, steps: u64) -> TrainConfig {
    let text = format!(
        "seed = 7
        [net]
        preset = \"small\"
        [data]
        scans = [\"none\"]
        views = 3
        size = [32, 32]
        crop = [16, 16, 16]
        threads = 2
        ahead = 3
        [train]
        steps = {steps}
        fine_tune_from = 12
        rate = 0.01
        warm_up = 4
        batch = 2
        clip = 1.0
        [output]
        folder = {folder:?}
        validate_every = 5
        validation_samples = 2
        checkpoint_every = 10
        keep = 2"
    );
    TrainConfig::parse(&text, "the test's settings").unwrap()
}

/// From the pictures' looks to nearly the same number for every sample: of no use, but it learns.
#[derive(Module, Debug)]
pub struct Toy {
    conv: Conv2d,
    norm: BatchNorm,
    out: Linear,
}

/// The trainer's view of [`Toy`].
pub struct ToyTask {
    /// Width and height of the pictures.
    pub size: [usize; 2],
}

impl Task for ToyTask {
    type Model = Toy;

    fn fresh(&self, seed: u64, device: &Device) -> Result<Toy, TrainError> {
        Ok(seeded(seed, device, || Toy {
            conv: Conv2dConfig::new([3, 4], [3, 3]).init(device),
            norm: BatchNormConfig::new(4).init(device),
            out: LinearConfig::new(4, 1).init(device),
        }))
    }

    fn look(&self, model: &Toy, sample: &Sample, _: &Moment, device: &Device) -> Outcome {
        let [width, height] = self.size;
        let shape = [sample.views.len(), 3, height, width];
        let images = Tensor::<4>::from_data(TensorData::new(sample.images.clone(), shape), device);
        let features = model.norm.forward(model.conv.forward(images / 255.0));
        let features = features.clamp_min(0.0).mean_dim(3).mean_dim(2);
        let said = model.out.forward(features.reshape([shape[0], 4])).mean();
        let occupied = &sample.truth.occupied[2];
        let share = occupied.iter().filter(|o| **o).count() as f32 / occupied.len() as f32;
        let total = (said - (0.7 + 0.1 * share)).powi_scalar(2);
        Outcome {
            parts: vec![("loss_share", total.clone().detach())],
            occupancy: vec![("coarse", [3, 1, 0])],
            sites: [10, 20, 40],
            pairs: [30, 60, 120],
            total,
        }
    }

    fn forward_macs(&self, _: usize, _: [usize; 3], _: [usize; 3]) -> f64 {
        1e6
    }

    fn save(&self, model: &Toy) -> Result<Vec<u8>, TrainError> {
        let numbers = net::named::tensors(model).into_iter();
        let numbers = numbers.flat_map(|(_, data)| data.iter::<f32>().collect::<Vec<_>>());
        Ok(numbers.flat_map(f32::to_le_bytes).collect())
    }

    fn load(&self, bytes: &[u8], device: &Device) -> Result<Toy, TrainError> {
        let words = bytes.as_chunks::<4>().0.iter();
        let mut numbers = words.map(|&word| f32::from_le_bytes(word));
        let fresh = self.fresh(0, device)?;
        Ok(net::named::replace(fresh, |_, shape| {
            Some(numbers.by_ref().take(shape.iter().product()).collect())
        }))
    }
}
