//! The field's numbers on the device, one row a slot, growing with the lattice.

use crate::lattice::BRICK_VOXELS;
use burn::{
    Tensor,
    tensor::{DType, Device, IndexingUpdateOp, Int, TensorData},
};

/// Numbers of a voxel's distance sample: the truncated signed distance, its weight, what it rests on ([`crate::evidence`]).
pub(crate) const SAMPLE: usize = 3;
/// Numbers of a voxel's colour: red, green, blue (0 to 255), then the weight of the colour.
pub(crate) const COLOR: usize = 4;

/// The field's numbers. A row is a brick; its voxels lie x fastest, then y, then z.
pub(crate) struct Field {
    /// `[slots, 512 * 3]`
    pub samples: Tensor<2>,
    /// `[slots, 512 * 4]`, or `[1, 512 * 4]` that is never written where there is no colour.
    pub colors: Tensor<2>,
    has_color: bool,
    device: Device,
}

impl Field {
    pub fn new(has_color: bool, device: &Device) -> Self {
        Self {
            samples: zeros(1, SAMPLE, device),
            colors: zeros(1, COLOR, device),
            has_color,
            device: device.clone(),
        }
    }

    pub fn has_color(&self) -> bool {
        self.has_color
    }

    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Slots that there is room for.
    pub fn capacity(&self) -> usize {
        self.samples.dims()[0]
    }

    /// Makes room for `slots`, doubling so that the copies stay few, up to `limit`.
    pub fn grow(&mut self, slots: usize, limit: usize) {
        let capacity = self.capacity();
        if slots <= capacity {
            return;
        }
        let more = slots.max(capacity * 2).max(1024).min(limit) - capacity;
        extend(&mut self.samples, more, SAMPLE, &self.device);
        if self.has_color {
            extend(&mut self.colors, more, COLOR, &self.device);
        }
    }

    /// Overwrites the rows `slots`: 512 * 3 numbers a row of `samples`, 512 * 4 of `colors`.
    pub fn set(&mut self, slots: Vec<i32>, samples: Vec<f32>, colors: Vec<f32>) {
        let rows = slots.len();
        let slots = TensorData::new(slots, [rows]);
        let slots = Tensor::<1, Int>::from_data(slots, (&self.device, DType::I32));
        set_rows(&mut self.samples, &slots, samples, &self.device);
        if self.has_color {
            set_rows(&mut self.colors, &slots, colors, &self.device);
        }
    }
}

fn set_rows(tensor: &mut Tensor<2>, slots: &Tensor<1, Int>, values: Vec<f32>, device: &Device) {
    let shape = [slots.dims()[0], tensor.dims()[1]];
    let values = Tensor::<2>::from_data(TensorData::new(values, shape), (device, DType::F32));
    let old = std::mem::replace(tensor, Tensor::empty([1, 1], device));
    let change = values - old.clone().select(0, slots.clone());
    *tensor = old.select_assign(0, slots.clone(), change, IndexingUpdateOp::Add);
}

fn zeros(rows: usize, channels: usize, device: &Device) -> Tensor<2> {
    Tensor::zeros([rows, BRICK_VOXELS * channels], (device, DType::F32))
}

fn extend(tensor: &mut Tensor<2>, rows: usize, channels: usize, device: &Device) {
    let old = std::mem::replace(tensor, Tensor::empty([1, 1], device));
    *tensor = Tensor::cat(vec![old, zeros(rows, channels, device)], 0);
}
