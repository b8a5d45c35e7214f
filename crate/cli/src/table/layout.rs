//! What is in which table.

use super::{
    figures::{Cell, Means, means, steadiness},
    grid::Grid,
    method::Method,
    setting::{Of, Setting},
};
use clap::ValueEnum;
use serde_json::{Value, json};

/// The paper's tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Table 4: depth that the meshes show to the scan's cameras.
    Depth,
    /// Table 3: accuracy, completeness, precision, recall and F of the meshes.
    Mesh,
    /// Table 5: how much quality depends on the number of views.
    Views,
    /// Table 6: milliseconds of the network's parts.
    Efficiency,
    /// Table 7: other sets of scans.
    Generalization,
    /// Table 8: what each switch of the network does.
    Ablation,
}

impl Kind {
    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Mesh => "mesh",
            Self::Views => "views",
            Self::Efficiency => "efficiency",
            Self::Generalization => "generalization",
            Self::Ablation => "ablation",
        }
    }
}

/// A finished table.
pub struct Table {
    /// Which of the paper's.
    pub kind: &'static str,
    /// Figures.
    pub grids: Vec<Grid>,
    /// What must be known to read them.
    pub notes: Vec<String>,
    /// Every single figure, to reckon with.
    pub cells: Value,
}

impl Table {
    /// To read.
    pub fn markdown(&self) -> String {
        let grids: Vec<String> = self.grids.iter().map(Grid::markdown).collect();
        format!("{}\n{}\n", grids.join("\n"), self.notes.join("\n"))
    }

    /// To reckon with.
    pub fn json(&self) -> Value {
        json!({ "table": self.kind, "notes": self.notes, "cells": self.cells })
    }
}

/// The numbers of views that the paper's stability is about.
const PAPERS_VIEWS: [usize; 3] = [60, 80, 100];

/// The table of what was measured.
pub fn table(kind: Kind, methods: &[Method], cells: &[Cell], setting: &Setting) -> Table {
    let grids = match kind {
        Kind::Depth => vec![depth(methods, cells, setting)],
        Kind::Views => views(methods, cells, setting),
        Kind::Generalization => vec![generalization(methods, cells, setting)],
        Kind::Ablation => vec![ablation(methods, cells, setting)],
        Kind::Mesh | Kind::Efficiency => vec![mesh(methods, cells, setting)],
    };
    Table {
        kind: kind.name(),
        grids,
        notes: notes(methods, cells, setting),
        cells: json!(cells),
    }
}

/// The means of a method with a number of views over all scans that `chosen` takes.
fn of(
    cells: &[Cell],
    method: &Method,
    views: Option<usize>,
    chosen: impl Fn(&Cell) -> bool,
) -> Option<Means> {
    let fits = |cell: &&Cell| cell.method == method.name && cell.views == views && chosen(cell);
    means(cells.iter().filter(fits))
}

/// The name of a row: with the number of views where there are several.
fn name(method: &Method, views: Option<usize>, setting: &Setting) -> String {
    match views {
        Some(views) if setting.views.len() > 1 => format!("{}, {views} views", method.name),
        _ => method.name.clone(),
    }
}

/// A row for each method and number of views; `figures` are what follows the name.
fn each(
    head: &[&str],
    methods: &[Method],
    cells: &[Cell],
    setting: &Setting,
    figures: impl Fn(&Means) -> Vec<String>,
) -> Grid {
    let mut rows = Vec::new();
    for method in methods {
        for &views in &setting.views {
            let mut row = vec![name(method, views, setting)];
            row.extend(of(cells, method, views, |_| true).iter().flat_map(&figures));
            rows.push(row);
        }
    }
    Grid::new(head, rows)
}

fn share(value: f64) -> String {
    format!("{value:.3}")
}

/// Precision, recall and F.
fn quality(means: &Means) -> Vec<String> {
    means.surface[3..]
        .iter()
        .map(|value| share(*value))
        .collect()
}

fn mesh(methods: &[Method], cells: &[Cell], setting: &Setting) -> Grid {
    let head = [
        "",
        "Acc (m)",
        "Comp (m)",
        "Chamfer (m)",
        "Prec",
        "Recall",
        "F",
        "keyframes",
        "s",
    ];
    let figures = |means: &Means| {
        let mut row: Vec<String> = means.surface.map(share).to_vec();
        row.push(format!("{:.0}", means.keyframes));
        row.push(format!("{:.1}", means.seconds));
        row
    };
    each(&head, methods, cells, setting, figures)
}

fn depth(methods: &[Method], cells: &[Cell], setting: &Setting) -> Grid {
    let head = [
        "",
        "Abs Rel",
        "Abs Diff (m)",
        "Sq Rel (m)",
        "RMSE (m)",
        "δ < 1.25",
        "δ < 1.25²",
        "δ < 1.25³",
        "Comp",
    ];
    let figures = |means: &Means| match &means.depth {
        None => Vec::new(),
        Some(of) => [
            of.abs_rel,
            of.abs_diff,
            of.sq_rel,
            of.rmse,
            of.delta_1,
            of.delta_2,
            of.delta_3,
            of.completeness,
        ]
        .map(share)
        .to_vec(),
    };
    each(&head, methods, cells, setting, figures)
}

fn views(methods: &[Method], cells: &[Cell], setting: &Setting) -> Vec<Grid> {
    let head = ["", "Prec", "Recall", "F", "keyframes"];
    let quality = each(&head, methods, cells, setting, |means| {
        let mut row = quality(means);
        row.push(format!("{:.0}", means.keyframes));
        row
    });
    let counts = steady_counts(setting);
    let list: Vec<String> = counts.iter().map(usize::to_string).collect();
    let list = list.join(", ");
    let percent = |value: f64| format!("{:.2}", 100.0 * value);
    let steady: Vec<Vec<String>> = methods
        .iter()
        .map(|method| {
            let means: Option<Vec<Means>> = counts
                .iter()
                .map(|&views| of(cells, method, Some(views), |_| true))
                .collect();
            let mut row = vec![method.name.clone()];
            let several = means.filter(|means| means.len() > 1);
            if let Some(of) = several.and_then(|means| steadiness(&means)) {
                row.extend([
                    percent(of.cv_sample),
                    percent(of.cv_population),
                    percent(of.retention_f),
                    percent(of.retention),
                    percent(of.max_drop),
                    share(of.stability),
                ]);
            }
            row
        })
        .collect();
    let head = [
        "",
        "CV, sample (%)",
        "CV, population (%)",
        "PRR of F (%)",
        "mean PRR (%)",
        "MaxDrop (%)",
        "SI",
    ];
    let mut steady = Grid::new(&head, steady);
    steady.title = Some(format!("Stability over {list} views"));
    vec![quality, steady]
}

/// The paper's numbers of views, as far as they were measured; all if they were not.
fn steady_counts(setting: &Setting) -> Vec<usize> {
    let mut all: Vec<usize> = setting.views.iter().flatten().copied().collect();
    all.sort_unstable();
    let papers: Vec<usize> = all
        .iter()
        .copied()
        .filter(|views| PAPERS_VIEWS.contains(views))
        .collect();
    if papers.len() > 1 { papers } else { all }
}

fn generalization(methods: &[Method], cells: &[Cell], setting: &Setting) -> Grid {
    let mut sets: Vec<&str> = cells.iter().map(|cell| cell.set.as_str()).collect();
    sets.dedup();
    let mut found = Vec::new();
    for set in sets {
        for method in methods {
            for &views in &setting.views {
                let mut row = vec![set.to_owned(), name(method, views, setting)];
                if let Some(means) = of(cells, method, views, |cell| cell.set == set) {
                    row.extend(quality(&means));
                    row.push(means.cells.to_string());
                }
                found.push(row);
            }
        }
    }
    Grid::new(&["set", "", "Prec", "Recall", "F", "meshes"], found)
}

fn ablation(methods: &[Method], cells: &[Cell], setting: &Setting) -> Grid {
    let mut found = Vec::new();
    for method in methods {
        for &views in &setting.views {
            let mut row = vec![name(method, views, setting)];
            row.extend(match method.config() {
                None => vec![String::new(); 5],
                Some(config) => [
                    config.pce,
                    config.acm,
                    config.ipsd,
                    config.matching,
                    config.guide,
                ]
                .map(|on| if on { "yes" } else { "" }.to_owned())
                .to_vec(),
            });
            row.extend(of(cells, method, views, |_| true).iter().flat_map(quality));
            found.push(row);
        }
    }
    let head = [
        "", "PCE", "ACM", "IPSD", "matching", "guide", "Prec", "Recall", "F",
    ];
    Grid::new(&head, found)
}

/// What must be known to read the figures.
fn notes(methods: &[Method], cells: &[Cell], setting: &Setting) -> Vec<String> {
    let mut scans: Vec<(&str, &str)> = cells
        .iter()
        .map(|c| (c.set.as_str(), c.scan.as_str()))
        .collect();
    scans.sort_unstable();
    scans.dedup();
    let truth = match &setting.truth {
        Some(_) => "meshes that were given".to_owned(),
        None => format!(
            "gt.ply of a scan, or fused from all of its depth up to {} m",
            setting.reach_m
        ),
    };
    let views: Vec<String> = setting
        .views
        .iter()
        .map(|views| views.map_or("all".to_owned(), |views| views.to_string()))
        .collect();
    let views = views.join(", ");
    let choice = match setting.seeds {
        Some(seeds) => format!("views of a tile at random, {seeds} seeds"),
        None => "views of a tile by coverage, which has no chance in it".to_owned(),
    };
    let (keyframes, tile) = match (setting.of, setting.tile_views) {
        (Of::Tile, _) => ("all".to_owned(), views),
        (Of::Scan, Some(of_tile)) => (views, of_tile.to_string()),
        (Of::Scan, None) => (views, "20 for small networks, 100 for full ones".to_owned()),
    };
    let mut notes = vec![format!(
        "{} scans, means over meshes; protocol {:?}, threshold 5 cm; truth {truth}; keyframes of a scan: {keyframes}; tiles of 3.84 x 3.84 x 1.92 m, at most so many views each: {tile}; \
         {choice}; {}; version {}, commit {}.",
        scans.len(),
        setting.protocol,
        setting.device_name,
        env!("CARGO_PKG_VERSION"),
        env!("IPDRECON_COMMIT"),
    )];
    for method in methods.iter().filter(|method| !method.is_there()) {
        notes.push(format!("- {}: no weights were given.", method.name));
    }
    for cell in cells {
        if let Err(why) = &cell.figures {
            notes.push(format!(
                "- {}, {}: no mesh, counted as 1 m, precision 1, recall 0: {why}",
                cell.method, cell.scan
            ));
        }
    }
    notes
}
