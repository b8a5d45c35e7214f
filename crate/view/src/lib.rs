//! The picture of the mesh while it grows: what the visitor sees, and how they move through it.
//!
//! [`Controls`] turns pointer and key events into an [`OrbitCamera`]. The mesh lives brick by brick in an [`Arena`] on
//! the GPU that computes it, and [`GpuPainter`] draws it there; [`CpuPainter`] makes the same pictures without one. Everything runs on a wgpu device and a texture that the
//! caller owns; no window, page or event type of any platform is known here.

mod arena;
mod bounds;
mod camera;
mod controls;
mod cpu;
mod free_list;
mod gpu;
mod input;
mod lines;
mod look;

pub use arena::{Arena, ArenaError};
pub use camera::{OrbitCamera, Ray};
pub use controls::Controls;
pub use cpu::CpuPainter;
pub use gpu::{GpuPainter, Picking, Scene};
pub use input::{Input, PointerKind};
pub use lines::{CameraPose, Frusta};
pub use look::{Look, RAMP, Shading, Theme, UNKNOWN, Viewport};
