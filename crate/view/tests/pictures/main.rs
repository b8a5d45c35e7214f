//! Pictures of scenes made by rule, looked at pixel by pixel. Where there is no graphics adapter the tests that need one
//! say so and pass. `IPDRECON_PICTURES=<folder>` keeps the pictures as PNG files.

#![allow(clippy::unwrap_used)] // A failed step is a failed test.

mod arena;
mod cpu;
mod shading;
mod support;
