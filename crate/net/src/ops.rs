//! Operations that burn does not have. Each is a trait of burn's backend extension with a plain body of tensor operations.

pub mod affine;
pub mod attention;
pub mod batch_norm;
pub mod depthwise;
pub(crate) mod flex;
mod lanes;
pub mod linrec;
pub mod pointwise;
pub mod pool;
pub mod rows;
pub mod segments;
pub mod sparse_conv;
pub mod upsample;
pub mod views;
pub(crate) mod wide;
