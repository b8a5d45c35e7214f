//! The pinhole camera (Hartley and Zisserman, Multiple View Geometry, section 6.1) in OpenCV's convention.

use glam::{DVec2, DVec3};
use serde::Serialize;

/// An undistorted pinhole camera. Axes: x right, y down, z forward. The centre of the top-left pixel is (0, 0).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Camera {
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// Focal length along x in pixels.
    pub fx: f64,
    /// Focal length along y in pixels.
    pub fy: f64,
    /// Principal point, x in pixels.
    pub cx: f64,
    /// Principal point, y in pixels.
    pub cy: f64,
}

impl Camera {
    /// The same camera for a picture resized to `to_width` x `to_height` pixels.
    ///
    /// With pixel centres at integers a resize by s moves x to (x + 0.5) s - 0.5.
    pub fn scaled(&self, to_width: u32, to_height: u32) -> Camera {
        let sx = f64::from(to_width) / f64::from(self.width);
        let sy = f64::from(to_height) / f64::from(self.height);
        Camera {
            width: to_width,
            height: to_height,
            fx: self.fx * sx,
            fy: self.fy * sy,
            cx: (self.cx + 0.5) * sx - 0.5,
            cy: (self.cy + 0.5) * sy - 0.5,
        }
    }

    /// The pixel that a point in camera coordinates (metres) falls on; `None` behind the camera.
    /// The pixel may lie outside the picture.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        (point.z > 0.0).then(|| {
            DVec2::new(
                self.fx * point.x / point.z + self.cx,
                self.fy * point.y / point.z + self.cy,
            )
        })
    }

    /// The point in camera coordinates (metres) seen by `pixel` at `depth_m` along the optical axis.
    pub fn unproject(&self, pixel: DVec2, depth_m: f64) -> DVec3 {
        DVec3::new(
            (pixel.x - self.cx) / self.fx * depth_m,
            (pixel.y - self.cy) / self.fy * depth_m,
            depth_m,
        )
    }
}
