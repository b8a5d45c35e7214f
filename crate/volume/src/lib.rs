//! The voxel lattice: a sparse truncated signed distance field (TSDF) in bricks of 8x8x8 lattice points, the
//! integration of depth images into it, and marching cubes.
//!
//! The field lives in burn tensors. Each operation has two forms that give the same results: `plain`, composed of
//! tensor operations and running on any device, and `fused`, one CubeCL kernel for WebGPU and its native relatives.
//!
//! Lattice point `i` lies at `i * voxel_size_m` in the canonical world (metres, Z up): a point, not the centre of a cell.
//! Distances are positive in free space and negative behind the surface, in units of the truncation distance.

mod allocate;
mod compute;
mod error;
mod evidence;
mod extract;
mod field;
mod integrate;
mod lattice;
mod points;
mod view;
mod volume;

pub use error::VolumeError;
pub use extract::{BrickMeshes, SurfaceRule};
pub use lattice::{BRICK_EDGE, BRICK_VOXELS, Brick};
pub use mesh::soup::Evidence;
pub use points::Point;
pub use view::DepthView;
pub use volume::{BYTES_PER_BRICK, Volume, VolumeConfig};
