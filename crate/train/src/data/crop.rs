//! A box of a scan in a coordinate system of its own, and the truth in it (methods 1.8 and 1.10).

use super::volume::{SATURATED, TruthVolume, VOXEL_M};
use crate::random::Random;
use glam::{Affine3A, Mat3, Quat, Vec3, Vec3A};
use net::sample::Truth;

/// What of a crop is drawn by chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CropChance {
    /// Turned about Z by any angle.
    pub rotate: bool,
    /// Mirrored in x every other time.
    pub mirror: bool,
}

/// A box of fine lattice points, its first at the origin of its own world, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop {
    /// Fine points along x, y and z.
    pub size: [usize; 3],
    /// A rotation about Z and a shift; for a mirrored crop also `x -> -x`.
    pub crop_from_world: Affine3A,
    /// Whether it is mirrored.
    pub mirrored: bool,
}

impl Crop {
    /// Puts `anchor_m` at a random place of the box, at least a voxel from its faces, and turns the box around it.
    pub fn draw(size: [usize; 3], anchor_m: Vec3, chance: CropChance, random: &mut Random) -> Self {
        let place = Vec3::from_array(size.map(|points| {
            let last = points.saturating_sub(1) as f32;
            VOXEL_M * random.range(1.0, (last - 1.0).max(1.0))
        }));
        let angle = random.range(0.0, std::f32::consts::TAU);
        let mirrored = random.chance(0.5) && chance.mirror;
        let turn = Mat3::from_quat(Quat::from_rotation_z(if chance.rotate {
            angle
        } else {
            0.0
        }));
        let flip = Vec3::new(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
        let linear = Mat3::from_diagonal(flip) * turn;
        Self {
            size,
            crop_from_world: Affine3A::from_mat3_translation(linear, place - linear * anchor_m),
            mirrored,
        }
    }

    /// A pose in the crop's world. In a mirrored crop the picture is mirrored too, so that the camera stays a proper one:
    /// its x axis is turned over.
    pub fn pose(&self, world_from_camera: Affine3A) -> Affine3A {
        let pose = self.crop_from_world * world_from_camera;
        if self.mirrored {
            pose * Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0))
        } else {
            pose
        }
    }

    /// The truth at the crop's points.
    pub fn truth(&self, volume: &TruthVolume) -> Truth {
        let tsdf = self.resample(volume);
        let fine: Vec<i8> = tsdf
            .iter()
            .map(|&value| match value {
                v if v <= -0.999 => UNSEEN,
                v if v >= 0.999 => FREE,
                _ => OCCUPIED,
            })
            .collect();
        let fine_size = self.size;
        let medium_size = fine_size.map(|n| n / 2);
        let medium = coarser(&fine, fine_size);
        let coarse = coarser(&medium, medium_size);
        let size = [fine_size.map(|n| n / 4), medium_size, fine_size];
        let states = [coarse, medium, fine];
        let occupied = states
            .each_ref()
            .map(|states| states.iter().map(|&state| state == OCCUPIED).collect());
        let mut supervised: [Vec<bool>; 3] = states
            .each_ref()
            .map(|states| states.iter().map(|&state| state != UNSEEN).collect());
        for (supervised, size) in supervised.iter_mut().zip(size) {
            add_unseen_columns(supervised, size);
        }
        Truth {
            size,
            tsdf,
            occupied,
            supervised,
        }
    }

    /// Trilinear, but where the nearest stored point is saturated its value stays; -1 out of the volume.
    fn resample(&self, volume: &TruthVolume) -> Vec<f32> {
        let to_lattice = Affine3A::from_scale(Vec3::splat(1.0 / VOXEL_M))
            * Affine3A::from_translation(-volume.origin_m())
            * self.crop_from_world.inverse()
            * Affine3A::from_scale(Vec3::splat(VOXEL_M));
        let [nx, ny, nz] = self.size;
        let mut values = Vec::with_capacity(nx * ny * nz);
        let step = to_lattice.transform_vector3a(Vec3A::X);
        for z in 0..nz {
            for y in 0..ny {
                let first = to_lattice.transform_point3a(Vec3A::new(0.0, y as f32, z as f32));
                values.extend((0..nx).map(|x| sample(volume, first + step * x as f32)));
            }
        }
        values
    }
}

/// The volume at a place in lattice units.
fn sample(volume: &TruthVolume, place: Vec3A) -> f32 {
    let [nx, ny, nz] = volume.size;
    let last = Vec3A::new(nx as f32, ny as f32, nz as f32) - 1.0;
    let nearest = place.round();
    if nearest.cmplt(Vec3A::ZERO).any() || nearest.cmpgt(last).any() {
        return -1.0;
    }
    let at = |x: usize, y: usize, z: usize| volume.values[x + nx * (y + ny * z)];
    let stored = at(nearest.x as usize, nearest.y as usize, nearest.z as usize);
    if stored.unsigned_abs() >= SATURATED as u8 {
        return f32::from(stored.signum());
    }
    let place = place.clamp(Vec3A::ZERO, last);
    let low = place.floor();
    let share = place - low;
    let (x, y, z) = (low.x as usize, low.y as usize, low.z as usize);
    let (x1, y1, z1) = (
        (x + 1).min(nx - 1),
        (y + 1).min(ny - 1),
        (z + 1).min(nz - 1),
    );
    let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let row = |y, z| mix(f32::from(at(x, y, z)), f32::from(at(x1, y, z)), share.x);
    let plane = |z| mix(row(y, z), row(y1, z), share.y);
    mix(plane(z), plane(z1), share.z) / f32::from(SATURATED)
}

const UNSEEN: i8 = 0;
const FREE: i8 = 1;
const OCCUPIED: i8 = 2;

/// States at twice the spacing: occupied where a point within one step was, else free where the point itself was seen.
fn coarser(states: &[i8], [nx, ny, nz]: [usize; 3]) -> Vec<i8> {
    let mut result = Vec::with_capacity(states.len() / 8);
    for z in (0..nz - nz % 2).step_by(2) {
        for y in (0..ny - ny % 2).step_by(2) {
            for x in (0..nx - nx % 2).step_by(2) {
                let near = (z.saturating_sub(1)..(z + 2).min(nz)).any(|z| {
                    (y.saturating_sub(1)..(y + 2).min(ny)).any(|y| {
                        let row = nx * (y + ny * z);
                        let row = &states[row + x.saturating_sub(1)..row + (x + 2).min(nx)];
                        row.contains(&OCCUPIED)
                    })
                });
                let own = states[x + nx * (y + ny * z)];
                result.push(if near { OCCUPIED } else { own });
            }
        }
    }
    result
}

/// Points of vertical columns of which nothing was seen count as known to be empty: what lies outside of a room.
fn add_unseen_columns(supervised: &mut [bool], [nx, ny, nz]: [usize; 3]) {
    for column in 0..nx * ny {
        if (0..nz).all(|z| !supervised[column + nx * ny * z]) {
            for z in 0..nz {
                supervised[column + nx * ny * z] = true;
            }
        }
    }
}
