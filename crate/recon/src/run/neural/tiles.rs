//! The room in tiles, and which keyframes each is made from (method 1.3, 1.4).

use crate::{
    convert::{pinhole, pose},
    event::{Flow, Sink},
    plan::{NetworkConfig, ViewChoice},
};
use glam::{Affine3A, DVec2, DVec3, IVec3, Vec3};
use mesh::camera::Pinhole;
use net::Level;
use rayon::prelude::*;
use scan::{Frame, Scan};
use std::{collections::BTreeSet, collections::BinaryHeap};

/// Fine voxels along the edge of a coarse one.
const FINE_A_COARSE: i32 = 4;
/// Two keyframes that see the same from no farther than this overlap, in metres: rooms are about so large.
const OVERLAP_M: f32 = 4.0;
/// How much the seed may change what a keyframe adds: enough to break ties, too little to spoil the choice.
const SEED_SHARE: f32 = 0.02;

/// A box of the lattice.
pub(super) struct Tile {
    /// Its first coarse site.
    pub first: IVec3,
    /// The keyframes that it is made from, ascending, as indices into the scan's keyframes.
    pub views: Vec<usize>,
}

/// The lattice of a scan and its tiles.
pub(super) struct Tiling {
    /// Where site 0 lies, in fine voxels of the canonical world.
    pub corner: IVec3,
    /// The same in metres.
    pub origin_m: Vec3,
    /// Coarse sites along the edges of a tile.
    pub size: IVec3,
    /// Tiles that some keyframe sees.
    pub tiles: Vec<Tile>,
    /// Of each keyframe whether it sees what another one sees too.
    shares: Vec<bool>,
}

/// A keyframe and the points of a tile that it sees, with their depth in metres.
struct Seen {
    keyframe: usize,
    points: Vec<(usize, f32)>,
}

impl Tiling {
    /// Lays the lattice over what the keyframes look at, and chooses each tile's views. `None` if the sink stopped it.
    pub async fn new(
        scan: &Scan,
        keyframes: &[usize],
        config: &NetworkConfig,
        sink: &mut impl Sink,
    ) -> Option<Self> {
        let frames: Vec<&Frame> = keyframes.iter().map(|&f| &scan.frames()[f]).collect();
        let voxel_m = f64::from(Level::Coarse.voxel_size_m());
        let boxes: Vec<(DVec3, DVec3)> = frames
            .iter()
            .map(|frame| frustum_box(frame, f64::from(config.reach_m)))
            .collect();
        let low = boxes.iter().fold(DVec3::INFINITY, |low, b| low.min(b.0));
        let first = (low / voxel_m).floor();
        let size = IVec3::from(config.tile.map(|edge| edge as i32)) / FINE_A_COARSE;
        let mut places: BTreeSet<[i32; 3]> = BTreeSet::new();
        for (low, high) in &boxes {
            let tile = |point: DVec3| ((point / voxel_m - first).as_ivec3()) / size;
            let (from, to) = (tile(*low), tile(*high));
            for z in from.z..=to.z {
                for y in from.y..=to.y {
                    places.extend((from.x..=to.x).map(|x| [z, y, x]));
                }
            }
        }
        let corner = first.as_ivec3() * FINE_A_COARSE;
        let mut tiling = Self {
            corner,
            origin_m: corner.as_vec3() * Level::Fine.voxel_size_m(),
            size,
            tiles: Vec::new(),
            shares: vec![false; keyframes.len()],
        };
        let cameras: Vec<Looks> = frames.iter().map(|frame| Looks::of(frame)).collect();
        for [z, y, x] in places {
            if sink.checkpoint().await == Flow::Stop {
                return None;
            }
            tiling.add(IVec3::new(x, y, z), &cameras, config);
        }
        Some(tiling)
    }

    fn add(&mut self, place: IVec3, cameras: &[Looks], config: &NetworkConfig) {
        let first = place * self.size;
        let points: Vec<Vec3> = sites_of(first, self.size)
            .map(|site| site.as_vec3() * Level::Coarse.voxel_size_m() + self.origin_m)
            .collect();
        let seen = cameras.par_iter().enumerate().map(|(keyframe, camera)| {
            let depths = points.iter().map(|&point| camera.depth_m(point));
            let points = depths.enumerate();
            let points = points
                .filter_map(|(at, depth_m)| Some((at, depth_m?)))
                .collect();
            Seen { keyframe, points }
        });
        let mut seen: Vec<Seen> = seen.collect();
        seen.retain(|seen| !seen.points.is_empty());
        if seen.is_empty() {
            return;
        }
        self.note_overlap(&seen, points.len());
        let mut views = match config.choice {
            _ if seen.len() <= config.views_a_tile => {
                seen.iter().map(|seen| seen.keyframe).collect()
            }
            ViewChoice::Coverage => by_coverage(&seen, points.len(), config),
            ViewChoice::Random => at_random(&seen, config, first),
        };
        views.sort_unstable();
        self.tiles.push(Tile { first, views });
    }

    fn note_overlap(&mut self, seen: &[Seen], points: usize) {
        let near = |seen: &Seen| {
            let near = seen.points.iter().filter(|&&(_, z)| z <= OVERLAP_M);
            near.map(|&(at, _)| at).collect::<Vec<_>>()
        };
        let mut count = vec![0u8; points];
        for seen in seen {
            for at in near(seen) {
                count[at] = count[at].saturating_add(1);
            }
        }
        for seen in seen {
            let shares = &mut self.shares[seen.keyframe];
            *shares = *shares || near(seen).iter().any(|&at| count[at] > 1);
        }
    }

    /// Whether any two keyframes see the same.
    pub fn overlaps(&self) -> bool {
        self.shares.contains(&true)
    }

    /// Keyframes that see nothing which another sees too, as indices into the scan's keyframes.
    pub fn alone(&self) -> impl Iterator<Item = usize> + '_ {
        let alone = self
            .shares
            .iter()
            .enumerate()
            .filter(|(_, shares)| !**shares);
        alone.map(|(keyframe, _)| keyframe)
    }

    /// Keyframes that some tile is made from, ascending.
    pub fn used(&self) -> Vec<usize> {
        let all = self
            .tiles
            .iter()
            .flat_map(|tile| tile.views.iter().copied());
        all.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// Coarse sites of a tile.
    pub fn sites(&self, tile: &Tile) -> impl Iterator<Item = IVec3> + use<> {
        sites_of(tile.first, self.size)
    }
}

fn sites_of(first: IVec3, size: IVec3) -> impl Iterator<Item = IVec3> {
    (0..size.z).flat_map(move |z| {
        (0..size.y).flat_map(move |y| (0..size.x).map(move |x| first + IVec3::new(x, y, z)))
    })
}

/// The box around what a frame looks at, up to `reach_m`.
fn frustum_box(frame: &Frame, reach_m: f64) -> (DVec3, DVec3) {
    let camera = &frame.color_camera;
    let (right, bottom) = (f64::from(camera.width), f64::from(camera.height));
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    let ends = corners.map(|(x, y)| camera.unproject(DVec2::new(x, y), reach_m));
    let place = frame.pose.translation;
    ends.into_iter().fold((place, place), |(low, high), end| {
        let end = frame.pose.transform_point3(end);
        (low.min(end), high.max(end))
    })
}

/// A camera that is asked what it sees.
struct Looks {
    camera: Pinhole,
    camera_from_world: Affine3A,
}

impl Looks {
    fn of(frame: &Frame) -> Self {
        Self {
            camera: pinhole(&frame.color_camera),
            camera_from_world: pose(frame).inverse(),
        }
    }

    /// The depth of a point if it falls into the picture.
    fn depth_m(&self, point: Vec3) -> Option<f32> {
        let point = self.camera_from_world.transform_point3(point);
        if point.z <= 0.0 {
            return None;
        }
        let pixel = self.camera.project(point);
        let inside = pixel.x >= 0.0
            && pixel.y >= 0.0
            && pixel.x <= (self.camera.width - 1) as f32
            && pixel.y <= (self.camera.height - 1) as f32;
        inside.then_some(point.z)
    }
}

/// A candidate with what it would add, as far as is known.
#[derive(PartialEq)]
struct Candidate {
    gain: f32,
    index: usize,
    /// Views chosen when the gain was computed.
    round: usize,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let by_gain = self.gain.total_cmp(&other.gain);
        by_gain.then_with(|| other.index.cmp(&self.index))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Greedy: next comes the view that adds most, where a point that was seen `c` times so far adds `1 / (1 + c)`. What a view
/// adds only shrinks as others are chosen, so that only the best candidate need be looked at again (Minoux 1978).
fn by_coverage(seen: &[Seen], points: usize, config: &NetworkConfig) -> Vec<usize> {
    let mut covered = vec![0.0f32; points];
    // What lies beyond reach is seen, but with coarser pixels.
    let worth = |depth_m: f32| (config.reach_m / depth_m).min(1.0).powi(2);
    let gain = |seen: &Seen, covered: &[f32]| {
        let points = seen.points.iter();
        let adds = points.map(|&(at, depth_m)| worth(depth_m) / (1.0 + covered[at]));
        let taste = unit(config.seed, seen.keyframe as u64);
        adds.sum::<f32>() * (1.0 + SEED_SHARE * taste)
    };
    let first = seen.iter().enumerate().map(|(index, seen)| Candidate {
        gain: gain(seen, &covered),
        index,
        round: 0,
    });
    let mut heap: BinaryHeap<Candidate> = first.collect();
    let mut views = Vec::new();
    while views.len() < config.views_a_tile {
        let Some(best) = heap.pop() else { break };
        let candidate = &seen[best.index];
        if best.round < views.len() {
            heap.push(Candidate {
                gain: gain(candidate, &covered),
                round: views.len(),
                ..best
            });
            continue;
        }
        for &(at, depth_m) in &candidate.points {
            covered[at] += worth(depth_m);
        }
        views.push(candidate.keyframe);
    }
    views
}

/// The views with the smallest of numbers drawn for each.
fn at_random(seen: &[Seen], config: &NetworkConfig, tile: IVec3) -> Vec<usize> {
    let [x, y, z] = tile.to_array().map(|place| place as u32 as u64);
    let seed = mix(config.seed ^ mix(x ^ (y << 20) ^ (z << 40)));
    let draw = |seen: &Seen| (unit(seed, seen.keyframe as u64), seen.keyframe);
    let mut drawn: Vec<(f32, usize)> = seen.iter().map(draw).collect();
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    drawn.truncate(config.views_a_tile);
    drawn.into_iter().map(|(_, keyframe)| keyframe).collect()
}

/// A number in [0, 1) that depends on both.
fn unit(seed: u64, index: u64) -> f32 {
    (mix(seed ^ mix(index)) >> 40) as f32 / (1u64 << 24) as f32
}

/// SplitMix64's finaliser (Steele, Lea and Flood 2014).
fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}
