//! The run as a picture: `plot.svg` in the run's folder, made from its log.

use crate::error::TrainError;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// The name of the picture in a run's folder.
pub const FILE: &str = "plot.svg";

const WIDTH: f64 = 960.0;
const PANEL: f64 = 230.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 26.0;
const COLORS: [&str; 8] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#666666", "#000000",
];

/// A curve: its name and its points (step, value).
struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
    dots: bool,
}

/// Writes the picture of the log's lines: the loss, its parts, and what the held-out scans say.
///
/// # Errors
/// What the system says.
pub fn write(folder: &Path, lines: &[Value]) -> Result<(), TrainError> {
    let path = folder.join(FILE);
    std::fs::write(&path, svg(lines)).map_err(|error| TrainError::file("write", &path, error))
}

/// The picture as SVG.
pub fn svg(lines: &[Value]) -> String {
    let of = |kind: &str| -> Vec<&Value> { lines.iter().filter(|l| l["kind"] == kind).collect() };
    let (steps, checks) = (of("step"), of("validation"));
    let both = |field: &str| {
        vec![
            curve(&steps, field, "training", true),
            curve(&checks, field, "held out", false),
        ]
    };
    let names = |prefix: &str| -> Vec<String> {
        let first = steps.first().or(checks.first()).and_then(|l| l.as_object());
        let keys = first.map(|object| object.keys().filter(|k| k.starts_with(prefix)));
        keys.map(|keys| keys.cloned().collect()).unwrap_or_default()
    };
    let all = |lines: &[&Value], prefix: &str, smooth: bool| -> Vec<Curve> {
        let names = names(prefix).into_iter();
        names
            .map(|name| curve(lines, &name, name.trim_start_matches(prefix), smooth))
            .collect()
    };
    let panels = [
        ("loss", both("loss")),
        ("parts of the loss, training", all(&steps, "loss_", true)),
        ("parts of the loss, held out", all(&checks, "loss_", false)),
        (
            "held out: IoU, precision, recall of occupancy",
            all(&checks, "occupied_", false),
        ),
        (
            "mean error of the signed distance, m",
            both("distance_error_m"),
        ),
    ];
    let height = panels.len() as f64 * PANEL;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for (i, (title, curves)) in panels.iter().enumerate() {
        panel(&mut svg, title, curves, i as f64 * PANEL);
    }
    svg.push_str("</svg>\n");
    svg
}

/// A field of the lines; smoothed to about 200 means where there are more.
fn curve(lines: &[&Value], field: &str, name: &str, smooth: bool) -> Curve {
    let points = lines
        .iter()
        .filter_map(|l| Some((l["step"].as_f64()?, l[field].as_f64()?)));
    let points: Vec<(f64, f64)> = points.collect();
    let group = if smooth {
        points.len().div_ceil(200).max(1)
    } else {
        1
    };
    let mean = |group: &[(f64, f64)]| {
        let sum = group.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        (sum.0 / group.len() as f64, sum.1 / group.len() as f64)
    };
    Curve {
        name: name.to_owned(),
        points: points.chunks(group).map(mean).collect(),
        dots: !smooth,
    }
}

fn panel(svg: &mut String, title: &str, curves: &[Curve], top: f64) {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let most = |of: &dyn Fn(&(f64, f64)) -> f64| points().map(of).fold(0.0_f64, f64::max);
    let (last, highest) = (most(&|p| p.0).max(1.0), most(&|p| p.1));
    let highest = if highest > 0.0 { highest * 1.05 } else { 1.0 };
    let (width, height) = (WIDTH - LEFT - RIGHT, PANEL - TOP - BOTTOM);
    let x = |step: f64| LEFT + width * step / last;
    let y = |value: f64| top + TOP + height * (1.0 - value / highest);
    let mut add = |text: String| svg.push_str(&text);
    add(format!(
        "<text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{title}</text>\n",
        top + 22.0
    ));
    for tick in 0..=4 {
        let (step, value) = (
            last * f64::from(tick) / 4.0,
            highest * f64::from(tick) / 4.0,
        );
        add(format!(
            "<path d=\"M{LEFT} {0:.1}H{1:.1}\" stroke=\"#ddd\"/><text x=\"{2}\" y=\"{3:.1}\" text-anchor=\"end\">{value:.3}</text>\
             <text x=\"{4:.1}\" y=\"{5:.1}\" text-anchor=\"middle\">{step:.0}</text>\n",
            y(value),
            LEFT + width,
            LEFT - 6.0,
            y(value) + 4.0,
            x(step),
            top + PANEL - 8.0,
        ));
    }
    if points().next().is_none() {
        add(format!(
            "<text x=\"{}\" y=\"{}\">nothing yet</text>\n",
            LEFT + 20.0,
            top + 0.5 * PANEL
        ));
    }
    for (i, curve) in curves.iter().enumerate() {
        let color = COLORS[i % COLORS.len()];
        let mut path = String::new();
        let mut dots = String::new();
        for (k, &(step, value)) in curve.points.iter().enumerate() {
            let letter = if k == 0 { 'M' } else { 'L' };
            // Writing to a string cannot fail.
            let _ = write!(path, "{letter}{:.1} {:.1}", x(step), y(value));
            if curve.dots {
                let _ = write!(
                    dots,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2\" fill=\"{color}\"/>",
                    x(step),
                    y(value)
                );
            }
        }
        let label = LEFT + width + 10.0;
        let at = top + TOP + 10.0 + 15.0 * i as f64;
        let now = curve
            .points
            .last()
            .map_or(String::new(), |p| format!(" {:.3}", p.1));
        add(format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.4\"/>{dots}\
             <text x=\"{label}\" y=\"{at}\" fill=\"{color}\">{}{now}</text>\n",
            curve.name
        ));
    }
}
