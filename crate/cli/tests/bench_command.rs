//! `ipdrecon bench` as its user meets it.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{ipdrecon, str, text};
use serde_json::Value;
use std::fs;

/// The cells of each row of a table, and the row's name.
fn rows(markdown: &str) -> Vec<Vec<String>> {
    let lines = markdown.lines().filter(|line| line.starts_with("| "));
    let cells = lines.map(|line| line.trim_matches('|').split('|'));
    cells
        .map(|cells| cells.map(|cell| cell.trim().to_owned()).collect())
        .collect()
}

#[test]
fn the_parts_of_the_released_network_are_timed() {
    let folder = tempfile::TempDir::new().unwrap();
    let json = folder.path().join("bench.json");
    let size = ["--size", "64x48,80x64", "--views", "2,5"];
    let mut arguments = vec!["bench", "--quick", "--json", str(&json)];
    arguments.extend(size);
    let run = ipdrecon(&arguments);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let markdown = text(&run.stdout);
    println!("{markdown}");
    let rows = rows(&markdown);
    // Two parts of each size; of each number of views the whole and seven stages.
    assert_eq!(rows.len(), 1 + 2 * 2 + 2 * 8);
    for row in &rows[1..] {
        assert!(row[2].parse::<f64>().unwrap() >= 0.0, "{row:?}");
    }
    assert!(markdown.contains("Peak: ") && markdown.contains("commit "));

    let data: Value = serde_json::from_slice(&fs::read(json).unwrap()).unwrap();
    let found = data["report"]["rows"].as_array().unwrap();
    let of = |part: &str| {
        let row = found
            .iter()
            .find(|row| row["part"].as_str().unwrap().starts_with(part));
        row.unwrap_or_else(|| panic!("no {part} in {found:?}"))
    };
    let flops = |part: &str| of(part)["work"]["flops"].as_f64().unwrap();
    // Each plane has four thirds to five thirds of the pixels.
    let larger = flops("picture of 80x64: backbone") / flops("picture of 64x48: backbone");
    assert!((1.5..1.9).contains(&larger), "{larger}");
    // All views see nearly all of the piece: 2.5 times the views are as many pairs and more.
    let more = flops("piece, 5 views: fusion, 4 cm") / flops("piece, 2 views: fusion, 4 cm");
    assert!((2.4..3.0).contains(&more), "{more}");
    assert!(of("piece, 2 views")["cold_ms"].as_f64().unwrap() > 0.0);
}
