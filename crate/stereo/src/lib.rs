//! Depth with confidence from posed colour alone.
#![allow(missing_docs)]
mod config;
pub mod consistency;
pub mod depth;
mod driver;
mod error;
pub mod fused;
pub mod planes;
pub mod smooth;
pub mod sources;
pub mod sweep;
pub mod view;
pub use config::StereoConfig;
pub use driver::{DepthMap, Step, Stereo, Tuning};
pub use error::StereoError;
