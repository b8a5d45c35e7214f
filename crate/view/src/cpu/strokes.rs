//! Lines over the surface, hidden by it where it is nearer, with a soft rim instead of multisampling.

use super::raster::{Canvas, to_screen};
use crate::camera::NEAR_M;
use crate::lines::Line;
use crate::look::Viewport;
use glam::{Mat4, Vec2, Vec3, Vec4};

pub(super) fn draw(
    rgba: &mut [u8],
    canvas: &Canvas,
    clip_from_world: &Mat4,
    viewport: Viewport,
    line: &Line,
) {
    let ends = [line.from_m, line.to_m].map(|p| *clip_from_world * Vec3::from(p).extend(1.0));
    let colors = [line.from_rgba, line.to_rgba].map(|c| Vec4::from_array(c.map(f32::from)));
    let Some(ends) = in_front(ends) else {
        return;
    };
    let size = viewport.size_px();
    let [from, to] = ends.map(|p| to_screen(p.truncate().truncate() / p.w, size));
    let inverse_depths = ends.map(|p| p.w.recip());
    let half_width = line.width_px * viewport.scale * 0.5;
    let way = to - from;
    let length = way.length().max(1e-6);

    // Walk along the longer axis; the other one is at most as steep, so the rim spans sqrt 2.
    let (major, minor) = if way.x.abs() > way.y.abs() {
        (Vec2::X, Vec2::Y)
    } else {
        (Vec2::Y, Vec2::X)
    };
    let (low, high) = (from.min(to).dot(major), from.max(to).dot(major));
    let reach = (half_width + 0.5) * std::f32::consts::SQRT_2;
    let first = low.max(0.0).floor() as i64;
    let last = high.min(size.dot(major)).ceil() as i64;
    for along in first..last {
        let t = (along as f32 + 0.5 - from.dot(major)) / way.dot(major);
        let t = t.clamp(0.0, 1.0);
        let middle = (from + way * t).dot(minor);
        let inverse_depth = inverse_depths[0] + (inverse_depths[1] - inverse_depths[0]) * t;
        let color = colors[0].lerp(colors[1], t);
        for aside in (middle - reach).floor() as i64..=(middle + reach).floor() as i64 {
            let (x, y) = if major == Vec2::X {
                (along, aside)
            } else {
                (aside, along)
            };
            let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let distance = way.perp_dot(center - from).abs() / length;
            let cover = (half_width + 0.5 - distance).clamp(0.0, 1.0);
            let open = canvas
                .inverse_depth(x, y)
                .is_some_and(|d| inverse_depth > d);
            if open && cover > 0.0 {
                let at = (y as usize * size.x as usize + x as usize) * 4;
                blend(&mut rgba[at..at + 3], color, cover);
            }
        }
    }
}

/// The part of a line (clip space) ahead of the near plane.
fn in_front([from, to]: [Vec4; 2]) -> Option<[Vec4; 2]> {
    let cut = || from.lerp(to, (NEAR_M - from.w) / (to.w - from.w));
    match (from.w >= NEAR_M, to.w >= NEAR_M) {
        (true, true) => Some([from, to]),
        (false, true) => Some([cut(), to]),
        (true, false) => Some([from, cut()]),
        (false, false) => None,
    }
}

fn blend(rgb: &mut [u8], color: Vec4, cover: f32) {
    let alpha = color.w / 255.0 * cover;
    for (channel, over) in rgb.iter_mut().zip(color.to_array()) {
        *channel = (f32::from(*channel) * (1.0 - alpha) + over * alpha).round() as u8;
    }
}
