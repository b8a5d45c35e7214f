//! One posed frame, before its pictures are read.

use glam::{DAffine3, DVec3};
use serde::Serialize;

use crate::camera::Camera;

/// A picture that has not been read yet.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ImageRef {
    /// Path inside the source.
    pub path: String,
}

/// One posed frame; its pictures are decoded by [`Scan::color`] and [`Scan::depth`].
#[derive(Debug, Clone)]
pub struct Frame {
    /// The frame's name in the scan, such as `frame-000012`.
    pub name: String,
    /// Canonical world from camera: OpenCV camera axes, metres, world Z up.
    pub pose: DAffine3,
    /// Its colour picture, if any.
    pub color: Option<ImageRef>,
    /// Its depth picture, if any.
    pub depth: Option<ImageRef>,
    /// The camera of the colour picture.
    pub color_camera: Camera,
    /// The camera of the depth picture.
    pub depth_camera: Camera,
    /// Seconds, where the format has times.
    pub timestamp_s: Option<f64>,
}

/// Mean image-up direction of cameras, of length at most 1.
pub(crate) fn mean_camera_up(frames: &[Frame]) -> DVec3 {
    let sum: DVec3 = frames.iter().map(|frame| -frame.pose.matrix3.y_axis).sum();
    sum / frames.len().max(1) as f64
}
