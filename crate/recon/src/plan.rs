//! What fits, said before any work: frames, bricks, bytes, and what was turned down and why.

use crate::convert::depth_view;
use glam::IVec3;
use scan::{KeyframeRule, Scan, keyframes};
use std::collections::HashMap;
use volume::{BYTES_PER_BRICK, VolumeConfig};

/// Keyframes whose depth is looked at to foretell the size of the volume.
const SAMPLED_KEYFRAMES: usize = 16;
/// A voxel is made this much larger at a time until the volume fits.
const COARSER: f32 = 1.25;
/// Share of the limit that the estimate may reach: it is an estimate.
const MARGIN: f64 = 0.8;
/// Bytes a vertex of the drawn surface takes, and triangles a brick has on average: measured on furnished rooms.
const TRIANGLES_PER_BRICK: usize = 75;

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Edge of a voxel in metres.
    pub voxel_size_m: f32,
    /// Take every n-th keyframe; at least 1.
    pub every: usize,
    /// Depth beyond this is not used, in metres.
    pub max_depth_m: f32,
}

impl Default for Options {
    /// 4 cm voxels, every keyframe, depth up to 5 m.
    fn default() -> Self {
        Self {
            voxel_size_m: 0.04,
            every: 1,
            max_depth_m: 5.0,
        }
    }
}

/// What the machine allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The largest buffer that a kernel may see, in bytes.
    pub binding_bytes: usize,
}

impl Default for Limits {
    /// What every WebGPU device guarantees.
    fn default() -> Self {
        Self {
            binding_bytes: 128 << 20,
        }
    }
}

/// What will be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What the user asked for, with a larger voxel if that one did not fit.
    pub options: Options,
    /// Usable frames of the scan.
    pub frames: usize,
    /// The frames that will be fused, as indices into the scan's.
    pub keyframes: Vec<usize>,
    /// Bricks expected.
    pub bricks: usize,
    /// Bytes expected on the device: the field with room to grow, and the surface.
    pub device_bytes: usize,
    /// Bytes expected on the heap: decoded pictures and what waits for the device.
    pub heap_bytes: usize,
    /// What was turned down and why, in words.
    pub remarks: Vec<String>,
    /// How the volume will be laid out.
    pub volume: VolumeConfig,
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The scan has no depth.
    #[error(
        "expected depth images beside the colour images of {name}, found none; \
         fusion needs a scan from an RGB-D camera or a phone with a depth sensor"
    )]
    NoDepth {
        /// Name of the scan.
        name: String,
    },
    /// A setting that makes no sense.
    #[error("expected {what}, found {found}")]
    Setting {
        /// What would make sense.
        what: &'static str,
        /// What was given.
        found: String,
    },
}

/// Plans a run: chooses keyframes, foretells the size of the volume from some of them, and makes the voxels larger if
/// it would not fit.
///
/// # Errors
/// No depth, or settings that make no sense.
pub fn plan(scan: &Scan, limits: &Limits, options: Options) -> Result<Plan, PlanError> {
    check(&options)?;
    if !scan.has_depth() {
        return Err(PlanError::NoDepth {
            name: scan.name().to_owned(),
        });
    }
    let frames = scan.frames();
    let kept = keyframes(frames, KeyframeRule::default());
    let kept = kept
        .into_iter()
        .filter(|&frame| frames[frame].depth.is_some());
    let keyframes: Vec<usize> = kept.step_by(options.every).collect();

    let samples = sample_depths(scan, &keyframes);
    let laid_out = |voxel_size_m: f32| {
        let volume = VolumeConfig {
            max_depth_m: options.max_depth_m,
            color: scan.has_color(),
            binding_bytes: limits.binding_bytes,
            ..VolumeConfig::new(voxel_size_m)
        };
        let bricks = estimate(scan, &volume, &samples, keyframes.len());
        (volume, bricks)
    };
    let fits = |(volume, bricks): &(VolumeConfig, usize)| {
        (*bricks as f64) < volume.brick_limit() as f64 * MARGIN
    };
    let asked = laid_out(options.voxel_size_m);
    let mut chosen = asked;
    while !fits(&chosen) {
        chosen = laid_out(chosen.0.voxel_size_m * COARSER);
    }
    let (volume, bricks) = chosen;
    let mut remarks = Vec::new();
    if volume != asked.0 {
        remarks.push(format!(
            "voxels of {:.1} cm would need about {} bricks, more than this device surely holds (of {}): voxels of {:.1} cm are used",
            options.voxel_size_m * 100.0,
            asked.1,
            volume.brick_limit(),
            volume.voxel_size_m * 100.0,
        ));
    }
    let options = Options {
        voxel_size_m: volume.voxel_size_m,
        ..options
    };
    let picture_bytes = keyframes
        .iter()
        .map(|&frame| picture_bytes(&frames[frame]))
        .max();
    Ok(Plan {
        options,
        frames: frames.len(),
        device_bytes: 2 * bricks * BYTES_PER_BRICK
            + bricks * TRIANGLES_PER_BRICK * 3 * mesh::soup::VERTEX_STRIDE_BYTES as usize,
        // The file, its pixels, and the copy on its way to the device.
        heap_bytes: 3 * picture_bytes.unwrap_or(0),
        keyframes,
        bricks,
        remarks,
        volume,
    })
}

fn check(options: &Options) -> Result<(), PlanError> {
    let fault = |what, found: String| Err(PlanError::Setting { what, found });
    if !(0.004..=1.0).contains(&options.voxel_size_m) {
        let found = format!("{} m", options.voxel_size_m);
        return fault("a voxel size between 0.004 and 1 m", found);
    }
    if !(0.1..=100.0).contains(&options.max_depth_m) {
        let found = format!("{} m", options.max_depth_m);
        return fault("a maximum depth between 0.1 and 100 m", found);
    }
    if options.every == 0 {
        return fault("to take every 1st, 2nd, 3rd … keyframe", "every 0th".into());
    }
    Ok(())
}

fn picture_bytes(frame: &scan::Frame) -> usize {
    let pixels = |camera: &scan::Camera| camera.width as usize * camera.height as usize;
    let color = frame
        .color
        .as_ref()
        .map_or(0, |_| pixels(&frame.color_camera) * 7);
    color + pixels(&frame.depth_camera) * 4
}

/// Depth of some keyframes, evenly spread; those that cannot be decoded are left out here and reported by the run.
fn sample_depths(scan: &Scan, keyframes: &[usize]) -> Vec<(usize, scan::DepthImage)> {
    let step = keyframes.len().div_ceil(SAMPLED_KEYFRAMES).max(1);
    let chosen = keyframes.iter().step_by(step);
    chosen
        .filter_map(|&frame| Some((frame, scan.depth(frame).ok()??)))
        .collect()
}

/// Bricks that all keyframes together need. What the sampled ones need is counted; what the others add is foretold by
/// Chao's estimator of unseen species (Chao 1987): from bricks that one sample needs (`q1`) and that two need (`q2`).
fn estimate(
    scan: &Scan,
    volume: &VolumeConfig,
    samples: &[(usize, scan::DepthImage)],
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
