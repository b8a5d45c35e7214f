//! Small planar patches of the room from depth pictures: a point and a normal every few centimetres.

use std::collections::HashSet;

use glam::{DMat3, DVec2, DVec3};

use crate::frame::Frame;
use crate::image::DepthImage;

/// A flat piece of a surface, in the frames' world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Metres.
    pub point: DVec3,
    /// Unit normal towards the camera.
    pub normal: DVec3,
}

/// Patches along the picture's width.
const CELLS_ACROSS: u32 = 40;
/// Samples along a patch's side.
const SAMPLES: u32 = 8;
/// Depth beyond which sensors are too noisy, and before which they see the user's hand.
const RANGE_M: std::ops::Range<f64> = 0.3..6.0;
/// Largest root mean square distance from the fitted plane, relative to the depth.
const FLATNESS: f64 = 0.03;
/// One patch is kept in each cube of this size, so that a surface counts by its area, not by how often it was seen.
const CUBE_M: f64 = 0.08;

/// Patches of several frames, thinned to about one per 8 cm.
pub(super) fn of_frames<'f>(frames: impl Iterator<Item = (&'f Frame, DepthImage)>) -> Vec<Patch> {
    let mut taken: HashSet<[i32; 3]> = HashSet::new();
    let mut patches = Vec::new();
    for (frame, depth) in frames {
        let cell = (depth.width / CELLS_ACROSS).max(SAMPLES);
        for top in (0..depth.height.saturating_sub(cell)).step_by(cell as usize) {
            for left in (0..depth.width.saturating_sub(cell)).step_by(cell as usize) {
                let Some(patch) = fit(frame, &depth, left, top, cell) else {
                    continue;
                };
                let cube = (patch.point / CUBE_M).floor().as_ivec3().to_array();
                if taken.insert(cube) {
                    patches.push(patch);
                }
            }
        }
    }
    patches
}

/// Fits a plane to a square of pixels. On a plane n.X = 1 the inverse depth is linear in the ray:
/// 1/z = n.(x/z, y/z, 1), so the normal is a linear least squares solution.
fn fit(frame: &Frame, depth: &DepthImage, left: u32, top: u32, cell: u32) -> Option<Patch> {
    let camera = &frame.depth_camera;
    let step = (cell / SAMPLES).max(1);
    let mut samples: Vec<(DVec3, f64)> = Vec::with_capacity((SAMPLES * SAMPLES) as usize);
    let mut missing = 0;
    for v in (top..top + cell).step_by(step as usize) {
        for u in (left..left + cell).step_by(step as usize) {
            let z = f64::from(depth.depth_m[(v * depth.width + u) as usize]);
            if RANGE_M.contains(&z) {
                let pixel = DVec2::new(u.into(), v.into());
                samples.push((camera.unproject(pixel, 1.0), z));
            } else {
                missing += 1;
            }
        }
    }
    if samples.len() < 12 || missing * 4 > samples.len() {
        return None;
    }
    let mut normal_matrix = DMat3::ZERO;
    let mut right_side = DVec3::ZERO;
    for &(ray, z) in &samples {
        normal_matrix += super::outer(ray);
        right_side += ray / z;
    }
    let plane = normal_matrix.inverse() * right_side;
    if !plane.is_finite() || plane == DVec3::ZERO {
        return None;
    }
    let square_error = |&(ray, z): &(DVec3, f64)| (1.0 - z * plane.dot(ray)).powi(2);
    let error = samples.iter().map(square_error).sum::<f64>() / samples.len() as f64;
    if error.sqrt() > FLATNESS {
        return None;
    }
    let ray = samples.iter().map(|(ray, _)| *ray).sum::<DVec3>() / samples.len() as f64;
    // n.X = 1 points away from the camera.
    Some(Patch {
        point: frame.pose.transform_point3(ray / plane.dot(ray)),
        normal: frame.pose.transform_vector3(-plane.normalize()),
    })
}
