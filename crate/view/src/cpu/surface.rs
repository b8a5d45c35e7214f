//! The surface shader once more, in Rust: formula for formula what surface.wgsl does.

use super::raster::{Hit, to_screen};
use crate::OrbitCamera;
use crate::look::{Look, MANY_VIEWS, RAMP, Shading, UNKNOWN, Viewport, unit};
use glam::{FloatExt, Mat4, Vec2, Vec3};
use mesh::soup::{Evidence, VERTEX_FLOATS, decode};

pub(super) struct Shader<'a> {
    look: &'a Look,
    eye_m: Vec3,
    clip_from_world: Mat4,
    size_px: Vec2,
    scale: f32,
    depth_range_m: [f32; 2],
}

impl<'a> Shader<'a> {
    pub(super) fn new(
        viewport: Viewport,
        camera: &OrbitCamera,
        look: &'a Look,
        depth_range_m: [f32; 2],
    ) -> Self {
        Self {
            look,
            eye_m: camera.eye_m(),
            clip_from_world: viewport.clip_from_world(camera),
            size_px: viewport.size_px(),
            scale: viewport.scale,
            depth_range_m,
        }
    }

    /// The sRGB colour of what was hit in the brick `soup`.
    pub(super) fn color(&self, hit: &Hit, soup: &[f32]) -> [u8; 3] {
        let start = hit.triangle as usize * 3 * VERTEX_FLOATS;
        let (corners, _) = soup[start..].as_chunks::<VERTEX_FLOATS>();
        let evidence = [0, 1, 2].map(|i| Evidence::of(&corners[i]));
        let corners = [0, 1, 2].map(|i| decode(&corners[i]));
        let shares = Vec3::new(1.0 - hit.second - hit.third, hit.second, hit.third);
        let mix = |of: fn(&(Vec3, Vec3, [u8; 3])) -> Vec3| {
            of(&corners[0]) * shares.x + of(&corners[1]) * shares.y + of(&corners[2]) * shares.z
        };
        let side = if hit.back { -1.0 } else { 1.0 };
        let normal = mix(|corner| corner.1).normalize_or_zero() * side;
        let color = match self.look.shading {
            Shading::Normal => normal * 0.5 + 0.5,
            Shading::Depth => self.of_depth(hit.inverse_depth.recip()),
            shading => {
                let position = mix(|corner| corner.0);
                let to_eye = (self.eye_m - position).normalize_or_zero();
                let shade = light(normal, to_eye).powf(1.0 / 2.2);
                let lit = mix(|corner| unit(corner.2)) * shade;
                if shading == Shading::Color {
                    lit
                } else if shading != Shading::Wireframe {
                    self.of_evidence(evidence, shares) * 1.0.lerp(shade, 0.4)
                } else {
                    let theme = &self.look.theme;
                    let edge = self.edge(shares, corners.map(|corner| corner.0));
                    lit.lerp(unit(theme.background), 0.25)
                        .lerp(unit(theme.wire), 0.6 * edge)
                }
            }
        };
        (color * 255.0).round().to_array().map(|c| c as u8)
    }

    fn of_depth(&self, depth_m: f32) -> Vec3 {
        let [near, far] = self.depth_range_m;
        ramp((far - depth_m) / (far - near))
    }

    fn of_evidence(&self, corners: [Evidence; 3], shares: Vec3) -> Vec3 {
        let mix = |of: fn(Evidence) -> f32| Vec3::from_array(corners.map(of)).dot(shares);
        let (known, share) = if self.look.shading == Shading::Views {
            let views = mix(|corner| corner.views() as f32);
            (views, views.max(1.0).log2() / MANY_VIEWS.log2())
        } else {
            let known = mix(|corner| f32::from(corner.confidence().is_some()));
            let confidence = mix(|corner| corner.confidence().unwrap_or(0.0));
            (known, confidence / known.max(0.5))
        };
        let known = known >= 0.5;
        if known { ramp(share) } else { unit(UNKNOWN) }
    }

    /// How much of an edge the pixel shows. The change of a share over one pixel is the same all over the triangle.
    fn edge(&self, shares: Vec3, corners_m: [Vec3; 3]) -> f32 {
        let [a, b, c] = corners_m.map(|p| {
            let ndc = self.clip_from_world.project_point3(p).truncate();
            to_screen(ndc, self.size_px)
        });
        let area = (b - a).perp_dot(c - a).abs();
        let per_px = [c - b, a - c, b - a].map(|side| side.abs().element_sum() / area);
        let line = (0..3)
            .map(|i| 1.0 - smoothstep(per_px[i] * 1.3 * self.scale, shares[i]))
            .fold(0.0, f32::max);
        let crowd = per_px.into_iter().fold(0.0, f32::max);
        line.lerp(0.35, smoothstep(0.7 - 0.2, crowd - 0.2))
    }
}

fn ramp(share: f32) -> Vec3 {
    let last = RAMP.len() - 1;
    let t = share.clamp(0.0, 1.0) * last as f32;
    let stop = (t as usize).min(last - 1);
    unit(RAMP[stop]).lerp(unit(RAMP[stop + 1]), t - stop as f32)
}

fn light(normal: Vec3, to_eye: Vec3) -> f32 {
    let head = normal.dot(to_eye).max(0.0);
    0.3 + 0.45 * head + 0.25 * (normal.z * 0.5 + 0.5)
}

/// WGSL's smoothstep from 0 to `end`.
fn smoothstep(end: f32, x: f32) -> f32 {
    let t = x.remap(0.0, end, 0.0, 1.0).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
