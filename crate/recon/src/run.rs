//! The run: keyframe by keyframe into the volume, and brick by brick out of it. Each source of depth has a file of its
//! own; what they share is here.

mod neural;
mod sensor;
mod stereo;

use crate::{
    event::{Flow, Sink, Stage},
    plan::{DepthSource, Plan},
};
use ::stereo::StereoError;
use burn::tensor::Device;
use glam::{Affine3A, Vec3};
use mesh::camera::Pinhole;
pub use neural::{Input, Network, Seen, fused_at_once, warm_up_network};
use scan::{ColorImage, Scan};
use volume::{DepthView, Volume, VolumeError};

/// Bricks handed over at a time. Small, so that the picture stays alive between them.
const BRICKS_A_STEP: usize = 384;
/// Keyframes between two hand-overs, once the first surface is there.
const KEYFRAMES_A_SURFACE: usize = 8;

/// Why a run could not go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The volume failed.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// Stereo failed.
    #[error(transparent)]
    Stereo(#[from] StereoError),
    /// Not one depth image could be used or made.
    #[error(
        "expected depth in {keyframes} keyframes, found none that can be used; the findings say what is wrong with each"
    )]
    NothingFused {
        /// Keyframes tried.
        keyframes: usize,
    },
    /// Too few pictures for the network could be decoded.
    #[error(
        "expected pictures of at least 2 of {keyframes} keyframes, found {found} that can be used; the findings say what is wrong with each"
    )]
    TooFewPictures {
        /// Keyframes tried.
        keyframes: usize,
        /// Pictures that could be decoded.
        found: usize,
    },
    /// A plan for the network was run without one.
    #[error(
        "expected the weights of a network, found none; give trained weights, or make depth by stereo, which needs none"
    )]
    NoWeights,
    /// No two keyframes see the same.
    #[error(
        "expected keyframes that see the same places, found none among {keyframes}, whose cameras move within {cameras}; \
         check that poses are in metres and lead from camera to world, and that the pictures overlap by a half or more"
    )]
    NoOverlap {
        /// Keyframes looked at.
        keyframes: usize,
        /// The space in which the cameras move, in words.
        cameras: String,
    },
    /// The network found no surface.
    #[error(
        "expected surfaces near some of {sites} voxels of {voxel_cm} cm, found none in what {keyframes} keyframes show; check the scale: the \
         cameras move within {cameras}, in a room that is a few metres; check which way is up: {up}; check that the pictures are sharp \
         and show the room from several places; or use other weights: these may not be trained for such a place"
    )]
    NothingOccupied {
        /// Voxels looked at.
        sites: usize,
        /// Their edge.
        voxel_cm: u32,
        /// Keyframes used.
        keyframes: usize,
        /// The space in which the cameras move, in words.
        cameras: String,
        /// How the up direction is known, in words.
        up: String,
    },
    /// The network's voxels have one size, so that they cannot be made larger.
    #[error(
        "expected room for the whole surface on this device, found more than its {limit} bricks of voxels; \
         take fewer keyframes or a smaller reach, or scan room by room"
    )]
    TooLarge {
        /// Bricks that fit.
        limit: usize,
    },
}

/// What a run leaves.
pub struct Outcome {
    /// The volume, to take the whole mesh from.
    pub volume: Volume,
    /// Keyframes that were fused.
    pub frames_fused: usize,
    /// The sink stopped it: the volume is of the frames until then.
    pub stopped: bool,
}

/// Runs a plan on a device.
///
/// Frames whose pictures cannot be decoded are reported and left out. A frame without usable colour still gives the
/// sensor's depth. A volume that outgrows its limit ends the run, but for stereo: that ends fusing with a finding, for its
/// size could only be guessed.
///
/// # Errors
/// A failing device, a volume that outgrows its limit, pictures without parallax, or not one usable depth image.
pub async fn run(
    scan: &Scan,
    plan: &Plan,
    device: &Device,
    sink: &mut impl Sink,
) -> Result<Outcome, RunError> {
    let mut fusion = begin(plan, device, sink).await?;
    match &plan.depth {
        DepthSource::Sensor => sensor::fuse(scan, &plan.keyframes, &mut fusion, sink).await?,
        DepthSource::Stereo(config) => {
            stereo::fuse(scan, &plan.keyframes, config, device, &mut fusion, sink).await?;
        }
        DepthSource::Network(_) => return Err(RunError::NoWeights),
    }
    finish(plan, fusion, sink).await
}

/// Runs a plan on a device with a network at hand; [`run`] does without one, and keeps it out of programs that have none.
///
/// # Errors
/// As [`run`]; keyframes that do not overlap, and a network that finds no surface.
pub async fn reconstruct(
    scan: &Scan,
    plan: &Plan,
    network: &impl Network,
    device: &Device,
    sink: &mut impl Sink,
) -> Result<Outcome, RunError> {
    let DepthSource::Network(config) = &plan.depth else {
        return run(scan, plan, device, sink).await;
    };
    let mut fusion = begin(plan, device, sink).await?;
    let keyframes = &plan.keyframes;
    neural::fuse(scan, keyframes, config, network, device, &mut fusion, sink).await?;
    finish(plan, fusion, sink).await
}

async fn begin(plan: &Plan, device: &Device, sink: &mut impl Sink) -> Result<Fusion, RunError> {
    sink.stage(Stage::WarmingUp, 1);
    warm_up(plan, device).await?;
    sink.progress(1);
    Ok(Fusion {
        volume: plan.volume.init(device)?,
        frames: 0,
        next_surface: 1,
        stopped: false,
    })
}

async fn finish(
    plan: &Plan,
    mut fusion: Fusion,
    sink: &mut impl Sink,
) -> Result<Outcome, RunError> {
    if fusion.frames == 0 && !fusion.stopped {
        return Err(RunError::NothingFused {
            keyframes: plan.keyframes.len(),
        });
    }
    let left = fusion.volume.changed_count();
    sink.stage(Stage::Meshing, left);
    fusion
        .hand_over(sink, |sink, waiting| {
            sink.progress(left - waiting.min(left));
        })
        .await?;
    Ok(Outcome {
        volume: fusion.volume,
        frames_fused: fusion.frames,
        stopped: fusion.stopped,
    })
}

/// Compiles the kernels on a volume of one tiny view, so that the wait has a name and later steps are even.
async fn warm_up(plan: &Plan, device: &Device) -> Result<(), RunError> {
    let camera = Pinhole {
        width: 2,
        height: 2,
        fx: 1.0,
        fy: 1.0,
        cx: 0.5,
        cy: 0.5,
    };
    let sure = [1.0; 4];
    let mut volume = plan.volume.init(device)?;
    volume.integrate(&DepthView {
        depth_m: &[plan.options.max_depth_m * 0.5; 4],
        depth_camera: camera,
        confidence: match plan.depth {
            DepthSource::Stereo(_) => Some(&sure),
            DepthSource::Sensor | DepthSource::Network(_) => None,
        },
        color: plan.volume.color.then_some((&[0; 12], camera)),
        world_from_camera: Affine3A::IDENTITY,
    })?;
    volume.mesh().await?;
    Ok(())
}

/// A frame's colour picture, if it has one; one that cannot be decoded is reported and the frame goes without.
fn color(scan: &Scan, frame: usize, sink: &mut impl Sink) -> Option<ColorImage> {
    scan.frames()[frame].color.as_ref()?;
    match scan.color(frame) {
        Ok(color) => Some(color),
        Err(error) => {
            sink.finding(error.finding().clone());
            None
        }
    }
}

/// The volume as it fills, and when its surface is next handed over.
struct Fusion {
    volume: Volume,
    frames: usize,
    next_surface: usize,
    stopped: bool,
}

impl Fusion {
    /// Takes one depth image in, and hands the surface over: the first at once, then after twice as many frames until
    /// the usual distance is reached.
    async fn take(&mut self, view: &DepthView<'_>, sink: &mut impl Sink) -> Result<(), RunError> {
        self.volume.integrate(view)?;
        self.frames += 1;
        if self.frames == self.next_surface {
            self.next_surface += self.next_surface.min(KEYFRAMES_A_SURFACE);
            self.hand_over(sink, |_, _| ()).await?;
        }
        Ok(())
    }

    /// Hands the changed bricks over, nearest to the eye first, unless nobody watches. `told` hears how many still wait.
    async fn hand_over<S: Sink>(
        &mut self,
        sink: &mut S,
        told: impl Fn(&mut S, usize),
    ) -> Result<(), RunError> {
        let Some(mut eye) = sink.eye() else {
            return Ok(());
        };
        while self.volume.changed_count() > 0 {
            let bricks = self.volume.take_changed(BRICKS_A_STEP, eye);
            let meshes = self.volume.extract(&bricks).await?;
            sink.bricks(meshes).await?;
            told(sink, self.volume.changed_count());
            if sink.checkpoint().await == Flow::Stop {
                self.stopped = true;
            }
            eye = sink.eye().unwrap_or(Vec3::ZERO);
        }
        Ok(())
    }
}
