//! Which triangle is in front at each pixel of the picture.
//!
//! Unlike `mesh::raster`, whose depth maps are measured, this one is for being quick with soup in bricks: each triangle
//! is looked at once, without an index or a copy of its vertices.

use crate::camera::NEAR_M;
use crate::look::Viewport;
use glam::{DVec2, Mat4, Vec2, Vec3};
use mesh::soup::VERTEX_FLOATS;

/// What is seen at a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hit {
    /// 1 / view depth; 0 where there is nothing.
    pub inverse_depth: f32,
    /// Which of the drawn bricks.
    pub brick: u32,
    /// Which triangle of it.
    pub triangle: u32,
    /// Shares of the second and third corner, correct in perspective.
    pub second: f32,
    pub third: f32,
    /// It is seen from behind.
    pub back: bool,
}

#[derive(Default)]
pub(super) struct Canvas {
    width: usize,
    height: usize,
    hits: Vec<Hit>,
}

impl Canvas {
    pub(super) fn clear(&mut self, viewport: Viewport) {
        let size = viewport.size_px();
        (self.width, self.height) = (size.x as usize, size.y as usize);
        self.hits.clear();
        self.hits.resize(self.width * self.height, Hit::default());
    }

    /// All pixels, row by row.
    pub(super) fn hits(&self) -> impl Iterator<Item = Option<&Hit>> {
        self.hits
            .iter()
            .map(|hit| (hit.inverse_depth > 0.0).then_some(hit))
    }

    /// 1 / view depth at a pixel, 0 where nothing is; `None` outside of the picture.
    pub(super) fn inverse_depth(&self, x: i64, y: i64) -> Option<f32> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.width && y < self.height).then(|| self.hits[y * self.width + x].inverse_depth)
    }

    /// View depth in metres at a pixel, where there is surface.
    pub(super) fn depth_m(&self, at_px: Vec2) -> Option<f32> {
        let inverse = self.inverse_depth(at_px.x.floor() as i64, at_px.y.floor() as i64)?;
        (inverse > 0.0).then(|| inverse.recip())
    }

    /// Draws the triangles of one brick. Those that reach behind the near plane are left out: a voxel's triangle is
    /// hardly larger than the way to that plane.
    pub(super) fn draw(
        &mut self,
        brick: u32,
        soup: &[f32],
        clip_from_world: &Mat4,
        cull_back: bool,
    ) {
        let size = Vec2::new(self.width as f32, self.height as f32);
        for (triangle, corners) in soup.chunks_exact(3 * VERTEX_FLOATS).enumerate() {
            let clip: [_; 3] = std::array::from_fn(|i| {
                let position = Vec3::from_slice(&corners[i * VERTEX_FLOATS..]);
                *clip_from_world * position.extend(1.0)
            });
            if clip.iter().any(|p| p.w < NEAR_M) {
                continue;
            }
            let screen = clip.map(|p| to_screen(p.truncate().truncate() / p.w, size).as_dvec2());
            let inverse_depths = clip.map(|p| p.w.recip());
            self.fill(brick, triangle as u32, screen, inverse_depths, cull_back);
        }
    }

    fn fill(
        &mut self,
        brick: u32,
        triangle: u32,
        [a, b, c]: [DVec2; 3],
        inverse_depths: [f32; 3],
        cull_back: bool,
    ) {
        // y runs down: counter-clockwise to the eye is a negative area.
        let area = (b - a).perp_dot(c - a);
        let back = area > 0.0;
        if area == 0.0 || (back && cull_back) {
            return;
        }
        let per_area = area.recip();
        let low = a.min(b).min(c) - 0.5;
        let high = a.max(b).max(c) - 0.5;
        // Casts saturate, so corners far outside end at the picture's rim.
        let left = low.x.ceil() as usize;
        let top = low.y.ceil() as usize;
        let right = ((high.x.floor() + 1.0) as usize).min(self.width);
        let bottom = ((high.y.floor() + 1.0) as usize).min(self.height);
        for y in top..bottom {
            for x in left..right {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                // An edge's pixels may go to both neighbours: the nearer wins, and no gap can open.
                let shares = [
                    (c - b).perp_dot(p - b) * per_area,
                    (a - c).perp_dot(p - c) * per_area,
                    (b - a).perp_dot(p - a) * per_area,
                ];
                if shares.iter().any(|&share| share < 0.0) {
                    continue;
                }
                let [first, second, third]: [f32; 3] =
                    std::array::from_fn(|i| shares[i] as f32 * inverse_depths[i]);
                let inverse_depth = first + second + third;
                let hit = &mut self.hits[y * self.width + x];
                if inverse_depth > hit.inverse_depth {
                    *hit = Hit {
                        inverse_depth,
                        brick,
                        triangle,
                        second: second / inverse_depth,
                        third: third / inverse_depth,
                        back,
                    };
                }
            }
        }
    }
}

/// Normalised device coordinates to pixels from the top left.
pub(super) fn to_screen(ndc: Vec2, size_px: Vec2) -> Vec2 {
    (ndc * Vec2::new(0.5, -0.5) + 0.5) * size_px
}
