//! The two real scans, read in place.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use scan::doctor::{self, Look};
use scan::{FolderSource, Scan};

fn shared(name: &str) -> Option<Scan> {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/scans")
        .join(name)
        .join("scan");
    if !folder.is_dir() {
        println!("skipped: {} is absent", folder.display());
        return None;
    }
    let source = FolderSource::open(&folder).unwrap();
    Some(scan::open(Rc::new(source)).unwrap())
}

#[test]
fn look() {
    for name in ["hololens", "livingroom"] {
        let Some(scan) = shared(name) else { return };
        println!("{:?}", scan.gravity());
        let t = std::time::Instant::now();
        println!(
            "{}",
            serde_json::to_string_pretty(&doctor::examine(&scan, Look::All)).unwrap()
        );
        println!("examine {:?}", t.elapsed());
    }
}
