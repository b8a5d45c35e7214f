//! A scan's truth: a dense signed distance field of its depth images, made as NeuralRecon and VoRTX make theirs
//! (method 1.8).

use glam::{Affine3A, IVec3, Vec3};
use mesh::camera::Pinhole;
use net::loss::TRUNCATION_M;
use rayon::prelude::*;
use std::path::Path;

/// Edge of a voxel, in metres.
pub const VOXEL_M: f32 = net::Level::Fine.voxel_size_m();
/// The stored number of a value of 1, which is free space, and negated of -1, which is behind or unobserved.
pub const SATURATED: i8 = i8::MAX;

/// One posed depth image. Lengths in metres.
pub struct DepthView {
    /// Its camera.
    pub camera: Pinhole,
    /// Camera to world.
    pub world_from_camera: Affine3A,
    /// Depth along the optical axis, row by row; 0 where none was measured.
    pub depth_m: Vec<f32>,
}

/// Signed distance over the truncation distance at the points `origin_m + i * VOXEL_M`; point `(x, y, z)` is value
/// `x + nx * (y + ny * z)`. Stored in 127ths: a step is 1 mm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TruthVolume {
    /// First lattice point, in voxels.
    pub start: IVec3,
    /// Points along x, y and z.
    pub size: [usize; 3],
    /// Positive before surfaces, [`SATURATED`] in free space, `-SATURATED` behind and where nothing was observed.
    pub values: Vec<i8>,
    /// How many values are not saturated: points near a surface.
    pub near: usize,
}

impl TruthVolume {
    /// Fuses depth images: at every point the mean over the images that see it of `min(1, (measured - z) / 0.12 m)`,
    /// where an image that measures a surface more than 0.12 m before the point says nothing. The nearest pixel counts.
    pub fn fuse(start: IVec3, size: [usize; 3], views: &[DepthView]) -> Self {
        let mut building = Building::new(start, size);
        building.add(views);
        building.finish()
    }

    /// World position of the first lattice point, in metres.
    pub fn origin_m(&self) -> Vec3 {
        self.start.as_vec3() * VOXEL_M
    }

    /// The `nth` point near a surface, as its world position in metres.
    pub fn near_point_m(&self, nth: usize) -> Option<Vec3> {
        let (index, _) = self
            .values
            .iter()
            .enumerate()
            .filter(|(_, value)| value.unsigned_abs() < SATURATED as u8)
            .nth(nth)?;
        let [nx, ny, _] = self.size;
        let at = [index % nx, index / nx % ny, index / (nx * ny)];
        Some(self.origin_m() + Vec3::from_array(at.map(|i| i as f32)) * VOXEL_M)
    }
}

/// A volume to which depth images are still being added.
pub struct Building {
    start: IVec3,
    size: [usize; 3],
    sums: Vec<f32>,
    counts: Vec<u16>,
}

impl Building {
    /// Nothing observed yet.
    pub fn new(start: IVec3, size: [usize; 3]) -> Self {
        let points = size.iter().product();
        Self {
            start,
            size,
            sums: vec![0.0; points],
            counts: vec![0; points],
        }
    }

    /// Adds images; slices of the lattice in parallel, so that the result does not depend on the threads.
    pub fn add(&mut self, views: &[DepthView]) {
        let [nx, ny, _] = self.size;
        let start = self.start;
        let slices = self.sums.par_chunks_mut(nx * ny);
        slices
            .zip(self.counts.par_chunks_mut(nx * ny))
            .enumerate()
            .for_each(|(z, (sums, counts))| {
                for view in views {
                    let camera_from_world = view.world_from_camera.inverse();
                    for y in 0..ny {
                        let first = (start + IVec3::new(0, y as i32, z as i32)).as_vec3() * VOXEL_M;
                        let row = Row {
                            first: camera_from_world.transform_point3(first),
                            step: camera_from_world.transform_vector3(Vec3::X * VOXEL_M),
                        };
                        let at = y * nx..(y + 1) * nx;
                        row.add(view, &mut sums[at.clone()], &mut counts[at]);
                    }
                }
            });
    }

    /// The field.
    pub fn finish(self) -> TruthVolume {
        let most = f32::from(SATURATED);
        let value = |(sum, count): (&f32, &u16)| match count {
            0 => -SATURATED,
            _ => {
                let mean = sum / f32::from(*count);
                if mean.abs() > 0.999 {
                    SATURATED * mean.signum() as i8
                } else {
                    // Only what is saturated may look so.
                    (mean * most).round().clamp(1.0 - most, most - 1.0) as i8
                }
            }
        };
        let pairs = self.sums.par_iter().zip(&self.counts);
        let values: Vec<i8> = pairs.map(value).collect();
        let near = count_near(&values);
        TruthVolume {
            start: self.start,
            size: self.size,
            values,
            near,
        }
    }
}

/// A row of lattice points in camera coordinates.
struct Row {
    first: Vec3,
    step: Vec3,
}

impl Row {
    fn add(&self, view: &DepthView, sums: &mut [f32], counts: &mut [u16]) {
        let camera = &view.camera;
        let (width, height) = (camera.width as usize, camera.height as usize);
        for x in self.inside(camera, sums.len()) {
            let point = self.first + self.step * x as f32;
            if point.z <= 0.0 {
                continue;
            }
            let pixel = camera.project(point).round();
            // A negative float becomes 0 as an index, so it is asked for first.
            if pixel.x < 0.0 || pixel.y < 0.0 {
                continue;
            }
            let (u, v) = (pixel.x as usize, pixel.y as usize);
            if u >= width || v >= height {
                continue;
            }
            let measured = view.depth_m[u + width * v];
            let distance = (measured - point.z) / TRUNCATION_M;
            if measured > 0.0 && distance >= -1.0 {
                sums[x] += distance.min(1.0);
                counts[x] = counts[x].saturating_add(1);
            }
        }
    }

    /// The part of the row that can be in the picture: points are linear in x, and so are the sides of the frustum.
    fn inside(&self, camera: &Pinhole, len: usize) -> std::ops::Range<usize> {
        let (a, b) = (self.first, self.step);
        let (right, bottom) = (camera.width as f32 - 0.5, camera.height as f32 - 0.5);
        let left_of = |p: Vec3| camera.fx * p.x + (camera.cx + 0.5) * p.z;
        let right_of = |p: Vec3| (right - camera.cx) * p.z - camera.fx * p.x;
        let above = |p: Vec3| camera.fy * p.y + (camera.cy + 0.5) * p.z;
        let below = |p: Vec3| (bottom - camera.cy) * p.z - camera.fy * p.y;
        let (mut low, mut high) = (0.0_f32, len as f32 - 1.0);
        for (at_start, slope) in [
            (a.z, b.z),
            (left_of(a), left_of(b)),
            (right_of(a), right_of(b)),
            (above(a), above(b)),
            (below(a), below(b)),
        ] {
            let zero = -at_start / slope;
            if slope > 0.0 {
                low = low.max(zero);
            } else if slope < 0.0 {
                high = high.min(zero);
            } else if at_start < 0.0 {
                return 0..0;
            }
        }
        // A point of slack at each end: the pixel decides.
        let first = (low.floor() - 1.0).max(0.0) as usize;
        let end = (high.ceil() + 2.0).clamp(0.0, len as f32) as usize;
        first..end.max(first)
    }
}

const MAGIC: [u8; 8] = *b"IPDTSDF1";

impl TruthVolume {
    /// Writes the volume: eight letters, start and size as six little-endian 32-bit numbers, the values.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, file: &Path) -> std::io::Result<()> {
        let mut bytes = MAGIC.to_vec();
        let size = self.size.map(|n| n as i32);
        for number in self.start.to_array().into_iter().chain(size) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.values.iter().map(|&value| value as u8));
        super::write_whole(file, &bytes)
    }

    /// Reads what [`TruthVolume::write`] wrote; `None` for anything else, so that it is made anew.
    pub fn read(file: &Path) -> Option<Self> {
        let bytes = std::fs::read(file).ok()?;
        let numbers = bytes.strip_prefix(&MAGIC)?;
        let (head, values) = numbers.split_at_checked(24)?;
        let number = |i: usize| Some(i32::from_le_bytes(head[4 * i..4 * i + 4].try_into().ok()?));
        let size = [number(3)?, number(4)?, number(5)?].map(|n| n.max(0) as usize);
        let values: Vec<i8> = values.iter().map(|&value| value as i8).collect();
        if values.len() != size.iter().product::<usize>() {
            return None;
        }
        let near = count_near(&values);
        Some(Self {
            start: IVec3::new(number(0)?, number(1)?, number(2)?),
            size,
            values,
            near,
        })
    }
}

fn count_near(values: &[i8]) -> usize {
    let near = |value: &&i8| value.unsigned_abs() < SATURATED as u8;
    values.iter().filter(near).count()
}
