//! Flex tensors as slices.

use std::ops::Deref;

use burn::tensor::{Bytes, DType, Shape};
use burn_flex::{FlexTensor, Layout};

/// Numbers of a tensor, row by row.
pub(crate) struct Numbers(FlexTensor);

impl Deref for Numbers {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        self.0.storage()
    }
}

/// The numbers of a 32-bit float tensor; only a tensor that is a view of another is copied.
pub(crate) fn read(tensor: FlexTensor) -> Numbers {
    Numbers(tensor.to_contiguous())
}

/// A tensor of `numbers`, row by row.
pub(crate) fn tensor(numbers: Vec<f32>, shape: Shape) -> FlexTensor {
    FlexTensor::new(
        Bytes::from_elems(numbers),
        Layout::contiguous(shape),
        DType::F32,
    )
}
