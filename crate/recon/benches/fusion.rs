//! How fast fusion is: the plain form on `flex` against the kernels on wgpu, in one run, as a Markdown table.
//!
//! On the sample room, and on a real scan where one lies beside the repository. On a machine without a GPU the wgpu
//! device is a processor that plays one: the ratios then say nothing about a GPU.

// A test that cannot go on may say so by a panic.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use burn::tensor::Device;
use common::{gpu, open, open_real, real};
use glam::Vec3;
use recon::{Flow, Limits, Options, Sink, Stage};
use scan::Scan;
use std::time::Instant;
use volume::{BrickMeshes, VolumeError};

const RUNS: usize = 5;

/// Times the parts of a run. The device is waited for after each frame and each batch of bricks.
struct Timer {
    device: Device,
    started: Instant,
    mark: Instant,
    warm_up_s: f64,
    first_surface_s: f64,
    meshing_s: f64,
    bricks: usize,
    total_s: f64,
}

impl Timer {
    fn new(device: &Device) -> Self {
        let now = Instant::now();
        Self {
            device: device.clone(),
            started: now,
            mark: now,
            warm_up_s: 0.0,
            first_surface_s: 0.0,
            meshing_s: 0.0,
            bricks: 0,
            total_s: 0.0,
        }
    }
}

impl Sink for Timer {
    fn stage(&mut self, stage: Stage, _total: usize) {
        if stage == Stage::Fusing {
            self.warm_up_s = self.started.elapsed().as_secs_f64();
        }
    }

    fn eye(&self) -> Option<Vec3> {
        Some(Vec3::ZERO)
    }

    async fn bricks(&mut self, meshes: BrickMeshes) -> Result<(), VolumeError> {
        let wait = self.device.sync();
        wait.map_err(|error| VolumeError::Device(error.to_string()))?;
        self.meshing_s += self.mark.elapsed().as_secs_f64();
        self.bricks += meshes.ranges.len();
        if self.first_surface_s == 0.0 {
            self.first_surface_s = self.started.elapsed().as_secs_f64();
        }
        Ok(())
    }

    async fn checkpoint(&mut self) -> Flow {
        let _ = self.device.sync();
        self.mark = Instant::now();
        self.total_s = self.started.elapsed().as_secs_f64();
        Flow::Continue
    }
}

struct Figures {
    warm_up_s: f64,
    frame_ms: f64,
    brick_ms: f64,
    first_surface_s: f64,
    total_s: f64,
}

fn measure(scan: &Scan, device: &Device) -> Figures {
    let plan = recon::plan(scan, &Limits::default(), Options::default()).expect("a plan");
    let mut timer = Timer::new(device);
    let run = recon::run(scan, &plan, device, &mut timer);
    let outcome = pollster::block_on(run).expect("a run");
    let total_s = timer.started.elapsed().as_secs_f64();
    let fusing_s = total_s - timer.warm_up_s - timer.meshing_s;
    Figures {
        warm_up_s: timer.warm_up_s,
        frame_ms: fusing_s * 1e3 / outcome.frames_fused as f64,
        brick_ms: timer.meshing_s * 1e3 / timer.bricks as f64,
        first_surface_s: timer.first_surface_s,
        total_s,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let mut scans = vec![("sample room", open(common::sample()))];
    for name in ["hololens", "livingroom"] {
        if let Some(folder) = real(name) {
            scans.push((name, open_real(&folder)));
        }
    }
    let gpu = gpu();
    println!("| scan | device | warm-up s | ms a frame | ms a brick | first surface s | total s |");
    println!("|---|---|---|---|---|---|---|");
    for (name, scan) in &scans {
        let devices = [("flex", Some(Device::flex())), ("wgpu", gpu.clone())];
        let devices = devices
            .into_iter()
            .filter_map(|(n, device)| Some((n, device?)));
        // In turn, so that a change of the machine's speed falls on both.
        let devices: Vec<_> = devices.collect();
        let mut figures: Vec<Vec<Figures>> = devices.iter().map(|_| Vec::new()).collect();
        for _ in 0..RUNS {
            for ((_, device), figures) in devices.iter().zip(&mut figures) {
                figures.push(measure(scan, device));
            }
        }
        let columns: [fn(&Figures) -> f64; 5] = [
            |f| f.warm_up_s,
            |f| f.frame_ms,
            |f| f.brick_ms,
            |f| f.first_surface_s,
            |f| f.total_s,
        ];
        let medians: Vec<[f64; 5]> = figures
            .iter()
            .map(|runs| columns.map(|column| median(runs.iter().map(column).collect())))
            .collect();
        for ((device, _), row) in devices.iter().zip(&medians) {
            let [warm, frame, brick, first, total] = row;
            println!(
                "| {name} | {device} | {warm:.2} | {frame:.1} | {brick:.3} | {first:.2} | {total:.2} |"
            );
        }
        if let [flex, wgpu] = medians.as_slice() {
            let ratio: Vec<String> = flex
                .iter()
                .zip(wgpu)
                .map(|(a, b)| format!("{:.2}", b / a))
                .collect();
            println!("| {name} | wgpu / flex | {} |", ratio.join(" | "));
        }
    }
    println!("\nmedians of {RUNS} runs, decoding included in a frame");
}
