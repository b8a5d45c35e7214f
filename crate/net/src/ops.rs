//! Operations that burn does not have. Each is a trait of burn's backend extension with a plain body of tensor operations.

pub mod affine;
pub mod attention;
pub(crate) mod flex;
pub mod linrec;
pub mod pool;
pub mod rows;
pub mod segments;
pub mod sparse_conv;
pub mod upsample;
