//! How long runs take is foretold within a factor of two, on real scans and the processor.
//!
//! They lie beside the repository and are not part of it; without them these tests say that they are skipped.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::Device;
use common::{files, open, open_real, real};
use glam::Vec3;
use net::weights;
use recon::{
    DepthSource, Flow, Limits, Options, Preset, Rates, Sink, Stage, arithmetic_rate, fusing_rate,
};
use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use stereo::StereoConfig;
use volume::{BrickMeshes, VolumeError};

/// Says how long stages take, and watches as the page does.
struct Clock {
    since: Instant,
    stage: Option<Stage>,
}

impl Clock {
    fn tell(&mut self, next: Option<Stage>) {
        if let Some(stage) = self.stage {
            println!("  {stage:?} {:.2} s", self.since.elapsed().as_secs_f64());
        }
        self.since = Instant::now();
        self.stage = next;
    }
}

impl Sink for Clock {
    fn stage(&mut self, stage: Stage, _total: usize) {
        self.tell(Some(stage));
    }

    fn eye(&self) -> Option<Vec3> {
        Some(Vec3::ZERO)
    }

    async fn bricks(&mut self, _meshes: BrickMeshes) -> Result<(), VolumeError> {
        Ok(())
    }

    async fn checkpoint(&mut self) -> Flow {
        Flow::Continue
    }
}

/// Seconds that this thread has worked, where the system says so, for a machine that is busy with something else stretches the
/// time on the wall; otherwise that.
fn worked_s(start: Instant) -> f64 {
    // The count is brought up to date where a thread makes room for others, and else by the system's ticks alone, 10 ms apart.
    std::thread::sleep(Duration::from_micros(1));
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let worked_ns = told.and_then(|told| told.split(' ').next()?.parse::<f64>().ok());
    worked_ns.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn rates(device: &Device) -> Rates {
    let start = Instant::now();
    let now_s = || worked_s(start);
    let fusing = pollster::block_on(fusing_rate(device, now_s)).unwrap();
    let arithmetic = pollster::block_on(arithmetic_rate(device, now_s)).unwrap();
    println!(
        "{:.1} million points and {:.2} GFLOP a second, calibrated in {:.0} ms",
        fusing / 1e6,
        arithmetic / 1e9,
        start.elapsed().as_secs_f64() * 1e3
    );
    Rates { fusing, arithmetic }
}

/// Runs a scan and compares, up to three times: a machine may turn to something else between calibration and run. On one thread, as in
/// the browser, and one test at a time, for they would take each other's caches.
fn check(name: &str, views: Option<usize>, depth: DepthSource) {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(folder) = real(name) else { return };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.unwrap();
    let ratios = (0..3).map(|_| pool.install(|| expected_by_taken(&folder, name, views, depth)));
    let mut ratios = ratios.inspect(|ratio| println!("{name}: expected / took = {ratio:.2}"));
    assert!(
        ratios.any(|ratio| (0.5..2.0).contains(&ratio)),
        "three times"
    );
}

/// The time foretold as a multiple of that taken.
fn expected_by_taken(folder: &Path, name: &str, views: Option<usize>, depth: DepthSource) -> f64 {
    let scan = open_real(folder);
    let options = Options {
        views,
        depth: Some(depth),
        ..Options::default()
    };
    let device = Device::flex();
    let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
    let weights =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../weights/ipdrecon.safetensors");
    let network = weights::load(&std::fs::read(weights).unwrap(), &device).unwrap();
    // Before and after, for the machine may be busy with something else by then.
    let before = rates(&device);
    let mut clock = Clock {
        since: Instant::now(),
        stage: None,
    };
    let start = Instant::now();
    let began_s = worked_s(start);
    let run = recon::reconstruct(&scan, &plan, &network, &device, &mut clock);
    pollster::block_on(run).unwrap();
    let took_s = worked_s(start) - began_s;
    clock.tell(None);
    let after = rates(&device);
    let expected_s = 0.5 * (plan.work.seconds(&before) + plan.work.seconds(&after));
    println!(
        "{name}, {} keyframes, {} bricks: {took_s:.1} s, expected {expected_s:.1} s; {:?}",
        plan.keyframes.len(),
        plan.bricks,
        plan.work
    );
    expected_s / took_s
}

#[test]
fn of_the_network() {
    for (name, views) in [("hololens", Some(20)), ("livingroom", None)] {
        check(name, views, DepthSource::Network(Preset::Small.config()));
    }
}

#[test]
fn of_stereo() {
    for (name, views) in [("hololens", Some(20)), ("livingroom", None)] {
        check(name, views, DepthSource::Stereo(StereoConfig::default()));
    }
}

#[test]
fn of_the_sensors_depth() {
    for name in ["hololens", "livingroom"] {
        check(name, None, DepthSource::Sensor);
    }
}

/// As fast in everything.
fn even(rate: f64) -> Rates {
    Rates {
        fusing: rate,
        arithmetic: rate,
    }
}

#[test]
fn more_work_takes_longer_and_a_faster_machine_less_long() {
    let scan = open(files(|_, bytes| Some(bytes)));
    let seconds = |views, depth, rates: &Rates| {
        let options = Options {
            views: Some(views),
            depth: Some(depth),
            ..Options::default()
        };
        let plan = recon::plan(&scan, &Limits::default(), options).unwrap();
        plan.work.seconds(rates)
    };
    let stereo = DepthSource::Stereo(StereoConfig::default());
    let [small, medium] = [Preset::Small, Preset::Medium].map(|p| DepthSource::Network(p.config()));
    let slow = even(1e9);
    for depth in [DepthSource::Sensor, stereo, small, medium] {
        let (few, many) = (seconds(8, depth, &slow), seconds(24, depth, &slow));
        assert!(many > 1.5 * few, "{depth:?}: {few} s, {many} s");
        assert!(seconds(8, depth, &even(1e10)) < few);
    }
    let of = |depth| seconds(24, depth, &slow);
    assert!(
        of(DepthSource::Sensor) < of(stereo) && of(stereo) < of(small) && of(small) < of(medium)
    );
}

#[test]
fn what_a_buffer_cannot_hold_is_said_before() {
    let scan = open(files(|_, bytes| Some(bytes)));
    let remarks = |binding_bytes, network_is_bound| {
        let limits = Limits {
            binding_bytes,
            network_is_bound,
        };
        let options = Options {
            depth: Some(DepthSource::Network(Preset::Small.config())),
            ..Options::default()
        };
        let plan = recon::plan(&scan, &limits, options).unwrap();
        plan.remarks
            .iter()
            .any(|remark| remark.contains("the surest are kept"))
    };
    assert!(remarks(48 << 20, true));
    assert!(
        !remarks(48 << 20, false),
        "a processor's tensors have no such bound"
    );
    assert!(!remarks(1 << 30, true));
}
