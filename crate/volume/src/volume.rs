//! The volume as its users see it.

use crate::{
    DepthView, VolumeError,
    allocate::bricks_near_surface,
    compute::Form,
    extract::{BrickMeshes, Extractor, SurfaceRule, weld::Welder},
    field::{COLOR, Field, SAMPLE},
    integrate::{self, Rule},
    lattice::{BRICK_EDGE, BRICK_VOXELS, Brick, EMPTY_SLOT, Lattice},
};
use burn::tensor::Device;
use glam::{IVec3, Vec3};
use mesh::Mesh;
use std::collections::HashSet;

/// Bytes that a brick takes on the device, colour included.
pub const BYTES_PER_BRICK: usize = BRICK_VOXELS * (SAMPLE + COLOR) * size_of::<f32>();

/// Bricks extracted at a time when the whole mesh is asked for.
const BRICKS_AN_EXTRACTION: usize = 1024;

/// How a volume is laid out and what goes into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeConfig {
    /// Edge of a voxel in metres.
    pub voxel_size_m: f32,
    /// Distance at which the field is cut off, in metres.
    pub truncation_m: f32,
    /// Depth beyond this is not used, in metres.
    pub max_depth_m: f32,
    /// Keep colours.
    pub color: bool,
    /// Weigh a measurement at depth `z` by `1 / max(z, 0.5 m)^2` instead of 1: sensors err more with distance
    /// (Khoshelham and Elberink 2012).
    pub weigh_by_depth: bool,
    /// Which cells may have a surface.
    pub surface: SurfaceRule,
    /// The largest buffer that a kernel may see, in bytes; it bounds the bricks. WebGPU guarantees 128 MiB.
    pub binding_bytes: usize,
}

impl VolumeConfig {
    /// The usual choice for a voxel size: truncation at three voxels, depth up to 5 m, colour, and no surface that was
    /// seen only once from beyond 4.7 m or that hangs between an edge and what is seen past it.
    pub fn new(voxel_size_m: f32) -> Self {
        Self {
            weigh_by_depth: true,
            surface: SurfaceRule {
                least_weight: 1.0 / (4.7 * 4.7),
                largest_jump: 1.7,
            },
            ..Self::uniform(voxel_size_m)
        }
    }

    /// Every measurement weighs 1 and every observed cell may have a surface, as in the ground truth of VoRTX.
    pub fn uniform(voxel_size_m: f32) -> Self {
        Self {
            weigh_by_depth: false,
            surface: SurfaceRule::ANY,
            voxel_size_m,
            truncation_m: 3.0 * voxel_size_m,
            max_depth_m: 5.0,
            color: true,
            binding_bytes: 128 << 20,
        }
    }

    /// Bricks that fit in the largest buffer.
    pub fn brick_limit(&self) -> usize {
        let channels = if self.color { COLOR } else { SAMPLE };
        // One slot stands for all bricks that were never allocated.
        self.binding_bytes / (BRICK_VOXELS * channels * size_of::<f32>()) - 1
    }

    /// The bricks that a depth image would be written to, in x, y, z order.
    pub fn bricks_of(&self, view: &DepthView<'_>) -> Vec<Brick> {
        let brick_size_m = self.voxel_size_m * BRICK_EDGE as f32;
        bricks_near_surface(view, brick_size_m, self.truncation_m, self.max_depth_m)
    }

    /// An empty volume on `device`.
    ///
    /// # Errors
    /// A length that is not positive.
    pub fn init(&self, device: &Device) -> Result<Volume, VolumeError> {
        for (what, found, example) in [
            ("the voxel size", self.voxel_size_m, 0.04),
            ("the truncation distance", self.truncation_m, 0.12),
            ("the maximum depth", self.max_depth_m, 5.0),
        ] {
            if !(found > 0.0 && found.is_finite()) {
                return Err(VolumeError::Setting {
                    what,
                    found,
                    example,
                });
            }
        }
        let form = Form::of(device);
        Ok(Volume {
            config: *self,
            form,
            lattice: Lattice::default(),
            field: Field::new(self.color, device),
            extractor: Extractor::new(form, self.surface),
            changed: HashSet::new(),
        })
    }
}

/// A sparse truncated signed distance field.
pub struct Volume {
    config: VolumeConfig,
    form: Form,
    lattice: Lattice,
    field: Field,
    extractor: Extractor,
    /// Bricks whose surface may differ from what was last taken by [`Volume::take_changed`].
    changed: HashSet<Brick>,
}

impl Volume {
    /// Runs the plain form of every operation, on whatever device: for checks of the kernels.
    pub fn use_plain_form(&mut self) {
        self.form = Form::Plain;
        self.extractor = Extractor::new(Form::Plain, self.config.surface);
    }

    /// What the volume was made with.
    pub fn config(&self) -> &VolumeConfig {
        &self.config
    }

    /// Edge of a brick in metres.
    pub fn brick_size_m(&self) -> f32 {
        self.config.voxel_size_m * BRICK_EDGE as f32
    }

    /// Bricks in use.
    pub fn brick_count(&self) -> usize {
        self.lattice.bricks().len()
    }

    /// Bytes that the field takes on the device.
    pub fn device_bytes(&self) -> usize {
        self.field.capacity() * BYTES_PER_BRICK
    }

    /// Takes one posed depth image into the field.
    ///
    /// # Errors
    /// Images of another size than their cameras say, more bricks than fit, or a failing device. Nothing has changed then.
    pub fn integrate(&mut self, view: &DepthView<'_>) -> Result<(), VolumeError> {
        view.check()?;
        let VolumeConfig {
            voxel_size_m,
            truncation_m,
            max_depth_m,
            ..
        } = self.config;
        let bricks = self.config.bricks_of(view);
        self.reserve(&bricks)?;
        let rule = Rule {
            voxel_size_m,
            truncation_m,
            max_depth_m,
            weigh_by_depth: self.config.weigh_by_depth,
        };
        let (form, field) = (self.form, &mut self.field);
        integrate::integrate(form, field, &self.lattice, &bricks, view, rule)?;
        self.mark_changed(&bricks);
        Ok(())
    }

    /// Sets the field around a surface that is known exactly: `distance_m` gives the signed distance in metres (positive
    /// in free space) and the sRGB colour at a point of the canonical world, or `None` where nothing is known, for every
    /// lattice point of `bricks`.
    ///
    /// # Errors
    /// More bricks than fit.
    pub fn fill(
        &mut self,
        bricks: &[Brick],
        surface: impl Fn(Vec3) -> Option<(f32, [u8; 3])>,
    ) -> Result<(), VolumeError> {
        self.reserve(bricks)?;
        let VolumeConfig {
            voxel_size_m,
            truncation_m,
            ..
        } = self.config;
        let mut samples = Vec::with_capacity(bricks.len() * BRICK_VOXELS * SAMPLE);
        let mut colors = Vec::with_capacity(bricks.len() * BRICK_VOXELS * COLOR);
        for &brick in bricks {
            for local in 0..BRICK_VOXELS as i32 {
                let offset = IVec3::new(local % 8, local / 8 % 8, local / 64);
                let point = (brick * BRICK_EDGE + offset).as_vec3() * voxel_size_m;
                let known = surface(point);
                let weight = if known.is_some() { 1.0 } else { 0.0 };
                let (distance_m, rgb) = known.unwrap_or_default();
                samples.extend([(distance_m / truncation_m).clamp(-1.0, 1.0), weight, 0.0]);
                colors.extend(rgb.map(f32::from));
                colors.push(weight);
            }
        }
        self.write(bricks, samples, colors);
        self.mark_changed(bricks);
        Ok(())
    }

    /// Overwrites the numbers of bricks that have their slots.
    pub(crate) fn write(&mut self, bricks: &[Brick], samples: Vec<f32>, colors: Vec<f32>) {
        let slots: Vec<i32> = bricks
            .iter()
            .map(|&brick| self.lattice.slot(brick))
            .collect();
        self.field.set(slots, samples, colors);
    }

    /// Makes room for bricks and gives them their slots.
    pub(crate) fn reserve(&mut self, bricks: &[Brick]) -> Result<(), VolumeError> {
        let fresh = bricks
            .iter()
            .filter(|&&brick| self.lattice.slot(brick) == EMPTY_SLOT);
        let limit = self.config.brick_limit();
        let needed = self.lattice.slot_count() + fresh.count();
        if needed > limit + 1 {
            return Err(VolumeError::TooManyBricks {
                limit,
                voxel_size_m: self.config.voxel_size_m,
                max_depth_m: self.config.max_depth_m,
            });
        }
        self.field.grow(needed, limit + 1);
        for &brick in bricks {
            self.lattice.allocate(brick);
        }
        Ok(())
    }

    /// Notes that the surface in `bricks` may differ, and in the seven bricks below each: their cells reach into it.
    pub(crate) fn mark_changed(&mut self, bricks: &[Brick]) {
        for &brick in bricks {
            for corner in 0..8 {
                let below = brick - IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
                if self.lattice.slot(below) != EMPTY_SLOT {
                    self.changed.insert(below);
                }
            }
        }
    }

    /// Up to `count` bricks whose surface may have changed, nearest to `eye` first; they count as unchanged from now on.
    pub fn take_changed(&mut self, count: usize, eye: Vec3) -> Vec<Brick> {
        let size = self.brick_size_m();
        let distance = |brick: &Brick| ((brick.as_vec3() + 0.5) * size).distance_squared(eye);
        let mut bricks: Vec<Brick> = self.changed.iter().copied().collect();
        // Position as a tie-break: the order must not depend on the hash.
        bricks.sort_by(|a, b| {
            let order = distance(a).total_cmp(&distance(b));
            order.then_with(|| a.to_array().cmp(&b.to_array()))
        });
        bricks.truncate(count);
        for brick in &bricks {
            self.changed.remove(brick);
        }
        bricks
    }

    /// Bricks whose surface may have changed.
    pub fn changed_count(&self) -> usize {
        self.changed.len()
    }

    /// The surface in some bricks, as triangle soup on the device.
    ///
    /// # Errors
    /// A failing device.
    pub async fn extract(&self, bricks: &[Brick]) -> Result<BrickMeshes, VolumeError> {
        let (field, lattice) = (&self.field, &self.lattice);
        let size = self.config.voxel_size_m;
        self.extractor.extract(field, lattice, bricks, size).await
    }

    /// The whole surface as one indexed mesh in the canonical world, with normals and colours.
    ///
    /// # Errors
    /// A failing device.
    pub async fn mesh(&self) -> Result<Mesh, VolumeError> {
        let mut welder = Welder::default();
        let mut bricks = self.lattice.bricks().to_vec();
        // The same file whatever order the frames came in.
        bricks.sort_by_key(|brick| [brick.z, brick.y, brick.x]);
        for batch in bricks.chunks(BRICKS_AN_EXTRACTION) {
            let BrickMeshes { vertices, ranges } = self.extract(batch).await?;
            let [_, numbers] = vertices.dims();
            let data = vertices.into_data_async().await;
            let data = data.map_err(|error| VolumeError::Device(error.to_string()))?;
            let soup = data.as_slice::<f32>();
            let soup = soup.map_err(|error| VolumeError::Device(format!("{error:?}")))?;
            for (brick, rows) in ranges {
                welder.add(brick, &soup[rows.start * numbers..rows.end * numbers]);
            }
        }
        let mut mesh = welder.finish();
        if !self.config.color {
            mesh.colors.clear();
        }
        Ok(mesh)
    }
}
