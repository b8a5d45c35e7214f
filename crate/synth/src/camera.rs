//! A pinhole camera in the room.

use glam::{Mat3, Vec3};

/// A pinhole camera: x right, y down, z forward; pixel centres at whole numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Camera axes in the room: the rotation of camera-to-room.
    pub rotation: Mat3,
    /// The camera's place in the room, in metres.
    pub position_m: Vec3,
    /// Focal length in pixels, the same along both axes.
    pub focal_px: f32,
    /// Principal point in pixels: the middle of the picture.
    pub center_px: [f32; 2],
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
}

/// Focal length over picture width: 66 degrees across, like the main camera of a phone.
const FOCAL_PER_WIDTH: f32 = 0.77;

impl Camera {
    /// A camera at `position_m` that looks along `forward` with `right` (orthogonal unit vectors).
    pub fn look(position_m: Vec3, forward: Vec3, right: Vec3, width: u32, height: u32) -> Self {
        Self {
            rotation: Mat3::from_cols(right, forward.cross(right), forward),
            position_m,
            focal_px: FOCAL_PER_WIDTH * width as f32,
            center_px: [0.5 * (width as f32 - 1.0), 0.5 * (height as f32 - 1.0)],
            width,
            height,
        }
    }

    /// Direction in the room through pixel (`u`, `v`), scaled so that its part along the optical axis is 1.
    pub fn ray(&self, u: f32, v: f32) -> Vec3 {
        let x = (u - self.center_px[0]) / self.focal_px;
        let y = (v - self.center_px[1]) / self.focal_px;
        self.rotation * Vec3::new(x, y, 1.0)
    }
}
