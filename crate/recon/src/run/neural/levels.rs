//! Coarse to fine: what the views say of each tile's voxels, the 3D network over all of them, and those that go on.

use super::super::RunError;
use super::{
    evidence::{Seen, joined},
    guide,
    kept::{self, Above},
    network::{Input, Network, rows},
    pictures::Pictures,
    preview::Preview,
    tiles::Tiling,
};
use crate::event::{Flow, Sink, Stage};
use burn::{Tensor, tensor::Device};
use glam::IVec3;
use net::{
    Level, View,
    decode::children,
    guide::{guide_at, surface_at},
    model::{Decoded, TSDF_SCALE},
    sample::GuideMap,
};
use scan::{Finding, Severity};
use std::{mem, ops::Range};
use volume::{Evidence, VolumeError};

/// Pairs of a voxel and a view that are fused at a time, at most: bounds the memory of the tokens.
const PAIRS_A_BLOCK: usize = 200_000;
/// Voxels that a level may have, at most: 5,000 fine ones are a square metre of surface.
const SITES_AT_MOST: [usize; 3] = [usize::MAX, 1 << 19, 1 << 21];

/// Blocks of sites that so many views are fused at, one block at a time.
pub fn fused_at_once(sites: Range<usize>, views: usize) -> impl Iterator<Item = Range<usize>> {
    let (step, end) = ((PAIRS_A_BLOCK / views.max(1)).max(1), sites.end);
    sites
        .step_by(step)
        .map(move |start| start..(start + step).min(end))
}

/// Voxels that a level may have where no tensor may be larger than `binding_bytes`.
pub(super) fn most_sites(network: &impl Network, level: Level, binding_bytes: usize) -> usize {
    let most = SITES_AT_MOST[level as usize];
    if network.device() == Device::flex() {
        return most;
    }
    most.min(binding_bytes / network.row_bytes(level))
}

/// Why there is no field.
pub(super) enum Fault {
    /// No voxel of a level has a surface near it.
    Nothing {
        /// The level.
        level: Level,
        /// Its voxels.
        sites: usize,
    },
    /// The run itself cannot go on.
    Run(RunError),
}

impl From<VolumeError> for Fault {
    fn from(error: VolumeError) -> Self {
        Self::Run(error.into())
    }
}

impl From<RunError> for Fault {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

/// Distances at the fine sites.
pub(super) struct Field {
    /// The sites.
    pub sites: Vec<IVec3>,
    /// Signed distance over the truncation distance, positive in free space.
    pub distances: Vec<f32>,
    /// What each rests on; empty for a network that cannot tell.
    pub evidence: Vec<Evidence>,
}

/// What the levels work on.
pub(super) struct Scene<'a, P> {
    /// The lattice and its tiles.
    pub tiling: &'a Tiling,
    /// Pictures' planes.
    pub pictures: &'a Pictures<'a, P>,
    /// Stereo's depth, where the network wants it.
    pub guide: Option<&'a [GuideMap]>,
}

/// All three levels. `None` if the sink stopped it.
pub(super) async fn decode<N: Network>(
    scene: &Scene<'_, N::Plane>,
    network: &N,
    preview: &Preview<'_>,
    sink: &mut impl Sink,
) -> Result<Option<Field>, Fault> {
    let device = &network.device();
    let origin_m = scene.tiling.origin_m;
    if let Some(field) = sink.kept(Stage::Decoding(Level::Fine))
        && let Some(field) = kept::read_field(&field)
    {
        return Ok(Some(field));
    }
    let (mut tiles, mut sites) = coarse(scene);
    let mut above: Option<Above> = None;
    let mut first = Level::Coarse;
    for done in [Level::Medium, Level::Coarse] {
        let before = sink.kept(Stage::Decoding(done));
        if let Some(mut before) =
            before.and_then(|bytes| kept::read_above(&bytes, tiles.len(), device))
        {
            first = Level::ALL[done as usize + 1];
            sites = divide(&mut tiles, &mut before);
            above = Some(before);
            break;
        }
    }
    for level in Level::ALL.into_iter().skip(first as usize) {
        let lattice = Lattice {
            level,
            sites: &sites,
            tiles: &tiles,
        };
        let Some((fused, seen)) = lattice.fuse(scene, network, sink).await else {
            return Ok(None);
        };
        let says = scene
            .guide
            .map(|maps| guide_at(&sites, level.voxel_size_m(), origin_m, maps));
        let parents = above.take();
        let decoded = network.decode(
            level,
            Input {
                sites: &sites,
                origin_m,
                fused,
                above: parents
                    .as_ref()
                    .map(|above| (&above.decoded, rows(parents_of(sites.len()), device))),
                guide: says.as_deref().map(|says| guide::tensor(says, device)),
            },
        );
        let logits = read(decoded.logit.clone()).await?;
        sink.progress(lattice.blocks().len() + 1);
        if level == Level::Fine {
            let distances = distances(scene, &sites, &logits);
            let field = Field {
                sites,
                distances,
                evidence: joined(seen).await?,
            };
            if sink.keeps() {
                sink.keep(Stage::Decoding(level), kept::field(&field));
            }
            return Ok(Some(field));
        }
        let below = Level::ALL[level as usize + 1];
        let most = most_sites(network, below, preview.config.binding_bytes);
        let kept = occupied(&logits, level, most / 8, sink);
        if kept.is_empty() {
            let sites = sites.len();
            return Err(Fault::Nothing { level, sites });
        }
        if let Some(says) = &says
            && preview.show(level, &sites, says, &kept, sink).await? == Flow::Stop
        {
            return Ok(None);
        }
        let mut on = goes_on(decoded, &sites, &tiles, &kept, device);
        if sink.keeps()
            && let Some(bytes) = kept::above(&on).await
        {
            sink.keep(Stage::Decoding(level), bytes);
        }
        sites = divide(&mut tiles, &mut on);
        above = Some(on);
    }
    Ok(None)
}

/// What is handed to the level below of those voxels that are kept.
fn goes_on(
    decoded: Decoded,
    sites: &[IVec3],
    tiles: &[Part],
    kept: &[usize],
    device: &Device,
) -> Above {
    let of = |end: usize| 8 * kept.partition_point(|&site| site < end);
    let parents: Vec<IVec3> = kept.iter().map(|&site| sites[site]).collect();
    let chosen = rows(kept.iter().map(|&site| site as i32).collect(), device);
    Above {
        decoded: Decoded {
            features: decoded.features.select(0, chosen.clone()),
            logit: decoded.logit.select(0, chosen),
        },
        ends: tiles.iter().map(|tile| of(tile.sites.end)).collect(),
        sites: children(&parents),
    }
}

/// Gives the tiles their parts of the level below, and takes its sites.
fn divide(tiles: &mut [Part], above: &mut Above) -> Vec<IVec3> {
    let mut start = 0;
    for (tile, &end) in tiles.iter_mut().zip(&above.ends) {
        tile.sites = start..end;
        start = end;
    }
    mem::take(&mut above.sites)
}

/// The row of each site's parent: eight follow each other.
pub(super) fn parents_of(sites: usize) -> Vec<i32> {
    (0..sites as i32).map(|site| site / 8).collect()
}

/// The network's distances, weighed with what stereo's maps say.
fn distances<P>(scene: &Scene<'_, P>, sites: &[IVec3], logits: &[f32]) -> Vec<f32> {
    let of = |&logit: &f32| TSDF_SCALE * logit.tanh();
    let mut distances: Vec<f32> = logits.iter().map(of).collect();
    if let Some(maps) = scene.guide {
        let (voxel_m, origin_m) = (Level::Fine.voxel_size_m(), scene.tiling.origin_m);
        let says = surface_at(sites, voxel_m, origin_m, maps);
        for (distance, said) in distances.iter_mut().zip(says) {
            *distance = said.mean_with(*distance);
        }
    }
    distances
}

/// A tile's views and its part of a level's sites.
struct Part {
    views: Vec<usize>,
    sites: Range<usize>,
}

/// The coarse sites of all tiles, tile by tile: children keep their parents' order.
fn coarse<P>(scene: &Scene<'_, P>) -> (Vec<Part>, Vec<IVec3>) {
    let mut sites: Vec<IVec3> = Vec::new();
    let mut tiles = Vec::new();
    for tile in &scene.tiling.tiles {
        let views = tile.views.iter().copied();
        let views = views.filter(|&view| scene.pictures.of(view).is_some());
        let views: Vec<usize> = views.collect();
        if !views.is_empty() {
            let start = sites.len();
            sites.extend(scene.tiling.sites(tile));
            tiles.push(Part {
                views,
                sites: start..sites.len(),
            });
        }
    }
    (tiles, sites)
}

/// A level's sites.
struct Lattice<'a> {
    level: Level,
    sites: &'a [IVec3],
    tiles: &'a [Part],
}

impl Lattice<'_> {
    /// Pieces of work, in order: a tile and some of its sites.
    fn blocks(&self) -> Vec<(usize, Range<usize>)> {
        let mut blocks = Vec::new();
        for (tile, part) in self.tiles.iter().enumerate() {
            let of_tile = fused_at_once(part.sites.clone(), part.views.len());
            blocks.extend(of_tile.map(|block| (tile, block)));
        }
        blocks
    }

    /// What the views say of every site: `[N, C]`, and of fine ones which views. `None` if the sink stopped it.
    async fn fuse<N: Network>(
        &self,
        scene: &Scene<'_, N::Plane>,
        network: &N,
        sink: &mut impl Sink,
    ) -> Option<(Tensor<2>, Vec<Seen>)> {
        let blocks = self.blocks();
        // The 3D network is the last step.
        sink.stage(Stage::Decoding(self.level), blocks.len() + 1);
        let mut fused: Vec<Tensor<2>> = Vec::with_capacity(blocks.len());
        let mut seen = Vec::new();
        let mut current: Option<(usize, N::Plane, Vec<View>)> = None;
        for (done, (tile, range)) in blocks.into_iter().enumerate() {
            if sink.checkpoint().await == Flow::Stop {
                return None;
            }
            let (plane, views) = match &mut current {
                Some((at, plane, views)) if *at == tile => (plane, views),
                other => {
                    let views = self.tiles[tile].views.iter();
                    let chosen = views.filter_map(|&view| scene.pictures.of(view));
                    let chosen: Vec<_> = chosen.collect();
                    let planes: Vec<_> = chosen.iter().map(|p| p.plane(self.level)).collect();
                    let views = chosen.iter().map(|picture| picture.view).collect();
                    let (_, plane, views) = other.insert((tile, network.stack(&planes), views));
                    (plane, views)
                }
            };
            let sites = &self.sites[range];
            let origin_m = scene.tiling.origin_m;
            let (features, of_block) = network.fuse(self.level, plane, views, sites, origin_m);
            fused.push(features);
            seen.extend(of_block);
            sink.progress(done + 1);
        }
        (sink.checkpoint().await == Flow::Continue).then(|| (Tensor::cat(fused, 0), seen))
    }
}

/// Sites whose logit is above 0, ascending; the surest of them where they are too many, which is told.
fn occupied(logits: &[f32], level: Level, limit: usize, sink: &mut impl Sink) -> Vec<usize> {
    let all = 0..logits.len();
    let mut kept: Vec<usize> = all.filter(|&site| logits[site] > 0.0).collect();
    if kept.len() > limit {
        sink.finding(too_many(kept.len(), logits.len(), limit, level));
        // The place breaks ties, so that the choice is the same everywhere.
        kept.sort_by(|&a, &b| logits[b].total_cmp(&logits[a]).then(a.cmp(&b)));
        kept.truncate(limit);
        kept.sort_unstable();
    }
    kept
}

fn too_many(found: usize, sites: usize, limit: usize, level: Level) -> Finding {
    let voxel_cm = level.voxel_size_m() * 100.0;
    Finding {
        severity: Severity::Warning,
        code: "surface-everywhere",
        file: None,
        line: None,
        expected: format!("a surface near at most {limit} voxels of {voxel_cm:.0} cm"),
        found: format!("one near {found} of {sites}"),
        advice: "Only the surest are kept, and parts of the room may be missing. If the scan is no larger than a few rooms, the weights \
                 do not know pictures like these, or the device is small: check that they are trained, and that poses are in metres"
            .to_owned(),
        frames_affected: 0,
    }
}

/// The numbers of a tensor. A device that does not give them is at fault.
pub(super) async fn read(numbers: Tensor<1>) -> Result<Vec<f32>, VolumeError> {
    let data = numbers.into_data_async().await;
    let data = data.map_err(|error| VolumeError::Device(error.to_string()))?;
    data.try_into_vec::<f32>()
        .map_err(|error| VolumeError::Device(format!("{error:?}")))
}
