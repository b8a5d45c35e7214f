//! From a scan to a mesh file: what `fuse` and `stereo` share. They differ in where depth comes from.

use crate::{
    compute::DeviceChoice,
    depth_folder::DepthFolder,
    failure::Failure,
    files::{MeshFormat, open_scan},
    progress::{Terminal, print_finding},
};
use clap::Args;
use recon::{DepthSource, Options, Plan, PlanError};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// What both are told.
#[derive(Args)]
pub struct Job {
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
    /// Take at most this many keyframes, evenly spread.
    #[arg(long)]
    views: Option<usize>,
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

impl Job {
    /// Makes the mesh and writes it; the depth maps of stereo too, where `maps` names a folder.
    pub fn run(&self, depth: DepthSource, maps: Option<&Path>) -> Result<(), Failure> {
        let started = Instant::now();
        let format = MeshFormat::of(&self.output)?;
        let scan = open_scan(&self.scan)?;
        scan.findings().iter().for_each(print_finding);
        let (device, limits) = self.device.device()?;
        let plan = recon::plan(&scan, &limits, self.options(depth)).map_err(planning_failed)?;
        print_plan(&plan);
        let maps = maps.map(|folder| DepthFolder::create(folder, &scan));
        let mut terminal = Terminal::new(maps.transpose()?);
        let outcome = pollster::block_on(recon::run(&scan, &plan, &device, &mut terminal));
        terminal.finish()?;
        let outcome = outcome?;
        let mut mesh = pollster::block_on(outcome.volume.mesh())?;
        let up = recon::place(&mut mesh, &scan, self.canonical);
        format.write(&mesh, up, &self.output)?;
        eprintln!(
            "{}: {} vertices, {} triangles from {} keyframes in {:.1} s",
            self.output.display(),
            mesh.positions.len(),
            mesh.triangles.len(),
            outcome.frames_fused,
            started.elapsed().as_secs_f64(),
        );
        Ok(())
    }

    fn options(&self, depth: DepthSource) -> Options {
        Options {
            voxel_size_m: self.voxel,
            every: self.every,
            views: self.views,
            max_depth_m: self.max_depth,
            depth: Some(depth),
        }
    }
}

/// In the words of the command line where the engine cannot know them.
fn planning_failed(error: PlanError) -> Failure {
    match error {
        PlanError::NoDepth { name } => Failure::NoDepth { name },
        other => Failure::Plan(other),
    }
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
