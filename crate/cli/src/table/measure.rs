//! Every mesh of a table made and judged.

use super::{
    figures::{Cell, Figures},
    method::{Made, Method},
    scans::Set,
};
use crate::{
    failure::Failure,
    files::{open_scan, read_mesh},
    progress::bar,
};
use burn::tensor::Device;
use mesh::Mesh;
use recon::{Limits, evaluate};
use scan::Scan;
use std::path::{Path, PathBuf};

/// What all cells share.
pub struct Setting {
    /// The most keyframes; `None` for all.
    pub views: Vec<Option<usize>>,
    /// The most views of a tile.
    pub tile_views: Option<usize>,
    /// Random choice of a tile's views with the seeds below this.
    pub seeds: Option<u64>,
    /// How meshes are compared.
    pub protocol: evaluate::Protocol,
    /// Where true meshes lie.
    pub truth: Option<PathBuf>,
    /// How far depth counts, in metres.
    pub reach_m: f32,
    /// The most pixels of a picture.
    pub size: Option<(u32, u32)>,
    /// Where to compute.
    pub device: Device,
    /// That in words.
    pub device_name: String,
    /// What it allows.
    pub limits: Limits,
}

/// One cell for each scan, number of views, method and seed. A method that fails on a scan is a cell that says why.
pub fn all(sets: &[Set], methods: &[Method], setting: &Setting) -> Result<Vec<Cell>, Failure> {
    let scans = sets.iter().map(|set| set.scans.len()).sum::<usize>();
    let there: Vec<&Method> = methods.iter().filter(|method| method.is_there()).collect();
    let bar = bar("measuring", scans * there.len() * setting.views.len());
    let mut cells = Vec::new();
    for (set, path) in sets
        .iter()
        .flat_map(|set| set.scans.iter().map(move |path| (set, path)))
    {
        let scan = open_scan(path)?;
        let name = path
            .file_stem()
            .unwrap_or(path.as_os_str())
            .to_string_lossy();
        let truth = truth(&scan, path, &name, setting)?;
        for &views in &setting.views {
            for method in &there {
                // What no chance is in gives the same with every seed.
                let seeds = match (method.as_network(), setting.seeds) {
                    (Some(_), Some(seeds)) => seeds,
                    _ => 1,
                };
                for seed in 0..seeds {
                    let figures = method.mesh(&scan, views, seed, setting);
                    let figures = figures.and_then(|made| judge(made, &truth, &scan, setting));
                    cells.extend(figures.transpose().map(|figures| Cell {
                        set: set.name.clone(),
                        scan: name.to_string(),
                        method: method.name.clone(),
                        views,
                        seed,
                        figures: figures.map_err(|failure| failure.to_string()),
                    }));
                }
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();
    Ok(cells)
}

/// The true mesh of a scan in its own world: a file that was named for it or lies in it, or fused from all of its depth.
fn truth(scan: &Scan, path: &Path, name: &str, setting: &Setting) -> Result<Mesh, Failure> {
    if let Some(folder) = &setting.truth {
        return read_mesh(&folder.join(format!("{name}.ply")));
    }
    let beside = path.join("gt.ply");
    if beside.is_file() {
        return read_mesh(&beside);
    }
    let made = Method::sensor().mesh(scan, None, 0, setting)?;
    Ok(made.map(|made| made.mesh).unwrap_or_default())
}

fn judge(
    made: Option<Made>,
    truth: &Mesh,
    scan: &Scan,
    setting: &Setting,
) -> Result<Option<Figures>, Failure> {
    let Some(made) = made else {
        return Ok(None);
    };
    let report = evaluate::evaluate(
        &made.mesh,
        truth,
        Some(scan),
        setting.protocol,
        0,
        &setting.device,
        |_, _| {},
    );
    let report = pollster::block_on(report)?;
    Ok(Some(Figures {
        surface: report.surface,
        depth: report.depth,
        keyframes: made.keyframes,
        triangles: made.mesh.triangles.len(),
        seconds: made.seconds,
    }))
}
