//! How fast a keyframe is matched, both sweeps: the host's form, the kernels on wgpu, and the NumPy and numba of
//! tests/reference/stereo.py, in one run, keyframe by keyframe in turn, with the same threads; as Markdown tables.
//!
//! On the sample room, and on a real scan where one lies beside the repository. Pictures are decoded and kernels
//! compiled before. On a machine without a GPU the wgpu device is a processor that plays one: the ratios then say nothing
//! about a GPU.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{gpu, open, open_real, real};
use scan::Scan;
use std::{
    io::{BufRead, BufReader, Lines, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::Instant,
};
use stereo::{
    Recipe, StereoConfig,
    depth::{Raw, winners},
    fused::{FusedMatcher, Work, most_planes, work},
    planes::{local_planes, weights},
    smooth::{SmoothConfig, smooth},
    sources,
    sweep::{SweepConfig, sweep},
    view::{View, fit},
};

/// Keyframes, spread evenly over a scan.
const KEYFRAMES: usize = 7;
const SIZES: [(u32, u32); 2] = [(160, 120), (320, 240)];

/// A keyframe's picture and its sources', with a number for each.
struct Job {
    reference: View,
    sources: Vec<(usize, View)>,
}

/// What matching one keyframe took and gave.
struct Figures {
    wall_s: f64,
    /// Of all processors; NaN where the system does not tell.
    cpu_s: f64,
    mean_zncc: f64,
}

/// The same keyframes as `spread` in tests/reference/stereo.py.
fn jobs(scan: &Scan, config: &StereoConfig) -> Vec<Job> {
    let count = scan.frames().len();
    let all: Vec<usize> = (0..count).collect();
    let sources = sources::choose(scan.frames(), &all, config.sources);
    let view = |at: usize| {
        let info = &scan.frames()[at];
        let image = scan.color(at).expect("a picture");
        View::new(&image, fit(&info.color_camera, config.size), info.pose)
    };
    let job = |i: usize| {
        let at = (i as f64 * (count - 1) as f64 / (KEYFRAMES - 1) as f64).round_ties_even();
        let at = at as usize;
        Job {
            reference: view(at),
            sources: sources[at].iter().map(|&s| (s, view(s))).collect(),
        }
    };
    (0..KEYFRAMES).map(job).collect()
}

/// One sweep: a base or none, offsets in 1/m, and how.
struct Sweep<'a> {
    base: Option<&'a [f32]>,
    offsets: &'a [f32],
    sweep: &'a SweepConfig,
    smooth: &'a SmoothConfig,
}

fn on_host(job: &Job, how: &Sweep) -> Raw {
    let (view, planes) = (&job.reference, how.offsets.len());
    let sources: Vec<&View> = job.sources.iter().map(|(_, view)| view).collect();
    let cost = sweep(view, &sources, how.base, how.offsets, how.sweep);
    let sum = smooth(&cost, &view.gray, view.size(), planes, how.smooth);
    winners(&cost, &sum, how.base, how.offsets)
}

fn on_device(matcher: &mut FusedMatcher, job: &Job, how: &Sweep) -> Raw {
    let sources: Vec<(usize, &View)> = job.sources.iter().map(|(k, view)| (*k, view)).collect();
    let (base, offsets) = (how.base, how.offsets);
    let raw = matcher.match_view(
        &job.reference,
        &sources,
        base,
        offsets,
        how.sweep,
        how.smooth,
    );
    pollster::block_on(raw).expect("maps")
}

/// Inverse depth of the first sweep's planes, in 1/m.
fn planes(job: &Job, config: &StereoConfig) -> Vec<f32> {
    let (width, height) = job.reference.size();
    let count = config.planes.min(most_planes(width, height));
    let (far, near) = (1.0 / config.far_m, 1.0 / config.near_m);
    let share = |i: usize| i as f32 / (count - 1) as f32;
    (0..count).map(|i| far + (near - far) * share(i)).collect()
}

/// Both sweeps, as `Stereo` does them.
fn measure(job: &Job, config: &StereoConfig, mut one: impl FnMut(&Sweep) -> Raw) -> Figures {
    let recipe = Recipe::default();
    let (cpu_s, started) = (cpu_s(), Instant::now());
    let offsets = planes(job, config);
    let coarse = one(&Sweep {
        base: None,
        offsets: &offsets,
        sweep: &recipe.sweep,
        smooth: &recipe.smooth,
    });
    let (gray, size) = (&job.reference.gray, job.reference.size());
    let weights = weights(&coarse.zncc);
    let base = local_planes(&coarse.rho, &weights, gray, size, &recipe.planes);
    let raw = one(&Sweep {
        base: Some(&base),
        offsets: &recipe.fine_offsets(offsets[1] - offsets[0]),
        sweep: &recipe.fine_sweep,
        smooth: &recipe.fine_smooth,
    });
    let wall_s = started.elapsed().as_secs_f64();
    let zncc: f64 = raw.zncc.iter().map(|&z| f64::from(z)).sum();
    Figures {
        wall_s,
        cpu_s: self::cpu_s() - cpu_s,
        mean_zncc: zncc / raw.zncc.len() as f64,
    }
}

/// Seconds of all processors that this process took so far, in hundredths; NaN off Linux.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets; utime and stime are fields 14 and 15 of proc(5), in ticks of 1/100 s.
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks: Vec<f64> = ticks.filter_map(|t| t.parse().ok()).collect();
    match ticks.as_slice() {
        [user, system] => (user + system) / 100.0,
        _ => f64::NAN,
    }
}

/// Operations and bytes of both sweeps, as the kernels do them.
fn work_of(job: &Job, config: &StereoConfig) -> Work {
    let ((width, height), sources) = (job.reference.size(), job.sources.len());
    let recipe = Recipe::default();
    let coarse = planes(job, config).len();
    let fine = recipe.fine_offsets(1.0).len();
    let coarse = work(width, height, coarse, sources, recipe.sweep.radius);
    let fine = work(width, height, fine, sources, recipe.fine_sweep.radius);
    Work {
        flops: coarse.flops + fine.flops,
        bytes: coarse.bytes + fine.bytes,
    }
}

/// The reference implementation, waiting for a line before each keyframe.
struct Peer {
    child: Child,
    input: ChildStdin,
    output: Lines<BufReader<ChildStdout>>,
}

impl Peer {
    /// `None`, and a line that says so, without its Python.
    fn start(folder: &Path, size: (u32, u32), form: &str, threads: usize) -> Option<Self> {
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
        let windows = cfg!(target_os = "windows");
        let python = ["bin/python", "Scripts/python.exe"][usize::from(windows)];
        let python = root.join(".tools/venv").join(python);
        if !python.exists() {
            println!("skipped: no Python in .tools/venv (npm run setup makes it)");
            return None;
        }
        let mut child = Command::new(python)
            .arg(root.join("tests/reference/stereo.py"))
            .arg("time")
            .arg(folder)
            .args(["--size", &format!("{}x{}", size.0, size.1)])
            .args(["--keyframes", &KEYFRAMES.to_string()])
            .args(["--threads", &threads.to_string()])
            .args(["--sweep", form, "--paced"])
            .env("NUMBA_NUM_THREADS", threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python starts");
        let input = child.stdin.take().expect("its input");
        let output = BufReader::new(child.stdout.take().expect("its output")).lines();
        let mut peer = Self {
            child,
            input,
            output,
        };
        peer.wait_until_ready();
        Some(peer)
    }

    fn line(&mut self) -> String {
        let line = self.output.next().expect("a line of the reference");
        line.expect("text of the reference")
    }

    fn wait_until_ready(&mut self) {
        assert_eq!(self.line(), "ready");
    }

    fn measure(&mut self, last: bool) -> Figures {
        writeln!(self.input).expect("the reference listens");
        let line = self.line();
        let numbers = line.trim_matches(['[', ']']).split(',');
        let numbers: Vec<f64> = numbers.filter_map(|n| n.trim().parse().ok()).collect();
        let [wall_s, cpu_s, mean_zncc] = numbers[..] else {
            panic!("expected three numbers from the reference, found {line}");
        };
        if !last {
            self.wait_until_ready();
        }
        Figures {
            wall_s,
            cpu_s,
            mean_zncc,
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.wait();
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// One after the other for each keyframe, so that a change of the machine's speed falls on all.
fn table(name: &str, scan: &Scan, folder: &Path, size: (u32, u32), threads: usize) {
    let config = StereoConfig {
        size,
        ..StereoConfig::default()
    };
    let jobs = jobs(scan, &config);
    let mut rows: Vec<(&str, Vec<Figures>)> = Vec::new();
    for form in ["flex", "wgpu", "numba", "numpy"] {
        rows.push((form, Vec::new()));
    }
    let mut matcher = gpu().map(|device| FusedMatcher::new(&device).expect("kernels"));
    let mut numba = Peer::start(folder, size, "numba", threads);
    let mut numpy = Peer::start(folder, size, "numpy", threads);
    // Compiles the kernels, wakes the threads.
    measure(&jobs[0], &config, |how| on_host(&jobs[0], how));
    if let Some(matcher) = &mut matcher {
        measure(&jobs[0], &config, |how| on_device(matcher, &jobs[0], how));
    }
    for (i, job) in jobs.iter().enumerate() {
        let last = i + 1 == jobs.len();
        let host = measure(job, &config, |how| on_host(job, how));
        rows[0].1.push(host);
        if let Some(matcher) = &mut matcher {
            let device = measure(job, &config, |how| on_device(matcher, job, how));
            rows[1].1.push(device);
        }
        for (row, peer) in [(2, &mut numba), (3, &mut numpy)] {
            if let Some(peer) = peer {
                rows[row].1.push(peer.measure(last));
            }
        }
    }
    rows.retain(|(_, figures)| !figures.is_empty());
    // Of each keyframe, then the median: keyframes have different numbers of sources.
    let ratio = |row: &[Figures], peer: &str, of: fn(&Figures) -> f64| {
        let peer = rows.iter().find(|(form, _)| *form == peer);
        peer.map_or("–".to_owned(), |(_, peer)| {
            let ratios = row.iter().zip(peer).map(|(a, b)| of(b) / of(a));
            format!("{:.2}", median(ratios))
        })
    };
    for (form, figures) in &rows {
        let rate = |of: fn(&Work) -> f64| {
            let rate = |(job, f): (&Job, &Figures)| of(&work_of(job, &config)) / f.wall_s / 1e9;
            format!("{:.1}", median(jobs.iter().zip(figures).map(rate)))
        };
        let rates = match *form {
            "flex" | "wgpu" => rate(|w| w.flops) + " | " + &rate(|w| w.bytes),
            _ => "– | –".to_owned(),
        };
        let wall_s = median(figures.iter().map(|f| f.wall_s));
        let cpu_s = median(figures.iter().map(|f| f.cpu_s));
        let zncc = figures.iter().map(|f| f.mean_zncc).sum::<f64>() / figures.len() as f64;
        let against = |peer| {
            let (wall, cpu) = (|f: &Figures| f.wall_s, |f: &Figures| f.cpu_s);
            format!(
                "{} / {}",
                ratio(figures, peer, wall),
                ratio(figures, peer, cpu)
            )
        };
        println!(
            "| {name} | {}x{} | {form} | {wall_s:.3} | {cpu_s:.2} | {} | {} | {rates} | {zncc:.4} |",
            size.0,
            size.1,
            against("numpy"),
            against("numba"),
        );
    }
}

/// The sample room as files, for the reference to read; gone at the end.
struct Written(PathBuf);

impl Written {
    fn sample() -> Self {
        let folder = std::env::temp_dir().join(format!("stereo-bench-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a temporary folder");
        for (path, bytes) in common::sample().files() {
            std::fs::write(folder.join(path), bytes).expect("a file of the sample room");
        }
        Self(folder)
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn main() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let sample = Written::sample();
    let mut scans = vec![("sample room", open(common::sample()), sample.0.clone())];
    if let Some(folder) = real("hololens") {
        scans.push(("hololens", open_real(&folder), folder.join("scan")));
    }
    println!(
        "| scan | size | form | s a keyframe | CPU s | faster than numpy, wall / CPU | faster than numba, wall / CPU | GFLOP/s | GB/s | mean ZNCC |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (name, scan, folder) in &scans {
        for size in SIZES {
            table(name, scan, folder, size, threads);
        }
    }
    println!("\nmedians of {KEYFRAMES} keyframes, {threads} threads each");
}
