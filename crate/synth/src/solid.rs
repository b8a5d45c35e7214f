//! The two convex shapes that everything in a room is made of, each described by one exact signed distance.
//!
//! Along a ray the distance to a convex set is itself convex, so Newton's method started outside never oversteps the
//! surface: one distance function gives ray hits, normals, clearance and the tessellation.

use glam::{Mat3, Vec2, Vec3};

use crate::texture::Look;

/// A convex shape around its own origin, in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// A box swollen by a radius: a box, a cushion, a capsule (two half sizes 0) or a ball (all 0).
    Block { half_m: Vec3, round_m: f32 },
    /// An upright cylinder or cut cone, swollen by a radius.
    Drum {
        bottom_m: f32,
        top_m: f32,
        half_m: f32,
        round_m: f32,
    },
}

/// A shape at its place with its look.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub shape: Shape,
    pub center: Vec3,
    /// Columns are the shape's own axes in the room.
    pub axes: Mat3,
    pub look: Look,
    /// Lamp shades let their own light out.
    pub casts_shadow: bool,
}

/// Where a ray meets a solid.
pub(crate) struct Touch {
    pub t: f32,
    /// Outward, in the room.
    pub normal: Vec3,
}

const NEWTON_STEPS: usize = 24;
const ON_SURFACE_M: f32 = 1e-5;

impl Shape {
    /// Half the size of the smallest box around the shape.
    pub fn half_size(&self) -> Vec3 {
        match *self {
            Shape::Block { half_m, round_m } => half_m + round_m,
            Shape::Drum {
                bottom_m,
                top_m,
                half_m,
                round_m,
            } => {
                let r = bottom_m.max(top_m);
                Vec3::new(r, r, half_m) + round_m
            }
        }
    }

    /// Signed distance and its gradient at `p`.
    pub fn field(&self, p: Vec3) -> (f32, Vec3) {
        match *self {
            Shape::Block { half_m, round_m } => block_field(p, half_m, round_m),
            Shape::Drum {
                bottom_m,
                top_m,
                half_m,
                round_m,
            } => {
                let (d, n) = drum_field(p, bottom_m, top_m, half_m);
                (d - round_m, n)
            }
        }
    }
}

fn block_field(p: Vec3, half: Vec3, round: f32) -> (f32, Vec3) {
    let q = p.abs() - half;
    let out = q.max(Vec3::ZERO);
    let length = out.length();
    if length > 1e-9 {
        return (length - round, out / length * p.signum());
    }
    let d = q.max_element();
    let axis = if d == q.x {
        Vec3::X
    } else if d == q.y {
        Vec3::Y
    } else {
        Vec3::Z
    };
    (d - round, axis * p.signum())
}

/// Distance to a trapezoid in the plane of the axis and the point, which the drum is the turning of.
fn drum_field(p: Vec3, bottom: f32, top: f32, half: f32) -> (f32, Vec3) {
    let radius = (p.x * p.x + p.y * p.y).sqrt();
    let outward = if radius > 1e-9 {
        Vec3::new(p.x / radius, p.y / radius, 0.0)
    } else {
        Vec3::X
    };
    // Above the end caps and beside the slope, each as (signed distance of its line, nearest point on it).
    let slope = Vec2::new(top - bottom, 2.0 * half);
    let side = Vec2::new(slope.y, -slope.x) / slope.length();
    let q = Vec2::new(radius, p.z);
    let from_bottom = q - Vec2::new(bottom, -half);
    let beside = from_bottom.dot(side);
    let above = p.z.abs() - half;
    let cap = if p.z > 0.0 { top } else { bottom };
    let up = Vec3::Z * p.z.signum();
    let tilt = outward * side.x + Vec3::Z * side.y;
    if beside <= 0.0 && above <= 0.0 {
        return if beside > above {
            (beside, tilt)
        } else {
            (above, up)
        };
    }
    if above > 0.0 && radius <= cap {
        return (above, up);
    }
    let along = from_bottom.dot(slope) / slope.length_squared();
    if (0.0..=1.0).contains(&along) {
        return (beside, tilt);
    }
    let away = if along > 0.5 {
        from_bottom - slope
    } else {
        from_bottom
    };
    let d = away.length();
    if d < 1e-9 {
        return (0.0, up);
    }
    (d, outward * (away.x / d) + Vec3::Z * (away.y / d))
}

impl Solid {
    /// `point` of the room in the solid's own axes.
    pub fn to_local(&self, point: Vec3) -> Vec3 {
        self.axes.transpose_mul_vec3(point - self.center)
    }

    /// Signed distance in metres from `point` of the room.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.shape.field(self.to_local(point)).0
    }

    /// Opposite corners of the axis-aligned box around the solid.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let half = self.shape.half_size();
        let reach = self.axes.x_axis.abs() * half.x
            + self.axes.y_axis.abs() * half.y
            + self.axes.z_axis.abs() * half.z;
        (self.center - reach, self.center + reach)
    }

    /// The first hit nearer than `limit` of a ray that starts outside; `dir` has unit length.
    pub fn cast(&self, origin: Vec3, dir: Vec3, limit: f32) -> Option<Touch> {
        let o = self.to_local(origin);
        let d = self.axes.transpose_mul_vec3(dir);
        let half = self.shape.half_size();
        let inverse = d.recip();
        let near = (-half * d.signum() - o) * inverse;
        let far = (half * d.signum() - o) * inverse;
        let enter = near.max_element();
        let leave = far.min_element();
        if enter > leave || leave < 0.0 || enter >= limit {
            return None;
        }
        if let Shape::Block { round_m: 0.0, .. } = self.shape {
            if enter < 0.0 {
                return None;
            }
            let axis = if enter == near.x {
                0
            } else if enter == near.y {
                1
            } else {
                2
            };
            let normal = self.axes.col(axis) * -d[axis].signum();
            return Some(Touch { t: enter, normal });
        }
        let mut t = enter.max(0.0);
        for step in 0..NEWTON_STEPS {
            let (gap, gradient) = self.shape.field(o + d * t);
            let slope = gradient.dot(d);
            if step == 0 && gap < 0.0 && enter < 0.0 || slope > -1e-6 {
                return None;
            }
            if gap < ON_SURFACE_M {
                let normal = self.axes * gradient;
                return Some(Touch { t, normal });
            }
            t -= gap / slope;
            if t > leave || t >= limit {
                return None;
            }
        }
        None
    }
}
