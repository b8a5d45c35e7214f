//! What happened, a JSON object a line: `train.jsonl` in the run's folder.

use crate::error::TrainError;
use serde_json::{Map, Value};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The name of the log in a run's folder.
pub const FILE: &str = "train.jsonl";

/// A log that is open for writing. Every line has a `kind` (`start`, `step`, `validation`, `end`) and a `step`.
pub struct Log {
    path: PathBuf,
    file: File,
}

impl Log {
    /// Opens the log of a run that stands at `step`: lines of later steps, which a run that was cut off may have left, go.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(folder: &Path, step: u64) -> Result<Self, TrainError> {
        let path = folder.join(FILE);
        let failed = |error| TrainError::file("write", &path, error);
        fs::create_dir_all(folder).map_err(failed)?;
        let before = read(folder)?;
        if step == 0 || before.iter().any(|line| step_of(line) > step) {
            let kept = before
                .iter()
                .filter(|line| step > 0 && step_of(line) <= step);
            let text: String = kept.map(|line| format!("{line}\n")).collect();
            fs::write(&path, text).map_err(failed)?;
        }
        let file = OpenOptions::new().create(true).append(true).open(&path);
        Ok(Self {
            file: file.map_err(failed)?,
            path,
        })
    }

    /// Adds a line. Numbers that are not finite become null: JSON has none.
    ///
    /// # Errors
    /// What the system says.
    pub fn line(
        &mut self,
        kind: &str,
        step: u64,
        fields: Vec<(&str, Value)>,
    ) -> Result<(), TrainError> {
        let mut object = Map::new();
        object.insert("kind".to_owned(), kind.into());
        object.insert("step".to_owned(), step.into());
        object.extend(
            fields
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value)),
        );
        writeln!(self.file, "{}", Value::Object(object))
            .map_err(|error| TrainError::file("write", &self.path, error))
    }
}

/// The lines of a run's log. A last line that was cut off is passed over.
///
/// # Errors
/// What the system says; no log is an empty one.
pub fn read(folder: &Path) -> Result<Vec<Value>, TrainError> {
    let path = folder.join(FILE);
    match fs::read_to_string(&path) {
        Ok(text) => Ok(text
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .collect()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(TrainError::file("read", &path, error)),
    }
}

fn step_of(line: &Value) -> u64 {
    line["step"].as_u64().unwrap_or_default()
}
