//! Where the scan's depth camera looked: a prediction is not blamed for surfaces that nobody measured.

use crate::Bounds;
use crate::camera::Pinhole;
use glam::{Affine3A, DVec3, IVec3, Mat3A, Vec2, Vec3, Vec3A};
use std::collections::HashMap;

/// Trilinear samples from here on count as observed, as in TransformerFusion's evaluation.
const OBSERVED: f64 = 1.0 - 1e-5;
/// Lattice points along each edge of a brick.
const EDGE: IVec3 = IVec3::splat(16);

/// A lattice over a scene; each point of it was observed by some depth frame, or not.
///
/// Kept in bricks where something was observed, so that one stray vertex far away, which makes the bounds huge, costs
/// nothing.
pub struct Visibility {
    min: DVec3,
    voxel_m: f64,
    /// The lattice point opposite to `min`.
    last: IVec3,
    /// A flag per point, x fastest, by the brick's place.
    bricks: HashMap<IVec3, Vec<bool>>,
}

impl Visibility {
    /// Builds the lattice over `bounds` with spacing `voxel_m`.
    ///
    /// A frame is a camera, its pose (world to camera) and its depth in metres, row-major, 0 = no data. It observes the
    /// lattice points that fall on a pixel with depth and lie in front of the measured surface or up to `behind_m`
    /// behind it. Frames whose depth has another size than their camera are passed over. Time grows with the cube of a
    /// frame's largest depth.
    pub fn from_depth(
        frames: impl Iterator<Item = (Pinhole, Affine3A, Vec<f32>)>,
        bounds: Bounds,
        voxel_m: f32,
        behind_m: f32,
    ) -> Self {
        let cells = (bounds.size() / voxel_m).ceil().max(Vec3::ONE);
        let mut visibility = Self {
            min: bounds.min.as_dvec3(),
            voxel_m: f64::from(voxel_m),
            last: cells.as_ivec3(),
            bricks: HashMap::new(),
        };
        for (camera, camera_from_world, depth_m) in frames {
            if depth_m.len() == camera.pixels() {
                visibility.observe(&DepthFrame {
                    camera,
                    camera_from_world,
                    depth_m,
                    behind_m,
                });
            }
        }
        visibility
    }

    fn observe(&mut self, frame: &DepthFrame) {
        let Some(reach) = frame.reach() else {
            return;
        };
        let on_lattice = |corner: Vec3| (corner.as_dvec3() - self.min) / self.voxel_m;
        let first = on_lattice(reach.min).floor().as_ivec3().max(IVec3::ZERO);
        let last = on_lattice(reach.max).ceil().as_ivec3().min(self.last);
        let turn = frame.camera_from_world.matrix3;
        let steps = turn * Mat3A::from_diagonal(Vec3::splat(self.voxel_m as f32));
        for place in all_between(first.div_euclid(EDGE), last.div_euclid(EDGE)) {
            let start = place * EDGE;
            let origin = (self.min + start.as_dvec3() * self.voxel_m).as_vec3a();
            let origin = frame.camera_from_world.transform_point3a(origin);
            let inside = (EDGE - 1).min(self.last - start);
            let brick = self.bricks.remove(&place);
            let mut brick = brick.unwrap_or_else(|| vec![false; EDGE.element_product() as usize]);
            for at in all_between(IVec3::ZERO, inside) {
                let flag = &mut brick[flag_index(at)];
                *flag = *flag || frame.observes(origin + steps * at.as_vec3a());
            }
            if brick.contains(&true) {
                self.bricks.insert(place, brick);
            }
        }
    }

    /// Whether every lattice point around `point` was observed; outside the lattice nothing is.
    pub fn visible(&self, point: Vec3) -> bool {
        let at = (point.as_dvec3() - self.min) / self.voxel_m;
        let last = self.last.as_dvec3();
        if !(at.cmpge(DVec3::ZERO).all() && at.cmple(last).all()) {
            return false;
        }
        let cell = at.floor().min(last - 1.0);
        let part = at - cell;
        let corners = all_between(IVec3::ZERO, IVec3::ONE);
        let observed = corners.filter(|&corner| self.observed(cell.as_ivec3() + corner));
        let weights = observed.map(|corner| {
            let high = corner.cmpeq(IVec3::ONE);
            DVec3::select(high, part, 1.0 - part).element_product()
        });
        weights.sum::<f64>() >= OBSERVED
    }

    fn observed(&self, point: IVec3) -> bool {
        let brick = self.bricks.get(&point.div_euclid(EDGE));
        brick.is_some_and(|brick| brick[flag_index(point.rem_euclid(EDGE))])
    }

    /// How many lattice points were observed.
    pub fn observed_points(&self) -> usize {
        let flags = self.bricks.values().flatten();
        flags.filter(|&&observed| observed).count()
    }
}

/// A depth map and where it was taken.
struct DepthFrame {
    camera: Pinhole,
    camera_from_world: Affine3A,
    depth_m: Vec<f32>,
    behind_m: f32,
}

impl DepthFrame {
    /// The box around all that the frame can observe; `None` without depth.
    fn reach(&self) -> Option<Bounds> {
        let farthest = self.depth_m.iter().copied().fold(0.0, f32::max);
        if farthest <= 0.0 {
            return None;
        }
        let world_from_camera = self.camera_from_world.inverse();
        let right = self.camera.width as f32 - 0.5;
        let bottom = self.camera.height as f32 - 0.5;
        let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)];
        let mut points = vec![Vec3::from(world_from_camera.translation)];
        points.extend(corners.map(|(x, y)| {
            let ray = self.camera.ray(Vec2::new(x, y));
            world_from_camera.transform_point3(ray * (farthest + self.behind_m))
        }));
        Bounds::of(&points)
    }

    /// Whether `point`, in camera coordinates, is seen or just behind what is seen.
    fn observes(&self, point: Vec3A) -> bool {
        if point.z <= 0.0 {
            return false;
        }
        let pixel = self.camera.project(point.into()).round();
        let inside = pixel.x >= 0.0
            && pixel.y >= 0.0
            && pixel.x < self.camera.width as f32
            && pixel.y < self.camera.height as f32;
        if !inside {
            return false;
        }
        let depth = self.depth_m[pixel.y as usize * self.camera.width as usize + pixel.x as usize];
        depth > 0.0 && point.z <= depth + self.behind_m
    }
}

/// All whole points of a box, corners included, x fastest.
fn all_between(first: IVec3, last: IVec3) -> impl Iterator<Item = IVec3> {
    let rows = move |z| (first.y..=last.y).map(move |y| (y, z));
    let row = move |(y, z)| (first.x..=last.x).map(move |x| IVec3::new(x, y, z));
    (first.z..=last.z).flat_map(rows).flat_map(row)
}

fn flag_index(at: IVec3) -> usize {
    ((at.z * EDGE.y + at.y) * EDGE.x + at.x) as usize
}
