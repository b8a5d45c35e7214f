//! A mesh seen from above one of its corners, coloured by how far it lies from another.

use glam::{Affine3A, Mat3, Vec2, Vec3};
use mesh::{
    Bounds, Mesh,
    camera::Pinhole,
    nearest::PointIndex,
    raster::{Cull, depth},
};

/// Width and height of a picture, in pixels.
pub const SIZE: [u32; 2] = [560, 420];
/// Errors of this many metres and more are all as red.
pub const REDDEST_M: f32 = 0.1;
const NEAR_M: f32 = 0.05;

/// A camera that looks down into a room whose walls and ceiling it sees from behind, which are not drawn.
pub struct Overview {
    camera: Pinhole,
    world_from_camera: Affine3A,
}

impl Overview {
    /// Of a box, where `up` is up.
    pub fn of(bounds: &Bounds, up: Vec3) -> Self {
        let [width, height] = SIZE;
        let focal = 1.3 * width as f32;
        let camera = Pinhole {
            width,
            height,
            fx: focal,
            fy: focal,
            cx: 0.5 * (width as f32 - 1.0),
            cy: 0.5 * (height as f32 - 1.0),
        };
        let up = up.normalize_or(Vec3::Z);
        let (side, other) = up.any_orthonormal_pair();
        // 55 degrees above the floor, off the axes of a room that lies along them.
        let ahead = -(0.82 * up + 0.47 * side + 0.33 * other).normalize();
        let right = ahead.cross(up).normalize();
        let turn = Mat3::from_cols(right, ahead.cross(right), ahead);
        let away_m = 0.5 * bounds.size().length() * focal / (0.5 * height as f32) * 0.6;
        Self {
            camera,
            world_from_camera: Affine3A::from_mat3_translation(
                turn,
                bounds.center() - away_m * ahead,
            ),
        }
    }

    /// The mesh, RGB row by row: grey, or by the distance of its points to those of `other`.
    pub fn paint(&self, mesh: &Mesh, other: Option<&PointIndex>) -> Vec<u8> {
        let camera_from_world = self.world_from_camera.inverse();
        let depth_m = depth(mesh, &self.camera, &camera_from_world, Cull::Back, NEAR_M);
        let width = self.camera.width as usize;
        let point = |i: usize| {
            let pixel = Vec2::new((i % width) as f32, (i / width) as f32);
            let depth_m = depth_m.get(i).copied().unwrap_or(0.0);
            (depth_m > 0.0).then(|| {
                self.world_from_camera
                    .transform_point3(self.camera.ray(pixel) * depth_m)
            })
        };
        let points: Vec<Option<Vec3>> = (0..depth_m.len()).map(point).collect();
        let shown: Vec<Vec3> = points.iter().flatten().copied().collect();
        let mut errors = other.map(|other| other.distances(&shown).into_iter());
        let ahead = Vec3::from(self.world_from_camera.matrix3.z_axis);
        let mut rgb = Vec::with_capacity(3 * points.len());
        for (i, here) in points.iter().enumerate() {
            let Some(here) = here else {
                rgb.extend([255; 3]);
                continue;
            };
            let color = match errors.as_mut().and_then(Iterator::next) {
                Some(error_m) => ramp(error_m / REDDEST_M),
                None => Vec3::splat(0.78),
            };
            let beside = |step: usize| {
                points
                    .get(i + step)
                    .copied()
                    .flatten()
                    .map(|there| there - here)
            };
            let light = match (beside(1), beside(width)) {
                (Some(right), Some(below)) => {
                    below.cross(right).normalize_or(-ahead).dot(ahead).abs()
                }
                _ => 0.7,
            };
            let color = color * (0.35 + 0.65 * light) * 255.0;
            rgb.extend(color.to_array().map(|value| value as u8));
        }
        rgb
    }
}

/// From blue over pale yellow at a half to red.
fn ramp(share: f32) -> Vec3 {
    let [low, middle, high] = [
        Vec3::new(0.20, 0.45, 0.75),
        Vec3::new(0.98, 0.92, 0.60),
        Vec3::new(0.80, 0.12, 0.15),
    ];
    let share = 2.0 * share.clamp(0.0, 1.0);
    if share < 1.0 {
        low.lerp(middle, share)
    } else {
        middle.lerp(high, share - 1.0)
    }
}
