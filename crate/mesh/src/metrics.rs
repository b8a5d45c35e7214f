//! The figures of the paper's Table 2 and section on stability, as plain functions of numbers.

pub mod depth;
pub mod robustness;
mod surface;

pub use depth::{Depth2d, depth_2d};
pub(crate) use surface::Distances;
pub use surface::{Surface3d, compare_points};
