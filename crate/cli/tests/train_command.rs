//! `ipdrecon train` as its user meets it.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use scan::Source;
use std::{
    fs,
    path::Path,
    process::{Command, Output},
};
use synth::SampleScan;
use tempfile::TempDir;

const SETTINGS: &str = r#"
seed = 1
[net]
preset = "small"
backbone = [4, 4, 6, 6, 8]
pyramid = 8
planes = [8, 6, 4]
unet = [4, 4, 4]
[data]
scans = ["rooms/*"]
validation = ["rooms/*"]
views = 3
size = [32, 32]
crop = [16, 16, 16]
[train]
steps = 3
fine_tune_from = 2
warm_up = 1
most_sites = [256, 512]
[output]
folder = "run"
validate_every = 2
validation_samples = 1
checkpoint_every = 2
"#;

/// A folder with the settings and a room.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let room = SampleScan::new(3, 8, 48, 36);
    for entry in room.entries() {
        let path = folder.path().join("rooms/one").join(&entry.path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, room.read(&entry.path).unwrap()).unwrap();
    }
    fs::write(folder.path().join("run.toml"), SETTINGS).unwrap();
    folder
}

fn train(folder: &Path, arguments: &[&str]) -> (Output, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_ipdrecon"))
        .current_dir(folder)
        .args(["train", "--config", "run.toml"])
        .args(arguments)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output, said)
}

#[test]
fn train_writes_a_run_and_goes_on_from_it() {
    let folder = folder();
    let (output, said) = train(folder.path(), &[]);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("1 scans to learn from, 1 held out") && said.contains("step 3 of 3: loss"),
        "{said}"
    );
    assert!(
        said.contains("finished at step 3; waited for samples"),
        "{said}"
    );
    let run = folder.path().join("run");
    for name in [
        "train.jsonl",
        "plot.svg",
        "best/weights.safetensors",
        "step-00000003/adam.safetensors",
    ] {
        assert!(run.join(name).is_file(), "{name} is missing");
    }
    let weights = fs::read(run.join("step-00000003/weights.safetensors")).unwrap();
    assert_eq!(net::weights::config(&weights).unwrap().planes, [8, 6, 4]);

    let (output, said) = train(folder.path(), &["--resume", "run", "--steps", "5"]);
    assert!(output.status.success(), "{said}");
    assert!(
        !said.contains("step 3 of 5") && said.contains("step 4 of 5"),
        "{said}"
    );
    let weights = "run/step-00000005/weights.safetensors";
    let (output, said) = train(
        folder.path(),
        &["--weights", weights, "-o", "other", "--steps", "1"],
    );
    assert!(
        output.status.success() && said.contains("step 1 of 1"),
        "{said}"
    );
}

#[test]
fn train_says_what_is_wrong() {
    let folder = folder();
    for (arguments, expected) in [
        (vec!["--scans", "nowhere/*"], "nowhere: expected to read it"),
        (
            vec!["--resume", "rooms"],
            "rooms: expected a checkpoint, or a run's folder with one",
        ),
        (
            vec!["--weights", "run.toml"],
            "expected weights as a safetensors file",
        ),
        (
            vec!["--resume", "run", "--weights", "x"],
            "cannot be used with",
        ),
    ] {
        let (output, said) = train(folder.path(), &arguments);
        assert!(
            !output.status.success() && said.contains(expected),
            "{arguments:?}: {said}"
        );
        assert!(!said.contains("panicked"), "{said}");
    }
    fs::write(
        folder.path().join("run.toml"),
        SETTINGS.replace("views = 3", "views = 30"),
    )
    .unwrap();
    let (output, said) = train(folder.path(), &[]);
    assert!(!output.status.success(), "{said}");
    assert!(
        said.contains("rooms/one: expected at least 30 frames")
            && said.contains("found 8; lower data.views"),
        "{said}"
    );
}
