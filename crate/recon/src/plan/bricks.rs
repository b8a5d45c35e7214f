//! How many bricks a run will need, foretold before any of them exists.

use crate::convert::depth_view;
use glam::{DVec2, DVec3, IVec3};
use scan::{DepthImage, Scan};
use std::collections::HashMap;
use volume::{BRICK_EDGE, VolumeConfig};

/// Keyframes whose depth is looked at to foretell the size of the volume.
const SAMPLED_KEYFRAMES: usize = 16;
/// The walls of a room are expected up to here from its cameras, in metres.
const REACH_M: f64 = 3.0;
/// Bricks that a scan of colour needs, at most, for each face of a brick on the box that its cameras look into. Measured
/// by stereo at 320x240 with voxels of 2, 4 and 8 cm: 1.71, 1.58, 1.48 in a whole room (hololens, 100 keyframes), 1.39 to
/// 1.61 in two rooms made by rule, 0.60 to 0.78 where a corner of a room is seen (livingroom). At 160x120 it is a quarter
/// less, with a third of the keyframes half. This is a quarter above the most.
const BRICKS_A_FACE: f64 = 2.1;

/// What is known of the surface before a run.
pub(super) enum Foresight {
    /// The sensor's depth of some keyframes, and how many keyframes there are.
    Sampled(Vec<(usize, DepthImage)>, usize),
    /// Sides in metres of the box that the cameras look into.
    Box(DVec3),
}

impl Foresight {
    /// From the sensor's depth of some keyframes, evenly spread; those that cannot be decoded are left out here and
    /// reported by the run.
    pub fn from_depth(scan: &Scan, keyframes: &[usize]) -> Self {
        let step = keyframes.len().div_ceil(SAMPLED_KEYFRAMES).max(1);
        let chosen = keyframes.iter().step_by(step);
        let depths = chosen.filter_map(|&frame| Some((frame, scan.depth(frame).ok()??)));
        Self::Sampled(depths.collect(), keyframes.len())
    }

    /// From the poses alone, where depth up to `far_m` will be looked for.
    pub fn from_cameras(scan: &Scan, keyframes: &[usize], far_m: f64) -> Self {
        let reach_m = far_m.min(REACH_M);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &frame in keyframes {
            let frame = &scan.frames()[frame];
            let camera = &frame.color_camera;
            let (right, bottom) = (f64::from(camera.width), f64::from(camera.height));
            let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
            let ends = corners.map(|(x, y)| camera.unproject(DVec2::new(x, y), reach_m));
            for point in ends.into_iter().chain([DVec3::ZERO]) {
                let point = frame.pose.transform_point3(point);
                (low, high) = (low.min(point), high.max(point));
            }
        }
        Self::Box((high - low).max(DVec3::ZERO))
    }

    /// Bricks that one keyframe's depth needs, where there is depth to count them by.
    pub fn bricks_a_view(&self, scan: &Scan, volume: &VolumeConfig) -> Option<f64> {
        let Self::Sampled(samples, _) = self else {
            return None;
        };
        // Three say enough.
        let some = samples.iter().step_by(samples.len().div_ceil(3).max(1));
        let counts = some.map(|(frame, depth)| {
            let view = depth_view(&scan.frames()[*frame], depth, None);
            volume.bricks_of(&view).len() as f64
        });
        let counts: Vec<f64> = counts.collect();
        (!counts.is_empty()).then(|| counts.iter().sum::<f64>() / counts.len() as f64)
    }

    /// Bricks that all keyframes together need.
    pub fn bricks(&self, scan: &Scan, volume: &VolumeConfig) -> usize {
        match self {
            Self::Sampled(samples, keyframes) => sampled(scan, volume, samples, *keyframes),
            Self::Box(size_m) => {
                let brick_m = f64::from(volume.voxel_size_m) * f64::from(BRICK_EDGE);
                let size = *size_m / brick_m;
                let faces = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
                (faces * BRICKS_A_FACE) as usize
            }
        }
    }
}

/// What the sampled keyframes need is counted; what the others add is foretold by Chao's estimator of unseen species
/// (Chao 1987): from bricks that one sample needs (`q1`) and that two need (`q2`).
fn sampled(
    scan: &Scan,
    volume: &VolumeConfig,
    samples: &[(usize, DepthImage)],
    keyframes: usize,
) -> usize {
    let mut uses: HashMap<IVec3, usize> = HashMap::new();
    for (frame, depth) in samples {
        let view = depth_view(&scan.frames()[*frame], depth, None);
        for brick in volume.bricks_of(&view) {
            *uses.entry(brick).or_default() += 1;
        }
    }
    let seen = uses.len();
    if samples.len() >= keyframes {
        return seen;
    }
    let used = |times| uses.values().filter(|&&n| n == times).count() as f64;
    let (q1, q2) = (used(1), used(2));
    seen + (q1 * q1 / (2.0 * q2.max(1.0))) as usize
}
