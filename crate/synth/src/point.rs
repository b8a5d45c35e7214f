//! What a ray from the camera meets, and edges between surfaces drawn softer than one ray a pixel would.

use glam::Vec3;

use crate::path::View;

/// What the first ray of a pixel found.
#[derive(Clone, Copy, Default)]
pub(crate) struct Point {
    pub solid: u32,
    /// Distance along the unit ray; 0 where it met nothing.
    pub t: f32,
    pub at: Vec3,
    pub normal: Vec3,
    /// Linear RGB of the surface.
    pub albedo: Vec3,
    /// Unit direction from the camera.
    pub dir: Vec3,
}

impl Point {
    fn belongs_with(&self, other: &Self) -> bool {
        self.solid == other.solid && self.normal.dot(other.normal) > 0.8
    }
}

/// Casts three more rays where neighbours belong to different surfaces and their colours `differ`. `look` gives what a ray
/// in a direction finds; `shade` gives its colour with the light of the pixel of that number, one next to it that belongs
/// to what the ray found.
pub(crate) fn soften_edges(
    view: &View,
    points: &[Point],
    colors: &mut [Vec3],
    differ: impl Fn(Vec3, Vec3) -> bool,
    look: impl Fn(Vec3) -> Point,
    shade: impl Fn(&Point, usize) -> Vec3,
) {
    let width = view.camera.width as usize;
    let sharp = colors.to_vec();
    for i in 0..points.len() {
        let (u, v) = (i % width, i / width);
        let mut around = [i; 4];
        for (slot, (k, inside)) in around.iter_mut().zip([
            (i.wrapping_sub(1), u > 0),
            (i + 1, u + 1 < width),
            (i.wrapping_sub(width), v > 0),
            (i + width, i + width < points.len()),
        ]) {
            if inside {
                *slot = k;
            }
        }
        let edge = |k: &usize| !points[*k].belongs_with(&points[i]) && differ(sharp[i], sharp[*k]);
        if !around.iter().any(edge) {
            continue;
        }
        let mut sum = sharp[i];
        for (dx, dy) in [(0.375, 0.125), (-0.125, 0.375), (-0.25, -0.375)] {
            let point = look(view.ray(u as f32 + dx, v as f32 + dy).normalize());
            let like = |k: &usize| points[*k].belongs_with(&point);
            let source = std::iter::once(i).chain(around).find(like).unwrap_or(i);
            sum += shade(&point, source);
        }
        colors[i] = sum * 0.25;
    }
}
