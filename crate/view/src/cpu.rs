//! The same pictures without a GPU: for machines without WebGPU, and for tests.
//!
//! Two steps: which triangle is in front at each pixel ([`raster`]), then the surface shader's formulas once a pixel.
//! Only multisampling is missing.

mod raster;
mod strokes;
mod surface;

use crate::look::{Look, Viewport, depth_range_m};
use crate::{Frusta, OrbitCamera, bounds, lines};
use glam::{Vec2, Vec3};
use mesh::Bounds;
use mesh::soup::VERTEX_FLOATS;
use raster::Canvas;
use std::collections::BTreeMap;
use surface::Shader;

/// Keeps bricks in main memory and draws them into RGBA bytes.
pub struct CpuPainter {
    brick_size_m: f32,
    bricks: BTreeMap<[i32; 3], Vec<f32>>,
    canvas: Canvas,
    rgba: Vec<u8>,
    /// Camera of the last picture: what [`CpuPainter::pick`] asks about.
    last: Option<(Viewport, OrbitCamera)>,
}

impl CpuPainter {
    /// No bricks yet; they are `brick_size_m` metres a side.
    pub fn new(brick_size_m: f32) -> Self {
        Self {
            brick_size_m,
            bricks: BTreeMap::new(),
            canvas: Canvas::default(),
            rgba: Vec::new(),
            last: None,
        }
    }

    /// The new version of `brick`: triangle soup ([`mesh::soup`]); what is no whole triangle is ignored, none removes
    /// the brick.
    pub fn insert(&mut self, brick: [i32; 3], vertices: &[f32]) {
        let whole = vertices.len() - vertices.len() % (3 * VERTEX_FLOATS);
        if whole == 0 {
            self.bricks.remove(&brick);
        } else {
            self.bricks.insert(brick, vertices[..whole].to_vec());
        }
    }

    /// Removes all bricks.
    pub fn clear(&mut self) {
        self.bricks.clear();
    }

    /// Number of bricks with a surface.
    pub fn brick_count(&self) -> usize {
        self.bricks.len()
    }

    /// Triangles held.
    pub fn triangle_count(&self) -> u64 {
        let floats: usize = self.bricks.values().map(Vec::len).sum();
        (floats / (3 * VERTEX_FLOATS)) as u64
    }

    /// Points around the surface for [`crate::Controls::set_outline`], a scan's strays left out; empty when it is.
    pub fn outline(&self) -> Vec<Vec3> {
        bounds::outline(self.bricks.keys(), self.brick_size_m)
    }

    /// The box around all bricks, exact to one brick; `None` when empty.
    pub fn bounds(&self) -> Option<Bounds> {
        bounds::of_bricks(self.bricks.keys(), self.brick_size_m)
    }

    /// Draws one picture: RGBA bytes (sRGB, opaque), row-major `[height, width, 4]`.
    pub fn paint(
        &mut self,
        viewport: Viewport,
        camera: &OrbitCamera,
        frusta: &Frusta,
        look: &Look,
    ) -> &[u8] {
        let clip_from_world = viewport.clip_from_world(camera);
        let seen: Vec<&[f32]> = self
            .bricks
            .iter()
            .filter(|(brick, _)| {
                let reach = bounds::reach_of_brick(**brick, self.brick_size_m);
                bounds::may_be_seen(&reach, &clip_from_world)
            })
            .map(|(_, soup)| soup.as_slice())
            .collect();
        self.canvas.clear(viewport);
        for (index, soup) in seen.iter().enumerate() {
            let brick = index as u32;
            self.canvas
                .draw(brick, soup, &clip_from_world, look.cull_back);
        }

        let extent = self.bounds();
        let shader = Shader::new(viewport, camera, look, depth_range_m(camera, extent));
        self.rgba.clear();
        for hit in self.canvas.hits() {
            let [r, g, b] = hit.map_or(look.theme.background, |hit| {
                shader.color(hit, seen[hit.brick as usize])
            });
            self.rgba.extend([r, g, b, 255]);
        }
        for line in lines::of_scene(extent, frusta, look) {
            strokes::draw(
                &mut self.rgba,
                &self.canvas,
                &clip_from_world,
                viewport,
                &line,
            );
        }
        self.last = Some((viewport, *camera));
        &self.rgba
    }

    /// The surface point (metres, world) at a pixel of the last picture, if there is surface.
    pub fn pick(&self, at_px: Vec2) -> Option<Vec3> {
        let (viewport, camera) = self.last.as_ref()?;
        let depth_m = self.canvas.depth_m(at_px)?;
        let ray = camera.ray(viewport.ndc(at_px), viewport.aspect());
        Some(ray.origin_m + ray.direction * (depth_m / ray.direction.dot(camera.axes().2)))
    }
}
