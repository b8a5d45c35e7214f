//! A look at scans that the network never learns from: always the same samples, without augmentation.

use super::numbers::Numbers;
use super::sample_options;
use crate::config::TrainConfig;
use crate::data::{Augment, Sampler, ScanSet};
use crate::error::TrainError;
use crate::feed::Feed;
use crate::task::{Descent, Moment, Task};
use burn::tensor::Device;
use net::sample::Sample;
use std::sync::Arc;

/// Keeps the samples of another run apart from these.
const SEED: u64 = 0x7E57;

/// Held-out samples, made at the first look and kept.
pub struct Validation {
    set: Arc<ScanSet>,
    config: TrainConfig,
    samples: Vec<Sample>,
}

impl Validation {
    /// Nothing is made yet.
    pub fn new(set: Arc<ScanSet>, config: &TrainConfig) -> Self {
        Self {
            set,
            config: config.clone(),
            samples: Vec::new(),
        }
    }

    /// Means over the held-out samples: losses as in training, occupancy as in use.
    pub(super) fn look<T: Task>(
        &mut self,
        task: &T,
        model: &T::Model,
        fine_tune: bool,
        device: &Device,
    ) -> Result<Numbers, TrainError> {
        self.make()?;
        let [taught, alone] = [Descent::Taught, Descent::Alone].map(|descent| {
            let mut numbers = Numbers::default();
            for (number, sample) in self.samples.iter().enumerate() {
                let moment = Moment {
                    seed: number as u64,
                    fine_tune,
                    descent,
                };
                numbers.add(task.look(model, sample, &moment, device));
            }
            numbers
        });
        Ok(taught.with_occupancy(alone))
    }

    fn make(&mut self) -> Result<(), TrainError> {
        let wanted = self.config.output.validation_samples;
        if self.samples.len() >= wanted {
            return Ok(());
        }
        let plain = Augment {
            rotate: false,
            mirror: false,
            photometric: false,
            thin_guide: false,
            pose_noise_m: 0.0,
            pose_noise_deg: 0.0,
        };
        let mut options = sample_options(&self.config, plain);
        options.seed = SEED;
        let set = self.set.clone();
        let mut feed = Feed::start(self.config.data.threads, wanted, 0, move || {
            let mut sampler = Sampler::new(set.clone(), options);
            move |number| sampler.sample(number)
        })?;
        self.samples = (0..wanted).map(|_| feed.take()).collect::<Result<_, _>>()?;
        Ok(())
    }
}
