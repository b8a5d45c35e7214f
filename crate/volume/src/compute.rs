//! Which form of an operation a device gets, and the way from burn's tensors to a kernel's buffers and back.

use crate::VolumeError;
use burn::{
    Tensor,
    tensor::{DType, Device, Int},
};
use burn_cubecl::{CubeBackend, tensor::CubeTensor};

/// The form of the operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Tensor operations, on any device.
    Plain,
    /// CubeCL kernels, on WebGPU and its native relatives.
    Fused,
}

impl Form {
    /// The faster form that the device can run.
    pub fn of(device: &Device) -> Self {
        let probe = Tensor::<1>::zeros([1], (device, DType::F32));
        match probe.try_into_primitive::<CubeBackend>() {
            Ok(_) => Self::Fused,
            Err(_) => Self::Plain,
        }
    }
}

/// The device's own handle of a float tensor whose rows lie without gaps.
pub(crate) fn float_buffer<const D: usize>(tensor: Tensor<D>) -> Result<CubeTensor, VolumeError> {
    let found = tensor.dtype();
    let cube = tensor.try_into_primitive::<CubeBackend>();
    let cube = cube.map_err(|error| VolumeError::Device(format!("{error:?}")))?;
    expect_type(DType::F32, found)?;
    Ok(cube)
}

/// The device's own handle of an integer tensor.
pub(crate) fn int_buffer<const D: usize>(
    tensor: Tensor<D, Int>,
) -> Result<CubeTensor, VolumeError> {
    let found = tensor.dtype();
    let cube = tensor.try_into_primitive::<CubeBackend>();
    let cube = cube.map_err(|error| VolumeError::Device(format!("{error:?}")))?;
    expect_type(DType::I32, found)?;
    Ok(cube)
}

/// Back to burn's tensor.
pub(crate) fn float_tensor<const D: usize>(cube: CubeTensor) -> Tensor<D> {
    Tensor::from_primitive::<CubeBackend>(cube)
}

fn expect_type(expected: DType, found: DType) -> Result<(), VolumeError> {
    if expected == found {
        return Ok(());
    }
    Err(VolumeError::Type { expected, found })
}
