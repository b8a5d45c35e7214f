//! `ipdrecon table` as its user meets it, on small rooms and with networks that have learnt nothing.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{ipdrecon, network, str, text};
use scan::Source;
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
};
use synth::SampleScan;
use tempfile::TempDir;

/// A folder with two rooms, a list of them, and weights that find something everywhere.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, seed) in [("one", 3), ("two", 4)] {
        let room = SampleScan::new(seed, 12, 80, 60);
        for entry in room.entries() {
            let path = folder.path().join("rooms").join(name).join(&entry.path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, room.read(&entry.path).unwrap()).unwrap();
        }
    }
    fs::write(
        folder.path().join("list.txt"),
        "# both\nrooms/one\n\nrooms/two\n",
    )
    .unwrap();
    fs::write(folder.path().join("ours"), network(false, 10.0)).unwrap();
    folder
}

/// The Markdown, and the single figures.
fn table(folder: &Path, kind: &str, more: &[&str]) -> (String, Vec<Value>) {
    let json: PathBuf = folder.join("out.json");
    let (weights, out) = (folder.join("ours"), str(&json).to_owned());
    let mut arguments = vec![
        "table",
        kind,
        "--weights",
        str(&weights),
        "--reach",
        "1.5",
        "--json",
        &out,
    ];
    arguments.extend(more);
    let run = ipdrecon(&arguments);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let json: Value = serde_json::from_slice(&fs::read(json).unwrap()).unwrap();
    (text(&run.stdout), json["cells"].as_array().unwrap().clone())
}

/// The cells of the row that begins with `name`.
fn row<'a>(markdown: &'a str, name: &str) -> Vec<&'a str> {
    let start = format!("| {name} |");
    let line = markdown.lines().find(|line| line.starts_with(&start));
    let line = line.unwrap_or_else(|| panic!("no row {name} in\n{markdown}"));
    line.trim_matches('|')
        .split('|')
        .map(str::trim)
        .skip(1)
        .collect()
}

fn figure(cells: &[Value], method: &str, views: Option<u64>, name: &str) -> Vec<f64> {
    let fits = |cell: &&Value| cell["method"] == method && cell["views"].as_u64() == views;
    let of = cells.iter().filter(fits);
    of.map(|cell| cell["figures"]["Ok"]["surface"][name].as_f64().unwrap())
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn meshes_are_judged_scan_by_scan_and_rows_are_their_means() {
    let folder = folder();
    let list = folder.path().join("list.txt");
    let (markdown, cells) = table(folder.path(), "mesh", &["--scans", str(&list)]);
    assert_eq!(cells.len(), 6, "{markdown}");
    let ceiling = row(&markdown, "depth fusion");
    assert!(ceiling[5].parse::<f64>().unwrap() > 0.95, "{markdown}");
    for method in ["depth fusion", "stereo", "ours"] {
        let found = row(&markdown, method);
        let names = [
            "accuracy_m",
            "completeness_m",
            "chamfer_m",
            "precision",
            "recall",
            "f_score",
        ];
        for (name, found) in names.into_iter().zip(found) {
            let values = figure(&cells, method, None, name);
            assert_eq!(values.len(), 2, "{method}");
            assert_eq!(found, format!("{:.3}", mean(&values)), "{name} of {method}");
        }
    }
    assert!(row(&markdown, "baseline").iter().all(|cell| *cell == "–"));
    for said in [
        "baseline: no weights were given",
        "2 scans",
        "TransformerFusion",
        "up to 1.5 m",
        "commit ",
    ] {
        assert!(markdown.contains(said), "{said}: {markdown}");
    }
    // The same rooms as depth maps.
    let room = folder.path().join("rooms/*");
    let (markdown, _) = table(folder.path(), "depth", &["--scans", str(&room)]);
    let [abs_rel, delta] =
        [0, 4].map(|k| row(&markdown, "depth fusion")[k].parse::<f64>().unwrap());
    assert!(abs_rel < 0.05 && delta > 0.95, "{markdown}");
}

#[test]
fn steadiness_follows_the_papers_formulas() {
    let folder = folder();
    let one = folder.path().join("rooms/one");
    let (markdown, cells) = table(
        folder.path(),
        "views",
        &["--scans", str(&one), "--views", "3,6,12"],
    );
    let f: Vec<f64> = [3, 6, 12]
        .map(|n| figure(&cells, "depth fusion", Some(n), "f_score")[0])
        .to_vec();
    assert!(f[0] < f[2], "{f:?}");
    assert_eq!(
        row(&markdown, "depth fusion, 3 views")[2],
        format!("{:.3}", f[0])
    );
    let middle = mean(&f);
    let squares: f64 = f.iter().map(|f| (f - middle) * (f - middle)).sum();
    let found = row(&markdown, "depth fusion");
    assert_eq!(
        found[0],
        format!("{:.2}", 100.0 * (squares / 2.0).sqrt() / middle)
    );
    assert_eq!(
        found[1],
        format!("{:.2}", 100.0 * (squares / 3.0).sqrt() / middle)
    );
    assert_eq!(found[2], format!("{:.2}", 100.0 * f[0] / f[2]));
    assert_eq!(found[4], format!("{:.2}", 100.0 * (f[2] - f[0]) / f[2]));
    assert!(
        markdown.contains("Stability over 3, 6, 12 views"),
        "{markdown}"
    );
}

/// The paper's way: rows without tiles stay as they are, and every row has all keyframes.
#[test]
fn views_of_a_tile_change_rows_with_tiles_alone() {
    let folder = folder();
    let scans = str(&folder.path().join("list.txt")).to_owned();
    let arguments = [
        "--scans", &scans, "--of", "tile", "--views", "2,9", "--jobs", "2",
    ];
    let (markdown, cells) = table(folder.path(), "views", &arguments);
    assert_eq!(cells.len(), 12, "{markdown}");
    let both = |method| [2, 9].map(|views| figure(&cells, method, Some(views), "f_score"));
    for method in ["depth fusion", "stereo"] {
        let [few, many] = both(method);
        assert_eq!(few, many, "{method}");
    }
    let [few, many] = both("ours");
    assert_ne!(few, many, "{markdown}");
    let keyframes = |views: &str| row(&markdown, &format!("ours, {views} views"))[3].to_owned();
    assert_eq!(keyframes("2"), keyframes("9"));
    assert!(markdown.contains("keyframes of a scan: all"), "{markdown}");
    assert!(
        markdown.contains("at most so many views each: 2, 9"),
        "{markdown}"
    );
    let names: Vec<&str> = cells
        .iter()
        .map(|cell| cell["scan"].as_str().unwrap())
        .collect();
    assert!(
        names.is_sorted(),
        "in the scans' order, however many at a time"
    );
}

#[test]
fn a_report_shows_every_mesh() {
    let folder = folder();
    let [one, report] = ["rooms/one", "report"].map(|name| folder.path().join(name));
    let more = [
        "--scans",
        str(&one),
        "--views",
        "4,8",
        "--report",
        str(&report),
    ];
    let (markdown, _) = table(folder.path(), "views", &more);
    let page = fs::read_to_string(report.join("index.html")).unwrap();
    let f = row(&markdown, "stereo, 8 views")[2];
    assert!(page.contains(&format!("<td>{f}</td>")), "{f}: {page}");
    assert!(page.contains("<polyline"), "{page}");
    let pictures: Vec<&str> = page
        .split("src=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    // The truth, and for three methods what was found and what is missing.
    assert_eq!(pictures.len(), 7, "{pictures:?}");
    for picture in pictures {
        let decoder = png::Decoder::new(std::io::BufReader::new(
            fs::File::open(report.join(picture)).unwrap(),
        ));
        let mut reader = decoder.read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        let drawn = rgb.chunks(3).filter(|rgb| **rgb != [255; 3]).count();
        // Stereo finds little in so few small pictures.
        assert!(drawn > 100, "{picture}: {drawn} pixels");
        // The sensor's own depth is nowhere as far off as to be red; what is not there cannot be.
        if picture.contains("depth_fusion-found") {
            let red = rgb
                .chunks(3)
                .filter(|rgb| rgb[0] / 2 > rgb[1].max(rgb[2]))
                .count();
            assert!(red * 50 < drawn, "{red} of {drawn}");
        }
    }
    assert!(page.contains("most missing"), "{page}");
}

#[test]
fn other_sets_and_switches_have_columns_of_their_own() {
    let folder = folder();
    let [one, two] = ["one", "two"].map(|name| folder.path().join("rooms").join(name));
    let named = format!("phone={}", str(&one));
    let (markdown, _) = table(
        folder.path(),
        "generalization",
        &["--scans", &named, str(&two)],
    );
    for set in ["phone", "two"] {
        assert!(
            markdown.contains(&format!("| {set} | depth fusion |")),
            "{markdown}"
        );
    }
    let guided = folder.path().join("guided");
    fs::write(&guided, network(true, 10.0)).unwrap();
    let more = format!("with stereo={}", str(&guided));
    let (markdown, _) = table(
        folder.path(),
        "ablation",
        &["--scans", str(&one), "--row", &more],
    );
    assert_eq!(row(&markdown, "ours")[..5], ["yes", "yes", "yes", "", ""]);
    assert_eq!(
        row(&markdown, "with stereo")[..5],
        ["yes", "yes", "yes", "", "yes"]
    );
}

#[test]
fn a_mesh_that_is_not_there_counts_as_the_protocol_says() {
    let folder = folder();
    fs::write(folder.path().join("ours"), network(false, -10.0)).unwrap();
    let one = folder.path().join("rooms/one");
    let (markdown, _) = table(folder.path(), "mesh", &["--scans", str(&one)]);
    assert_eq!(
        row(&markdown, "ours")[..6],
        ["1.000", "1.000", "1.000", "1.000", "0.000", "0.000"]
    );
    assert!(markdown.contains("- ours, one: no mesh"), "{markdown}");
}

#[test]
fn the_parts_of_the_network_are_timed() {
    let folder = folder();
    let more = ["--size", "64x48", "--views", "2,4"];
    let (markdown, cells) = table(folder.path(), "efficiency", &more);
    let found = row(&markdown, "ours");
    assert!(
        found.iter().all(|cell| cell.parse::<f64>().unwrap() > 0.0),
        "{markdown}"
    );
    assert_eq!(cells.len(), 2);
    assert!(markdown.contains("1.6 m, 4 views"), "{markdown}");
}

#[test]
fn what_cannot_be_done_says_what_to_do() {
    let folder = folder();
    let lacking = folder.path().join("none.txt");
    for (arguments, said) in [
        (vec!["table", "mesh"], "expected --scans"),
        (
            vec!["table", "mesh", "--scans", "x", "--row", "nameless"],
            "expected --row NAME=FILE, found nameless",
        ),
        (vec!["table", "mesh", "--scans", str(&lacking)], "none.txt"),
        (
            vec![
                "table",
                "mesh",
                "--scans",
                "x",
                "--weights",
                "nowhere.safetensors",
            ],
            "nowhere.safetensors",
        ),
    ] {
        let run = ipdrecon(&arguments);
        assert!(!run.status.success());
        let error = text(&run.stderr);
        assert!(
            error.starts_with("error: ") && error.contains(said),
            "{error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
