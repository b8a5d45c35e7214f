//! Losses to weights: what the network learns from, and how.
//!
//! [`data`] makes samples of scans with depth: a dense signed distance field, a turned crop of it, the views that see
//! it. [`feed`] prepares them ahead on threads of its own. [`trainer`] walks down the gradient, looks at held-out scans,
//! and writes checkpoints from which a run goes on as if it had never stopped.

pub mod adam;
pub mod checkpoint;
pub mod config;
pub mod cost;
pub mod data;
mod error;
pub mod feed;
pub mod log;
pub mod network;
pub mod plot;
pub mod random;
pub mod task;
pub mod trainer;

pub use config::TrainConfig;
pub use error::TrainError;
