//! A mesh seen by a camera, on the CPU: depth for the metrics, and pictures where there is no GPU.

mod depth;
mod scene;
mod shaded;

pub use depth::depth;
pub use shaded::{Style, shaded};

/// Which sides of a triangle are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cull {
    /// Both sides.
    None,
    /// Only the front: corners counter-clockwise as the camera sees them.
    Back,
}
