//! What can go wrong in the volume.

use burn::tensor::DType;

/// What can go wrong in the volume, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// The surface needs more bricks than one buffer of the device holds.
    #[error(
        "the scan needs more than {limit} bricks of voxels, which is what one buffer of this device holds; \
         use larger voxels (now {voxel_size_m} m) or a smaller maximum depth (now {max_depth_m} m)"
    )]
    TooManyBricks {
        /// Bricks that fit.
        limit: usize,
        /// Edge of a voxel.
        voxel_size_m: f32,
        /// Depth that is still used.
        max_depth_m: f32,
    },
    /// An image whose length is not width times height.
    #[error(
        "expected a {what} image of {expected} values ({width} x {height}), found {found}; check the camera that was given with it"
    )]
    ImageSize {
        /// Depth, confidence or colour.
        what: &'static str,
        /// Width of the camera's image.
        width: u32,
        /// Height of the camera's image.
        height: u32,
        /// Width times height.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A voxel size, truncation or depth that no volume can have.
    #[error(
        "expected {what} to be a positive number of metres, found {found}; set it to something like {example}"
    )]
    Setting {
        /// Which setting.
        what: &'static str,
        /// Its value.
        found: f32,
        /// A usual value.
        example: f32,
    },
    /// The device failed to give a result back.
    #[error(
        "the device did not return a result ({0}); it may have been lost: start again, with larger voxels if it happens again"
    )]
    Device(String),
    /// A tensor of another type than the kernels work with.
    #[error(
        "expected {expected:?} values on the device, found {found:?}; this is a defect of the program, please report it"
    )]
    Type {
        /// What the kernels need.
        expected: DType,
        /// What there is.
        found: DType,
    },
}
