//! A picture's camera and pose, as the network takes it.

use glam::{Affine3A, Vec3};
use mesh::camera::Pinhole;

/// A posed pinhole camera. Lengths in metres; the world is gravity-aligned, Z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera of the picture as the network sees it: its pixels are those of the picture given.
    pub camera: Pinhole,
    /// Camera to world; OpenCV axes (x right, y down, z forward).
    pub world_from_camera: Affine3A,
}

impl View {
    /// Where the camera is.
    pub fn position_m(&self) -> Vec3 {
        self.world_from_camera.translation.into()
    }
}
