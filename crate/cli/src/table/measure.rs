//! Every mesh of a table made and judged.

use super::{
    figures::{Cell, Figures},
    method::Method,
    report::{Judged, Report},
    scans::Set,
    setting::Setting,
};
use crate::{
    failure::Failure,
    files::{open_scan, read_mesh},
    progress::bar,
};
use mesh::Mesh;
use recon::evaluate;
use scan::Scan;
use std::path::Path;

/// One cell for each scan, number of views, method and seed. A method that fails on a scan is a cell that says why. The
/// report gets the meshes of the first seed and the last number of views.
pub fn all(
    sets: &[Set],
    methods: &[Method],
    setting: &Setting,
    mut report: Option<&mut Report>,
) -> Result<Vec<Cell>, Failure> {
    let methods: Vec<&Method> = methods.iter().filter(|method| method.is_there()).collect();
    let scans: usize = sets.iter().map(|set| set.scans.len()).sum();
    let bar = bar("measuring", scans * methods.len() * setting.views.len());
    let mut cells = Vec::new();
    for set in sets {
        for path in &set.scans {
            let subject = Subject::open(path, setting)?;
            for &views in &setting.views {
                let mut shown = report
                    .as_deref_mut()
                    .filter(|_| setting.views.last() == Some(&views));
                for method in &methods {
                    for seed in 0..seeds(method, setting) {
                        let report = shown.as_deref_mut().filter(|_| seed == 0);
                        cells.push(Cell {
                            set: set.name.clone(),
                            scan: subject.name.clone(),
                            method: method.name.clone(),
                            views,
                            seed,
                            figures: subject.figures(method, views, seed, setting, report)?,
                        });
                    }
                    bar.inc(1);
                }
            }
        }
    }
    bar.finish_and_clear();
    Ok(cells)
}

/// How many seeds a method is tried with; one where there is no chance in it.
fn seeds(method: &Method, setting: &Setting) -> u64 {
    match (method.as_network(), setting.seeds) {
        (Some(_), Some(seeds)) => seeds,
        _ => 1,
    }
}

/// A scan and what is true of it.
struct Subject {
    name: String,
    scan: Scan,
    truth: Mesh,
}

impl Subject {
    /// The true mesh is a file that was named for the scan or lies in it, or is fused from all of its depth.
    fn open(path: &Path, setting: &Setting) -> Result<Self, Failure> {
        let scan = open_scan(path)?;
        let name = path
            .file_stem()
            .unwrap_or(path.as_os_str())
            .to_string_lossy();
        let beside = path.join("gt.ply");
        let truth = match &setting.truth {
            Some(folder) => read_mesh(&folder.join(format!("{name}.ply")))?,
            None if beside.is_file() => read_mesh(&beside)?,
            None => Method::sensor().mesh(&scan, None, 0, setting)?.mesh,
        };
        Ok(Self {
            name: name.into_owned(),
            scan,
            truth,
        })
    }

    /// Makes a mesh and judges it; gives in words why there is none.
    fn figures(
        &self,
        method: &Method,
        views: Option<usize>,
        seed: u64,
        setting: &Setting,
        report: Option<&mut Report>,
    ) -> Result<Result<Figures, String>, Failure> {
        let made = match method.mesh(&self.scan, views, seed, setting) {
            Ok(made) => made,
            Err(failure) => return Ok(Err(failure.to_string())),
        };
        if let Some(report) = report {
            report.add(&Judged {
                scan: &self.name,
                method: &method.name,
                mesh: &made.mesh,
                truth: &self.truth,
                up: recon::up(&self.scan),
            })?;
        }
        let judged = evaluate::evaluate(
            &made.mesh,
            &self.truth,
            Some(&self.scan),
            setting.protocol,
            0,
            &setting.device,
            |_, _| {},
        );
        let judged = pollster::block_on(judged)?;
        Ok(Ok(Figures {
            surface: judged.surface,
            depth: judged.depth,
            keyframes: made.keyframes,
            triangles: made.mesh.triangles.len(),
            seconds: made.seconds,
        }))
    }
}
