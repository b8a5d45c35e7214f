//! The room's surface as a triangle mesh: ground truth for whatever is reconstructed from its pictures.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use mesh::Mesh;

use crate::palette::to_srgb;
use crate::room::Room;
use crate::shell::WALL_M;
use crate::solid::{Shape, Solid};

/// Longest side of a cell before it is cut in two triangles.
const CELL_M: f32 = 0.04;
/// Cells around a quarter of a rounded edge.
const ARC_CELLS: usize = 3;
/// A surface is open if there is free space this far in front of it.
const OPEN_M: f32 = 1e-3;

/// A point of a patch and the outward normal there, in the solid's own axes.
type Spot = (Vec3, Vec3);

impl Room {
    /// The surface that free space touches, in cells of at most 4 cm, with unlit colours. Where one thing stands on
    /// another the cut is as coarse as the cells.
    pub fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        for solid in &self.scene.solids {
            match solid.shape {
                Shape::Block { half_m, round_m } => {
                    self.add_block(&mut mesh, solid, half_m, round_m)
                }
                Shape::Drum {
                    bottom_m,
                    top_m,
                    half_m,
                    round_m,
                } => self.add_drum(&mut mesh, solid, [bottom_m, top_m, half_m, round_m]),
            }
        }
        mesh
    }

    /// Six faces of the box, each pulled onto the rounding.
    fn add_block(&self, mesh: &mut Mesh, solid: &Solid, half: Vec3, round: f32) {
        for face in 0..6 {
            let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let (us, vs) = (lines(half[a], round), lines(half[b], round));
            self.add_patch(mesh, solid, us.len(), vs.len(), |i, j| {
                let mut p = Vec3::ZERO;
                p[axis] = sign * (half[axis] + round);
                p[a] = us[i];
                p[b] = vs[j];
                let mut normal = Vec3::ZERO;
                normal[axis] = sign;
                if round > 0.0 {
                    let core = p.clamp(-half, half);
                    normal = (p - core).normalize();
                    p = core + normal * round;
                }
                (p, normal)
            });
        }
    }

    /// Bands of the outline turned about the axis.
    fn add_drum(&self, mesh: &mut Mesh, solid: &Solid, [bottom, top, half, round]: [f32; 4]) {
        let widest = bottom.max(top) + round;
        let around = ((TAU * widest / CELL_M) as usize).clamp(12, 64);
        for band in outline(bottom, top, half, round) {
            let along = ((band[1].0 - band[0].0).length() / CELL_M) as usize + 1;
            self.add_patch(mesh, solid, around + 1, along + 1, |i, j| {
                let share = j as f32 / along as f32;
                let p = band[0].0.lerp(band[1].0, share);
                let n = band[0].1.lerp(band[1].1, share).normalize();
                let (sin, cos) = libm::sincosf(TAU * i as f32 / around as f32);
                let turn = |v: Vec2| Vec3::new(v.x * cos, v.x * sin, v.y);
                (turn(p), turn(n))
            });
        }
    }

    /// A grid of `us` by `vs` points; cells that face something else than free space are left out.
    fn add_patch(
        &self,
        mesh: &mut Mesh,
        solid: &Solid,
        us: usize,
        vs: usize,
        spot: impl Fn(usize, usize) -> Spot,
    ) {
        const UNUSED: u32 = u32::MAX;
        let half = solid.shape.half_size();
        let spots: Vec<Spot> = (0..us * vs).map(|k| spot(k % us, k / us)).collect();
        let mut index = vec![UNUSED; spots.len()];
        for j in 0..vs - 1 {
            for i in 0..us - 1 {
                let k = j * us + i;
                for mut corners in [[k, k + 1, k + us], [k + 1, k + us + 1, k + us]] {
                    let [a, b, c] =
                        corners.map(|corner| solid.center + solid.axes * spots[corner].0);
                    let facing = (b - a).cross(c - a);
                    if facing.length_squared() < 1e-14 || !self.is_open(solid, (a + b + c) / 3.0) {
                        continue;
                    }
                    let normals: Vec3 = corners.iter().map(|&corner| spots[corner].1).sum();
                    if facing.dot(solid.axes * normals) < 0.0 {
                        corners.swap(1, 2);
                    }
                    mesh.triangles.push(corners.map(|corner| {
                        if index[corner] == UNUSED {
                            let (p, n) = spots[corner];
                            index[corner] = mesh.positions.len() as u32;
                            mesh.positions.push(solid.center + solid.axes * p);
                            mesh.normals.push(solid.axes * n);
                            let tone = solid.look.colour(p, n, half, 0.5 * CELL_M);
                            mesh.colors.push(tone.to_array().map(to_srgb));
                        }
                        index[corner]
                    }));
                }
            }
        }
    }

    /// Whether there is free space of the room in front of the solid's surface next to `point`.
    fn is_open(&self, solid: &Solid, point: Vec3) -> bool {
        let (gap, gradient) = solid.shape.field(solid.to_local(point));
        let front = point + solid.axes * gradient * (OPEN_M - gap);
        let half = 0.5 * self.size_m();
        let inside = (front - Vec3::Z * half.z)
            .abs()
            .cmplt(half + 0.9 * WALL_M)
            .all();
        inside && self.distance(front) > 0.5 * OPEN_M
    }
}

/// Where a face of a box is cut: evenly over its flat part, finer over its rounded rim.
fn lines(half: f32, round: f32) -> Vec<f32> {
    let mut at = Vec::new();
    if round > 0.0 {
        // Even angles from the face's own direction to the diagonal.
        at.extend(
            (1..=ARC_CELLS)
                .map(|k| half + round * libm::tanf(k as f32 * TAU / 8.0 / ARC_CELLS as f32)),
        );
    }
    let mut all: Vec<f32> = at.iter().rev().map(|v| -v).collect();
    let cells = (2.0 * half / CELL_M) as usize + 1;
    if half > 0.0 {
        all.extend((0..=cells).map(|k| half * (2.0 * k as f32 / cells as f32 - 1.0)));
    } else {
        all.push(0.0);
    }
    all.extend(at);
    all
}

/// The outline of a drum in (radius, height) from the middle of its bottom to the middle of its top, as bands with a
/// normal at either end.
fn outline(bottom: f32, top: f32, half: f32, round: f32) -> Vec<[(Vec2, Vec2); 2]> {
    let side = Vec2::new(2.0 * half, bottom - top).normalize_or(Vec2::X);
    let (low, high) = (Vec2::new(bottom, -half), Vec2::new(top, half));
    let down = Vec2::NEG_Y;
    let mut bands = vec![[
        (Vec2::new(0.0, -half - round), down),
        (low + down * round, down),
    ]];
    let mut arc = |center: Vec2, from: Vec2, to: Vec2| {
        let step = |k: usize| from.lerp(to, k as f32 / ARC_CELLS as f32).normalize_or(to);
        if round > 0.0 {
            bands.extend(
                (0..ARC_CELLS).map(|k| [step(k), step(k + 1)].map(|n| (center + n * round, n))),
            );
        }
    };
    arc(low, down, side);
    arc(high, side, Vec2::Y);
    bands.push([(low + side * round, side), (high + side * round, side)]);
    bands.push([
        (high + Vec2::Y * round, Vec2::Y),
        (Vec2::new(0.0, half + round), Vec2::Y),
    ]);
    bands
}
