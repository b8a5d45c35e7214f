//! What a trainer needs to know of the network that it trains.

use crate::error::TrainError;
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor};
use net::sample::Sample;
use std::sync::{Mutex, PoisonError};

/// When a sample is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Decides what the loss draws by chance.
    pub seed: u64,
    /// Phase 2: weighted pooling.
    pub fine_tune: bool,
    /// Which voxels are divided.
    pub descent: Descent,
}

/// Which voxels of a level are divided into those of the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Descent {
    /// Those that the network believes most to be occupied, as many as truly are at the least and up to a number: to learn.
    /// Losses of two networks can be compared, since a level is never spared for want of voxels.
    Taught,
    /// Those that the network believes to be occupied, as in use: to be judged.
    Alone,
}

/// A sample's loss, and how right the network was.
pub struct Outcome {
    /// What is made small, `[1]`.
    pub total: Tensor<1>,
    /// What it is the sum of, and other numbers worth a line in the log; each `[1]` and without gradient.
    pub parts: Vec<(&'static str, Tensor<1>)>,
    /// Hits, false alarms and misses of what is told by yes and no.
    pub occupancy: Vec<(&'static str, [usize; 3])>,
    /// Voxels of each level.
    pub sites: [usize; 3],
    /// Pairs of a voxel and a view that sees it.
    pub pairs: [usize; 3],
}

/// A network and its loss.
pub trait Task {
    /// The network.
    type Model: Module;

    /// The network as a run begins with it; `seed` decides what is drawn by chance.
    ///
    /// # Errors
    /// When it begins with given weights that do not fit.
    fn fresh(&self, seed: u64, device: &Device) -> Result<Self::Model, TrainError>;

    /// Runs the network over a sample.
    fn look(
        &self,
        model: &Self::Model,
        sample: &Sample,
        moment: &Moment,
        device: &Device,
    ) -> Outcome;

    /// Multiply-adds of running it forward over `views` pictures with these numbers of voxels and pairs: an estimate.
    fn forward_macs(&self, views: usize, sites: [usize; 3], pairs: [usize; 3]) -> f64;

    /// The weights as a file.
    ///
    /// # Errors
    /// When they are of no use.
    fn save(&self, model: &Self::Model) -> Result<Vec<u8>, TrainError>;

    /// The weights of a file that this task wrote.
    ///
    /// # Errors
    /// When the file is not that.
    fn load(&self, bytes: &[u8], device: &Device) -> Result<Self::Model, TrainError>;
}

/// A module whose weights `seed` decides. A device has one stream of random numbers and burn draws weights when they are
/// first asked for, so this draws all of them at once, and one module at a time.
pub fn seeded<M: Module>(seed: u64, device: &Device, make: impl FnOnce() -> M) -> M {
    static STREAM: Mutex<()> = Mutex::new(());
    let guard = STREAM.lock().unwrap_or_else(PoisonError::into_inner);
    device.seed(seed);
    let module = make();
    module.visit(&mut Draw);
    drop(guard);
    module
}

/// Asks for every tensor once.
struct Draw;

impl ModuleVisitor for Draw {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        drop(param.val());
    }
}
