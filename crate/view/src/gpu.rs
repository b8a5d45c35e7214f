//! The pictures, drawn with wgpu.

mod frame;
mod painter;
mod pick;
mod pipelines;

pub use painter::{GpuPainter, Scene};
pub use pick::Picking;
