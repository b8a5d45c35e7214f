//! What can go wrong.

/// Why stereo could not go on.
#[derive(Debug, thiserror::Error)]
pub enum StereoError {
    /// A setting that makes no sense.
    #[error("expected {what}, found {found}")]
    Setting {
        /// What would make sense.
        what: &'static str,
        /// What was given.
        found: String,
    },
    /// No two pictures see the same thing from different places.
    #[error(
        "expected pictures that see the same things from places at least {least_m} m apart, found none among {keyframes} keyframes; \
         walk sideways while scanning instead of turning on the spot"
    )]
    NoParallax {
        /// Keyframes looked at.
        keyframes: usize,
        /// The least distance between two cameras, in metres.
        least_m: f64,
    },
    /// The device failed.
    #[error("the device failed: {0}")]
    Device(String),
}
