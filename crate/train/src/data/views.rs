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

/// `count` different frames in random order: of `keyframes` that `sees` says yes to; where those do not suffice, of the
/// other frames that see something; where those do not suffice either, of any.
pub fn choose(
    count: usize,
    frames: usize,
    keyframes: &[usize],
    sees: impl Fn(usize) -> bool,
    random: &mut Random,
) -> Vec<usize> {
    let mut is_key = vec![false; frames];
    for &frame in keyframes {
        is_key[frame] = true;
    }
    let mut groups: [Vec<usize>; 3] = Default::default();
    for frame in 0..frames {
        let group = match (sees(frame), is_key[frame]) {
            (true, true) => 0,
            (true, false) => 1,
            (false, _) => 2,
        };
        groups[group].push(frame);
    }
    for group in &mut groups {
        random.shuffle(group);
    }
    groups.into_iter().flatten().take(count).collect()
}
