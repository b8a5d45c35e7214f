//! Where the scan's depth camera looked: a prediction is not blamed for surfaces that nobody measured.

use crate::Bounds;
use crate::camera::Pinhole;
use glam::{Affine3A, UVec3, Vec3, Vec3A};

/// Trilinear samples from here on count as observed, as in TransformerFusion's evaluation.
const OBSERVED: f32 = 1.0 - 1e-5;

/// A lattice over a scene; each point of it was observed by some depth frame, or not.
pub struct Visibility {
    min: Vec3,
    voxel_m: f32,
    points: UVec3,
    observed: Vec<bool>,
}

impl Visibility {
    /// Builds the lattice over `bounds` with spacing `voxel_m`.
    ///
    /// A frame is a camera, its pose (world to camera) and its depth in metres, row-major, 0 = no data. It observes the
    /// lattice points that fall on a pixel with depth and lie in front of the measured surface or up to `behind_m`
    /// behind it. Frames whose depth has another size than their camera are passed over.
    pub fn from_depth(
        frames: impl Iterator<Item = (Pinhole, Affine3A, Vec<f32>)>,
        bounds: Bounds,
        voxel_m: f32,
        behind_m: f32,
    ) -> Self {
        let cells = (bounds.size() / voxel_m).ceil().max(Vec3::ONE);
        let points = cells.as_uvec3() + 1;
        let count = points.x as usize * points.y as usize * points.z as usize;
        let mut visibility = Self {
            min: bounds.min,
            voxel_m,
            points,
            observed: vec![false; count],
        };
        for (camera, camera_from_world, depth) in frames {
            if depth.len() == camera.pixels() {
                visibility.observe(&camera, &camera_from_world, &depth, behind_m);
            }
        }
        visibility
    }

    fn observe(
        &mut self,
        camera: &Pinhole,
        camera_from_world: &Affine3A,
        depth: &[f32],
        behind_m: f32,
    ) {
        let origin = camera_from_world.transform_point3a(self.min.into());
        let axes = camera_from_world.matrix3 * self.voxel_m;
        let row_length = self.points.x as usize;
        let rows = self.observed.chunks_mut(row_length);
        for (index, row) in rows.enumerate() {
            let (y, z) = (index as u32 % self.points.y, index as u32 / self.points.y);
            let start = origin + axes.y_axis * y as f32 + axes.z_axis * z as f32;
            for (x, observed) in row.iter_mut().enumerate() {
                *observed = *observed || {
                    let point = start + axes.x_axis * x as f32;
                    measured_depth(camera, depth, point).is_some_and(|d| point.z <= d + behind_m)
                };
            }
        }
    }

    /// Whether every lattice point around `point` was observed; outside the lattice nothing is.
    pub fn visible(&self, point: Vec3) -> bool {
        let at = (point - self.min) / self.voxel_m;
        let last = (self.points - 1).as_vec3();
        if !(at.cmpge(Vec3::ZERO).all() && at.cmple(last).all()) {
            return false;
        }
        let cell = at.floor().min(last - 1.0);
        let part = at - cell;
        let mut sum = 0.0;
        for corner in 0..8_u32 {
            let step = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let index = cell.as_uvec3() + step;
            let (width, height) = (self.points.x as usize, self.points.y as usize);
            let row = index.z as usize * height + index.y as usize;
            if self.observed[row * width + index.x as usize] {
                sum += Vec3::select(step.cmpeq(UVec3::ONE), part, 1.0 - part).element_product();
            }
        }
        sum >= OBSERVED
    }

    /// Share of lattice points that were observed.
    pub fn observed_share(&self) -> f64 {
        let observed = self.observed.iter().filter(|&&observed| observed).count();
        observed as f64 / self.observed.len() as f64
    }
}

/// The depth at the pixel that `point` (camera coordinates) falls on, where there is any.
fn measured_depth(camera: &Pinhole, depth: &[f32], point: Vec3A) -> Option<f32> {
    if point.z <= 0.0 {
        return None;
    }
    let pixel = camera.project(point.into()).round();
    let inside = pixel.x >= 0.0
        && pixel.y >= 0.0
        && pixel.x < camera.width as f32
        && pixel.y < camera.height as f32;
    if !inside {
        return None;
    }
    let index = pixel.y as usize * camera.width as usize + pixel.x as usize;
    Some(depth[index]).filter(|&depth| depth > 0.0)
}
