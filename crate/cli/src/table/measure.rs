//! Every mesh of a table made and judged.

use super::{
    figures::{Cell, Figures},
    method::Method,
    report::{Judged, Report},
    scans::Set,
    setting::{Of, Setting},
};
use crate::{
    failure::Failure,
    files::{open_scan, read_mesh},
    progress::bar,
};
use indicatif::ProgressBar;
use mesh::Mesh;
use recon::evaluate;
use scan::Scan;
use std::{
    panic::resume_unwind,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// One cell for each scan, number of views, method and seed, `setting.jobs` scans at a time. A method that fails on a scan is
/// a cell that says why. The report gets the meshes of the first seed and the last number of views.
pub fn all(
    sets: &[Set],
    methods: &[Method],
    setting: &Setting,
    report: Option<&mut Report>,
) -> Result<Vec<Cell>, Failure> {
    let methods: Vec<&Method> = methods.iter().filter(|method| method.is_there()).collect();
    let in_set = |set| move |path| (set, path);
    let scans: Vec<(&Set, &PathBuf)> = sets
        .iter()
        .flat_map(|set| set.scans.iter().map(in_set(set)))
        .collect();
    let all = All {
        bar: bar(
            "measuring",
            scans.len() * methods.len() * setting.views.len(),
        ),
        methods: &methods,
        setting,
        report: report.map(Mutex::new),
    };
    let next = AtomicUsize::new(0);
    let some = || {
        let mut found = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some((set, path)) = scans.get(at) else {
                return Ok(found);
            };
            found.push((at, all.of_scan(set, path)?));
        }
    };
    let found: Result<Vec<_>, Failure> = thread::scope(|scope| {
        let jobs: Vec<_> = (0..setting.jobs.get()).map(|_| scope.spawn(some)).collect();
        jobs.into_iter()
            .map(|job| job.join().unwrap_or_else(|panic| resume_unwind(panic)))
            .collect()
    });
    all.bar.finish_and_clear();
    let mut found: Vec<(usize, Vec<Cell>)> = found?.into_iter().flatten().collect();
    found.sort_by_key(|(at, _)| *at);
    Ok(found.into_iter().flat_map(|(_, cells)| cells).collect())
}

/// What all scans share.
struct All<'a> {
    methods: &'a [&'a Method],
    setting: &'a Setting,
    report: Option<Mutex<&'a mut Report>>,
    bar: ProgressBar,
}

impl All<'_> {
    fn of_scan(&self, set: &Set, path: &Path) -> Result<Vec<Cell>, Failure> {
        let setting = self.setting;
        let subject = Subject::open(path, setting)?;
        let mut cells = Vec::new();
        for &views in &setting.views {
            let last = setting.views.last() == Some(&views);
            for method in self.methods {
                // What has no tiles is the same at every number of their views.
                let known = cells
                    .iter()
                    .find(|cell: &&Cell| setting.of == Of::Tile && cell.method == method.name)
                    .filter(|_| method.as_network().is_none());
                if let Some(known) = known.cloned() {
                    cells.push(Cell { views, ..known });
                    self.bar.inc(1);
                    continue;
                }
                for seed in 0..seeds(method, setting) {
                    let report = self.report.as_ref().filter(|_| last && seed == 0);
                    cells.push(Cell {
                        set: set.name.clone(),
                        scan: subject.name.clone(),
                        method: method.name.clone(),
                        views,
                        seed,
                        figures: subject.figures(method, views, seed, setting, report)?,
                    });
                }
                self.bar.inc(1);
            }
        }
        Ok(cells)
    }
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
        report: Option<&Mutex<&mut Report>>,
    ) -> Result<Result<Figures, String>, Failure> {
        let made = match method.mesh(&self.scan, views, seed, setting) {
            Ok(made) => made,
            Err(failure) => return Ok(Err(failure.to_string())),
        };
        if let Some(report) = report {
            let mut report = report.lock().unwrap_or_else(PoisonError::into_inner);
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
