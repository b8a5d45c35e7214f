//! Depth with confidence from posed colour alone: the classical way, plane by plane.
//!
//! [`StereoConfig::init`] chooses source views for every keyframe; [`Stereo::advance`] then works through them:
//! [`sweep`] compares a keyframe with its sources at every inverse-depth plane, [`smooth`] lets neighbouring pixels agree,
//! [`depth`] picks the winners, [`planes`] fits local planes around which a second, finer sweep goes on, and
//! [`consistency`] asks the sources' own depth what may be relied on. Those are the forms that run on the processor and that
//! define what is right; [`fused`] holds kernels for the first three.

mod config;
pub mod consistency;
pub mod depth;
mod driver;
mod error;
pub mod fused;
mod lanes;
mod pass;
pub mod planes;
mod pose_check;
mod recipe;
mod sample;
pub mod smooth;
pub mod sources;
pub mod sweep;
pub mod view;
mod window;

pub use config::StereoConfig;
pub use driver::{DepthMap, Step, Stereo, VIEWS_KEPT};
pub use error::StereoError;
pub use recipe::Recipe;
