//! Matching as kernels, for WebGPU and its native relatives. The definitions are [`crate::sweep`], [`crate::smooth`] and
//! [`crate::depth`]; numbers that cross memory between the kernels have 16 bits, and those forms round as these do.
//!
//! What bounds these kernels is the number of loads and stores, on a GPU as on a processor that plays one. So no window
//! is ever looked at pixel by pixel: [`sweep`] has the layout, [`smooth`] the paths. Only the winners' maps are read back.

mod pack;
mod pictures;
mod shape;
mod smooth;
mod sweep;
mod window;
mod winners;
mod work;

pub use shape::{most_planes, most_sources};
pub use work::{Work, work, work_by_kernel};

use crate::{
    StereoError,
    depth::Raw,
    smooth::SmoothConfig,
    sweep::SweepConfig,
    view::{View, warp},
    window::{gray_steps, in_steps},
};
use burn::{
    Tensor,
    tensor::{DType, Device, Int},
};
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use cubecl::prelude::*;
use pictures::{Pictures, framed, upload};
use shape::{Shape, shape};
use smooth::DIRECTIONS;
use sweep::{ROWS, SEGMENT, STRIP, THREADS, TILE, WARP, WIDE};

/// Samples of a chunk of planes fill at most this much, as long as four planes do; scores as much again.
const SCRATCH_BYTES: usize = 32 << 20;

/// Matches one keyframe after the other on a device.
#[derive(Debug)]
pub struct FusedMatcher {
    device: Device,
    pictures: Option<Pictures>,
}

/// Costs of all planes at all pixels of a picture, on the device.
#[derive(Debug)]
pub struct Costs {
    shape: Shape,
    /// Packed, `[pixels, padded / 2]`.
    cost: CubeTensor,
    /// Grey values of the reference.
    gray: CubeTensor,
    base: Option<CubeTensor>,
}

/// Sums of the costs along eight paths, on the device.
#[derive(Debug)]
pub struct Sums {
    /// `[pixels, padded]`.
    sum: CubeTensor,
}

impl FusedMatcher {
    /// Whether the device runs kernels.
    pub fn runs_on(device: &Device) -> bool {
        float_buffer(Tensor::zeros([1], (device, DType::F32))).is_ok()
    }

    /// # Errors
    /// [`StereoError::Device`] on a device that runs no kernels; the host's form is for those.
    pub fn new(device: &Device) -> Result<Self, StereoError> {
        float_buffer(Tensor::zeros([1], (device, DType::F32)))?;
        Ok(Self {
            device: device.clone(),
            pictures: None,
        })
    }

    /// The best plane of every pixel of `reference`: [`crate::sweep::sweep`], [`crate::smooth::smooth`] and
    /// [`crate::depth::winners`] in one.
    ///
    /// Sources come with a number each: the same number, the same picture; those of late are not brought to the device
    /// again. `base` (1/m, one a pixel) is added to the `offsets` (1/m, evenly spaced).
    ///
    /// # Errors
    /// As [`Self::sweep`] and [`Self::winners`].
    pub async fn match_view(
        &mut self,
        reference: &View,
        sources: &[(usize, &View)],
        base: Option<&[f32]>,
        offsets: &[f32],
        sweep: &SweepConfig,
        smooth: &SmoothConfig,
    ) -> Result<Raw, StereoError> {
        let costs = self.sweep(reference, sources, base, offsets, sweep)?;
        let sums = self.smooth(&costs, smooth)?;
        self.winners(costs, sums).await
    }

    /// The cost of every plane at every pixel.
    ///
    /// # Errors
    /// [`StereoError::Setting`] without a source, for offsets that are not evenly spaced, or for more planes or sources
    /// than [`most_planes`] and [`most_sources`] allow; [`StereoError::Device`] if the device fails.
    pub fn sweep(
        &mut self,
        reference: &View,
        sources: &[(usize, &View)],
        base: Option<&[f32]>,
        offsets: &[f32],
        config: &SweepConfig,
    ) -> Result<Costs, StereoError> {
        let shape = shape(reference, sources, offsets, config.radius)?;
        let Shape { width, height, .. } = shape;
        let (count, radius) = (sources.len(), config.radius);
        let (across, down) = (width + 2 * radius, height + 2 * radius);
        let groups = shape.padded() / 4;
        let group_samples = 2 * count * across * down;
        let chunk = (SCRATCH_BYTES / (4 * group_samples)).clamp(1, groups);

        let steps = gray_steps(radius);
        let slot = sources.iter().map(|(_, v)| v.gray.len()).max().unwrap_or(0);
        let mut pictures = match self.pictures.take() {
            Some(pictures) if pictures.fits(slot, count, steps) => pictures,
            _ => Pictures::new(&self.device, slot, count, steps)?,
        };
        let places = pictures.places(&self.device, sources)?;
        let warps = upload(&self.device, warps(reference, sources, &places))?;
        let gray = upload(&self.device, reference.gray.clone())?;
        let in_steps = upload(&self.device, in_steps(&reference.gray, steps))?;
        let framed = framed(&self.device, &in_steps, width, height, radius)?;
        let base = base.map(|b| upload(&self.device, b.to_vec())).transpose()?;
        let has_base = base.is_some();
        let base_or_any = base.clone().unwrap_or_else(|| gray.clone());
        // The last thread of a row reads past the end by less than a window.
        let warped = self.empty_ints(chunk * group_samples + 4 * across)?;
        let scores = self.empty_ints(2 * chunk * count * shape.pixels())?;
        let cost = self.empty_ints(shape.pixels() * shape.padded() / 2)?;

        let kept = (count as f32 * config.best).ceil().max(1.0) as usize;
        // Few kernels for many counts of sources.
        let kept = kept.next_multiple_of(if kept > 8 { 8 } else { 2 });
        let client = &cost.client;
        let (w, h, r, n) = (width as u32, height as u32, radius as u32, count as u32);
        let used = shape.planes.div_ceil(4);
        for first in (0..used).step_by(chunk) {
            let many = chunk.min(used - first) as u32;
            let first = first as u32;
            // SAFETY (all three): threads outside the picture end at once; samples are clamped into their source, whose size
            // `shape` checked; chunks and planes fit in buffers made for them above.
            unsafe {
                sweep::warp_kernel::launch_unchecked(
                    client,
                    CubeCount::Static(
                        (across as u32).div_ceil(TILE.0),
                        (down as u32).div_ceil(TILE.1 * ROWS),
                        n,
                    ),
                    CubeDim::new_2d(TILE.0, TILE.1),
                    pictures.buffer.clone().into_buffer_arg(),
                    warps.clone().into_buffer_arg(),
                    base_or_any.clone().into_buffer_arg(),
                    warped.clone().into_buffer_arg(),
                    w,
                    h,
                    pictures.slot as u32,
                    2 * first,
                    2 * many,
                    shape.first_rho,
                    shape.step,
                    r,
                    has_base,
                );
                sweep::window_kernel::launch_unchecked(
                    client,
                    CubeCount::Static(
                        w.div_ceil(STRIP * WIDE as u32),
                        h.div_ceil(SEGMENT),
                        2 * many * n,
                    ),
                    CubeDim::new_1d(STRIP),
                    warped.clone().into_buffer_arg(),
                    framed.clone().into_buffer_arg(),
                    warps.clone().into_buffer_arg(),
                    base_or_any.clone().into_buffer_arg(),
                    scores.clone().into_buffer_arg(),
                    w,
                    h,
                    n,
                    2 * first,
                    shape.first_rho,
                    shape.step,
                    config.noise_var * steps * steps,
                    r,
                    WIDE,
                    has_base,
                );
                sweep::best_kernel::launch_unchecked(
                    client,
                    CubeCount::Static((w * h).div_ceil(THREADS), many, 1),
                    CubeDim::new_1d(THREADS),
                    scores.clone().into_buffer_arg(),
                    cost.clone().into_buffer_arg(),
                    w * h,
                    n,
                    groups as u32,
                    first,
                    config.best,
                    kept,
                );
            }
        }
        self.pictures = Some(pictures);
        Ok(Costs {
            shape,
            cost,
            gray,
            base,
        })
    }

    /// Sums of the costs along paths from eight directions.
    ///
    /// # Errors
    /// [`StereoError::Device`] if the device fails.
    pub fn smooth(&self, costs: &Costs, config: &SmoothConfig) -> Result<Sums, StereoError> {
        let shape = costs.shape;
        let lanes = shape.lanes();
        let sum = self.empty_floats(shape.pixels() * shape.padded())?;
        for (i, (dx, dy)) in DIRECTIONS.into_iter().enumerate() {
            let lines = if dy == 0 { shape.height } else { shape.width };
            // SAFETY: a thread's pixels lie within the picture, and its planes within a row of `padded`.
            unsafe {
                smooth::path_kernel::launch_unchecked(
                    &sum.client,
                    CubeCount::new_1d((lines * lanes).div_ceil(smooth::THREADS) as u32),
                    CubeDim::new_1d(smooth::THREADS as u32),
                    costs.cost.clone().into_buffer_arg(),
                    costs.gray.clone().into_buffer_arg(),
                    sum.clone().into_buffer_arg(),
                    shape.width as u32,
                    shape.height as u32,
                    dx,
                    dy,
                    shape.planes as u32,
                    config.p1,
                    config.p2,
                    config.edge,
                    lanes,
                    shape.padded() / (4 * lanes),
                    shape.planes != shape.padded(),
                    i == 0,
                );
            }
        }
        Ok(Sums { sum })
    }

    /// The best plane of every pixel, read back.
    ///
    /// # Errors
    /// [`StereoError::Device`] if the device fails.
    pub async fn winners(&self, costs: Costs, sums: Sums) -> Result<Raw, StereoError> {
        let shape = costs.shape;
        let pixels = shape.pixels();
        let maps = self.empty_floats(3 * pixels)?;
        let has_base = costs.base.is_some();
        let base = costs.base.unwrap_or(costs.gray);
        // SAFETY: threads past the last pixel end at once; a winner is one of the planes.
        unsafe {
            winners::winners_kernel::launch_unchecked(
                &maps.client,
                CubeCount::new_1d((pixels as u32).div_ceil(THREADS)),
                CubeDim::new_1d(THREADS),
                costs.cost.into_buffer_arg(),
                sums.sum.into_buffer_arg(),
                base.into_buffer_arg(),
                maps.clone().into_buffer_arg(),
                pixels as u32,
                shape.planes as u32,
                (shape.padded() / 4) as u32,
                shape.first_rho,
                shape.step,
                has_base,
            );
        }
        let maps = Tensor::<1>::from_primitive::<CubeBackend>(maps);
        let maps = maps.into_data_async().await;
        let maps = maps.map_err(|error| StereoError::Device(error.to_string()))?;
        let mut rho: Vec<f32> = maps
            .try_to_vec()
            .map_err(|error| StereoError::Device(format!("{error:?}")))?;
        let unique = rho.split_off(2 * pixels);
        let zncc = rho.split_off(pixels);
        Ok(Raw { rho, zncc, unique })
    }

    fn empty_floats(&self, length: usize) -> Result<CubeTensor, StereoError> {
        float_buffer(Tensor::empty([length], (&self.device, DType::F32)))
    }

    fn empty_ints(&self, length: usize) -> Result<CubeTensor, StereoError> {
        int_buffer(Tensor::empty([length], (&self.device, DType::I32)))
    }
}

/// [`WARP`] numbers of each source.
fn warps(reference: &View, sources: &[(usize, &View)], places: &[usize]) -> Vec<f32> {
    let mut numbers = Vec::with_capacity(sources.len() * WARP);
    for ((_, source), place) in sources.iter().zip(places) {
        let to_source = warp(reference, source);
        let (width, height) = (source.camera.width as f32, source.camera.height as f32);
        numbers.extend(to_source.a);
        numbers.extend(to_source.b);
        numbers.extend([width - 1.001, height - 1.001, width, *place as f32]);
    }
    numbers
}

/// The device's own handle of a float tensor.
fn float_buffer(tensor: Tensor<1>) -> Result<CubeTensor, StereoError> {
    let cube = tensor.try_into_primitive::<CubeBackend>();
    cube.map_err(|error| StereoError::Device(format!("{error:?}")))
}

/// The device's own handle of an integer tensor.
fn int_buffer(tensor: Tensor<1, Int>) -> Result<CubeTensor, StereoError> {
    let cube = tensor.try_into_primitive::<CubeBackend>();
    cube.map_err(|error| StereoError::Device(format!("{error:?}")))
}
