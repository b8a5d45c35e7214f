//! What a painter draws.

use crate::Arena;
use crate::lines::Frusta;
use crate::look::Look;

/// What is in the picture.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The surface.
    pub arena: &'a Arena,
    /// The photos' cameras.
    pub frusta: &'a Frusta,
    /// How it looks.
    pub look: &'a Look,
}
