//! The walk of someone who scans a room with a phone: two turns along the walls, looking across the room; first level
//! and past the middle on one side, then down and past it on the other, so that things are seen from two sides.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec2, Vec3};
use scan::Camera;

use crate::room::Room;

/// A camera at its place in the room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The pinhole camera.
    pub camera: Camera,
    /// Room from camera: the columns are the camera's right, down and forward in the room.
    pub rotation: Mat3,
    /// The camera's place in the room, in metres.
    pub position_m: Vec3,
}

/// Nothing of the room comes closer to the camera than this.
pub const CLEARANCE_M: f32 = 0.3;

/// Focal length over picture width: 66 degrees across, like the main camera of a phone.
const FOCAL_PER_WIDTH: f64 = 0.77;
const TURNS: f32 = 2.0;

/// `frames` views of `width` by `height` pixels along the walk, in order.
pub fn path(room: &Room, frames: usize, width: u32, height: u32) -> Vec<View> {
    let focal = FOCAL_PER_WIDTH * f64::from(width);
    let camera = Camera {
        width,
        height,
        fx: focal,
        fy: focal,
        cx: 0.5 * (f64::from(width) - 1.0),
        cy: 0.5 * (f64::from(height) - 1.0),
    };
    (0..frames)
        .map(|i| view(room, i as f32 / frames as f32, camera))
        .collect()
}

/// The view after `share` of the walk.
fn view(room: &Room, share: f32, camera: Camera) -> View {
    // libm, not the machine's own sine, so that all machines walk the same way.
    let sway = |per_turn: f32, phase: f32| libm::sinf(share * TURNS * TAU * per_turn + phase);
    let later = smooth_step((share - 0.38) / 0.24);
    let heading = share * TURNS * TAU + 0.06 * sway(3.3, 0.4);
    let pitch = -0.18 - 0.30 * later + 0.035 * sway(2.7, 1.1);
    let roll = 0.03 * sway(1.9, 2.0);

    let (sin, cos) = libm::sincosf(heading);
    let ahead = Vec3::new(cos, sin, 0.0);
    let (dive, level) = libm::sincosf(pitch);
    let forward = ahead * level + Vec3::Z * dive;
    let right = forward.cross(Vec3::Z).normalize();
    let (tilt, upright) = libm::sincosf(roll);
    let right = right * upright + right.cross(forward) * tilt;

    let (sin, cos) = libm::sincosf(heading + later - 0.5);
    let half = 0.5 * room.size_m().truncate();
    let back_m = 1.5 + 0.1 * later + 0.08 * sway(1.4, PI);
    let place = -Vec2::new(cos, sin) * back_m * half / half.max_element();
    let wanted = place.extend(1.5 - 0.1 * later + 0.03 * sway(5.0, 0.0));
    View {
        camera,
        rotation: Mat3::from_cols(right, forward.cross(right), forward),
        position_m: step_aside(room, wanted),
    }
}

fn smooth_step(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Moves `position` up the distance field until there is room around it.
fn step_aside(room: &Room, mut position: Vec3) -> Vec3 {
    const ENOUGH_M: f32 = CLEARANCE_M + 0.05;
    const STEPS: usize = 32;
    const APART_M: f32 = 1e-2;
    for _ in 0..STEPS {
        let gap = room.distance(position);
        if gap >= ENOUGH_M {
            break;
        }
        let slope = |axis: Vec3| room.distance(position + axis * APART_M) - gap;
        let uphill = Vec3::new(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z));
        // Level ground between two things: towards the middle of the room.
        let inwards = -position.with_z(0.0).normalize_or_zero();
        let way = uphill.normalize_or(inwards) + 0.2 * inwards;
        position += way * (ENOUGH_M - gap).max(APART_M);
    }
    position
}

impl View {
    /// Direction in the room through pixel (`u`, `v`), scaled so that its part along the optical axis is 1.
    pub fn ray(&self, u: f32, v: f32) -> Vec3 {
        let (fx, fy) = (self.camera.fx as f32, self.camera.fy as f32);
        let x = (u - self.camera.cx as f32) / fx;
        let y = (v - self.camera.cy as f32) / fy;
        self.rotation * Vec3::new(x, y, 1.0)
    }
}
