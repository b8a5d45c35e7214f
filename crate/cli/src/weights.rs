//! Weights: a file's, or those that come with the program.

use crate::failure::Failure;
use net::weights::WeightsError;
use std::{
    borrow::Cow,
    fs,
    path::{Path, PathBuf},
};

/// The trained network that comes with the program; weights/README.md is its card.
const RELEASED: &[u8] = include_bytes!("../../../weights/ipdrecon.safetensors");

/// The bytes of a file of weights.
pub struct Weights {
    path: PathBuf,
    bytes: Cow<'static, [u8]>,
}

impl Weights {
    /// Reads a file; without one takes the released weights.
    pub fn read(path: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = path else {
            return Ok(Self {
                path: "the weights that come with this program".into(),
                bytes: RELEASED.into(),
            });
        };
        let bytes = fs::read(path).map_err(|error| Failure::file("read", path, error))?;
        Ok(Self {
            path: path.to_owned(),
            bytes: bytes.into(),
        })
    }

    /// What `of` makes of the bytes, or what is wrong with them.
    pub fn get<T>(&self, of: impl FnOnce(&[u8]) -> Result<T, WeightsError>) -> Result<T, Failure> {
        of(&self.bytes).map_err(|error| Failure::Weights {
            path: self.path.clone(),
            error: Box::new(error),
        })
    }
}
