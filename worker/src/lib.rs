//! The engine in the browser: compute and renderer in one module worker, on one device.
//!
//! The only place with wasm-bindgen. Typed messages come in ([`messages::Request`]), events go out ([`messages::Event`]);
//! the work itself is `recon`'s, the pictures are `view`'s.
#![cfg(target_family = "wasm")]

mod convert;
mod engine;
mod files;
mod handle;
mod handoff;
mod job;
pub mod messages;
mod platform;
mod stage;

pub use handle::Handle;
