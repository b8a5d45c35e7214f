//! The engine in the browser: on WebGPU compute and renderer in one module worker, on one device; where the processor computes, each in a worker of its own.
//!
//! The only place with wasm-bindgen. Typed messages come in ([`messages::Request`]), events go out ([`messages::Event`]);
//! the work itself is `recon`'s, the pictures are `view`'s.
#![cfg(target_family = "wasm")]

mod convert;
mod device;
mod engine;
mod files;
mod given;
mod handle;
mod handoff;
mod job;
pub mod messages;
mod page;
mod picture;
mod platform;
mod rates;
mod screen;
mod sink;
mod stage;
mod viewer;
mod weights;

pub use handle::Handle;

use wasm_bindgen::prelude::wasm_bindgen;

unsafe extern "C" {
    /// Made by the linker: what libraries register before a program's `main`.
    fn __wasm_call_ctors();
}

/// Once a module, before anything else. The linker sees that the registrations are called here. In a module that nowhere calls them it puts them before
/// every entry from JavaScript, each allocation for a string and each promise's answer among them: a picture's planes then took WebGPU ten
/// times as long.
#[wasm_bindgen(start)]
fn begin() {
    console_error_panic_hook::set_once();
    // SAFETY: the module's first entry, and the only one that calls it.
    unsafe { __wasm_call_ctors() };
}
