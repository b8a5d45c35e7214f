//! The rows of a table: ways from a scan to a mesh.

use super::setting::{Of, Setting};
use crate::{failure::Failure, files::read_mesh, job::surface, weights::Weights};
use burn::tensor::Device;
use mesh::Mesh;
use net::{Ipdrecon, NetConfig, weights};
use recon::{DepthSource, Flow, NetworkConfig, Options, Preset, Sink, ViewChoice};
use scan::Scan;
use std::{path::Path, time::Instant};
use stereo::StereoConfig;

/// A way to make a mesh.
pub struct Method {
    /// What the row is called.
    pub name: String,
    source: Source,
}

enum Source {
    /// The sensor's own depth: what could be had at best.
    Sensor,
    Stereo,
    Network(Box<Ipdrecon>),
    /// The same mesh for every scan, in the canonical world: what can be had without looking.
    Guess(Box<Mesh>),
    /// A row that the table has and nobody gave weights for.
    Missing,
}

/// A mesh, and what it took.
pub struct Made {
    /// In the scan's own world.
    pub mesh: Mesh,
    /// Keyframes it was made from.
    pub keyframes: usize,
    /// Seconds from the scan to the mesh.
    pub seconds: f64,
}

impl Method {
    /// Fusion of the sensor's depth.
    pub fn sensor() -> Self {
        Self {
            name: "depth fusion".to_owned(),
            source: Source::Sensor,
        }
    }

    /// Stereo.
    pub fn stereo() -> Self {
        Self {
            name: "stereo".to_owned(),
            source: Source::Stereo,
        }
    }

    /// A row without figures.
    pub fn missing(name: String) -> Self {
        Self {
            name,
            source: Source::Missing,
        }
    }

    /// What a file makes: a mesh (.ply) the same guess for every scan, weights a network.
    ///
    /// # Errors
    /// A file that is neither.
    pub fn from_file(name: String, path: &Path, device: &Device) -> Result<Self, Failure> {
        if path.extension().is_some_and(|ending| ending == "ply") {
            let source = Source::Guess(Box::new(read_mesh(path)?));
            return Ok(Self { name, source });
        }
        Self::network(name, Some(path), device)
    }

    /// A network with the weights of a file, or with the released ones.
    ///
    /// # Errors
    /// A file that is no weights.
    pub fn network(name: String, path: Option<&Path>, device: &Device) -> Result<Self, Failure> {
        let network = Weights::read(path)?.get(|bytes| weights::load(bytes, device))?;
        Ok(Self {
            name,
            source: Source::Network(Box::new(network)),
        })
    }

    /// Whether it makes meshes.
    pub fn is_there(&self) -> bool {
        !matches!(self.source, Source::Missing)
    }

    /// The network, where it is one.
    pub fn as_network(&self) -> Option<&Ipdrecon> {
        match &self.source {
            Source::Network(network) => Some(network),
            _ => None,
        }
    }

    /// What the network is made of, where it is one.
    pub fn config(&self) -> Option<&NetConfig> {
        self.as_network().map(Ipdrecon::config)
    }

    /// The mesh of a scan from at most `views`, of the scan or of a tile.
    ///
    /// # Errors
    /// What the run says.
    pub fn mesh(
        &self,
        scan: &Scan,
        views: Option<usize>,
        seed: u64,
        setting: &Setting,
    ) -> Result<Made, Failure> {
        let started = Instant::now();
        let (keyframes, tile_views) = match setting.of {
            Of::Scan => (views, setting.tile_views),
            Of::Tile => (None, views),
        };
        let depth = match &self.source {
            Source::Missing => return Err(Failure::NoWeights),
            Source::Guess(mesh) => {
                let mut mesh = mesh.as_ref().clone();
                recon::place(&mut mesh, scan, false);
                return Ok(Made {
                    mesh,
                    keyframes: 0,
                    seconds: 0.0,
                });
            }
            Source::Sensor => DepthSource::Sensor,
            Source::Stereo => DepthSource::Stereo(StereoConfig::default()),
            Source::Network(network) => {
                DepthSource::Network(network_config(network.config(), tile_views, seed, setting))
            }
        };
        let options = Options {
            views: keyframes,
            max_depth_m: setting.reach_m,
            depth: Some(depth),
            ..Options::default()
        };
        let plan = recon::plan(scan, &setting.limits, options)?;
        let outcome = pollster::block_on(async {
            match &self.source {
                Source::Network(network) => {
                    let network = network.as_ref();
                    recon::reconstruct(scan, &plan, network, &setting.device, &mut Quiet).await
                }
                _ => recon::run(scan, &plan, &setting.device, &mut Quiet).await,
            }
        })?;
        let (mesh, _) = surface(&outcome, scan, false)?;
        Ok(Made {
            mesh,
            keyframes: plan.keyframes.len(),
            seconds: started.elapsed().as_secs_f64(),
        })
    }
}

fn network_config(
    config: &NetConfig,
    tile_views: Option<usize>,
    seed: u64,
    setting: &Setting,
) -> NetworkConfig {
    let usual = Preset::of(config).config();
    NetworkConfig {
        size: setting.size.unwrap_or(usual.size),
        views_a_tile: tile_views.unwrap_or(usual.views_a_tile),
        reach_m: setting.reach_m,
        seed,
        choice: match setting.seeds {
            Some(_) => ViewChoice::Random,
            None => ViewChoice::Coverage,
        },
        ..usual
    }
}

/// Nobody watches.
struct Quiet;

impl Sink for Quiet {
    async fn checkpoint(&mut self) -> Flow {
        Flow::Continue
    }
}
