//! Rooms of flat surfaces and the depth pictures of them, by ray casting.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use scan::Camera;

/// A parallelogram: a corner and two edges.
pub struct Surface {
    corner: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
}

pub fn surface(corner: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Surface {
    Surface {
        corner: corner.into(),
        edge_u: edge_u.into(),
        edge_v: edge_v.into(),
    }
}

/// Floor, ceiling (if `height` says so) and four walls of a box from the origin.
pub fn shell(x: f64, y: f64, height: f64, ceiling: bool) -> Vec<Surface> {
    let mut surfaces = vec![
        surface([0.0; 3], [x, 0.0, 0.0], [0.0, y, 0.0]),
        surface([0.0; 3], [x, 0.0, 0.0], [0.0, 0.0, height]),
        surface([0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, height]),
        surface([0.0; 3], [0.0, y, 0.0], [0.0, 0.0, height]),
        surface([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, height]),
    ];
    if ceiling {
        surfaces.push(surface([0.0, 0.0, height], [x, 0.0, 0.0], [0.0, y, 0.0]));
    }
    surfaces
}

/// The five visible faces of a box standing on something, turned about the vertical.
pub fn block(centre: [f64; 3], size: [f64; 3], turn_deg: f64) -> Vec<Surface> {
    let turn = DMat3::from_rotation_z(turn_deg.to_radians());
    let [sx, sy, sz] = size;
    let base = DVec3::from(centre);
    let (ex, ey, ez) = (turn.x_axis * sx, turn.y_axis * sy, DVec3::Z * sz);
    let corner = base - (ex + ey) / 2.0;
    let face = |corner, edge_u, edge_v| Surface {
        corner,
        edge_u,
        edge_v,
    };
    vec![
        face(corner + ez, ex, ey),
        face(corner, ex, ez),
        face(corner + ey, ex, ez),
        face(corner, ey, ez),
        face(corner + ex, ey, ez),
    ]
}

/// A camera at a place, looking along a heading (degrees from +x), pitched up and rolled.
pub fn camera_at(place: [f64; 3], heading_deg: f64, pitch_deg: f64, roll_deg: f64) -> DAffine3 {
    let heading = DMat3::from_rotation_z(heading_deg.to_radians());
    let pitch = DMat3::from_rotation_y(-pitch_deg.to_radians());
    let roll = DMat3::from_rotation_x(roll_deg.to_radians());
    // Columns: image right, image down, forward, for a camera that looks along +x.
    let level = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
    DAffine3::from_mat3_translation(heading * pitch * roll * level, place.into())
}

/// A repeatable random number in [-1, 1).
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// About normally distributed, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() / 2.0
    }
}

/// Depth in millimetres with noise of `noise_at_1m_m` x z^2, as a structured-light sensor has.
pub fn depth_mm(
    room: &[Surface],
    camera: &Camera,
    pose: &DAffine3,
    noise_at_1m_m: f64,
    noise: &mut Noise,
) -> Vec<u16> {
    let pixels = (0..camera.height).flat_map(|v| (0..camera.width).map(move |u| (u, v)));
    pixels
        .map(|(u, v)| {
            let ray = camera.unproject(DVec2::new(u.into(), v.into()), 1.0);
            let depth_m = nearest(room, pose.translation, pose.transform_vector3(ray));
            match depth_m {
                Some(z) => ((z + noise.normal() * noise_at_1m_m * z * z) * 1000.0).round() as u16,
                None => 0,
            }
        })
        .collect()
}

fn nearest(room: &[Surface], origin: DVec3, ray: DVec3) -> Option<f64> {
    let hit = |surface: &Surface| {
        let normal = surface.edge_u.cross(surface.edge_v);
        let t = (surface.corner - origin).dot(normal) / ray.dot(normal);
        let at = origin + ray * t - surface.corner;
        let along = |edge: DVec3| at.dot(edge) / edge.length_squared();
        let inside = |share: f64| (0.0..=1.0).contains(&share);
        (t > 0.05 && inside(along(surface.edge_u)) && inside(along(surface.edge_v))).then_some(t)
    };
    room.iter().filter_map(hit).min_by(f64::total_cmp)
}
