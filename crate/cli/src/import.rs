//! `ipdrecon import`: a checkpoint of VoRTX's own code that a user owns, as weights of this program.

use crate::failure::Failure;
use burn::tensor::Device;
use clap::Args;
use net::weights::{Precision, save, vortx};
use pytorch_reader::{DType, PytorchReader, Tensor};
use std::{fs, path::PathBuf};

/// What `import` is told.
#[derive(Args)]
pub struct Arguments {
    /// The checkpoint of VoRTX: a file of `torch.save`, with the weights alone or under `state_dict`.
    checkpoint: PathBuf,
    /// The weights to write (.safetensors).
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs `import`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.checkpoint;
    let unreadable = |error: String| Failure::Checkpoint {
        path: path.clone(),
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
    let network = vortx::import(read, reader.len(), &Device::flex());
    if let Some(error) = fault {
        return Err(unreadable(error));
    }
    let weights = |error| Failure::Weights {
        path: path.clone(),
        error: Box::new(error),
    };
    let bytes = save(&network?, Precision::F16).map_err(weights)?;
    fs::write(&arguments.output, bytes)
        .map_err(|error| Failure::file("write", &arguments.output, error))?;
    eprintln!(
        "{}: VoRTX's network, {} tensors read",
        arguments.output.display(),
        reader.len()
    );
    Ok(())
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
