//! Which frames a sample shows (method 1.3).

use crate::random::Random;
use glam::{Affine3A, Vec3};
use mesh::camera::Pinhole;

/// How many of `points` lie in the picture and before the camera.
pub fn seen(camera: &Pinhole, world_from_camera: Affine3A, points: &[Vec3]) -> usize {
    let camera_from_world = world_from_camera.inverse();
    let (right, bottom) = (camera.width as f32 - 1.0, camera.height as f32 - 1.0);
    let inside = |&&point: &&Vec3| {
        let point = camera_from_world.transform_point3(point);
        if point.z <= 0.0 {
            return false;
        }
        let pixel = camera.project(point);
        pixel.x > 0.0 && pixel.y > 0.0 && pixel.x < right && pixel.y < bottom
    };
    points.iter().filter(inside).count()
}

/// `count` different frames in random order: of `keyframes` that `see` enough; where those do not suffice, of the other
/// frames that see enough; then of those that see anything; then of any.
pub fn choose(
    count: usize,
    frames: usize,
    keyframes: &[usize],
    see: impl Fn(usize) -> Sight,
    random: &mut Random,
) -> Vec<usize> {
    let mut is_key = vec![false; frames];
    for &frame in keyframes {
        is_key[frame] = true;
    }
    let mut groups: [Vec<usize>; 4] = Default::default();
    for (frame, &is_key) in is_key.iter().enumerate() {
        let group = match (see(frame), is_key) {
            (Sight::Enough, true) => 0,
            (Sight::Enough, false) => 1,
            (Sight::Little, _) => 2,
            (Sight::Nothing, _) => 3,
        };
        groups[group].push(frame);
    }
    for group in &mut groups {
        random.shuffle(group);
    }
    groups.into_iter().flatten().take(count).collect()
}

/// How much of a crop a frame sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// None of its points.
    Nothing,
    /// Less than asked.
    Little,
    /// As much as asked.
    Enough,
}

impl Sight {
    /// `seen` of `points` points, where a share of `least` is asked.
    pub fn new(seen: usize, points: usize, least: f32) -> Self {
        match seen {
            0 => Self::Nothing,
            _ if (seen as f32) < least * points as f32 => Self::Little,
            _ => Self::Enough,
        }
    }
}
