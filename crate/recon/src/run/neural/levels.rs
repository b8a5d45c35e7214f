//! Coarse to fine: what the views say of each tile's voxels, the 3D network over all of them, and those that go on.

use super::{
    guide,
    network::{Input, Network, rows},
    pictures::Pictures,
    tiles::Tiling,
};
use crate::event::{Flow, Sink, Stage};
use burn::{Tensor, tensor::Device};
use glam::IVec3;
use net::{
    Level, View,
    decode::children,
    guide::guide_at,
    model::{Decoded, TSDF_SCALE},
    sample::GuideMap,
};
use scan::{Finding, Severity};
use std::ops::Range;

/// Pairs of a voxel and a view that are fused at a time, at most: bounds the memory of the tokens.
const PAIRS_A_BLOCK: usize = 200_000;
/// Voxels that a level may have, at most: 5,000 fine ones are a square metre of surface.
const SITES_AT_MOST: [usize; 3] = [usize::MAX, 1 << 19, 1 << 21];

/// Why there is no field.
pub(super) enum Fault {
    /// No voxel of a level has a surface near it.
    Nothing {
        /// The level.
        level: Level,
        /// Its voxels.
        sites: usize,
    },
    /// The device failed.
    Device(String),
}

/// Distances at the fine sites.
pub(super) struct Field {
    /// The sites.
    pub sites: Vec<IVec3>,
    /// Signed distance over the truncation distance, positive in free space.
    pub distances: Vec<f32>,
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
    device: &Device,
    sink: &mut impl Sink,
) -> Result<Option<Field>, Fault> {
    let origin_m = scene.tiling.origin_m;
    let (mut tiles, mut sites) = coarse(scene);
    let mut above: Option<(Decoded, Vec<i32>)> = None;
    for level in Level::ALL {
        let lattice = Lattice {
            level,
            sites: &sites,
            tiles: &tiles,
        };
        let Some(fused) = lattice.fuse(scene, network, sink).await else {
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
                    .map(|(decoded, parents)| (decoded, rows(parents.clone(), device))),
                guide: says.as_deref().map(|says| guide::tensor(says, device)),
            },
        );
        let logits = read(decoded.logit.clone()).await?;
        sink.progress(lattice.blocks().len() + 1);
        if level == Level::Fine {
            let mut distances: Vec<f32> = logits
                .iter()
                .map(|&logit| TSDF_SCALE * logit.tanh())
                .collect();
            for (distance, said) in distances.iter_mut().zip(says.iter().flatten()) {
                *distance = said.mean_with(*distance);
            }
            return Ok(Some(Field { sites, distances }));
        }
        let kept = occupied(&logits, level, sink);
        if kept.is_empty() {
            let sites = sites.len();
            return Err(Fault::Nothing { level, sites });
        }
        for tile in &mut tiles {
            let of = |end: usize| 8 * kept.partition_point(|&site| site < end);
            tile.sites = of(tile.sites.start)..of(tile.sites.end);
        }
        let parents: Vec<IVec3> = kept.iter().map(|&site| sites[site]).collect();
        sites = children(&parents);
        let parents = kept.iter().flat_map(|&parent| [parent as i32; 8]);
        above = Some((decoded, parents.collect()));
    }
    Ok(None)
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
            let step = (PAIRS_A_BLOCK / part.views.len()).max(1);
            let starts = part.sites.clone().step_by(step);
            blocks.extend(starts.map(|start| (tile, start..(start + step).min(part.sites.end))));
        }
        blocks
    }

    /// What the views say of every site: `[N, C]`. `None` if the sink stopped it.
    async fn fuse<N: Network>(
        &self,
        scene: &Scene<'_, N::Plane>,
        network: &N,
        sink: &mut impl Sink,
    ) -> Option<Tensor<2>> {
        let blocks = self.blocks();
        // The 3D network is the last step.
        sink.stage(Stage::Decoding(self.level), blocks.len() + 1);
        let mut fused: Vec<Tensor<2>> = Vec::with_capacity(blocks.len());
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
            fused.push(network.fuse(self.level, plane, views, sites, origin_m));
            sink.progress(done + 1);
        }
        (sink.checkpoint().await == Flow::Continue).then(|| Tensor::cat(fused, 0))
    }
}

/// Sites whose logit is above 0, ascending; the surest of them where they are too many, which is told.
fn occupied(logits: &[f32], level: Level, sink: &mut impl Sink) -> Vec<usize> {
    let all = 0..logits.len();
    let mut kept: Vec<usize> = all.filter(|&site| logits[site] > 0.0).collect();
    let limit = SITES_AT_MOST[level as usize + 1] / 8;
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
                 do not know pictures like these: check that they are trained, and that poses are in metres"
            .to_owned(),
        frames_affected: 0,
    }
}

async fn read(logit: Tensor<1>) -> Result<Vec<f32>, Fault> {
    let data = logit.into_data_async().await;
    let data = data.map_err(|error| Fault::Device(error.to_string()))?;
    data.try_into_vec::<f32>()
        .map_err(|error| Fault::Device(format!("{error:?}")))
}
