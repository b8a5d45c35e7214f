//! Where a run can go on from: weights, the optimiser's memory, the step, the configuration.
//!
//! A checkpoint is a folder `step-00001000` with `weights.safetensors`, `adam.safetensors` and `run.json`. It is written
//! under another name and renamed when whole, so that a run that is stopped while it writes leaves nothing half-done.

use crate::adam::Moments;
use crate::config::TrainConfig;
use crate::error::TrainError;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const WEIGHTS: &str = "weights.safetensors";
const ADAM: &str = "adam.safetensors";
const RUN: &str = "run.json";
const BEST: &str = "best";

/// Where a run stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunState {
    /// Steps done.
    pub step: u64,
    /// Seconds of training so far, over all resumes.
    pub seconds: f64,
    /// The least loss on held-out scans so far.
    pub best: Option<f64>,
    /// What the run was told.
    pub config: TrainConfig,
}

/// A checkpoint in memory.
pub struct Checkpoint {
    /// Where the run stands.
    pub state: RunState,
    /// The weights as a file.
    pub weights: Vec<u8>,
    /// The optimiser's memory.
    pub adam: BTreeMap<String, Moments<Vec<f32>>>,
}

impl Checkpoint {
    /// Writes it into the run's folder, and removes all but the last `keep`.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, folder: &Path, keep: usize) -> Result<PathBuf, TrainError> {
        let target = folder.join(format!("step-{:08}", self.state.step));
        self.write_to(&target)?;
        let old = listed(folder)?;
        for old in &old[..old.len().saturating_sub(keep)] {
            fs::remove_dir_all(old).map_err(|error| TrainError::file("remove", old, error))?;
        }
        Ok(target)
    }

    /// Writes it as the best of the run's folder.
    ///
    /// # Errors
    /// What the system says.
    pub fn write_best(&self, folder: &Path) -> Result<(), TrainError> {
        self.write_to(&folder.join(BEST))
    }

    fn write_to(&self, target: &Path) -> Result<(), TrainError> {
        let part = target.with_extension("part");
        let failed = |error| TrainError::file("write", target, error);
        remove_if_there(&part).map_err(failed)?;
        fs::create_dir_all(&part).map_err(failed)?;
        fs::write(part.join(WEIGHTS), &self.weights).map_err(failed)?;
        fs::write(part.join(ADAM), adam_bytes(&self.adam)?).map_err(failed)?;
        let state = serde_json::to_vec_pretty(&self.state)
            .map_err(|error| TrainError::Weights(error.to_string()))?;
        fs::write(part.join(RUN), state).map_err(failed)?;
        remove_if_there(target).map_err(failed)?;
        fs::rename(&part, target).map_err(failed)
    }

    /// Reads a checkpoint: `folder` itself, or the last one of a run's folder.
    ///
    /// # Errors
    /// No checkpoint there, or one that is damaged.
    pub fn read(folder: &Path) -> Result<Self, TrainError> {
        let folder = if folder.join(RUN).is_file() {
            folder.to_owned()
        } else {
            listed(folder)?.pop().ok_or_else(|| {
                TrainError::unfit(
                    folder.display(),
                    "a checkpoint, or a run's folder with one",
                    "none",
                    "name another folder, or start anew without --resume",
                )
            })?
        };
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).map_err(|error| TrainError::file("read", &path, error))
        };
        let damaged = |name: &str, error: String| {
            TrainError::unfit(
                folder.join(name).display(),
                "a file of a whole checkpoint",
                error,
                "go on from an earlier checkpoint",
            )
        };
        let state = serde_json::from_slice(&read(RUN)?);
        Ok(Self {
            state: state.map_err(|error| damaged(RUN, error.to_string()))?,
            weights: read(WEIGHTS)?,
            adam: adam_numbers(&read(ADAM)?).map_err(|error| damaged(ADAM, error))?,
        })
    }
}

fn remove_if_there(path: &Path) -> std::io::Result<()> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// The checkpoints of a run's folder, the last one last.
fn listed(folder: &Path) -> Result<Vec<PathBuf>, TrainError> {
    let listing = fs::read_dir(folder).map_err(|error| TrainError::file("read", folder, error))?;
    let mut found: Vec<PathBuf> = listing
        .filter_map(|item| Some(item.ok()?.path()))
        .filter(|path| {
            let name = path.file_name().map(|name| name.to_string_lossy());
            name.is_some_and(|name| name.starts_with("step-") && !name.ends_with(".part"))
        })
        .collect();
    found.sort();
    Ok(found)
}

const TIME: &str = "time:";
const FIRST: &str = "first:";
const SECOND: &str = "second:";

fn adam_bytes(adam: &BTreeMap<String, Moments<Vec<f32>>>) -> Result<Vec<u8>, TrainError> {
    let mut stored = Vec::new();
    for (path, moments) in adam {
        let time = moments.time.to_le_bytes().to_vec();
        stored.push((format!("{TIME}{path}"), Dtype::U64, 1, time));
        for (kind, numbers) in [(FIRST, &moments.first), (SECOND, &moments.second)] {
            let bytes = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
            stored.push((format!("{kind}{path}"), Dtype::F32, numbers.len(), bytes));
        }
    }
    let failed = |error: safetensors::SafeTensorError| TrainError::Weights(error.to_string());
    let mut views = Vec::new();
    for (name, dtype, len, bytes) in &stored {
        let view = TensorView::new(*dtype, vec![*len], bytes).map_err(failed)?;
        views.push((name, view));
    }
    serialize(views, None).map_err(failed)
}

fn adam_numbers(bytes: &[u8]) -> Result<BTreeMap<String, Moments<Vec<f32>>>, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|error| error.to_string())?;
    let floats = |name: String| -> Result<Vec<f32>, String> {
        let view = file.tensor(&name).map_err(|error| error.to_string())?;
        let words = view.data().as_chunks::<4>().0;
        Ok(words.iter().map(|&word| f32::from_le_bytes(word)).collect())
    };
    let mut adam = BTreeMap::new();
    for (name, view) in file.tensors() {
        if let Some(path) = name.strip_prefix(TIME) {
            let time = view.data().as_array().copied().map(u64::from_le_bytes);
            let moments = Moments {
                time: time.ok_or_else(|| format!("{name} of {} bytes", view.data().len()))?,
                first: floats(format!("{FIRST}{path}"))?,
                second: floats(format!("{SECOND}{path}"))?,
            };
            adam.insert(path.to_owned(), moments);
        }
    }
    Ok(adam)
}
