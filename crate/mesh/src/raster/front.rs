//! What is in front at each pixel: the rasteriser behind depth maps.
//!
//! Corners are snapped to 1/256 pixel and edges are tested in whole numbers with the top-left rule, so that triangles
//! sharing an edge leave no gap between them and no pixel is drawn twice. Inverse depth is linear on the screen, which
//! makes the interpolation correct in perspective.

use super::Cull;
use crate::Mesh;
use crate::camera::Pinhole;
use glam::{Affine3A, Vec3, Vec3A};

/// Steps per pixel that corners are snapped to.
const SUBPIXEL: f32 = 256.0;
/// Corners further than this many pixels from the picture's origin are moved there, so that products fit 64 bits.
const FAR_AWAY: f32 = 2_097_152.0;
/// A corner on the screen: position in 1/256 pixel and inverse depth.
#[derive(Clone, Copy)]
struct Corner {
    x: i64,
    y: i64,
    inverse_depth: f32,
}

/// 1 / z of the nearest surface at each pixel, row-major, 0 where there is none: of all triangles of a valid mesh that are
/// at least partly beyond `near_m`.
pub(super) fn draw(
    mesh: &Mesh,
    camera: &Pinhole,
    camera_from_world: &Affine3A,
    cull: Cull,
    near_m: f32,
) -> Vec<f32> {
    let near_m = near_m.max(1e-6);
    let transform = |&p: &Vec3| camera_from_world.transform_point3a(p.into());
    let points: Vec<Vec3A> = mesh.positions.iter().map(transform).collect();
    let corners: Vec<Corner> = points.iter().map(|&p| corner(camera, p)).collect();
    let mut canvas = Canvas {
        width: i64::from(camera.width),
        height: i64::from(camera.height),
        mirrored: camera.fx * camera.fy < 0.0,
        cull,
        inverse_depth: vec![0.0; camera.pixels()],
    };
    for triangle in &mesh.triangles {
        let at = triangle.map(|index| index as usize);
        let beyond = at.map(|index| points[index].z >= near_m);
        match beyond {
            [false, false, false] => (),
            [true, true, true] => canvas.fill(at.map(|index| corners[index])),
            _ => {
                let polygon = clip(at.map(|index| points[index]), near_m);
                let polygon: Vec<Corner> = polygon.map(|p| corner(camera, p)).collect();
                for pair in polygon[1..].windows(2) {
                    canvas.fill([polygon[0], pair[0], pair[1]]);
                }
            }
        }
    }
    canvas.inverse_depth
}

fn corner(camera: &Pinhole, point: Vec3A) -> Corner {
    let pixel = camera.project(point.into());
    let snap = |value: f32| (value.clamp(-FAR_AWAY, FAR_AWAY) * SUBPIXEL).round_ties_even() as i64;
    Corner {
        x: snap(pixel.x),
        y: snap(pixel.y),
        inverse_depth: 1.0 / point.z,
    }
}

/// The part of a triangle with z >= `near_m`: three or four corners in the same order (Sutherland and Hodgman 1974).
fn clip(triangle: [Vec3A; 3], near_m: f32) -> impl Iterator<Item = Vec3A> {
    (0..3).flat_map(move |i| {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        let kept = (a.z >= near_m).then_some(a);
        // The same cut for both directions of an edge, so that neighbours meet.
        let (low, high) = if a.z < b.z { (a, b) } else { (b, a) };
        let crosses = low.z < near_m && high.z >= near_m;
        let cut = crosses.then(|| low + (high - low) * ((near_m - low.z) / (high.z - low.z)));
        kept.into_iter().chain(cut)
    })
}

struct Canvas {
    width: i64,
    height: i64,
    mirrored: bool,
    cull: Cull,
    inverse_depth: Vec<f32>,
}

impl Canvas {
    fn fill(&mut self, [a, b, c]: [Corner; 3]) {
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area == 0 {
            return;
        }
        // y runs down: what is counter-clockwise to the eye has a negative area here.
        let faces_camera = (area < 0) != self.mirrored;
        if self.cull == Cull::Back && !faces_camera {
            return;
        }
        let (b, c, area) = if area < 0 {
            (c, b, -area)
        } else {
            (b, c, area)
        };

        let step = SUBPIXEL as i64;
        let first = |low: i64| (low + step - 1).div_euclid(step).max(0);
        let last = |high: i64, size: i64| high.div_euclid(step).min(size - 1);
        let left = first(a.x.min(b.x).min(c.x));
        let right = last(a.x.max(b.x).max(c.x), self.width);
        let top = first(a.y.min(b.y).min(c.y));
        let bottom = last(a.y.max(b.y).max(c.y), self.height);
        if left > right || top > bottom {
            return;
        }

        let edges = [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)];
        // In f64: next to the near plane a corner's 1 / z is hundreds of times the pixel's.
        let [from, slope_b, slope_c] = [a, b, c].map(|corner| f64::from(corner.inverse_depth));
        let slope_b = (slope_b - from) / area as f64;
        let slope_c = (slope_c - from) / area as f64;
        let mut row = edges
            .each_ref()
            .map(|edge| edge.at(left * step, top * step));
        for y in top..=bottom {
            let mut value = row;
            let start = (y * self.width + left) as usize;
            let end = (y * self.width + right) as usize;
            for pixel in start..=end {
                // Negative as soon as one is.
                if value[0] | value[1] | value[2] >= 0 {
                    let weight_b = (value[1] - edges[1].bias) as f64;
                    let weight_c = (value[2] - edges[2].bias) as f64;
                    let inverse_depth = (from + weight_b * slope_b + weight_c * slope_c) as f32;
                    if inverse_depth > self.inverse_depth[pixel] {
                        self.inverse_depth[pixel] = inverse_depth;
                    }
                }
                for (value, edge) in value.iter_mut().zip(&edges) {
                    *value += edge.per_column;
                }
            }
            for (value, edge) in row.iter_mut().zip(&edges) {
                *value += edge.per_row;
            }
        }
    }
}

/// Twice the signed area between an edge and a point, at least 0 inside; -1 is added to edges that do not own their
/// points, so that exactly one of two neighbours does.
struct Edge {
    from: Corner,
    dx: i64,
    dy: i64,
    bias: i64,
    per_column: i64,
    per_row: i64,
}

impl Edge {
    fn new(from: Corner, to: Corner) -> Self {
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let top_or_left = dy < 0 || (dy == 0 && dx > 0);
        Self {
            from,
            dx,
            dy,
            bias: if top_or_left { 0 } else { -1 },
            per_column: -dy * SUBPIXEL as i64,
            per_row: dx * SUBPIXEL as i64,
        }
    }

    fn at(&self, x: i64, y: i64) -> i64 {
        self.dx * (y - self.from.y) - self.dy * (x - self.from.x) + self.bias
    }
}
