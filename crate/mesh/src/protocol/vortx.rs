//! VoRTX's protocol: the prediction is rendered into every view, masked by the ground truth, fused again into a
//! single-walled mesh and compared by points spread evenly. The fusion in the middle is the job of `recon`.

use super::THRESHOLD_M;
use crate::camera::Pinhole;
use crate::metrics::{Surface3d, compare_points};
use crate::raster::{Cull, depth};
use crate::{Bounds, Mesh};
use glam::{Affine3A, DVec3, Vec3};

/// Surfaces nearer than this are not rendered.
const NEAR_M: f32 = 0.05;
/// Edge of the cubes that vertices are averaged in.
const DOWNSAMPLE_M: f32 = 0.02;

/// A camera and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Intrinsics, at the depth map's size.
    pub camera: Pinhole,
    /// Takes world coordinates to camera coordinates.
    pub camera_from_world: Affine3A,
}

/// Step 1: the z-depth of the prediction in metres, `[height, width]`, 0 = empty; what the 2D metrics are taken from.
/// Backs of triangles are not drawn.
pub fn vortx_render(pred: &Mesh, view: &View) -> Vec<f32> {
    depth(
        pred,
        &view.camera,
        &view.camera_from_world,
        Cull::Back,
        NEAR_M,
    )
}

/// Step 2: empties `depth_m` where the ground truth, rendered likewise, is empty: nothing is known in that direction.
pub fn vortx_mask(depth_m: &mut [f32], gt: &Mesh, view: &View) {
    for (value, truth) in depth_m.iter_mut().zip(vortx_render(gt, view)) {
        if truth <= 0.0 {
            *value = 0.0;
        }
    }
}

/// Steps 1 and 2: the depth map of this view that is to be fused (4 cm voxels, truncation 12 cm, weight 1).
pub fn vortx_masked_depths(pred: &Mesh, gt: &Mesh, view: &View) -> Vec<f32> {
    let mut depth_m = vortx_render(pred, view);
    vortx_mask(&mut depth_m, gt, view);
    depth_m
}

/// Step 5: compares the vertices of the fused prediction and of the ground truth, each averaged in cubes of 2 cm.
pub fn vortx_compare(trimmed: &Mesh, gt: &Mesh) -> Surface3d {
    let [pred, gt] = [trimmed, gt].map(|mesh| downsample(&mesh.positions, DOWNSAMPLE_M));
    compare_points(&pred, &gt, THRESHOLD_M, None)
}

/// One point, the centroid, for every occupied cube of edge `voxel_m`. The cubes start half an edge below the smallest
/// coordinates, as Open3D's `voxel_down_sample` has them.
pub(crate) fn downsample(points: &[Vec3], voxel_m: f32) -> Vec<Vec3> {
    let Some(Bounds { min, .. }) = Bounds::of(points) else {
        return Vec::new();
    };
    let voxel_m = f64::from(voxel_m);
    let start = min.as_dvec3() - voxel_m * 0.5;
    let mut in_cubes: Vec<([i32; 3], DVec3)> = points
        .iter()
        .map(|point| {
            let cube = (point.as_dvec3() - start) / voxel_m;
            (cube.floor().as_ivec3().to_array(), point.as_dvec3())
        })
        .collect();
    in_cubes.sort_by_key(|&(cube, _)| cube);
    let cubes = in_cubes.chunk_by(|a, b| a.0 == b.0);
    let centroid = |cube: &[([i32; 3], DVec3)]| {
        let sum: DVec3 = cube.iter().map(|&(_, point)| point).sum();
        (sum / cube.len() as f64).as_vec3()
    };
    cubes.map(centroid).collect()
}
