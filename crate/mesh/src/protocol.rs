//! Three ways to score a reconstruction against ground truth. They differ in what is compared, not in how; a figure
//! without its protocol means nothing.

mod visibility;
mod vortx;

pub use visibility::Visibility;
pub use vortx::{View, vortx_compare, vortx_mask, vortx_masked_depths, vortx_render};

use crate::metrics::{Distances, Surface3d, compare_points};
use crate::nearest::PointIndex;
use crate::{Mesh, sample};
use glam::Vec3;

/// Within this distance a point counts as right, in all three protocols.
pub const THRESHOLD_M: f32 = 0.05;
/// Points drawn on a surface unless a caller says otherwise.
pub const SAMPLES: usize = 200_000;
/// TransformerFusion's ceiling for every distance.
const CLIP_M: f32 = 1.0;

/// Plain sampling: `samples` points drawn uniformly on each surface, compared with nothing masked and nothing clipped.
/// A mesh without faces is taken by its points. The ground truth is drawn with `seed` + 1, so that equal meshes do not
/// get equal points.
pub fn plain(pred: &Mesh, gt: &Mesh, samples: usize, seed: u64) -> Surface3d {
    let pred = points(pred, samples, seed);
    let gt = points(gt, samples, seed.wrapping_add(1));
    compare_points(&pred, &gt, THRESHOLD_M, None)
}

/// TransformerFusion's protocol: 200,000 points drawn on the prediction against the vertices of the ground truth,
/// distances cut at 1 m.
///
/// With `visibility`, accuracy and precision count only the predicted points that some depth frame observed (all of
/// them if none was); completeness and recall are measured to all predicted points.
pub fn transformer_fusion(
    pred: &Mesh,
    gt: &Mesh,
    visibility: Option<&Visibility>,
    seed: u64,
) -> Surface3d {
    let all = points(pred, SAMPLES, seed);
    let mut observed = all.clone();
    if let Some(visibility) = visibility {
        observed.retain(|&point| visibility.visible(point));
        if observed.is_empty() {
            observed.clone_from(&all);
        }
    }
    let measure = |from: &[Vec3], to: &[Vec3]| {
        Distances::new(from, &PointIndex::new(to), THRESHOLD_M, Some(CLIP_M))
    };
    let forth = measure(&observed, &gt.positions);
    let back = measure(&gt.positions, &all);
    Surface3d::new(&forth, &back, THRESHOLD_M)
}

/// Points drawn on the surface, or the vertices of a point cloud.
fn points(mesh: &Mesh, samples: usize, seed: u64) -> Vec<Vec3> {
    if mesh.triangles.is_empty() {
        return mesh.positions.clone();
    }
    sample::surface(mesh, samples, seed)
}
