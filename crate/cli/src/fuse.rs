//! `ipdrecon fuse`: the depth images of a scan to a mesh.

use crate::{
    compute::DeviceChoice,
    failure::Failure,
    files::{MeshFormat, open_scan},
    progress::{Terminal, print_finding},
};
use clap::Args;
use recon::{Options, Plan};
use std::{path::PathBuf, time::Instant};

/// What `fuse` is told.
#[derive(Args)]
pub struct Arguments {
    /// Folder or zip of the scan: 7-Scenes, ScanNet (exported) or TUM RGB-D.
    scan: PathBuf,
    /// The mesh to write: .ply, .glb or .obj.
    #[arg(short, long)]
    output: PathBuf,
    /// Edge of a voxel in metres.
    #[arg(long, default_value_t = Options::default().voxel_size_m)]
    voxel: f32,
    /// Take every n-th keyframe.
    #[arg(long, default_value_t = Options::default().every)]
    every: usize,
    /// Depth beyond this many metres is not used.
    #[arg(long, default_value_t = Options::default().max_depth_m)]
    max_depth: f32,
    /// Keep the canonical frame (Z up) instead of the scan's own.
    #[arg(long)]
    canonical: bool,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t = DeviceChoice::Cpu)]
    device: DeviceChoice,
}

/// Runs `fuse`.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let format = MeshFormat::of(&arguments.output)?;
    let scan = open_scan(&arguments.scan)?;
    scan.findings().iter().for_each(print_finding);
    let options = Options {
        voxel_size_m: arguments.voxel,
        every: arguments.every,
        max_depth_m: arguments.max_depth,
    };
    let (device, limits) = arguments.device.device()?;
    let plan = recon::plan(&scan, &limits, options)?;
    print_plan(&plan);
    let mut terminal = Terminal::new();
    let outcome = pollster::block_on(recon::run(&scan, &plan, &device, &mut terminal));
    terminal.finish();
    let outcome = outcome?;
    let mut mesh = pollster::block_on(outcome.volume.mesh())?;
    let up = recon::place(&mut mesh, &scan, arguments.canonical);
    format.write(&mesh, up, &arguments.output)?;
    eprintln!(
        "{}: {} vertices, {} triangles from {} keyframes in {:.1} s",
        arguments.output.display(),
        mesh.positions.len(),
        mesh.triangles.len(),
        outcome.frames_fused,
        started.elapsed().as_secs_f64(),
    );
    Ok(())
}

fn print_plan(plan: &Plan) {
    eprintln!(
        "{} of {} frames as keyframes, voxels of {:.1} cm, about {} bricks, {} MB on the device",
        plan.keyframes.len(),
        plan.frames,
        plan.options.voxel_size_m * 100.0,
        plan.bricks,
        plan.device_bytes >> 20,
    );
    for remark in &plan.remarks {
        eprintln!("note: {remark}");
    }
}
