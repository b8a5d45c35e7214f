//! `ipdrecon reconstruct` as its user meets it. The networks here are untrained: what they find is no room, but it comes out
//! of the command as any surface would.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{ipdrecon, network, str, text};
use scan::Source;
use std::{
    fs,
    path::{Path, PathBuf},
};
use synth::SampleScan;
use tempfile::TempDir;

/// A folder with a scan of sixteen frames, changed file by file; `None` leaves one out.
struct Sample {
    folder: TempDir,
}

impl Sample {
    fn new(change: impl Fn(&str, Vec<u8>) -> Option<Vec<u8>>) -> Self {
        let folder = TempDir::new().unwrap();
        let sample = SampleScan::new(3, 16, 160, 120);
        for entry in sample.entries() {
            let path = folder.path().join("scan").join(&entry.path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            if let Some(bytes) = change(&entry.path, sample.read(&entry.path).unwrap()) {
                fs::write(path, bytes).unwrap();
            }
        }
        Self { folder }
    }

    fn color() -> Self {
        Self::new(|path, bytes| (!path.contains("depth")).then_some(bytes))
    }

    fn scan(&self) -> PathBuf {
        self.folder.path().join("scan")
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes weights of a tiny network.
    fn weights(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.file(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

/// The bytes with a word of their header replaced by one as long.
fn changed(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
    let at = at.expect("the word is in the header");
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

/// Little of the room, so that a network that finds everything everywhere is done soon.
const SMALL: [&str; 4] = ["--reach", "0.6", "--keyframes", "4"];

#[test]
fn colour_poses_and_weights_make_a_mesh_that_eval_takes() {
    let sample = Sample::new(|_, bytes| Some(bytes));
    let scan = sample.scan();
    let weights = sample.weights("weights", &network(false, 10.0));
    let make =
        |out: &Path, more: &[&str]| reconstruct(&scan, &weights, out, &[&SMALL, more].concat());
    let [ply, again, glb] = ["room.ply", "again.ply", "room.glb"].map(|n| sample.file(n));
    let said = make(&ply, &["--seed", "5"]);
    // Fewer frames than asked for are told, and used.
    assert!(
        said.contains("4 of 16 frames as keyframes")
            && said.contains("20 views were asked for, the scan has 4 keyframes")
            && said.contains("from 4 keyframes"),
        "{said}"
    );
    let mesh = mesh::ply::read(&fs::read(&ply).unwrap()).unwrap();
    mesh.validate().unwrap();
    assert!(mesh.triangles.len() > 300, "{}", mesh.triangles.len());
    make(&again, &["--seed", "5"]);
    assert_eq!(fs::read(&ply).unwrap(), fs::read(&again).unwrap());
    let more = ["--views", "2", "--choice", "random", "--preset", "medium"];
    // All of it fits in one tile.
    let said = make(&glb, &more);
    assert!(said.contains("from 2 keyframes"), "{said}");
    assert_eq!(fs::read(&glb).unwrap()[..4], *b"glTF");

    let truth = sample.file("truth.ply");
    let run = ipdrecon(&["fuse", str(&scan), "-o", str(&truth)]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    for protocol in ["plain", "transformerfusion", "vortx"] {
        let mut eval = vec!["eval", "--pred", str(&ply), "--gt", str(&truth)];
        eval.extend(["--scan", str(&scan), "--protocol", protocol, "--json"]);
        let run = ipdrecon(&eval);
        let report: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        let figure = |of: &str, name: &str| report[of][name].as_f64().unwrap();
        // It lies where the cameras are, whatever it is.
        assert!(figure("surface", "accuracy_m") < 2.0, "{report}");
        assert!(figure("depth", "completeness") > 0.0, "{report}");
    }
}

/// Runs the command to a good end; gives what it said.
fn reconstruct(scan: &Path, weights: &Path, out: &Path, more: &[&str]) -> String {
    let mut arguments = vec!["reconstruct", str(scan), "-o", str(out)];
    arguments.extend(["--weights", str(weights)]);
    arguments.extend(more);
    let run = ipdrecon(&arguments);
    let said = text(&run.stderr);
    assert!(run.status.success(), "{said}");
    assert!(run.stdout.is_empty());
    said
}

#[test]
fn a_network_that_wants_a_guide_gets_one_or_goes_without() {
    let sample = Sample::color();
    let weights = sample.weights("guided", &network(true, 10.0));
    let out = sample.file("room.ply");
    let make = |more: &[&str]| {
        let said = reconstruct(&sample.scan(), &weights, &out, more);
        (said, fs::read(&out).unwrap())
    };
    let (said, _) = make(&["--reach", "0.6"]);
    assert!(!said.contains("guide"), "{said}");
    // Four pictures around the room have nothing in common that stereo could use.
    let (said, mesh) = make(&SMALL);
    assert!(
        said.contains("warning: ") && said.contains("guide"),
        "{said}"
    );
    assert!(mesh.len() > 10_000);
}

/// Scan, weights, more arguments, and words of what is said.
type Case<'a> = (&'a Path, Option<&'a Path>, &'a [&'a str], &'a [&'a str]);

#[test]
fn what_cannot_be_done_is_said_in_one_line_and_nothing_is_written() {
    let sample = Sample::color();
    let scan = sample.scan();
    let good = network(false, 10.0);
    let weights = sample.weights("good", &good);
    let nothing = sample.weights("nothing", &network(false, -10.0));
    let shape = changed(&good, r#"\"unet\":[4,4,4]"#, r#"\"unet\":[4,4,6]"#);
    let shape = sample.weights("shape", &shape);
    let version = r#""ipdrecon.version":"1""#;
    let version = changed(&good, version, r#""ipdrecon.version":"9""#);
    let version = sample.weights("version", &version);
    let foreign = changed(&good, "ipdrecon.config", "somebody.config");
    let foreign = sample.weights("foreign", &foreign);
    let cut = sample.weights("cut", &good[..good.len() / 2]);
    let empty = sample.weights("empty", b"");
    let text_file = sample.weights("notes", b"Weights of a network, by and by.");
    let missing = sample.file("missing");

    let no_color = Sample::new(|path, bytes| (!path.contains("color")).then_some(bytes));
    let depth_alone = no_color.scan();
    let far = Sample::new(|path, bytes| {
        let digits: String = path.chars().filter(char::is_ascii_digit).collect();
        match path.ends_with("pose.txt") {
            true => Some(shifted(&bytes, 60.0 * digits.parse::<f64>().unwrap())),
            false => Some(bytes),
        }
    });
    let apart = far.scan();
    let torn = Sample::new(|path, mut bytes| {
        let color = path.contains("color");
        if color && !path.contains("000003") {
            bytes.truncate(bytes.len() / 2);
        }
        (!path.contains("depth")).then_some(bytes)
    });
    let broken = torn.scan();

    let out = sample.file("room.ply");
    let cases: [Case<'_>; 14] = [
        (&scan, Some(&missing), &[], &["missing", "read"]),
        (
            &scan,
            Some(&empty),
            &[],
            &["empty", "safetensors", "0 bytes"],
        ),
        (
            &scan,
            Some(&text_file),
            &[],
            &["notes", "safetensors", "32 bytes"],
        ),
        (&scan, Some(&cut), &[], &["cut", "safetensors", "cut short"]),
        (
            &scan,
            Some(&version),
            &[],
            &["version 1", "found version 9", "train again"],
        ),
        (
            &scan,
            Some(&foreign),
            &[],
            &["foreign", "not written by IPDRecon"],
        ),
        (
            &scan,
            Some(&shape),
            &[],
            &["shape", "decoders.2", "expected", "found"],
        ),
        (
            &scan,
            Some(&weights),
            &["--views", "1"],
            &["at least 2 views", "found 1"],
        ),
        (
            &scan,
            Some(&weights),
            &["--size", "20x15"],
            &["picture size", "20x15"],
        ),
        (
            &scan,
            Some(&weights),
            &["--reach", "0"],
            &["reach between", "0 m"],
        ),
        (
            &depth_alone,
            Some(&weights),
            &[],
            &["colour images", "found 0"],
        ),
        (
            &apart,
            Some(&weights),
            &[],
            &["same places", "metres", "overlap"],
        ),
        (
            &broken,
            Some(&weights),
            &[],
            &["at least 2", "found 1", "findings"],
        ),
        (
            &scan,
            Some(&nothing),
            &[],
            &["found none", "16 cm", "scale", "which way is up", "weights"],
        ),
    ];
    for (scan, weights, more, words) in cases {
        let mut arguments = vec!["reconstruct", str(scan), "-o", str(&out)];
        arguments.extend(more);
        if !more.contains(&"--reach") {
            arguments.extend(["--reach", "0.6"]);
        }
        if let Some(weights) = weights {
            arguments.extend(["--weights", str(weights)]);
        }
        let run = ipdrecon(&arguments);
        let said = text(&run.stderr);
        assert_eq!(run.status.code(), Some(1), "{arguments:?}: {said}");
        let last = said.lines().last().unwrap();
        assert!(
            last.starts_with("error: ") && !said.contains("panicked"),
            "{arguments:?}: {said}"
        );
        for word in words {
            assert!(
                last.contains(word),
                "{arguments:?}: expected \"{word}\" in: {said}"
            );
        }
        println!("{last}");
    }
    assert!(!out.exists());
}

/// A pose file moved along x.
fn shifted(pose: &[u8], by_m: f64) -> Vec<u8> {
    let numbers = text(pose);
    let numbers = numbers.split_whitespace().enumerate();
    let moved = numbers.map(|(at, number)| {
        let number: f64 = number.parse().unwrap();
        let end = if at % 4 == 3 { "\n" } else { " " };
        format!("{}{end}", if at == 3 { number + by_m } else { number })
    });
    moved.collect::<String>().into_bytes()
}

#[test]
fn the_released_weights_make_the_room_that_they_never_saw() {
    // The page's sample is made by other rules than the rooms that the weights were trained on.
    let folder = TempDir::new().unwrap();
    let sample = SampleScan::new(5, 24, 160, 120);
    for entry in sample.entries() {
        let path = folder.path().join("scan").join(&entry.path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, sample.read(&entry.path).unwrap()).unwrap();
    }
    let [scan, truth, ours] = ["scan", "truth.ply", "ours.ply"].map(|n| folder.path().join(n));
    let run = |arguments: &[&str]| {
        let run = ipdrecon(arguments);
        assert!(run.status.success(), "{}", text(&run.stderr));
        text(&run.stdout)
    };
    run(&["fuse", str(&scan), "-o", str(&truth), "--max-depth", "4"]);
    run(&["reconstruct", str(&scan), "-o", str(&ours)]);
    let mut eval = vec!["eval", "--pred", str(&ours), "--gt", str(&truth)];
    eval.extend([
        "--scan",
        str(&scan),
        "--protocol",
        "transformerfusion",
        "--json",
    ]);
    let report: serde_json::Value = serde_json::from_str(&run(&eval)).unwrap();
    let [f, precision] =
        ["f_score", "precision"].map(|name| report["surface"][name].as_f64().unwrap());
    println!("F {f:.3}, precision {precision:.3}");
    assert!(f > 0.5 && precision > 0.6, "F {f}, precision {precision}");
}
