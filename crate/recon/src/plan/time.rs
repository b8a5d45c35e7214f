//! How long a run will take: what it has to do, counted from the plan, over how fast the device does a typical piece of each kind
//! of work ([`crate::calibrate`]).
//!
//! The numbers of operations were fitted to the stages of runs on the two scans of the README, natively and in the browser
//! (`tests/expected_time.rs` prints them). They are no more exact than a factor of two.

use super::{DepthSource, NetworkConfig, pixels, working_size};
use net::Level;
use scan::Scan;
use stereo::{StereoConfig, sources};

/// How fast the device is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Lattice points a second that it fuses a view into.
    pub fusing: f64,
    /// Operations a second.
    pub arithmetic: f64,
}

/// What a run has to do. An operation is a multiplication or an addition, or what takes as long.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Lattice points of the volume that views are fused into; those whose surface is made count more.
    pub fusing: f64,
    /// Operations of stereo, or of the network and its guide.
    pub operations: f64,
    /// Pixels of files that are decoded.
    pub decoded_pixels: f64,
}

/// Seconds to decode a pixel of a file; processors differ little.
const DECODE_S: f64 = 12e-9;
/// A lattice point whose surface is made takes as long as so many that a view is fused into.
pub(crate) const SURFACE: f64 = 6.0;
/// Bricks that a keyframe's depth from stereo changes, about, where there is none yet to count them by.
const BRICKS_A_MAP: f64 = 500.0;
/// Surfaces are handed over after the first few keyframes and then every so many; meanwhile so many times the bricks of a view
/// have changed.
const HAND_OVERS: f64 = 4.0;
const KEYFRAMES_A_SURFACE: f64 = 8.0;
const CHANGED: f64 = 2.5;

/// Operations for each pixel and hypothesis of stereo, and for each of these and source.
const SMOOTH: f64 = 400.0;
pub(crate) const MATCH: f64 = 200.0;
/// Hypotheses of stereo's second pass.
const SECOND_PASS: usize = 17;

/// Voxels of each level for each brick that is foreseen, and the share of a tile's views that have a voxel in their picture.
const SITES_A_BRICK: [f64; 3] = [10.0, 40.0, 110.0];
const SEEN: f64 = 0.35;
/// Operations for each pixel of a plane and each pair of its channels.
const FEATURES: f64 = 300.0;
/// Operations for each pair of a voxel and a view that sees it, and each pair of channels; for each two views and each channel.
const FUSE: f64 = 30.0;
const ATTEND: f64 = 4.0;
/// Operations for each voxel and each pair of the 3D network's base channels.
const DECODE: f64 = 2000.0;

/// What the plan knows of the scan.
pub(super) struct Scope<'a> {
    /// The scan and the frames that are used.
    pub scan: &'a Scan,
    pub keyframes: &'a [usize],
    /// Bricks of the volume.
    pub bricks: usize,
    /// Bricks that a view changes, where there is depth to count them by.
    pub bricks_a_view: Option<f64>,
}

impl Work {
    /// Of a plan.
    pub(super) fn of(depth: &DepthSource, scope: &Scope) -> Self {
        let keyframes = scope.keyframes.len() as f64;
        let first = scope.keyframes.first().map(|&f| &scope.scan.frames()[f]);
        let color = first.map_or(0.0, |frame| pixels(&frame.color_camera) as f64);
        let sensed = first.map_or(0.0, |frame| pixels(&frame.depth_camera) as f64);
        let bricks = scope.bricks as f64;
        let points = volume::BRICK_VOXELS as f64;
        let a_view = scope.bricks_a_view.unwrap_or(BRICKS_A_MAP).min(bricks);
        let hand_overs = HAND_OVERS + keyframes / KEYFRAMES_A_SURFACE;
        let surfaces = hand_overs * (CHANGED * a_view).min(bricks);
        let fusing = (keyframes * a_view + surfaces * SURFACE) * points;
        match depth {
            DepthSource::Sensor => Self {
                fusing,
                decoded_pixels: keyframes * (color + sensed),
                ..Self::default()
            },
            DepthSource::Stereo(config) => Self {
                fusing,
                operations: matching(config, scope),
                // For matching, and for their colours.
                decoded_pixels: 2.0 * keyframes * color,
            },
            DepthSource::Network(config) => Self {
                // The surface of each level, before colours and after.
                fusing: 2.0 * bricks * points * SURFACE,
                operations: matching(&StereoConfig::default(), scope) + thinking(config, scope),
                // For their features, for the guide, and for their colours.
                decoded_pixels: 3.0 * keyframes * color,
            },
        }
    }

    /// Seconds it takes.
    pub fn seconds(&self, rates: &Rates) -> f64 {
        self.fusing / rates.fusing
            + self.operations / rates.arithmetic
            + self.decoded_pixels * DECODE_S
    }
}

/// Pixels of a picture that is brought to a working size.
fn working_pixels(size: (u32, u32), scope: &Scope) -> f64 {
    let first = scope.keyframes.first().map(|&f| &scope.scan.frames()[f]);
    first.map_or(0.0, |frame| {
        let (width, height) = working_size(&frame.color_camera, size);
        f64::from(width) * f64::from(height)
    })
}

/// Operations of stereo.
fn matching(config: &StereoConfig, scope: &Scope) -> f64 {
    let hypotheses = (config.planes + SECOND_PASS) as f64;
    let frames = scope.scan.frames();
    let sources = sources::mean_count(frames, scope.keyframes, config.sources);
    let pixels = working_pixels(config.size, scope) * scope.keyframes.len() as f64;
    pixels * hypotheses * (SMOOTH + sources * MATCH)
}

/// Operations of the network: planes of every picture, then a level after the other.
fn thinking(config: &NetworkConfig, scope: &Scope) -> f64 {
    let pixels = working_pixels(config.size, scope) * scope.keyframes.len() as f64;
    let views = scope.keyframes.len().min(config.views_a_tile) as f64 * SEEN;
    let square = |channels: usize| (channels * channels) as f64;
    let level = |level: Level| {
        let plane = config.net.planes[level as usize];
        let sites = scope.bricks as f64 * SITES_A_BRICK[level as usize];
        pixels / square(level.stride()) * square(plane) * FEATURES
            + sites * views * (square(plane) * FUSE + views * plane as f64 * ATTEND)
            + sites * square(config.net.unet[level as usize]) * DECODE
    };
    Level::ALL.map(level).iter().sum()
}
