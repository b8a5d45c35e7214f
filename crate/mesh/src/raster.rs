//! A mesh seen by a camera, on the CPU: depth for the metrics.

mod depth;
mod front;

pub use depth::depth;

/// Which sides of a triangle are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cull {
    /// Both sides.
    None,
    /// Only the front: corners counter-clockwise as the camera sees them.
    Back,
}
