//! The command line as its user meets it: files in, files and figures out, and plain words when something is wrong.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use scan::Source;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};
use synth::SampleScan;
use tempfile::TempDir;

fn ipdrecon(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_ipdrecon");
    Command::new(program).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The sample room as a folder on the disk.
struct Sample {
    folder: TempDir,
}

impl Sample {
    fn write() -> Self {
        Self::of(10, |_| true)
    }

    /// Of this many frames the files whose path is wanted.
    fn of(frames: usize, wanted: impl Fn(&str) -> bool) -> Self {
        let folder = TempDir::new().unwrap();
        let sample = SampleScan::new(3, frames, 160, 120);
        for entry in sample.entries().iter().filter(|e| wanted(&e.path)) {
            let path = folder.path().join("scan").join(&entry.path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, sample.read(&entry.path).unwrap()).unwrap();
        }
        Self { folder }
    }

    fn scan(&self) -> PathBuf {
        self.folder.path().join("scan")
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

fn str(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn fuse_writes_every_format_and_eval_finds_them_equal() {
    let sample = Sample::write();
    for ending in ["ply", "glb", "obj"] {
        let out = sample.file(&format!("room.{ending}"));
        let run = ipdrecon(&["fuse", str(&sample.scan()), "-o", str(&out)]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        assert!(fs::metadata(&out).unwrap().len() > 20_000);
        // A pipe gets neither bars nor anything else on standard output.
        assert!(run.stdout.is_empty());
        assert!(
            !text(&run.stderr).contains('\r'),
            "a progress bar in a pipe"
        );
    }
    let ply = sample.file("room.ply");
    for protocol in ["plain", "transformerfusion", "vortx"] {
        let run = ipdrecon(&[
            "eval",
            "--pred",
            str(&ply),
            "--gt",
            str(&ply),
            "--scan",
            str(&sample.scan()),
            "--protocol",
            protocol,
            "--json",
        ]);
        let report: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!(report["protocol"], protocol);
        let f = report["surface"]["f_score"].as_f64().unwrap();
        // Against itself; what VoRTX's second fusion costs a mesh of 160 x 120 pictures is its own affair.
        let least = if protocol == "vortx" { 0.8 } else { 0.99 };
        assert!(f > least, "{protocol}: F {f}");
        assert!(report["depth"]["abs_rel"].as_f64().unwrap() < 0.05);
    }
}

#[test]
fn the_mesh_lies_in_the_scans_world_unless_canonical_is_asked_for() {
    let sample = Sample::write();
    let read = |name: &str, canonical: bool| {
        let out = sample.file(name);
        let scan = sample.scan();
        let mut arguments = vec!["fuse", str(&scan), "-o", str(&out)];
        if canonical {
            arguments.push("--canonical");
        }
        assert!(ipdrecon(&arguments).status.success());
        mesh::ply::read(&fs::read(&out).unwrap()).unwrap()
    };
    let own = read("own.ply", false);
    let canonical = read("canonical.ply", true);
    // Canonical is Z up: the room is lower than wide. The sample's own world is its first camera's.
    let size = canonical.bounds().unwrap().size();
    assert!(size.z < size.x.max(size.y), "{size}");
    let scan = scan::open(std::rc::Rc::new(
        scan::FolderSource::open(&sample.scan()).unwrap(),
    ))
    .unwrap();
    let mut turned = canonical.clone();
    turned.transform(&scan.scan_from_canonical());
    for (a, b) in turned.positions.iter().zip(&own.positions) {
        assert!(a.distance(*b) < 1e-4);
    }
    assert!(own.positions[0].distance(canonical.positions[0]) > 0.1);
}

/// Colour and poses alone, some of the keyframes, small pictures: a mesh in the scan's own world, and depth maps that can
/// be judged against a sensor's.
#[test]
fn stereo_makes_a_mesh_and_depth_maps_of_colour_alone() {
    let color = Sample::of(16, |path| !path.contains("depth"));
    let (out, maps) = (color.file("room.ply"), color.file("maps"));
    let scan = color.scan();
    let mut arguments = vec!["stereo", str(&scan), "-o", str(&out), "--size", "96x72"];
    arguments.extend(["--views", "12", "--depth", str(&maps)]);
    let run = ipdrecon(&arguments);
    let said = text(&run.stderr);
    assert!(run.status.success(), "{said}");
    assert!(run.stdout.is_empty());
    assert!(said.contains("12 of 16 frames as keyframes"), "{said}");
    let mesh = mesh::ply::read(&fs::read(&out).unwrap()).unwrap();
    assert!(mesh.triangles.len() > 300, "{said}");

    let names: Vec<String> = fs::read_dir(&maps)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let count = |ending: &str| names.iter().filter(|name| name.ends_with(ending)).count();
    assert!(count(".depth.png") >= 10, "{names:?}");
    assert_eq!(count(".raw.png"), count(".depth.png"));
    assert!(
        names.contains(&"frame-000000.depth.png".to_owned()),
        "{names:?}"
    );

    // The same walk with its depth is what they are judged by.
    let whole = Sample::of(16, |_| true);
    let whole = whole.scan();
    let eval = vec!["eval", "--depth", str(&maps), "--scan", str(&whole)];
    let words = text(&ipdrecon(&eval).stdout);
    assert!(
        words.contains("raw depth of")
            && words.contains("filtered depth of")
            && words.contains("coverage"),
        "{words}"
    );
    let run = ipdrecon(&[eval, vec!["--json"]].concat());
    let report: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let figure = |kind: &str, name: &str| report[kind][name].as_f64().unwrap();
    assert_eq!(figure("raw", "maps"), count(".raw.png") as f64);
    assert!(figure("raw", "coverage") > 0.9);
    assert!(figure("filtered", "coverage") < figure("raw", "coverage"));
    assert!(figure("filtered", "abs_rel") < figure("raw", "abs_rel"));
}

#[test]
fn doctor_reports_in_words_and_in_json() {
    let sample = Sample::write();
    fs::write(
        sample.scan().join("frame-000003.pose.txt"),
        "1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
    )
    .unwrap();
    let run = ipdrecon(&["doctor", str(&sample.scan())]);
    assert!(
        text(&run.stdout).contains("(7-Scenes)"),
        "{}",
        text(&run.stdout)
    );
    let words = text(&run.stderr);
    assert!(
        words.contains("frame-000003.pose.txt:1")
            && words.contains("expected")
            && words.contains("found"),
        "{words}"
    );
    let run = ipdrecon(&["doctor", str(&sample.scan()), "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(report["frames"], 9);
    let findings = report["findings"].as_array().unwrap();
    assert!(
        findings
            .iter()
            .any(|f| f["line"] == 1 && f["file"].as_str().unwrap().contains("000003"))
    );
}

#[test]
fn what_cannot_be_done_is_said_in_one_line() {
    let sample = Sample::write();
    let scan = sample.scan();
    let out = sample.file("room.ply");
    let empty = sample.file("empty");
    fs::create_dir(&empty).unwrap();
    let no_zip = sample.file("scan.zip");
    fs::write(&no_zip, "not a zip").unwrap();
    let no_ply = sample.file("no.ply");
    fs::write(&no_ply, "solid cube").unwrap();
    let color = Sample::of(3, |path| !path.contains("depth"));
    let color = color.scan();
    let cases: [(&[&str], &[&str]); 12] = [
        (
            &["fuse", str(&color), "-o", str(&out)],
            &["found none", "ipdrecon stereo"],
        ),
        (
            &["stereo", str(&color), "-o", str(&out), "--views", "1"],
            &["at least 2 keyframes", "1 view"],
        ),
        (
            &["stereo", str(&color), "-o", str(&out), "--size", "8x6"],
            &["working size", "8x6"],
        ),
        (
            &["eval", "--depth", str(&empty), "--scan", str(&scan)],
            &["expected depth maps", "found none", "stereo --depth"],
        ),
        (
            &["eval", "--depth", "missing", "--scan", str(&scan)],
            &["missing", "read"],
        ),
        (
            &["fuse", str(&scan), "-o", "room.stl"],
            &[".ply, .glb or .obj", "room.stl"],
        ),
        (
            &["fuse", "nowhere", "-o", str(&out)],
            &["nowhere", "expected a folder"],
        ),
        (
            &["fuse", str(&empty), "-o", str(&out)],
            &["expected", "found"],
        ),
        (
            &["fuse", str(&no_zip), "-o", str(&out)],
            &["expected a zip archive"],
        ),
        (
            &["fuse", str(&scan), "-o", str(&out), "--voxel", "0"],
            &["voxel size between", "0 m"],
        ),
        (
            &[
                "eval",
                "--pred",
                str(&no_ply),
                "--gt",
                str(&no_ply),
                "--protocol",
                "plain",
            ],
            &["no.ply", "expected"],
        ),
        (
            &[
                "eval",
                "--pred",
                "missing.ply",
                "--gt",
                "missing.ply",
                "--protocol",
                "plain",
            ],
            &["missing.ply", "read"],
        ),
    ];
    for (arguments, words) in cases {
        let run = ipdrecon(arguments);
        let said = text(&run.stderr);
        assert!(!run.status.success(), "{arguments:?} succeeded");
        // What was noticed when the scan was opened may stand before it.
        let last = said.lines().last().unwrap();
        assert!(
            last.starts_with("error: ") && !said.contains("panicked"),
            "{arguments:?}: {said}"
        );
        for word in words {
            assert!(
                said.contains(word),
                "{arguments:?}: expected \"{word}\" in: {said}"
            );
        }
    }
    assert!(!out.exists(), "nothing is written when something is wrong");
}
