//! Which views see which voxels, and where.

use burn::tensor::{Device, Tensor, TensorData};
use glam::{DMat3, DVec3, IVec3, Vec3};
use rayon::prelude::*;

use crate::View;
use crate::ops::{rows::Places, segments::Segments};

/// Voxels that a thread projects at a time.
const VOXELS: usize = 1024;

/// Every visible pair of a voxel and a view, sorted by voxel, then view (method 1.5): `0 <= u <= w - 1`,
/// `0 <= v <= h - 1`, `z > 0`. Nothing hides anything here: that is what fusion learns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pairs {
    /// Column in the level's plane: the picture's over the stride.
    pub u: Vec<f32>,
    /// Row in the level's plane.
    pub v: Vec<f32>,
    /// Depth along the optical axis in metres.
    pub z_m: Vec<f32>,
    /// The view.
    pub view: Vec<u32>,
    /// Pairs `offsets[n]..offsets[n + 1]` are those of voxel `n`.
    pub offsets: Vec<i32>,
    /// Columns and rows of a plane.
    pub plane: [usize; 2],
}

/// [`Pairs`] on a device.
#[derive(Clone, Debug)]
pub struct PairTensors {
    /// Where the planes are sampled.
    pub places: Places,
    /// Depth in metres, `[P]`.
    pub z_m: Tensor<1>,
    /// The pairs of each voxel.
    pub segments: Segments,
}

/// From sites to a plane's pixels. In 64 bits: what is left of a pixel after its whole part weighs features.
struct Projection {
    plane_from_site: DMat3,
    offset: DVec3,
}

impl Projection {
    fn new(view: &View, voxel_size_m: f32, origin_m: Vec3, stride: usize) -> Self {
        let camera = &view.camera;
        let intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy];
        let [fx, fy, cx, cy] = intrinsics.map(|k| f64::from(k) / stride as f64);
        let plane_from_camera = DMat3::from_cols(
            DVec3::new(fx, 0.0, 0.0),
            DVec3::new(0.0, fy, 0.0),
            DVec3::new(cx, cy, 1.0),
        );
        let world_from_camera = DMat3::from_cols_array(
            &view
                .world_from_camera
                .matrix3
                .to_cols_array()
                .map(f64::from),
        );
        let plane_from_world = plane_from_camera * world_from_camera.inverse();
        let eye = DVec3::from(view.position_m());
        Self {
            plane_from_site: plane_from_world * f64::from(voxel_size_m),
            offset: plane_from_world * (DVec3::from(origin_m) - eye),
        }
    }

    /// Column, row and depth.
    fn project(&self, site: IVec3) -> Option<DVec3> {
        let at = self.plane_from_site * site.as_dvec3() + self.offset;
        (at.z > 0.0).then(|| DVec3::new(at.x / at.z, at.y / at.z, at.z))
    }
}

impl Pairs {
    /// The pairs of `sites` (at `site * voxel_size_m + origin_m`) and `views`, in planes of `plane` columns and rows whose
    /// pixels are `stride` pixels of the picture apart.
    pub fn find(
        sites: &[IVec3],
        voxel_size_m: f32,
        origin_m: Vec3,
        views: &[View],
        plane: [usize; 2],
        stride: usize,
    ) -> Self {
        let projections: Vec<Projection> = views
            .iter()
            .map(|view| Projection::new(view, voxel_size_m, origin_m, stride))
            .collect();
        let [right, bottom] = plane.map(|size| size as f64 - 1.0);
        let parts: Vec<Self> = sites
            .par_chunks(VOXELS)
            .map(|sites| {
                let mut part = Self::default();
                for site in sites {
                    for (view, projection) in (0..).zip(&projections) {
                        let Some(at) = projection.project(*site) else {
                            continue;
                        };
                        if at.x >= 0.0 && at.y >= 0.0 && at.x <= right && at.y <= bottom {
                            part.u.push(at.x as f32);
                            part.v.push(at.y as f32);
                            part.z_m.push(at.z as f32);
                            part.view.push(view);
                        }
                    }
                    part.offsets.push(part.u.len() as i32);
                }
                part
            })
            .collect();
        let mut all = Self {
            offsets: vec![0],
            plane,
            ..Self::default()
        };
        for part in parts {
            let before = all.u.len() as i32;
            all.u.extend(part.u);
            all.v.extend(part.v);
            all.z_m.extend(part.z_m);
            all.view.extend(part.view);
            all.offsets
                .extend(part.offsets.iter().map(|end| before + end));
        }
        all
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.u.len()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.u.is_empty()
    }

    /// Number of voxels, those that nobody sees among them.
    pub fn voxels(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// On a device.
    pub fn on(&self, device: &Device) -> PairTensors {
        let [width, height] = self.plane;
        let mut corner = Vec::with_capacity(self.len());
        let mut right = Vec::with_capacity(self.len());
        let mut down = Vec::with_capacity(self.len());
        for ((u, v), view) in self.u.iter().zip(&self.v).zip(&self.view) {
            // The last pixel is reached from the one before it.
            let x = (*u as usize).min(width.saturating_sub(2));
            let y = (*v as usize).min(height.saturating_sub(2));
            corner.push((x + width * (y + height * *view as usize)) as i32);
            right.push(u - x as f32);
            down.push(v - y as f32);
        }
        let floats = |values: &[f32]| Tensor::from_data(TensorData::from(values), device);
        PairTensors {
            places: Places {
                corner: Tensor::from_data(TensorData::from(corner.as_slice()), device),
                right: floats(&right),
                down: floats(&down),
                plane: self.plane,
            },
            z_m: floats(&self.z_m),
            segments: Segments::new(&self.offsets, device),
        }
    }

    /// What is true of each pair's projective occupancy (method 1.9): the surface that view `i` measured lies within
    /// `near_m` of the voxel, `|z - depth_i| < near_m`, looked up at the nearest pixel of the full-size picture. Returns
    /// the pairs where something was measured (depth above 0) and, for each, 1 or 0. `depth_m` is `[V, H, W]` of
    /// `picture` columns and rows.
    pub fn truth(
        &self,
        depth_m: &[f32],
        picture: [usize; 2],
        stride: usize,
        near_m: f32,
    ) -> (Vec<i32>, Vec<f32>) {
        let [width, height] = picture;
        let mut rows = Vec::new();
        let mut labels = Vec::new();
        for pair in 0..self.len() {
            let [x, y] = [self.u[pair], self.v[pair]].map(|p| (p * stride as f32).round() as usize);
            if x >= width || y >= height {
                continue;
            }
            let at = x + width * (y + height * self.view[pair] as usize);
            let depth = depth_m.get(at).copied().unwrap_or(0.0);
            if depth > 0.0 {
                rows.push(pair as i32);
                labels.push(f32::from((self.z_m[pair] - depth).abs() < near_m));
            }
        }
        (rows, labels)
    }
}
