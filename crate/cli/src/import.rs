//! `ipdrecon import`: weights made ready for release, and a checkpoint of VoRTX's own code that a user owns.

use crate::{failure::Failure, weights::Weights};
use burn::tensor::Device;
use clap::Args;
use net::{
    Ipdrecon,
    weights::{self, Precision, save},
};
use pytorch_reader::{DType, PytorchReader, Tensor};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// What `import` is told.
#[derive(Args)]
pub struct Arguments {
    /// Weights of `ipdrecon train`; or a checkpoint of VoRTX: a file of `torch.save`, with the weights alone or under
    /// `state_dict`.
    checkpoint: PathBuf,
    /// The weights to write (.safetensors), in 16 bits.
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs `import`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.checkpoint;
    let network = if path
        .extension()
        .is_some_and(|ending| ending == "safetensors")
    {
        Weights::read(Some(path))?.get(|bytes| weights::load(bytes, &Device::flex()))?
    } else {
        vortx(path)?
    };
    let bytes = save(&network, Precision::F16).map_err(|error| Failure::Weights {
        path: path.clone(),
        error: Box::new(error),
    })?;
    fs::write(&arguments.output, &bytes)
        .map_err(|error| Failure::file("write", &arguments.output, error))?;
    eprintln!("{}: {} bytes", arguments.output.display(), bytes.len());
    Ok(())
}

/// The network of a file of `torch.save`.
fn vortx(path: &Path) -> Result<Ipdrecon, Failure> {
    let unreadable = |error: String| Failure::Checkpoint {
        path: path.to_owned(),
        error,
    };
    fs::metadata(path).map_err(|error| Failure::file("read", path, error))?;
    // Lightning puts the weights under a key, beside much else.
    let reader = PytorchReader::with_top_level_key(path, "state_dict")
        .or_else(|_| PytorchReader::new(path))
        .map_err(|error| unreadable(error.to_string()))?;
    let mut fault = None;
    let read = |name: &str| {
        let tensor = reader.get(name)?;
        match numbers(tensor) {
            Ok(values) => Some((tensor.shape().to_vec(), values)),
            Err(error) => {
                fault.get_or_insert(format!("{name}: {error}"));
                None
            }
        }
    };
    let network = net::weights::vortx::import(read, reader.len(), &Device::flex());
    match fault {
        Some(error) => Err(unreadable(error)),
        None => Ok(network?),
    }
}

fn numbers(tensor: &Tensor) -> Result<Vec<f32>, String> {
    let bytes = tensor.read().map_err(|error| error.to_string())?;
    match tensor.dtype() {
        DType::F32 => {
            let words = bytes.as_chunks::<4>().0.iter();
            Ok(words.map(|word| f32::from_le_bytes(*word)).collect())
        }
        DType::F64 => {
            let words = bytes.as_chunks::<8>().0.iter();
            Ok(words.map(|word| f64::from_le_bytes(*word) as f32).collect())
        }
        found => Err(format!("expected 32-bit floats, found {found:?}")),
    }
}
