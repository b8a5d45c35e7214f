//! The pictures, drawn with wgpu.

mod frame;
mod painter;
mod pick;
mod pipelines;
mod scene;

pub use painter::GpuPainter;
pub use pick::Picking;
pub use scene::Scene;
