//! What fits, said before any work: frames, bricks, bytes, and what was turned down and why.

mod bricks;
mod network;
mod options;
mod time;

use bricks::Foresight;
pub(crate) use network::working_size;
pub use network::{NetworkConfig, Preset, ViewChoice};
pub use options::{DepthSource, Options};
use scan::{Camera, Frame, KeyframeRule, Scan, keyframes};
use stereo::{StereoConfig, StereoError};
pub(crate) use time::{MATCH, SURFACE};
pub use time::{Rates, Work};
use volume::{BYTES_PER_BRICK, SurfaceRule, VolumeConfig};

/// A voxel is made this much larger at a time until the volume fits.
const COARSER: f32 = 1.25;
/// Share of the limit that the estimate may reach: it is an estimate.
const MARGIN: f64 = 0.8;
/// Bytes a vertex of the drawn surface takes, and triangles a brick has on average: measured on furnished rooms.
const TRIANGLES_PER_BRICK: usize = 75;
/// The weight that a surface of stereo needs: half of what a sensor's needs. Measured in ARCHITECTURE.md.
const STEREO_LEAST_WEIGHT: f32 = 0.02;

/// What the machine allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The largest buffer that a kernel may see, in bytes.
    pub binding_bytes: usize,
    /// Whether the network works on the same device, and its tensors are bound by that, too; not so on a processor.
    pub network_is_bound: bool,
}

impl Default for Limits {
    /// What every WebGPU device guarantees.
    fn default() -> Self {
        Self {
            binding_bytes: 128 << 20,
            network_is_bound: false,
        }
    }
}

/// What will be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What the user asked for, with a larger voxel if that one did not fit.
    pub options: Options,
    /// Where depth comes from, decided.
    pub depth: DepthSource,
    /// Usable frames of the scan.
    pub frames: usize,
    /// The frames that will be fused, as indices into the scan's.
    pub keyframes: Vec<usize>,
    /// Bricks expected; where depth is not there yet, no more than this many.
    pub bricks: usize,
    /// Bytes expected on the device: the field with room to grow, the surface, and what stereo works on.
    pub device_bytes: usize,
    /// Bytes that the network works on, on whichever device that does; 0 without it.
    pub network_bytes: usize,
    /// Bytes expected on the heap: decoded pictures and what waits for the device.
    pub heap_bytes: usize,
    /// What there is to do, for the time that it may be expected to take.
    pub work: Work,
    /// What was turned down and why, in words.
    pub remarks: Vec<String>,
    /// How the volume will be laid out.
    pub volume: VolumeConfig,
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The sensor's depth was asked for, and the scan has none.
    #[error(
        "expected depth images beside the colour images of {name}, found none; \
         fusion needs a scan from an RGB-D camera or a phone with a depth sensor: use stereo for colour alone"
    )]
    NoDepth {
        /// Name of the scan.
        name: String,
    },
    /// Neither depth nor enough colour.
    #[error(
        "expected colour images in at least 2 keyframes of {name} to make depth from, found {found}; \
         give a scan with depth images or with more colour images from different places, or take more of its keyframes"
    )]
    TooFewPictures {
        /// Name of the scan.
        name: String,
        /// Keyframes with colour.
        found: usize,
    },
    /// A setting that makes no sense.
    #[error("expected {what}, found {found}")]
    Setting {
        /// What would make sense.
        what: &'static str,
        /// What was given.
        found: String,
    },
    /// A setting of stereo that makes no sense.
    #[error(transparent)]
    Stereo(#[from] StereoError),
    /// Pictures that the network cannot take.
    #[error(transparent)]
    Pictures(#[from] net::planes::PlanesError),
}

/// Plans a run: decides where depth comes from, chooses keyframes, foretells the size of the volume from the depth of
/// some of them or from the cameras alone, and makes the voxels larger if it would not fit.
///
/// # Errors
/// Neither depth nor two pictures in colour, or settings that make no sense.
pub fn plan(scan: &Scan, limits: &Limits, options: Options) -> Result<Plan, PlanError> {
    options.check()?;
    let depth = options.depth_source(scan)?;
    let frames = scan.frames();
    let usable = |frame: &usize| match depth {
        DepthSource::Sensor => frames[*frame].depth.is_some(),
        DepthSource::Stereo(_) | DepthSource::Network(_) => frames[*frame].color.is_some(),
    };
    let kept = keyframes(frames, KeyframeRule::default());
    let keyframes = options.chosen(kept.into_iter().filter(usable));
    let foresight = match depth {
        DepthSource::Sensor => Foresight::from_depth(scan, &keyframes),
        DepthSource::Stereo(_) | DepthSource::Network(_) if keyframes.len() < 2 => {
            return Err(PlanError::TooFewPictures {
                name: scan.name().to_owned(),
                found: keyframes.len(),
            });
        }
        DepthSource::Stereo(config) => {
            let far_m = config.far_m.min(options.max_depth_m);
            Foresight::from_cameras(scan, &keyframes, f64::from(far_m))
        }
        DepthSource::Network(config) => {
            network::check_pictures(&config, keyframes.iter().map(|&f| &frames[f]))?;
            Foresight::from_cameras(scan, &keyframes, f64::from(config.reach_m))
        }
    };

    let mut remarks = Vec::new();
    let wanted_m = match &depth {
        DepthSource::Network(config) => {
            remarks.extend(network_remarks(config, &options, keyframes.len()));
            network::VOXEL_M
        }
        _ => options.voxel_size_m,
    };
    let laid_out = |voxel_size_m: f32| {
        let volume = VolumeConfig {
            max_depth_m: options.max_depth_m,
            color: scan.has_color(),
            binding_bytes: limits.binding_bytes,
            surface: surface_rule(&depth),
            ..VolumeConfig::new(voxel_size_m)
        };
        (volume, foresight.bricks(scan, &volume))
    };
    let fits = |(volume, bricks): &(VolumeConfig, usize)| {
        (*bricks as f64) < volume.brick_limit() as f64 * MARGIN
    };
    let asked = laid_out(wanted_m);
    let mut chosen = asked;
    if matches!(depth, DepthSource::Network(_)) && !fits(&asked) {
        remarks.push(format!(
            "about {} bricks may be needed, and this device holds {}: if they do not fit, take fewer keyframes or a smaller reach",
            asked.1,
            asked.0.brick_limit(),
        ));
    } else {
        while !fits(&chosen) {
            chosen = laid_out(chosen.0.voxel_size_m * COARSER);
        }
    }
    let (volume, bricks) = chosen;
    if volume != asked.0 {
        remarks.push(format!(
            "voxels of {:.1} cm would need about {} bricks, more than this device surely holds (of {}): voxels of {:.1} cm are used",
            wanted_m * 100.0,
            asked.1,
            volume.brick_limit(),
            volume.voxel_size_m * 100.0,
        ));
    }
    let options = Options {
        voxel_size_m: volume.voxel_size_m,
        ..options
    };
    if let DepthSource::Network(config) = &depth {
        remarks.extend(config.cap_remark(bricks, limits));
    }
    let fusion = 2 * bricks * BYTES_PER_BRICK
        + bricks * TRIANGLES_PER_BRICK * 3 * mesh::soup::VERTEX_STRIDE_BYTES as usize;
    let working = match &depth {
        DepthSource::Sensor => Bytes::default(),
        DepthSource::Stereo(config) => stereo_bytes(scan, &keyframes, config),
        // Its guide.
        DepthSource::Network(_) => stereo_bytes(scan, &keyframes, &StereoConfig::default()),
    };
    let network_bytes = match &depth {
        DepthSource::Network(config) => config.bytes(keyframes.len(), bricks),
        DepthSource::Sensor | DepthSource::Stereo(_) => 0,
    };
    let pictures = keyframes.iter().map(|&f| picture_bytes(&frames[f], &depth));
    let scope = time::Scope {
        scan,
        keyframes: &keyframes,
        bricks,
        bricks_a_view: foresight.bricks_a_view(scan, &volume),
    };
    let work = Work::of(&depth, &scope);
    Ok(Plan {
        options,
        depth,
        frames: frames.len(),
        device_bytes: fusion + working.device,
        network_bytes,
        // The file, its pixels, and the copy on its way to the device.
        heap_bytes: 3 * pictures.max().unwrap_or(0) + working.heap,
        keyframes,
        bricks,
        work,
        remarks,
        volume,
    })
}

/// Which cells may have a surface. The one place where stereo's depth may be judged otherwise than a sensor's.
fn surface_rule(depth: &DepthSource) -> SurfaceRule {
    let sensor = VolumeConfig::new(0.04).surface;
    match depth {
        DepthSource::Sensor => sensor,
        // A distance that the network gives is known or it is not.
        DepthSource::Network(_) => SurfaceRule::ANY,
        // Two sources agreed to every depth of stereo already, and its weights are below 1.
        DepthSource::Stereo(_) => SurfaceRule {
            least_weight: STEREO_LEAST_WEIGHT,
            ..sensor
        },
    }
}

fn pixels(camera: &Camera) -> usize {
    camera.width as usize * camera.height as usize
}

fn picture_bytes(frame: &Frame, depth: &DepthSource) -> usize {
    let color = frame.color.as_ref();
    let color = color.map_or(0, |_| pixels(&frame.color_camera) * 7);
    match depth {
        DepthSource::Sensor => color + pixels(&frame.depth_camera) * 4,
        DepthSource::Stereo(_) | DepthSource::Network(_) => color,
    }
}

/// What of the wishes the network cannot grant.
fn network_remarks(config: &NetworkConfig, options: &Options, keyframes: usize) -> Vec<String> {
    let mut remarks = Vec::new();
    if keyframes < config.views_a_tile {
        remarks.push(format!(
            "{} views were asked for, the scan has {keyframes} keyframes: all of them are used",
            config.views_a_tile
        ));
    }
    if options.voxel_size_m != network::VOXEL_M {
        remarks.push(format!(
            "the network is made for voxels of {:.1} cm, which are used instead of {:.1} cm",
            network::VOXEL_M * 100.0,
            options.voxel_size_m * 100.0
        ));
    }
    remarks
}

#[derive(Default)]
struct Bytes {
    device: usize,
    heap: usize,
}

/// What stereo works on: a cost for each pixel and plane, before and after smoothing, and the pictures it keeps, with
/// depth and confidence beside each.
fn stereo_bytes(scan: &Scan, keyframes: &[usize], config: &StereoConfig) -> Bytes {
    let (width, height) = config.size;
    let working = keyframes.iter().map(|&frame| {
        let camera = &scan.frames()[frame].color_camera;
        pixels(camera).min(width as usize * height as usize)
    });
    let working = working.max().unwrap_or(0);
    Bytes {
        device: 2 * working * config.planes * size_of::<f32>(),
        heap: keyframes.len().min(stereo::VIEWS_KEPT) * working * 4 * size_of::<f32>(),
    }
}
