//! Operations that burn does not have. Each is a trait of burn's backend extension with a plain body of tensor operations.
