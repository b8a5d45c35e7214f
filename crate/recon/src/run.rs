//! The run: keyframe by keyframe into the volume, and brick by brick out of it.

use crate::{
    convert::depth_view,
    event::{Flow, Sink, Stage},
    plan::Plan,
};
use burn::tensor::Device;
use glam::{Affine3A, Vec3};
use mesh::camera::Pinhole;
use scan::{FrameError, Scan};
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
    /// Not one depth image could be used.
    #[error(
        "expected depth in {keyframes} keyframes, found none that can be used; the findings say what is wrong with each"
    )]
    NothingFused {
        /// Keyframes tried.
        keyframes: usize,
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
/// Frames whose pictures cannot be decoded are reported and left out. A frame without usable colour still gives depth.
///
/// # Errors
/// A failing device, a volume that outgrows its limit, or not one usable depth image.
pub async fn run(
    scan: &Scan,
    plan: &Plan,
    device: &Device,
    sink: &mut impl Sink,
) -> Result<Outcome, RunError> {
    sink.stage(Stage::WarmingUp, 1);
    warm_up(plan, device).await?;
    sink.progress(1);
    let mut outcome = Outcome {
        volume: plan.volume.init(device)?,
        frames_fused: 0,
        stopped: false,
    };
    sink.stage(Stage::Fusing, plan.keyframes.len());
    let mut next_surface = 1;
    for (done, &frame) in plan.keyframes.iter().enumerate() {
        if sink.checkpoint().await == Flow::Stop {
            outcome.stopped = true;
            break;
        }
        if fuse(scan, frame, &mut outcome.volume, sink)? {
            outcome.frames_fused += 1;
        }
        // The first surface at once, then after twice as many frames until the usual distance is reached.
        if outcome.frames_fused == next_surface {
            next_surface += next_surface.min(KEYFRAMES_A_SURFACE);
            hand_over(&mut outcome, sink, |_, _| ()).await?;
        }
        sink.progress(done + 1);
    }
    if outcome.frames_fused == 0 && !outcome.stopped {
        return Err(RunError::NothingFused {
            keyframes: plan.keyframes.len(),
        });
    }
    let left = outcome.volume.changed_count();
    sink.stage(Stage::Meshing, left);
    hand_over(&mut outcome, sink, |sink, waiting| {
        sink.progress(left - waiting.min(left));
    })
    .await?;
    Ok(outcome)
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
    let mut volume = plan.volume.init(device)?;
    volume.integrate(&DepthView {
        depth_m: &[plan.options.max_depth_m * 0.5; 4],
        depth_camera: camera,
        color: plan.volume.color.then_some((&[0; 12], camera)),
        world_from_camera: Affine3A::IDENTITY,
    })?;
    volume.mesh().await?;
    Ok(())
}

/// Takes one frame into the volume; whether it had depth that could be used.
fn fuse(
    scan: &Scan,
    frame: usize,
    volume: &mut Volume,
    sink: &mut impl Sink,
) -> Result<bool, RunError> {
    let report = |error: FrameError| error.finding().clone();
    let depth = match scan.depth(frame) {
        Ok(Some(depth)) => depth,
        Ok(None) => return Ok(false),
        Err(error) => {
            sink.finding(report(error));
            return Ok(false);
        }
    };
    let info = &scan.frames()[frame];
    let color = match info.color.as_ref().map(|_| scan.color(frame)) {
        Some(Ok(color)) => Some(color),
        Some(Err(error)) => {
            sink.finding(report(error));
            None
        }
        None => None,
    };
    volume.integrate(&depth_view(info, &depth, color.as_ref()))?;
    Ok(true)
}

/// Hands the changed bricks over, nearest to the eye first, unless nobody watches. `told` hears how many still wait.
async fn hand_over<S: Sink>(
    outcome: &mut Outcome,
    sink: &mut S,
    told: impl Fn(&mut S, usize),
) -> Result<(), RunError> {
    let Some(mut eye) = sink.eye() else {
        return Ok(());
    };
    while outcome.volume.changed_count() > 0 {
        let bricks = outcome.volume.take_changed(BRICKS_A_STEP, eye);
        let meshes = outcome.volume.extract(&bricks).await?;
        sink.bricks(meshes).await?;
        told(sink, outcome.volume.changed_count());
        if sink.checkpoint().await == Flow::Stop {
            outcome.stopped = true;
        }
        eye = sink.eye().unwrap_or(Vec3::ZERO);
    }
    Ok(())
}
