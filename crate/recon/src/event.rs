//! What a run tells while it goes on, and how it is told to wait or to stop.

use glam::Vec3;
use net::Level;
use scan::Finding;
use stereo::DepthMap;
use volume::{BrickMeshes, VolumeError};

/// The stages of a run, in order. Between warming up and meshing a run has either [`Stage::Matching`], or [`Stage::Fusing`],
/// or the network's: [`Stage::Features`], [`Stage::Decoding`] of each level, [`Stage::Coloring`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Kernels are compiled.
    WarmingUp,
    /// Colour becomes depth, and depth a volume; counted in keyframes that were matched with their neighbours.
    Matching,
    /// The sensor's depth becomes a volume; counted in keyframes.
    Fusing,
    /// Pictures become the network's feature planes; counted in keyframes.
    Features,
    /// The network makes voxels of a level; counted in blocks of voxels that views are fused at, and one for its 3D network.
    Decoding(Level),
    /// The network's surface gets its colours; counted in keyframes.
    Coloring,
    /// The last bricks of the mesh are made; counted in bricks.
    Meshing,
}

/// Whether to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Go on.
    Continue,
    /// Stop here; what was done so far stays.
    Stop,
}

/// Whoever watches a run. Every method but [`Sink::checkpoint`] has a body that ignores the news.
pub trait Sink {
    /// A stage began; it has `total` steps.
    fn stage(&mut self, _stage: Stage, _total: usize) {}

    /// `done` of the stage's steps are behind us.
    fn progress(&mut self, _done: usize) {}

    /// Something about a frame that the user should know; the run goes on without it.
    fn finding(&mut self, _finding: Finding) {}

    /// A keyframe's depth was made from colour; it is fused next, if any of it may be relied on.
    fn depth_map(&mut self, _map: &DepthMap) {}

    /// Where bricks are wanted first, in the canonical world; `None` for no streaming: the mesh is then taken at the end.
    fn eye(&self) -> Option<Vec3> {
        None
    }

    /// Bricks that follow have edges of so many metres, and stand in place of all that were handed over before.
    fn surface(&mut self, _brick_size_m: f32) {}

    /// The surface of some bricks changed: the soup lies on the run's device.
    ///
    /// # Errors
    /// A device that failed to hand it over.
    #[allow(async_fn_in_trait)]
    async fn bricks(&mut self, _meshes: BrickMeshes) -> Result<(), VolumeError> {
        Ok(())
    }

    /// Whether what finished stages made is wanted: it takes time and memory to hand over.
    fn keeps(&self) -> bool {
        false
    }

    /// A stage is done, and made this. With it at hand a run of the same plan with the same network goes on after that stage.
    fn keep(&mut self, _stage: Stage, _made: Vec<u8>) {}

    /// What an earlier run of the same plan made in a stage, as it gave it to [`Sink::keep`]. Asked of a stage once, when it is to begin.
    fn kept(&mut self, _stage: Stage) -> Option<Vec<u8>> {
        None
    }

    /// Called between any two steps: the place to draw a frame, to wait while paused, or to stop.
    #[allow(async_fn_in_trait)]
    async fn checkpoint(&mut self) -> Flow;
}
