//! Where the visitor looks from: a pivot, a distance to it, a heading and a lens.
//!
//! The orientation is kept as yaw, pitch and roll, and the axes are built from the angles alone
//! (no look-at), so nothing degenerates when looking straight down. Roll is there because
//! captured photos have it: looking through one shows the world as the photo does.

use glam::{Affine3A, Mat3A, Mat4, Vec2, Vec3, Vec4};
use mesh::Bounds;
use mesh::camera::Pinhole;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Nearest distance that is drawn.
pub(crate) const NEAR_M: f32 = 0.02;

/// Vertical field of view unless a photo's own is taken over.
const DEFAULT_FOV_Y_RAD: f32 = 0.9;

/// A world-space ray: what lies under a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The eye, metres.
    pub origin_m: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// A pinhole camera that turns about a pivot. World: metres, Z up. View axes as in wgpu and
/// OpenGL: x right, y up, looking along -z. Depth is reversed (1 at the near plane, 0 at
/// infinity): f32 depth then keeps its precision over a whole flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitCamera {
    /// The point turned about and zoomed to.
    pub pivot_m: Vec3,
    /// Eye to pivot.
    pub distance_m: f32,
    /// Heading of the view direction about +Z, from +X towards +Y; not wrapped.
    pub yaw_rad: f32,
    /// Elevation of the view direction, -pi/2 (straight down) to pi/2.
    pub pitch_rad: f32,
    /// Turn of the picture about the view direction; 0 keeps the horizon level.
    pub roll_rad: f32,
    /// Vertical field of view.
    pub fov_y_rad: f32,
    /// Tangents (right, up) of the direction in the middle of the picture: a photo's principal
    /// point is rarely its exact middle.
    pub lens_shift: Vec2,
}

impl Default for OrbitCamera {
    fn default() -> Self {
        Self {
            pivot_m: Vec3::new(0.0, 0.0, 1.0),
            distance_m: 6.0,
            yaw_rad: 1.1,
            pitch_rad: -0.7,
            roll_rad: 0.0,
            fov_y_rad: DEFAULT_FOV_Y_RAD,
            lens_shift: Vec2::ZERO,
        }
    }
}

impl OrbitCamera {
    /// The camera of a photo (OpenCV axes: x right, y down, z forward), with its lens opened until
    /// the whole photo fits a picture of `aspect` (width / height). The pivot goes `distance_m`
    /// ahead.
    pub fn looking_through(
        world_from_camera: &Affine3A,
        pinhole: &Pinhole,
        aspect: f32,
        distance_m: f32,
    ) -> Self {
        let axes = world_from_camera.matrix3;
        let forward = Vec3::from(axes.z_axis).normalize_or(Vec3::X);
        let right = Vec3::from(axes.x_axis);
        // Looking straight up or down, the heading lives in the right axis alone.
        let (yaw_rad, level) = if forward.truncate().length() > 1e-4 {
            (forward.y.atan2(forward.x), false)
        } else {
            (right.x.atan2(-right.y), true)
        };
        let mut camera = Self {
            pivot_m: Vec3::from(world_from_camera.translation) + forward * distance_m,
            distance_m,
            yaw_rad,
            pitch_rad: forward.z.clamp(-1.0, 1.0).asin(),
            ..Self::default()
        };
        if !level {
            let (level_right, level_up, _) = camera.axes();
            camera.roll_rad = right.dot(level_up).atan2(right.dot(level_right));
        }
        let (width, height) = (pinhole.width as f32, pinhole.height as f32);
        let (fx, fy) = (pinhole.fx, pinhole.fy);
        let half_height = (height / fy).max(width / fx / aspect) * 0.5;
        camera.fov_y_rad = 2.0 * half_height.atan();
        // Pixel centres are integers, so the middle of the photo is (size - 1) / 2.
        camera.lens_shift = Vec2::new(
            ((width - 1.0) * 0.5 - pinhole.cx) / fx,
            -((height - 1.0) * 0.5 - pinhole.cy) / fy,
        );
        camera
    }

    /// Right, up and forward in the world, unit length.
    pub fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let (sin_yaw, cos_yaw) = self.yaw_rad.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch_rad.sin_cos();
        let forward = Vec3::new(cos_pitch * cos_yaw, cos_pitch * sin_yaw, sin_pitch);
        let right = Vec3::new(sin_yaw, -cos_yaw, 0.0);
        let up = right.cross(forward);
        let (sin_roll, cos_roll) = self.roll_rad.sin_cos();
        (
            right * cos_roll + up * sin_roll,
            up * cos_roll - right * sin_roll,
            forward,
        )
    }

    /// The eye, metres.
    pub fn eye_m(&self) -> Vec3 {
        self.pivot_m - self.axes().2 * self.distance_m
    }

    /// World to view (x right, y up, -z ahead).
    pub fn view_from_world(&self) -> Affine3A {
        let (right, up, forward) = self.axes();
        let world_from_view = Affine3A {
            matrix3: Mat3A::from_cols(right.into(), up.into(), (-forward).into()),
            translation: self.eye_m().into(),
        };
        world_from_view.inverse()
    }

    /// View to clip, reversed depth, far plane at infinity. `aspect` is width / height.
    pub fn clip_from_view(&self, aspect: f32) -> Mat4 {
        let half = self.tan_half_fov(aspect);
        Mat4::from_cols(
            Vec4::new(1.0 / half.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / half.y, 0.0, 0.0),
            Vec4::new(
                self.lens_shift.x / half.x,
                self.lens_shift.y / half.y,
                0.0,
                -1.0,
            ),
            Vec4::new(0.0, 0.0, NEAR_M, 0.0),
        )
    }

    /// World to clip.
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        self.clip_from_view(aspect) * Mat4::from(self.view_from_world())
    }

    /// The ray through `ndc` (x right, y up, both -1..1).
    pub fn ray(&self, ndc: Vec2, aspect: f32) -> Ray {
        let (right, up, forward) = self.axes();
        let tangent = self.tangent(ndc, aspect);
        Ray {
            origin_m: self.eye_m(),
            direction: (right * tangent.x + up * tangent.y + forward).normalize(),
        }
    }

    /// Tangents (right, up) of the direction through `ndc`.
    pub fn tangent(&self, ndc: Vec2, aspect: f32) -> Vec2 {
        ndc * self.tan_half_fov(aspect) + self.lens_shift
    }

    /// Moves, heading kept, to where `points_m` fill the picture with a small margin; the lens and the horizon go back
    /// to normal. No points, no move.
    pub fn fit(&mut self, points_m: &[Vec3], aspect: f32) {
        let Some(bounds) = Bounds::of(points_m) else {
            return;
        };
        self.lens_shift = Vec2::ZERO;
        self.roll_rad = 0.0;
        self.fov_y_rad = DEFAULT_FOV_Y_RAD;
        let (right, up, forward) = self.axes();
        let half = self.tan_half_fov(aspect) / 1.1;
        // A point at x, z (right, ahead) is in the picture of an eye at c, -d when |x - c| <= (d + z) * half. So the
        // two largest of x - z * half and -x - z * half give the eye; up and down likewise.
        let center_m = bounds.center();
        let farthest = |axis: Vec3, half: f32| {
            let reach = |p: &Vec3| (p - center_m).dot(axis) - (p - center_m).dot(forward) * half;
            points_m.iter().map(reach).fold(f32::NEG_INFINITY, f32::max)
        };
        let eye = |axis: Vec3, half: f32| {
            let (ahead, behind) = (farthest(axis, half), farthest(-axis, half));
            ((ahead - behind) * 0.5, (ahead + behind) * 0.5 / half)
        };
        let (aside_m, distance_x_m) = eye(right, half.x);
        let (above_m, distance_y_m) = eye(up, half.y);
        self.pivot_m = center_m + right * aside_m + up * above_m;
        self.distance_m = distance_x_m.max(distance_y_m).max(0.3);
    }

    /// Heading of the first view and of the home key: over a corner, looking down.
    pub fn face_home(&mut self) {
        let home = Self::default();
        self.yaw_rad = nearest_turn(home.yaw_rad, self.yaw_rad);
        self.pitch_rad = home.pitch_rad;
    }

    /// Turns the heading, pitch held within straight up and down.
    pub fn turn(&mut self, yaw_rad: f32, pitch_rad: f32) {
        self.yaw_rad += yaw_rad;
        self.pitch_rad = (self.pitch_rad + pitch_rad).clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// The camera a share `t` of the way to `goal`. Pivot and distance move in one proportion, so
    /// an eased zoom keeps its fixed point on the way too.
    pub fn toward(&self, goal: &Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * t;
        Self {
            pivot_m: self.pivot_m.lerp(goal.pivot_m, t),
            distance_m: mix(self.distance_m, goal.distance_m),
            yaw_rad: mix(self.yaw_rad, goal.yaw_rad),
            pitch_rad: mix(self.pitch_rad, goal.pitch_rad),
            roll_rad: mix(self.roll_rad, goal.roll_rad),
            fov_y_rad: mix(self.fov_y_rad, goal.fov_y_rad),
            lens_shift: self.lens_shift.lerp(goal.lens_shift, t),
        }
    }

    /// Whether the two look the same at a screen's precision.
    pub fn is_close_to(&self, other: &Self) -> bool {
        let reach = self.distance_m.min(other.distance_m).max(1e-3);
        let angle = (self.yaw_rad - other.yaw_rad)
            .abs()
            .max((self.pitch_rad - other.pitch_rad).abs())
            .max((self.roll_rad - other.roll_rad).abs())
            .max((self.fov_y_rad - other.fov_y_rad).abs())
            .max((self.lens_shift - other.lens_shift).length());
        let shift =
            self.pivot_m.distance(other.pivot_m) + (self.distance_m - other.distance_m).abs();
        angle < 2e-4 && shift < 2e-4 * reach
    }

    fn tan_half_fov(&self, aspect: f32) -> Vec2 {
        let half_y = (self.fov_y_rad * 0.5).tan();
        Vec2::new(half_y * aspect, half_y)
    }
}

/// `angle_rad` plus the whole turns that bring it closest to `near_rad`: the short way round.
pub(crate) fn nearest_turn(angle_rad: f32, near_rad: f32) -> f32 {
    near_rad + (angle_rad - near_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
#[path = "camera_tests.rs"]
mod tests;
