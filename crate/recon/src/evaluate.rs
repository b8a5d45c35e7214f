//! How good a mesh is against ground truth, under a named protocol, and depth maps against a sensor's. Meshes are in the
//! scan's own world, as exports are.

mod depth;

use crate::convert::pinhole;
use burn::tensor::Device;
pub use depth::{DepthFigures, compare_depth, mean_depth};
use glam::{Affine3A, DAffine3, DMat4};
use mesh::{
    Mesh,
    camera::Pinhole,
    metrics::{self, Depth2d, Surface3d},
    protocol::{self, View, Visibility},
};
use scan::{FrameError, Scan};
use serde::Serialize;
use volume::{DepthView, VolumeConfig, VolumeError};

/// Spacing of the lattice that says what the depth camera saw, and how far behind a surface it still counts as seen.
const VISIBILITY_VOXEL_M: f32 = 0.04;
const VISIBILITY_BEHIND_M: f32 = 0.12;
/// Depth is trusted up to here when asking what was seen, as in the ground truth of ScanNet's benchmarks.
const VISIBILITY_DEPTH_M: f32 = 5.0;

/// How a mesh is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// Rendered into every frame, masked by the ground truth, fused again, compared by vertices. Needs the scan.
    Vortx,
    /// 200,000 samples against the ground truth's vertices, only where the scan saw something. Uses the scan if given.
    TransformerFusion,
    /// Samples of both surfaces, nothing masked.
    Plain,
}

/// The figures.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// How the mesh was compared.
    pub protocol: Protocol,
    /// Seed of the samples.
    pub seed: u64,
    /// Whether a scan said what was seen.
    pub masked_by_scan: bool,
    /// Upper part of the paper's Table 2: distances, precision, recall and F at 5 cm.
    pub surface: Surface3d,
    /// Lower part: rendered depth against the sensor's, mean over frames. Only with a scan that has depth.
    pub depth: Option<Depth2d>,
}

/// Why a mesh cannot be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// VoRTX's protocol renders into the scan's cameras.
    #[error(
        "the VoRTX protocol renders into the scan's cameras: expected a scan, found none; add --scan FOLDER"
    )]
    NoScan,
    /// Nothing to compare.
    #[error("expected a {which} mesh with vertices, found none in it")]
    Empty {
        /// Predicted or ground truth.
        which: &'static str,
    },
    /// A depth map whose length is not its camera's width times height.
    #[error(
        "expected a depth map of {expected} values ({width} x {height}), found {found}; check the camera that was given with it"
    )]
    MapSize {
        /// Width of the camera's picture.
        width: u32,
        /// Height of the camera's picture.
        height: u32,
        /// Width times height.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// The sensor's depth of a frame cannot be decoded.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The re-fusion failed.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

/// Compares `pred` with `gt`. `progress` hears done and total frames of the parts that go through the scan.
///
/// # Errors
/// An empty mesh, VoRTX's protocol without a scan, or a failing device.
pub async fn evaluate(
    pred: &Mesh,
    gt: &Mesh,
    scan: Option<&Scan>,
    protocol: Protocol,
    seed: u64,
    device: &Device,
    mut progress: impl FnMut(usize, usize),
) -> Result<Report, EvaluateError> {
    for (which, mesh) in [("predicted", pred), ("ground truth", gt)] {
        if mesh.positions.is_empty() {
            return Err(EvaluateError::Empty { which });
        }
    }
    let depth = scan.and_then(|scan| depth_figures(pred, scan, &mut progress));
    let surface = match (protocol, scan) {
        (Protocol::Plain, _) => protocol::plain(pred, gt, protocol::SAMPLES, seed),
        (Protocol::TransformerFusion, scan) => {
            let visibility = scan.and_then(|scan| visibility(pred, scan));
            protocol::transformer_fusion(pred, gt, visibility.as_ref(), seed)
        }
        (Protocol::Vortx, Some(scan)) => {
            let trimmed = refuse(pred, gt, scan, device, &mut progress).await?;
            protocol::vortx_compare(&trimmed, gt)
        }
        (Protocol::Vortx, None) => return Err(EvaluateError::NoScan),
    };
    Ok(Report {
        protocol,
        seed,
        masked_by_scan: scan.is_some() && protocol != Protocol::Plain,
        surface,
        depth,
    })
}

/// A frame's depth camera in the scan's own world.
fn view(scan: &Scan, frame: usize) -> View {
    let frame = &scan.frames()[frame];
    let world_from_camera: DAffine3 = scan.scan_from_canonical() * frame.pose;
    let camera_from_world = DMat4::from(world_from_camera).inverse().as_mat4();
    View {
        camera: pinhole(&frame.depth_camera),
        camera_from_world: Affine3A::from_mat4(camera_from_world),
    }
}

/// Depth of every frame that has one which can be decoded.
fn depths(scan: &Scan) -> impl Iterator<Item = (View, Vec<f32>)> + '_ {
    (0..scan.frames().len()).filter_map(|frame| {
        let depth = scan.depth(frame).ok()??;
        Some((view(scan, frame), depth.depth_m))
    })
}

fn visibility(pred: &Mesh, scan: &Scan) -> Option<Visibility> {
    let bounds = pred.bounds()?;
    let frames = depths(scan).map(|(view, mut depth_m)| {
        for value in &mut depth_m {
            if *value > VISIBILITY_DEPTH_M {
                *value = 0.0;
            }
        }
        (view.camera, view.camera_from_world, depth_m)
    });
    let (voxel_m, behind_m) = (VISIBILITY_VOXEL_M, VISIBILITY_BEHIND_M);
    Some(Visibility::from_depth(frames, bounds, voxel_m, behind_m))
}

fn depth_figures(
    pred: &Mesh,
    scan: &Scan,
    progress: &mut impl FnMut(usize, usize),
) -> Option<Depth2d> {
    let total = scan.frames().len();
    let frames = depths(scan)
        .enumerate()
        .filter_map(|(done, (view, depth_m))| {
            progress(done + 1, total);
            metrics::depth_2d(&protocol::vortx_render(pred, &view), &depth_m)
        });
    metrics::depth::mean(&frames.collect::<Vec<_>>())
}

/// The single-walled mesh of what the prediction shows to the scan's cameras where the ground truth shows something.
async fn refuse(
    pred: &Mesh,
    gt: &Mesh,
    scan: &Scan,
    device: &Device,
    progress: &mut impl FnMut(usize, usize),
) -> Result<Mesh, EvaluateError> {
    // Depth is not cut in this protocol: the far end of any room is nearer.
    let config = VolumeConfig {
        max_depth_m: 100.0,
        color: false,
        ..VolumeConfig::uniform(0.04)
    };
    let mut volume = config.init(device)?;
    let frames = scan.frames().len();
    for frame in 0..frames {
        let view = view(scan, frame);
        let depth_m = protocol::vortx_masked_depths(pred, gt, &view);
        volume.integrate(&depth_view(&view, &depth_m))?;
        progress(frame + 1, frames);
    }
    Ok(volume.mesh().await?)
}

fn depth_view<'a>(view: &View, depth_m: &'a [f32]) -> DepthView<'a> {
    let depth_camera: Pinhole = view.camera;
    DepthView {
        depth_m,
        depth_camera,
        confidence: None,
        color: None,
        world_from_camera: view.camera_from_world.inverse(),
    }
}
