//! The pinhole camera that meshes are looked at through.

use glam::{Vec2, Vec3};

/// A pinhole camera without distortion. OpenCV axes: x right, y down, z forward. The centre of the top left pixel is
/// (0, 0), so the picture spans -0.5 to width - 0.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Focal length in pixels, horizontal.
    pub fx: f32,
    /// Focal length in pixels, vertical.
    pub fy: f32,
    /// Column of the principal point.
    pub cx: f32,
    /// Row of the principal point.
    pub cy: f32,
}

impl Pinhole {
    /// Where a point in camera coordinates (metres, z > 0) appears, in pixels.
    pub fn project(&self, point: Vec3) -> Vec2 {
        let scale = 1.0 / point.z;
        Vec2::new(
            self.fx * point.x * scale + self.cx,
            self.fy * point.y * scale + self.cy,
        )
    }

    /// The direction seen at `pixel`, in camera coordinates with z = 1: times a z-depth it is the point seen.
    pub fn ray(&self, pixel: Vec2) -> Vec3 {
        Vec3::new(
            (pixel.x - self.cx) / self.fx,
            (pixel.y - self.cy) / self.fy,
            1.0,
        )
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}
