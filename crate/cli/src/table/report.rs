//! A page that shows a table: its figures, F by the number of views, every mesh coloured by its errors, the worst places.

use super::{
    figures::{Cell, means},
    grid::escaped,
    layout::Table,
    picture::{Overview, REDDEST_M, SIZE},
};
use crate::failure::Failure;
use glam::{IVec3, Vec3};
use mesh::{Mesh, nearest::PointIndex};
use std::{
    collections::HashMap,
    fmt::Write,
    fs::{self, File},
    io::BufWriter,
    path::{Path, PathBuf},
};

/// Edge of the places that are told apart, in metres.
const PLACE_M: f32 = 0.5;
/// Fewer points say nothing about a place.
const LEAST_POINTS: usize = 50;
/// Worst places told of a mesh.
const WORST: usize = 3;

/// A mesh that was judged.
pub struct Judged<'a> {
    /// Its scan.
    pub scan: &'a str,
    /// Its row.
    pub method: &'a str,
    /// In the scan's own world.
    pub mesh: &'a Mesh,
    /// The truth there.
    pub truth: &'a Mesh,
    /// Which way is up there.
    pub up: Vec3,
}

/// A report that is being made.
pub struct Report {
    folder: PathBuf,
    /// Of each scan its part of the page.
    scans: Vec<(String, String)>,
}

impl Report {
    /// Makes the folder.
    pub fn create(folder: &Path) -> Result<Self, Failure> {
        fs::create_dir_all(folder).map_err(|error| Failure::file("make", folder, error))?;
        Ok(Self {
            folder: folder.to_owned(),
            scans: Vec::new(),
        })
    }

    /// Draws a mesh.
    pub fn add(&mut self, judged: &Judged<'_>) -> Result<(), Failure> {
        let Some(bounds) = judged.truth.bounds() else {
            return Ok(());
        };
        let overview = Overview::of(&bounds, judged.up);
        let truth = PointIndex::new(&judged.truth.positions);
        let found = PointIndex::new(&judged.mesh.positions);
        if self
            .scans
            .last()
            .is_none_or(|(scan, _)| scan != judged.scan)
        {
            let file = self.draw(judged.scan, "truth", &overview.paint(judged.truth, None))?;
            let figure = figure(&file, "truth");
            self.scans.push((judged.scan.to_owned(), figure));
        }
        let wrong = overview.paint(judged.mesh, Some(&truth));
        let wrong = self.draw(judged.scan, &format!("{}-found", judged.method), &wrong)?;
        let missing = overview.paint(judged.truth, Some(&found));
        let missing = self.draw(judged.scan, &format!("{}-missing", judged.method), &missing)?;
        let mut part = figure(
            &wrong,
            &format!("{}: what it found, by distance to the truth", judged.method),
        );
        part += &figure(
            &missing,
            &format!("{}: the truth, by distance to what it found", judged.method),
        );
        let places = |name: &str, points: &[Vec3], to: &PointIndex| {
            let places = worst(points, &to.distances(points));
            let said: Vec<String> = places.iter().map(said).collect();
            format!(
                "<p>{}, {name}: {}</p>\n",
                escaped(judged.method),
                said.join("; ")
            )
        };
        part += &places("most wrong", &judged.mesh.positions, &truth);
        part += &places("most missing", &judged.truth.positions, &found);
        if let Some((_, page)) = self.scans.last_mut() {
            page.push_str(&part);
        }
        Ok(())
    }

    fn draw(&self, scan: &str, what: &str, rgb: &[u8]) -> Result<String, Failure> {
        let plain = |c: char| {
            if c.is_alphanumeric() || c == '-' {
                c
            } else {
                '_'
            }
        };
        let name: String = format!("{scan}-{what}")
            .chars()
            .map(plain)
            .collect::<String>()
            + ".png";
        let path = self.folder.join(&name);
        let file = File::create(&path).map_err(|error| Failure::file("write", &path, error))?;
        let mut encoder = png::Encoder::new(BufWriter::new(file), SIZE[0], SIZE[1]);
        encoder.set_color(png::ColorType::Rgb);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(rgb)?;
            writer.finish()
        });
        written.map_err(|error| Failure::Picture {
            path,
            error: error.to_string(),
        })?;
        Ok(name)
    }

    /// Writes `index.html`.
    pub fn write(&self, table: &Table, cells: &[Cell]) -> Result<(), Failure> {
        let grids: String = table.grids.iter().map(|grid| grid.html()).collect();
        let note = |note: &String| format!("<p>{}</p>\n", escaped(note));
        let notes: String = table.notes.iter().map(note).collect();
        let scan = |(name, part): &(String, String)| {
            format!(
                "<h2>{}</h2>\n<div class=\"scan\">{part}</div>\n",
                escaped(name)
            )
        };
        let scans: String = self.scans.iter().map(scan).collect();
        let page = format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>IPDRecon: {kind}</title>\n<style>{STYLE}</style>\n\
             <h1>{kind}</h1>\n{grids}{}{notes}<p>Blue is right, red is {REDDEST_M} m off or more.</p>\n{scans}</html>\n",
            plot(cells),
            kind = table.kind,
        );
        let path = self.folder.join("index.html");
        fs::write(&path, page).map_err(|error| Failure::file("write", &path, error))
    }
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1240px;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;margin:1rem 0}caption{text-align:left}td,th{padding:.2rem .7rem;border-bottom:1px solid #ddd;text-align:right}\
td:first-child,th:first-child{text-align:left}figure{display:inline-block;margin:.3rem}img{max-width:100%;border:1px solid #eee}\
figcaption,p{font-size:13px}";

fn figure(file: &str, caption: &str) -> String {
    let caption = escaped(caption);
    format!(
        "<figure><img src=\"{file}\" alt=\"{caption}\" width=\"{}\" height=\"{}\"><figcaption>{caption}</figcaption></figure>\n",
        SIZE[0], SIZE[1]
    )
}

/// A place and the mean error there.
struct Place {
    middle_m: Vec3,
    error_m: f32,
}

fn said(place: &Place) -> String {
    let Vec3 { x, y, z } = place.middle_m;
    format!("{:.2} m around ({x:.1}, {y:.1}, {z:.1})", place.error_m)
}

/// The places with the largest mean errors.
fn worst(points: &[Vec3], errors_m: &[f32]) -> Vec<Place> {
    let mut places: HashMap<IVec3, (f32, usize)> = HashMap::new();
    for (point, error_m) in points.iter().zip(errors_m) {
        let (sum, count) = places
            .entry((point / PLACE_M).floor().as_ivec3())
            .or_default();
        *sum += error_m;
        *count += 1;
    }
    let full = places
        .into_iter()
        .filter(|(_, (_, count))| *count >= LEAST_POINTS);
    let mut found: Vec<Place> = full
        .map(|(place, (sum, count))| Place {
            middle_m: (place.as_vec3() + 0.5) * PLACE_M,
            error_m: sum / count as f32,
        })
        .collect();
    let order = |place: &Place| place.middle_m.to_array().map(|value| (value * 1e3) as i64);
    found.sort_by(|a, b| {
        b.error_m
            .total_cmp(&a.error_m)
            .then(order(a).cmp(&order(b)))
    });
    found.truncate(WORST);
    found
}

/// F of every row by the number of views, where there are several.
fn plot(cells: &[Cell]) -> String {
    const COLORS: [&str; 6] = [
        "#666666", "#d55e00", "#56b4e9", "#0072b2", "#009e73", "#cc79a7",
    ];
    const SIDE: [f64; 2] = [560.0, 300.0];
    let mut counts: Vec<usize> = cells.iter().filter_map(|cell| cell.views).collect();
    counts.sort_unstable();
    counts.dedup();
    let (Some(&first), Some(&last)) = (counts.first(), counts.last()) else {
        return String::new();
    };
    if first == last {
        return String::new();
    }
    let mut methods: Vec<&str> = Vec::new();
    for cell in cells {
        if !methods.contains(&cell.method.as_str()) {
            methods.push(&cell.method);
        }
    }
    let x =
        |views: usize| 40.0 + (SIDE[0] - 180.0) * (views - first) as f64 / (last - first) as f64;
    let y = |f: f64| 20.0 + (SIDE[1] - 50.0) * (1.0 - f);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {} {}\" width=\"{}\" font-size=\"11\" role=\"img\" aria-label=\"F by views\">\n",
        SIDE[0], SIDE[1], SIDE[0]
    );
    for tick in 0..=4 {
        let f = f64::from(tick) / 4.0;
        let _ = writeln!(
            svg,
            "<path d=\"M40 {0:.1}H{1}\" stroke=\"#ddd\"/><text x=\"10\" y=\"{0:.1}\">{f:.2}</text>",
            y(f),
            x(last)
        );
    }
    for &views in &counts {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\">{views}</text>",
            x(views),
            SIDE[1] - 8.0
        );
    }
    for (method, color) in methods.iter().zip(COLORS.iter().cycle()) {
        let f = |views: usize| {
            let of = cells
                .iter()
                .filter(|cell| cell.method == **method && cell.views == Some(views));
            means(of).map(|means| (x(views), y(means.surface[5])))
        };
        let points: Vec<(f64, f64)> = counts.iter().filter_map(|&views| f(views)).collect();
        let line: Vec<String> = points
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let (end_x, end_y) = points.last().copied().unwrap_or_default();
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/><text x=\"{:.1}\" y=\"{end_y:.1}\" fill=\"{color}\">{}</text>",
            line.join(" "),
            end_x + 6.0,
            escaped(method),
        );
    }
    svg + "</svg>\n<p>F by the number of keyframes.</p>\n"
}
