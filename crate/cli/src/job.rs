//! From a scan to a mesh file: what `fuse`, `stereo` and `reconstruct` share. They differ in where the surface comes from.

use crate::{
    compute::DeviceChoice,
    depth_folder::DepthFolder,
    failure::Failure,
    files::{MeshFormat, open_scan},
    progress::{Terminal, print_finding},
};
use burn::tensor::Device;
use clap::Args;
use glam::Vec3;
use mesh::Mesh;
use recon::{DepthSource, Limits, Options, Outcome, Plan, PlanError};
use scan::Scan;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// What all are told.
#[derive(Args)]
pub struct Job {
    /// Folder or zip of the scan: 7-Scenes, ScanNet (exported) or TUM RGB-D.
    scan: PathBuf,
    /// The mesh to write: .ply, .glb or .obj.
    #[arg(short, long)]
    output: PathBuf,
    /// Take every n-th keyframe.
    #[arg(long, default_value_t = Options::default().every)]
    every: usize,
    /// Keep the canonical frame (Z up) instead of the scan's own.
    #[arg(long)]
    canonical: bool,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t = DeviceChoice::Cpu)]
    device: DeviceChoice,
}

/// What those are told that fuse depth.
#[derive(Args)]
pub struct DepthJob {
    #[command(flatten)]
    job: Job,
    /// Edge of a voxel in metres.
    #[arg(long, default_value_t = Options::default().voxel_size_m)]
    voxel: f32,
    /// Take at most this many keyframes, evenly spread.
    #[arg(long)]
    views: Option<usize>,
    /// Depth beyond this many metres is not used.
    #[arg(long, default_value_t = Options::default().max_depth_m)]
    max_depth: f32,
}

impl DepthJob {
    /// Makes the mesh and writes it; the depth maps of stereo too, where `maps` names a folder.
    pub fn run(&self, depth: DepthSource, maps: Option<&Path>) -> Result<(), Failure> {
        let opened = self.job.open()?;
        let plan = opened.plan(Options {
            voxel_size_m: self.voxel,
            views: self.views,
            max_depth_m: self.max_depth,
            ..self.job.options(depth)
        })?;
        let maps = maps.map(|folder| DepthFolder::create(folder, &opened.scan));
        let mut terminal = Terminal::new(maps.transpose()?);
        let Opened { scan, device, .. } = &opened;
        let outcome = pollster::block_on(recon::run(scan, &plan, device, &mut terminal));
        terminal.finish()?;
        self.job.write(&opened, &outcome?)
    }
}

/// A scan and a device at hand.
pub struct Opened {
    /// The scan; what was noticed about it is told.
    pub scan: Scan,
    /// Where to compute.
    pub device: Device,
    limits: Limits,
    format: MeshFormat,
    started: Instant,
}

impl Job {
    /// Opens the scan and the device, and tells a wrong name of the output before any work.
    pub fn open(&self) -> Result<Opened, Failure> {
        let started = Instant::now();
        let format = MeshFormat::of(&self.output)?;
        let scan = open_scan(&self.scan)?;
        scan.findings().iter().for_each(print_finding);
        let (device, limits) = self.device.device()?;
        Ok(Opened {
            scan,
            device,
            limits,
            format,
            started,
        })
    }

    /// What is asked for, with the usual for everything that is not in a [`Job`].
    pub fn options(&self, depth: DepthSource) -> Options {
        Options {
            every: self.every,
            depth: Some(depth),
            ..Options::default()
        }
    }

    /// Takes the mesh from the volume and writes it, unless there is none.
    pub fn write(&self, opened: &Opened, outcome: &Outcome) -> Result<(), Failure> {
        let (mesh, up) = surface(outcome, &opened.scan, self.canonical)?;
        opened.format.write(&mesh, up, &self.output)?;
        eprintln!(
            "{}: {} vertices, {} triangles from {} keyframes in {:.1} s",
            self.output.display(),
            mesh.positions.len(),
            mesh.triangles.len(),
            outcome.frames_fused,
            opened.started.elapsed().as_secs_f64(),
        );
        Ok(())
    }
}

/// The mesh of a run, where exports lie, and which way is up there; a failure where there is none.
pub fn surface(outcome: &Outcome, scan: &Scan, canonical: bool) -> Result<(Mesh, Vec3), Failure> {
    let mut mesh = pollster::block_on(outcome.volume.mesh())?;
    if mesh.triangles.is_empty() {
        return Err(Failure::NoSurface {
            keyframes: outcome.frames_fused,
        });
    }
    let up = recon::place(&mut mesh, scan, canonical);
    Ok((mesh, up))
}

impl Opened {
    /// Plans, and prints what was planned.
    pub fn plan(&self, options: Options) -> Result<Plan, Failure> {
        let plan = recon::plan(&self.scan, &self.limits, options).map_err(planning_failed)?;
        print_plan(&plan);
        Ok(plan)
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
        (plan.device_bytes + plan.network_bytes) >> 20,
    );
    for remark in &plan.remarks {
        eprintln!("note: {remark}");
    }
}
