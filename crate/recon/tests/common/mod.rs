//! What the tests of the job share: the sample room, real scans that may be absent, and a sink that remembers.

#![allow(dead_code)]

use burn::tensor::Device;
use glam::Vec3;
use recon::{Flow, Sink, Stage};
use scan::{FolderSource, MemorySource, Scan, Source};
use std::{collections::HashMap, path::PathBuf, rc::Rc};
use stereo::DepthMap;
use synth::SampleScan;
use volume::{BrickMeshes, VolumeError};

/// The sample room.
pub const SEED: u64 = 3;

/// A walk through it with a sensor's noise.
pub fn sample() -> SampleScan {
    SampleScan::new(SEED, 24, 320, 240)
}

pub fn open(source: impl scan::Source + 'static) -> Scan {
    scan::open(Rc::new(source)).unwrap()
}

/// The sample's files, changed; `None` leaves one out.
pub fn files(change: impl Fn(&str, Vec<u8>) -> Option<Vec<u8>>) -> MemorySource {
    let sample = sample();
    let paths: Vec<String> = sample
        .entries()
        .iter()
        .map(|entry| entry.path.clone())
        .collect();
    MemorySource::new(paths.into_iter().filter_map(|path| {
        let bytes = change(&path, sample.read(&path).unwrap())?;
        Some((path, bytes))
    }))
}

/// The sample without its depth, and with changed files.
pub fn color_alone(change: impl Fn(&str, Vec<u8>) -> Vec<u8>) -> MemorySource {
    files(|path, bytes| (!path.contains("depth")).then(|| change(path, bytes)))
}

/// A folder of the real scans beside this repository; `None`, and a line that says so, where it is absent.
pub fn real(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/scans")
        .join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no real scan {name} beside the repository");
    None
}

pub fn open_real(folder: &std::path::Path) -> Scan {
    open(FolderSource::open(&folder.join("scan")).unwrap())
}

/// burn's wgpu device; `None`, and a line that says so, where there is none.
pub fn gpu() -> Option<Device> {
    use std::sync::OnceLock;
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    let device = DEVICE.get_or_init(|| Device::wgpu_options().init().ok());
    if device.is_none() {
        println!("skipped: no Vulkan, Metal or DirectX adapter on this machine");
    }
    device.clone()
}

/// Remembers everything, and stops after some checkpoints if told to.
#[derive(Default)]
pub struct Recorder {
    pub stages: Vec<(Stage, usize)>,
    pub progress: Vec<usize>,
    pub findings: Vec<scan::Finding>,
    /// Progress of each stage.
    pub progress_of: HashMap<Stage, Vec<usize>>,
    pub surfaces: Vec<usize>,
    /// Progress of its stage when the first surface came.
    pub first_surface_at: Option<usize>,
    pub maps: Vec<DepthMap>,
    pub stop_after: Option<usize>,
    pub checkpoints: usize,
    pub watching: bool,
}

impl Sink for Recorder {
    fn stage(&mut self, stage: Stage, total: usize) {
        self.stages.push((stage, total));
    }

    fn progress(&mut self, done: usize) {
        self.progress.push(done);
        if let Some((stage, _)) = self.stages.last() {
            self.progress_of.entry(*stage).or_default().push(done);
        }
    }

    fn finding(&mut self, finding: scan::Finding) {
        self.findings.push(finding);
    }

    fn depth_map(&mut self, map: &DepthMap) {
        self.maps.push(map.clone());
    }

    fn eye(&self) -> Option<Vec3> {
        self.watching.then_some(Vec3::ZERO)
    }

    async fn bricks(&mut self, meshes: BrickMeshes) -> Result<(), VolumeError> {
        self.first_surface_at
            .get_or_insert(self.progress.last().copied().unwrap_or(0));
        self.surfaces.push(meshes.vertices.dims()[0] / 3);
        Ok(())
    }

    async fn checkpoint(&mut self) -> Flow {
        self.checkpoints += 1;
        match self.stop_after {
            Some(limit) if self.checkpoints > limit => Flow::Stop,
            _ => Flow::Continue,
        }
    }
}
