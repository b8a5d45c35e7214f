//! IPDRecon: posed colour pictures of a room in, a truncated signed distance field on a sparse lattice out.
//!
//! Three stages, each at 16, 8 and 4 cm: [`planes`] makes feature planes of every picture (once a frame), [`fusion`]
//! samples them at the voxels and merges what the views say of each, [`decode`] completes and sharpens that in 3D.
//! [`ops`] holds what burn has no operation for.

pub mod config;
pub mod decode;
pub mod fusion;
pub mod guide;
pub mod loss;
pub mod model;
pub mod named;
pub mod ops;
pub mod planes;
pub mod sample;
pub mod view;
pub mod weights;

pub use config::{Level, NetConfig};
pub use model::Ipdrecon;
pub use sample::Sample;
pub use view::View;
