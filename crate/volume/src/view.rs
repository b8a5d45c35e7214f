//! One posed depth image, as the volume takes it.

use crate::VolumeError;
use glam::Affine3A;
use mesh::camera::Pinhole;

/// A posed depth image, with colour if there is one. Both cameras share the pose.
pub struct DepthView<'a> {
    /// Depth along the optical axis in metres, row by row; 0 where nothing was measured.
    pub depth_m: &'a [f32],
    /// How much each pixel of the depth image may be relied on, 0 to 1: its measurement's weight is multiplied by it.
    /// A pixel of 0 counts as not measured. `None` where all may be relied on alike, which is the same as 1 everywhere.
    pub confidence: Option<&'a [f32]>,
    /// The camera of the depth image.
    pub depth_camera: Pinhole,
    /// Colour as sRGB bytes, three a pixel, and its camera.
    pub color: Option<(&'a [u8], Pinhole)>,
    /// Camera to canonical world; OpenCV axes (x right, y down, z forward), metres.
    pub world_from_camera: Affine3A,
}

impl DepthView<'_> {
    /// Says whether the images have the sizes that their cameras say.
    pub(crate) fn check(&self) -> Result<(), VolumeError> {
        check_size("depth", &self.depth_camera, 1, self.depth_m.len())?;
        if let Some(confidence) = self.confidence {
            check_size("confidence", &self.depth_camera, 1, confidence.len())?;
        }
        match &self.color {
            Some((rgb, camera)) => check_size("colour", camera, 3, rgb.len()),
            None => Ok(()),
        }
    }

    /// Depth of a pixel in metres, 0 where nothing was measured or where the measurement is worth nothing.
    pub(crate) fn depth_at(&self, pixel: usize) -> f32 {
        // Not so for NaN.
        let counts = |confidence: &[f32]| confidence[pixel] > 0.0;
        if self.confidence.is_none_or(counts) {
            self.depth_m[pixel]
        } else {
            0.0
        }
    }
}

fn check_size(
    what: &'static str,
    camera: &Pinhole,
    channels: usize,
    found: usize,
) -> Result<(), VolumeError> {
    let expected = camera.width as usize * camera.height as usize * channels;
    if found == expected {
        return Ok(());
    }
    Err(VolumeError::ImageSize {
        what,
        width: camera.width,
        height: camera.height,
        expected,
        found,
    })
}
