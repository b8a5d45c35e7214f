//! Pictures of a mesh without a GPU: the viewer's last resort and the command line's screenshot.

use super::Cull;
use super::scene::{EMPTY, Scene, draw};
use crate::Mesh;
use crate::camera::Pinhole;
use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};

/// Surfaces nearer than this are cut away.
const NEAR_M: f32 = 0.01;
/// The surface without vertex colours.
const GREY: Vec3 = Vec3::splat(208.0);
/// Share of the light that reaches a grey surface seen at a grazing angle.
const GREY_AMBIENT: f32 = 0.35;
/// The same for vertex colours, which hold the light of the room already.
const COLOR_AMBIENT: f32 = 0.75;
/// What is left of the light on the back of a surface.
const BACK: f32 = 0.55;
/// Half the width of a line.
const LINE_PX: f32 = 0.7;
/// Triangles from this height on get full lines.
const OPEN_PX: f32 = 8.0;
/// Near to far, sRGB.
const DEPTH_RAMP: [Vec3; 5] = [
    Vec3::new(253.0, 231.0, 37.0),
    Vec3::new(94.0, 201.0, 98.0),
    Vec3::new(33.0, 145.0, 140.0),
    Vec3::new(59.0, 82.0, 139.0),
    Vec3::new(68.0, 1.0, 84.0),
];

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Vertex colours (grey without them), lit from the camera.
    Color,
    /// World normals: x, y, z from -1 to 1 as red, green, blue.
    Normal,
    /// z-depth, from the nearest (yellow) to the farthest point in the picture (violet).
    Depth,
    /// Triangle edges over the lit surface.
    Wireframe,
}

/// A picture of `mesh`: RGBA bytes (sRGB), row-major `[height, width, 4]`, with `background` where nothing is seen.
/// Both sides of triangles are drawn, backs darker. The mesh must be valid ([`Mesh::validate`]).
pub fn shaded(
    mesh: &Mesh,
    camera: &Pinhole,
    camera_from_world: &Affine3A,
    style: Style,
    background: [u8; 4],
) -> Vec<u8> {
    let scene = draw(mesh, camera, camera_from_world, Cull::None, NEAR_M);
    let range = depth_range(&scene);
    let turn = &camera_from_world.matrix3;
    let mut picture = Vec::with_capacity(camera.pixels() * 4);
    for y in 0..camera.height {
        for x in 0..camera.width {
            let pixel = (y * camera.width + x) as usize;
            let id = scene.triangle[pixel];
            if id == EMPTY {
                picture.extend(background);
                continue;
            }
            let ray = camera.ray(Vec2::new(x as f32, y as f32)).into();
            let hit = Hit::new(mesh, &scene, id, ray);
            let color = match style {
                Style::Depth => ramp(1.0 / scene.inverse_depth[pixel], range),
                Style::Normal => (hit.normal() + 1.0) * 127.5,
                Style::Wireframe => GREY * hit.light(GREY_AMBIENT, turn) * hit.ink(camera),
                Style::Color if mesh.colors.is_empty() => GREY * hit.light(GREY_AMBIENT, turn),
                Style::Color => hit.color() * hit.light(COLOR_AMBIENT, turn),
            };
            picture.extend(color.to_array().map(|channel| channel.round() as u8));
            picture.push(255);
        }
    }
    picture
}

/// Where the ray of a pixel meets its triangle.
struct Hit<'a> {
    mesh: &'a Mesh,
    triangle: [u32; 3],
    /// Direction of the ray in camera coordinates, z = 1.
    ray: Vec3A,
    /// Two edges from the first corner, in camera coordinates.
    edges: [Vec3A; 2],
    /// Per corner, the plane through the eye and the opposite edge; its product with the ray is proportional to the
    /// corner's weight (Moeller and Trumbore 1997).
    planes: [Vec3A; 3],
    /// Barycentric coordinates.
    weights: Vec3,
}

impl<'a> Hit<'a> {
    fn new(mesh: &'a Mesh, scene: &Scene, id: u32, ray: Vec3A) -> Self {
        let triangle = mesh.triangles[id as usize];
        let [a, b, c] = triangle.map(|index| scene.points[index as usize]);
        let edges = [b - a, c - a];
        let plane_b = a.cross(edges[1]);
        let plane_c = edges[0].cross(a);
        let plane_a = edges[1].cross(edges[0]) - plane_b - plane_c;
        let planes = [plane_a, plane_b, plane_c];
        let weights = Vec3::from_array(planes.map(|plane| plane.dot(ray)));
        // The pixel may lie outside by the rounding of corners; a triangle seen edge-on has no inside.
        let weights = (weights * weights.element_sum().signum()).max(Vec3::ZERO);
        let sum = weights.element_sum();
        let weights = if sum > 0.0 {
            weights / sum
        } else {
            Vec3::splat(1.0 / 3.0)
        };
        Self {
            mesh,
            triangle,
            ray,
            edges,
            planes,
            weights,
        }
    }

    /// The weighted mean of a vertex attribute.
    fn blend(&self, attribute: impl Fn(usize) -> Vec3) -> Vec3 {
        let [a, b, c] = self.triangle.map(|index| attribute(index as usize));
        a * self.weights.x + b * self.weights.y + c * self.weights.z
    }

    /// sRGB, 0 to 255.
    fn color(&self) -> Vec3 {
        self.blend(|index| Vec3::from_array(self.mesh.colors[index].map(f32::from)))
    }

    /// The normal in world coordinates: the vertices', or the triangle's own where they say nothing.
    fn normal(&self) -> Vec3 {
        let smooth = match self.mesh.normals.is_empty() {
            true => Vec3::ZERO,
            false => self.blend(|index| self.mesh.normals[index]),
        };
        smooth.try_normalize().unwrap_or_else(|| {
            let [a, b, c] = self.mesh.corners(self.triangle);
            (b - a).cross(c - a).normalize_or_zero()
        })
    }

    /// How much of a lamp at the camera comes back, 0 to 1; `turn` rotates world to camera.
    fn light(&self, ambient: f32, turn: &Mat3A) -> f32 {
        let cosine = (*turn * Vec3A::from(self.normal()))
            .dot(self.ray.normalize())
            .abs();
        let from_behind = self.edges[0].cross(self.edges[1]).dot(self.ray) > 0.0;
        let side = if from_behind { BACK } else { 1.0 };
        side * (ambient + (1.0 - ambient) * cosine.min(1.0))
    }

    /// 1 away from the triangle's edges, dark on them, with a soft step. Lines pale on triangles of a few pixels, which
    /// they would fill.
    fn ink(&self, camera: &Pinhole) -> f32 {
        let products = self.planes.map(|plane| plane.dot(self.ray).abs());
        let whole: f32 = products.iter().sum();
        let (mut distance_px, mut height_px) = (f32::INFINITY, f32::INFINITY);
        for (plane, product) in self.planes.iter().zip(products) {
            let per_pixel = (plane.x / camera.fx).hypot(plane.y / camera.fy);
            let pixels = 1.0 / per_pixel.max(f32::MIN_POSITIVE);
            distance_px = distance_px.min(product * pixels);
            height_px = height_px.min(whole * pixels);
        }
        let line = (LINE_PX + 0.5 - distance_px).clamp(0.0, 1.0);
        let strength = (height_px / OPEN_PX).min(1.0);
        1.0 - 0.85 * line * strength
    }
}

/// Nearest and farthest z-depth in the picture.
fn depth_range(scene: &Scene) -> (f32, f32) {
    let seen = scene.inverse_depth.iter().filter(|&&value| value > 0.0);
    seen.fold((f32::INFINITY, 0.0), |(near, far), value| {
        (near.min(1.0 / value), far.max(1.0 / value))
    })
}

fn ramp(depth: f32, (near, far): (f32, f32)) -> Vec3 {
    let steps = DEPTH_RAMP.len() - 1;
    let at = (depth - near) / (far - near).max(1e-6) * steps as f32;
    let step = (at as usize).min(steps - 1);
    DEPTH_RAMP[step].lerp(DEPTH_RAMP[step + 1], (at - step as f32).clamp(0.0, 1.0))
}
