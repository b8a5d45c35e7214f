//! Pictures on the device. A view is a source of a dozen keyframes, so sources stay there until their place is needed.

use super::{float_buffer, int_buffer, pack::pack, shape::BINDING_BYTES, sweep::THREADS};
use crate::{StereoError, view::View, window::in_steps};
use burn::{
    Tensor,
    tensor::{DType, Device, TensorData},
};
use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

/// Sources kept, unless more are asked for at once.
const KEPT: usize = 32;

/// Source pictures in places of equal size in one buffer.
#[derive(Debug)]
pub(super) struct Pictures {
    /// Pairs of grey values: each pixel with its right neighbour.
    pub(super) buffer: CubeTensor,
    /// Pixels of a place.
    pub(super) slot: usize,
    /// Steps of a grey level.
    steps: f32,
    places: Vec<Place>,
    clock: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Place {
    key: Option<usize>,
    used: u64,
}

impl Pictures {
    /// Room for `count` sources of `slot` pixels and some more, with so many steps of a grey level.
    pub(super) fn new(
        device: &Device,
        slot: usize,
        count: usize,
        steps: f32,
    ) -> Result<Self, StereoError> {
        let most = BINDING_BYTES / (4 * slot.max(1));
        let places = KEPT.min(most).max(count);
        let empty = Tensor::empty([places * slot], (device, DType::I32));
        Ok(Self {
            buffer: int_buffer(empty)?,
            slot,
            steps,
            places: vec![Place::default(); places],
            clock: 0,
        })
    }

    /// Whether `count` sources of `slot` pixels have room at once, in these steps.
    pub(super) fn fits(&self, slot: usize, count: usize, steps: f32) -> bool {
        slot <= self.slot && count <= self.places.len() && steps == self.steps
    }

    /// The places of some sources; those that are not there yet are brought there.
    pub(super) fn places(
        &mut self,
        device: &Device,
        sources: &[(usize, &View)],
    ) -> Result<Vec<usize>, StereoError> {
        self.clock += 1;
        // First those that are there, so that none of them gives way to another.
        for place in &mut self.places {
            if sources.iter().any(|(key, _)| place.key == Some(*key)) {
                place.used = self.clock;
            }
        }
        sources
            .iter()
            .map(|(key, view)| self.place(device, *key, view))
            .collect()
    }

    fn place(&mut self, device: &Device, key: usize, view: &View) -> Result<usize, StereoError> {
        let there = self.places.iter().position(|p| p.key == Some(key));
        if let Some(there) = there {
            return Ok(there);
        }
        let oldest = self.places.iter().enumerate().min_by_key(|(_, p)| p.used);
        let oldest = oldest.map_or(0, |(i, _)| i);
        let gray = upload(device, in_steps(&view.gray, self.steps))?;
        let pixels = view.gray.len() as u32;
        // SAFETY: a place has room for the picture, and threads past its end stop at once.
        unsafe {
            place_kernel::launch_unchecked(
                &gray.client.clone(),
                CubeCount::new_1d(pixels.div_ceil(THREADS)),
                CubeDim::new_1d(THREADS),
                gray.into_buffer_arg(),
                self.buffer.clone().into_buffer_arg(),
                pixels,
                (oldest * self.slot) as u32,
            );
        }
        self.places[oldest] = Place {
            key: Some(key),
            used: self.clock,
        };
        Ok(oldest)
    }
}

/// A reference, in steps, with a frame of zeros, `radius` pixels wide; each pixel with its right neighbour.
pub(super) fn framed(
    device: &Device,
    gray: &CubeTensor,
    width: usize,
    height: usize,
    radius: usize,
) -> Result<CubeTensor, StereoError> {
    let pixels = (width + 2 * radius) * (height + 2 * radius);
    // A thread of two windows reads past the last.
    let framed = int_buffer(Tensor::empty([pixels + 8], (device, DType::I32)))?;
    // SAFETY: threads past the end stop at once, and the frame reads nothing.
    unsafe {
        frame_kernel::launch_unchecked(
            &framed.client,
            CubeCount::new_1d((pixels as u32).div_ceil(THREADS)),
            CubeDim::new_1d(THREADS),
            gray.clone().into_buffer_arg(),
            framed.clone().into_buffer_arg(),
            width as u32,
            height as u32,
            radius as u32,
        );
    }
    Ok(framed)
}

/// A list of numbers on the device.
pub(super) fn upload(device: &Device, values: Vec<f32>) -> Result<CubeTensor, StereoError> {
    let shape = [values.len()];
    let data = TensorData::new(values, shape);
    float_buffer(Tensor::from_data(data, (device, DType::F32)))
}

#[cube(launch_unchecked)]
fn place_kernel(gray: &[f32], pictures: &mut [i32], pixels: u32, start: u32) {
    let at = CUBE_POS_X * THREADS + UNIT_POS_X;
    if at >= pixels {
        terminate!();
    }
    let next = (at + 1).min(pixels - 1);
    pictures[(start + at) as usize] = pack(gray[at as usize], gray[next as usize]);
}

/// The grey value of a pixel of the framed picture.
#[cube]
fn framed_steps(gray: &[f32], x: u32, y: u32, width: u32, height: u32, radius: u32) -> f32 {
    let mut value = 0.0f32;
    if x >= radius && y >= radius && x < width + radius && y < height + radius {
        value = gray[((y - radius) * width + x - radius) as usize];
    }
    value
}

#[cube(launch_unchecked)]
fn frame_kernel(gray: &[f32], framed: &mut [i32], width: u32, height: u32, radius: u32) {
    let across = width + 2 * radius;
    let at = CUBE_POS_X * THREADS + UNIT_POS_X;
    if at >= across * (height + 2 * radius) {
        terminate!();
    }
    let x = at % across;
    let y = at / across;
    framed[at as usize] = pack(
        framed_steps(gray, x, y, width, height, radius),
        framed_steps(gray, x + 1, y, width, height, radius),
    );
}
