//! Which bricks a depth image needs: every brick within the truncation distance of a point that it measured.

use crate::{DepthView, lattice::Brick};
use glam::{IVec3, Vec3, Vec3A};

/// Pixels between two samples of the depth image. At 2 a chair leg of 2 cm is still hit from 5 m with a usual lens.
const STRIDE_PX: usize = 2;

/// Bricks within `truncation_m` (in the maximum norm) of the depth image's points up to `max_depth_m`, in x, y, z order.
pub(crate) fn bricks_near_surface(
    view: &DepthView<'_>,
    brick_size_m: f32,
    truncation_m: f32,
    max_depth_m: f32,
) -> Vec<Brick> {
    let points = surface_points(view, max_depth_m);
    let Some(marks) = Marks::around(&points, brick_size_m, truncation_m) else {
        return Vec::new();
    };
    marks.into_bricks(&points, brick_size_m, truncation_m)
}

fn surface_points(view: &DepthView<'_>, max_depth_m: f32) -> Vec<Vec3> {
    let camera = &view.depth_camera;
    let width = camera.width as usize;
    let mut points = Vec::with_capacity(view.depth_m.len() / (STRIDE_PX * STRIDE_PX));
    for row in (0..camera.height as usize).step_by(STRIDE_PX) {
        for column in (0..width).step_by(STRIDE_PX) {
            let z = view.depth_at(row * width + column);
            if z > 0.0 && z <= max_depth_m {
                let x = (column as f32 - camera.cx) / camera.fx;
                let y = (row as f32 - camera.cy) / camera.fy;
                let point = view
                    .world_from_camera
                    .transform_point3a(Vec3A::new(x * z, y * z, z));
                points.push(point.into());
            }
        }
    }
    points
}

/// One flag a brick of the box around the points: faster than hashing every point's bricks.
struct Marks {
    first: IVec3,
    size: IVec3,
    marked: Vec<bool>,
}

impl Marks {
    fn around(points: &[Vec3], brick_size_m: f32, margin_m: f32) -> Option<Self> {
        let mut points = points.iter().copied();
        let start = points.next()?;
        let (low, high) = points.fold((start, start), |(low, high), p| (low.min(p), high.max(p)));
        let first = ((low - margin_m) / brick_size_m).floor().as_ivec3();
        let last = ((high + margin_m) / brick_size_m).floor().as_ivec3();
        let size = last - first + 1;
        let count = size.x as usize * size.y as usize * size.z as usize;
        Some(Self {
            first,
            size,
            marked: vec![false; count],
        })
    }

    fn into_bricks(mut self, points: &[Vec3], brick_size_m: f32, margin_m: f32) -> Vec<Brick> {
        for &point in points {
            let low = ((point - margin_m) / brick_size_m).floor().as_ivec3() - self.first;
            let high = ((point + margin_m) / brick_size_m).floor().as_ivec3() - self.first;
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    let row = (z * self.size.y + y) * self.size.x;
                    for x in low.x..=high.x {
                        self.marked[(row + x) as usize] = true;
                    }
                }
            }
        }
        let (first, size) = (self.first, self.size);
        let position = move |index: i32| {
            first
                + IVec3::new(
                    index % size.x,
                    index / size.x % size.y,
                    index / (size.x * size.y),
                )
        };
        let marked = self
            .marked
            .iter()
            .enumerate()
            .filter(|(_, marked)| **marked);
        marked.map(|(index, _)| position(index as i32)).collect()
    }
}
