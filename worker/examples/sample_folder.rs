//! Writes the sample room as a folder, so that a test can drop it on the page like anybody's scan:
//! `cargo run --release -p worker --example sample_folder -- FOLDER`.

use std::{env, fs, io, path::PathBuf};

fn main() -> io::Result<()> {
    let folder = env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.ok_or_else(|| io::Error::other("expected a folder, found no argument"))?;
    for (path, bytes) in synth::SampleScan::first().files() {
        let path = folder.join(path);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(path, bytes)?;
    }
    Ok(())
}
