//! Weights as files: safetensors in 16 or 32 bit, with the configuration and the format's version in the header.

pub mod vortx;

use std::collections::{HashMap, HashSet};
use std::{io, ops::Range};

use burn::tensor::Device;
use half::f16;
use safetensors::tensor::{Dtype, Metadata, SafeTensorError, TensorInfo, TensorView, serialize};

use crate::config::ConfigError;
use crate::{Ipdrecon, NetConfig, named};

/// The version of names and layouts that this code reads and writes.
const VERSION: &str = "1";
const KEY_VERSION: &str = "ipdrecon.version";
const KEY_CONFIG: &str = "ipdrecon.config";
/// The length of a safetensors file's header, which comes first.
const LENGTH_BYTES: usize = 8;

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 16-bit floats: for release.
    F16,
    /// 32-bit floats: for going on with training.
    F32,
}

/// A file that is read in parts, so that memory never holds more of it than its largest tensor.
pub trait WeightsFile {
    /// Its size in bytes.
    fn len(&self) -> usize;

    /// Whether there is nothing in it.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// These bytes of it, all below [`WeightsFile::len`].
    ///
    /// # Errors
    /// A file that cannot be read any more.
    fn read(&self, range: Range<usize>) -> io::Result<Vec<u8>>;
}

impl<B: AsRef<[u8]> + ?Sized> WeightsFile for B {
    fn len(&self) -> usize {
        self.as_ref().len()
    }

    fn read(&self, range: Range<usize>) -> io::Result<Vec<u8>> {
        let part = self.as_ref().get(range);
        part.map(<[u8]>::to_vec)
            .ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }
}

/// Why a file is not the weights of this network.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// No safetensors file, or cut short.
    #[error(
        "expected weights as a safetensors file, found {found_bytes} bytes that are none ({why}); \
         the file may be cut short: copy or download it again"
    )]
    Format {
        /// Size of what was given.
        found_bytes: usize,
        /// What the reader stumbled over.
        why: SafeTensorError,
    },
    /// The file could not be read.
    #[error("expected to read the weights, found: {0}; give the file again")]
    Unreadable(#[from] io::Error),
    /// A safetensors file of another program.
    #[error(
        "expected `{KEY_CONFIG}` in the header of the weights, found none; \
         this safetensors file was not written by IPDRecon: use one that `ipdrecon train` made"
    )]
    NotOurs,
    /// Written for another version.
    #[error(
        "expected weights of version {VERSION}, found version {found}; use the program that wrote them, or train again"
    )]
    Version {
        /// The file's version.
        found: String,
    },
    /// The stored configuration cannot be read.
    #[error(
        "expected a network's configuration in the header of the weights, found one that cannot be read: {0}"
    )]
    Config(#[from] serde_json::Error),
    /// The stored configuration makes no sense.
    #[error(transparent)]
    Impossible(#[from] ConfigError),
    /// Tensors are missing, or there are some that the network does not have.
    #[error(
        "expected the tensors of the configuration in the file, found {missing} missing and {unknown} unknown (first: `{first}`); \
         the file is damaged or was edited"
    )]
    Names {
        /// Tensors of the network that the file lacks.
        missing: usize,
        /// Tensors of the file that the network lacks.
        unknown: usize,
        /// One of them.
        first: String,
    },
    /// A tensor of another shape.
    #[error(
        "expected `{name}` of shape {expected:?}, found {found:?}; the weights do not fit the configuration in their header"
    )]
    Shape {
        /// The tensor.
        name: String,
        /// Its shape in the network.
        expected: Vec<usize>,
        /// Its shape in the file.
        found: Vec<usize>,
    },
    /// Numbers of another type.
    #[error("expected `{name}` as F16 or F32, found {found:?}; convert the file")]
    Type {
        /// The tensor.
        name: String,
        /// Its type in the file.
        found: Dtype,
    },
    /// Numbers that are no numbers.
    #[error(
        "expected finite numbers in `{name}`, found NaN or infinity; the training that wrote it had diverged: use an earlier checkpoint"
    )]
    NotFinite {
        /// The tensor.
        name: String,
    },
}

/// The file's bytes. Reads the tensors from the device at once, which a browser's GPU does not allow.
///
/// # Errors
/// A model whose numbers are not finite: such weights are of no use to anybody.
pub fn save(model: &Ipdrecon, precision: Precision) -> Result<Vec<u8>, WeightsError> {
    let mut stored = Vec::new();
    for (name, data) in named::tensors(model) {
        let shape = data.shape().to_vec();
        let values: Vec<f32> = data.iter::<f32>().collect();
        let (bytes, kept): (Vec<u8>, bool) = match precision {
            Precision::F32 => (
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
                values.iter().all(|v| v.is_finite()),
            ),
            Precision::F16 => {
                let halves = values.iter().map(|&v| f16::from_f32(v));
                (
                    halves.clone().flat_map(f16::to_le_bytes).collect(),
                    halves.clone().all(f16::is_finite),
                )
            }
        };
        if !kept {
            return Err(WeightsError::NotFinite { name });
        }
        stored.push((name, shape, bytes));
    }
    let dtype = match precision {
        Precision::F16 => Dtype::F16,
        Precision::F32 => Dtype::F32,
    };
    let header = HashMap::from([
        (KEY_VERSION.to_owned(), VERSION.to_owned()),
        (
            KEY_CONFIG.to_owned(),
            serde_json::to_string(model.config())?,
        ),
    ]);
    let format = |why| WeightsError::Format {
        found_bytes: 0,
        why,
    };
    let mut views = Vec::with_capacity(stored.len());
    for (name, shape, bytes) in &stored {
        let view = TensorView::new(dtype, shape.clone(), bytes).map_err(format)?;
        views.push((name.as_str(), view));
    }
    serialize(views, Some(header)).map_err(format)
}

/// The configuration in a file's header.
///
/// # Errors
/// No weights of this network's version.
pub fn config(file: &(impl WeightsFile + ?Sized)) -> Result<NetConfig, WeightsError> {
    Header::read(file)?.config()
}

/// The network in a file, on `device`, read tensor by tensor.
///
/// # Errors
/// A file that is cut short, of another program or version, or that does not fit its own configuration.
pub fn load(file: &(impl WeightsFile + ?Sized), device: &Device) -> Result<Ipdrecon, WeightsError> {
    let header = Header::read(file)?;
    let config = header.config()?;
    let mut unused: HashSet<String> = header.metadata.offset_keys().into_iter().collect();
    let mut missing = Vec::new();
    let mut fault = None;
    let model = named::replace(Ipdrecon::new(&config, device), |name, shape| {
        let Some(info) = header.metadata.info(name) else {
            missing.push(name.to_owned());
            return None;
        };
        unused.remove(name);
        let (start, end) = info.data_offsets;
        let bytes = file.read(header.end + start..header.end + end);
        match bytes
            .map_err(WeightsError::Unreadable)
            .and_then(|bytes| numbers(name, shape, info, &bytes))
        {
            Ok(values) => Some(values),
            Err(error) => {
                fault.get_or_insert(error);
                None
            }
        }
    });
    if let Some(error) = fault {
        return Err(error);
    }
    let mut unknown: Vec<String> = unused.into_iter().collect();
    unknown.sort_unstable();
    match missing.first().or(unknown.first()) {
        None => Ok(model),
        Some(first) => Err(WeightsError::Names {
            missing: missing.len(),
            unknown: unknown.len(),
            first: first.clone(),
        }),
    }
}

/// What stands before the numbers of a file.
struct Header {
    metadata: Metadata,
    /// Where the numbers begin.
    end: usize,
}

impl Header {
    fn read(file: &(impl WeightsFile + ?Sized)) -> Result<Self, WeightsError> {
        let fault = |why| WeightsError::Format {
            found_bytes: file.len(),
            why,
        };
        // The format begins with the length of its header.
        let start = file.read(0..file.len().min(LENGTH_BYTES))?;
        let start = <[u8; LENGTH_BYTES]>::try_from(start.as_slice())
            .map_err(|_| fault(SafeTensorError::HeaderTooSmall))?;
        let end = usize::try_from(u64::from_le_bytes(start)).ok();
        let end = end.and_then(|length| length.checked_add(LENGTH_BYTES));
        let end = end
            .filter(|&end| end <= file.len())
            .ok_or_else(|| fault(SafeTensorError::InvalidHeaderLength))?;
        let metadata = serde_json::from_slice::<Metadata>(&file.read(LENGTH_BYTES..end)?)
            .map_err(|why| fault(SafeTensorError::InvalidHeaderDeserialization(why)))?;
        if end + metadata.data_len() != file.len() {
            return Err(fault(SafeTensorError::MetadataIncompleteBuffer));
        }
        Ok(Self { metadata, end })
    }

    fn config(&self) -> Result<NetConfig, WeightsError> {
        let entries = self.metadata.metadata().as_ref();
        let entry = |key: &str| entries.and_then(|entries| entries.get(key));
        let config = entry(KEY_CONFIG).ok_or(WeightsError::NotOurs)?;
        match entry(KEY_VERSION) {
            Some(version) if version == VERSION => {
                let config: NetConfig = serde_json::from_str(config)?;
                config.check()?;
                Ok(config)
            }
            other => Err(WeightsError::Version {
                found: other.map_or("none", String::as_str).to_owned(),
            }),
        }
    }
}

fn numbers(
    name: &str,
    shape: &[usize],
    info: &TensorInfo,
    bytes: &[u8],
) -> Result<Vec<f32>, WeightsError> {
    if info.shape != shape {
        return Err(WeightsError::Shape {
            name: name.to_owned(),
            expected: shape.to_vec(),
            found: info.shape.clone(),
        });
    }
    let values: Vec<f32> = match info.dtype {
        Dtype::F32 => {
            let words = bytes.as_chunks::<4>().0;
            words.iter().map(|&word| f32::from_le_bytes(word)).collect()
        }
        Dtype::F16 => {
            let words = bytes.as_chunks::<2>().0;
            let halves = words.iter().map(|&word| f16::from_le_bytes(word));
            halves.map(f16::to_f32).collect()
        }
        found => {
            return Err(WeightsError::Type {
                name: name.to_owned(),
                found,
            });
        }
    };
    if values.iter().all(|v| v.is_finite()) {
        Ok(values)
    } else {
        Err(WeightsError::NotFinite {
            name: name.to_owned(),
        })
    }
}
