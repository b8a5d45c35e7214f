//! The network itself, as the trainer sees it.

use crate::config::TrainConfig;
use crate::cost;
use crate::error::TrainError;
use crate::task::{Descent, Moment, Outcome, Task, seeded};
use burn::tensor::Device;
use net::fusion::Pooling;
use net::loss::{LossOptions, loss};
use net::sample::Sample;
use net::weights::{self, Precision};
use net::{Ipdrecon, NetConfig};

/// IPDRecon under a run's settings.
pub struct Network {
    net: NetConfig,
    size: [u32; 2],
    most_sites: [usize; 2],
    start: Option<Vec<u8>>,
}

impl Network {
    /// The network that the settings name; `start` is a file of weights to begin with.
    pub fn new(config: &TrainConfig, start: Option<Vec<u8>>) -> Self {
        Self {
            net: config.net.config(),
            size: config.data.size,
            most_sites: config.train.most_sites,
            start,
        }
    }
}

impl Task for Network {
    type Model = Ipdrecon;

    fn fresh(&self, seed: u64, device: &Device) -> Result<Ipdrecon, TrainError> {
        match &self.start {
            Some(bytes) => self.load(bytes, device),
            None => Ok(seeded(seed, device, || Ipdrecon::new(&self.net, device))),
        }
    }

    fn look(&self, model: &Ipdrecon, sample: &Sample, moment: &Moment, device: &Device) -> Outcome {
        let taught = moment.descent == Descent::Taught;
        let [most_medium, most_fine] = self.most_sites;
        let options = LossOptions {
            pooling: if moment.fine_tune {
                Pooling::Softmax
            } else {
                Pooling::Mean
            },
            // Alone, every medium voxel is needed to count what was missed.
            most_sites: [if taught { most_medium } else { usize::MAX }, most_fine],
            seed: moment.seed,
            at_least_true: taught,
        };
        let size = self.size.map(|side| side as usize);
        let found = loss(model, sample, size, &options, device);
        let mut parts: Vec<_> = found
            .parts
            .into_iter()
            .map(|(name, part)| (logged(name), part))
            .collect();
        parts.push(("distance_error_m", found.distance_error_m));
        let [coarse, mut medium] = found
            .occupancy
            .map(|found| [found.hits, found.false_alarms, found.misses]);
        if !taught {
            // What lies below coarse voxels that were missed is missed too.
            medium[2] = occupied_medium(sample) - medium[0];
        }
        Outcome {
            total: found.total,
            parts,
            occupancy: vec![("coarse", coarse), ("medium", medium)],
            sites: found.sites,
            pairs: found.pairs,
        }
    }

    fn forward_macs(&self, views: usize, sites: [usize; 3], pairs: [usize; 3]) -> f64 {
        cost::forward_macs(&self.net, self.size, views, sites, pairs)
    }

    fn save(&self, model: &Ipdrecon) -> Result<Vec<u8>, TrainError> {
        weights::save(model, Precision::F32).map_err(|error| TrainError::Weights(error.to_string()))
    }

    fn load(&self, bytes: &[u8], device: &Device) -> Result<Ipdrecon, TrainError> {
        let unfit = |error: net::weights::WeightsError| TrainError::Weights(error.to_string());
        let found = weights::config(bytes).map_err(unfit)?;
        if found != self.net {
            return Err(TrainError::unfit(
                "weights",
                format!(
                    "those of the network that the settings name, {:?}",
                    self.net
                ),
                format!("those of {found:?}"),
                "change [net] in the settings, or give other weights",
            ));
        }
        weights::load(bytes, device).map_err(unfit)
    }
}

/// Medium voxels that are known to be occupied.
fn occupied_medium(sample: &Sample) -> usize {
    let truth = &sample.truth;
    let voxels = truth.occupied[1].iter().zip(&truth.supervised[1]);
    voxels
        .filter(|(occupied, known)| **occupied && **known)
        .count()
}

/// Parts of the loss begin with `loss_` in the log.
fn logged(name: &str) -> &'static str {
    match name {
        "view_coarse" => "loss_view_coarse",
        "view_medium" => "loss_view_medium",
        "view_fine" => "loss_view_fine",
        "occupancy_coarse" => "loss_occupancy_coarse",
        "occupancy_medium" => "loss_occupancy_medium",
        _ => "loss_distance_fine",
    }
}
