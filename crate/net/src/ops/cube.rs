//! What kernels for WebGPU and its native relatives have in common. They are forward only: a tensor that is differentiated
//! takes the tensor operations, unless its operation has a way back of its own.
//!
//! A thread keeps its sums in registers and reads weights at places that all threads of a workgroup share; workgroup memory
//! and barriers are left out, for the rasterisers that play a GPU on a processor pay dearly for them. Sizes are numbers
//! given at run time wherever they do not decide how much a thread holds: every pipeline takes a browser time to make. Products are
//! added by `a + b * c`, which a GPU's compiler joins: an explicit `fma` takes SwiftShader nearly twice as long.

use burn::backend::{DispatchDevice, TensorMetadata};
use burn::tensor::{DType, Device, Int, Shape, Tensor};
use burn_cubecl::kernel::into_contiguous;
use burn_cubecl::ops::numeric::empty_device_contiguous_dtype;
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use cubecl::prelude::*;

/// Threads of a workgroup.
pub(crate) const THREADS: u32 = 64;
/// WebGPU allows 65,535 workgroups in a dimension.
const GROUPS: u32 = 1 << 15;

/// In a browser a device is either a GPU or the processor, and nothing is differentiated: tensor operations for any other case
/// are left out of the engine there, with the matrix products and convolutions of burn's that only they ask for.
pub(crate) const NO_OTHER: bool = cfg!(target_family = "wasm");

/// Whether tensor operations stand in for all kernels.
#[cfg(not(target_family = "wasm"))]
static PLAIN: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);

/// For the whole process: tensor operations instead of kernels, so that a benchmark can set the two beside each other.
#[cfg(not(target_family = "wasm"))]
pub fn use_plain(plain: bool) {
    PLAIN.store(plain, std::sync::atomic::Ordering::Relaxed);
}

/// What [`use_plain`] was told last. A browser's engine has kernels alone.
pub(crate) fn plain() -> bool {
    #[cfg(not(target_family = "wasm"))]
    return PLAIN.load(std::sync::atomic::Ordering::Relaxed);
    #[cfg(target_family = "wasm")]
    false
}

/// Whether `device` runs the kernels that have no gradient.
pub fn runs_on(device: &Device) -> bool {
    !plain() && !device.is_autodiff() && matches!(device.as_dispatch(), DispatchDevice::Cube(_))
}

/// The device's own handle of a float tensor on a device that [`runs_on`] is true of, row by row.
pub(crate) fn numbers<const D: usize>(tensor: Tensor<D>) -> CubeTensor {
    match tensor.try_into_primitive::<CubeBackend>() {
        Ok(cube) => rows(cube),
        Err(error) => panic!("a tensor of a device that runs kernels: {error:?}"),
    }
}

/// The device's own handle of a tensor of whole numbers, as [`numbers`].
pub(crate) fn whole_numbers<const D: usize>(tensor: Tensor<D, Int>) -> CubeTensor {
    match tensor.try_into_primitive::<CubeBackend>() {
        Ok(cube) => rows(cube),
        Err(error) => panic!("a tensor of a device that runs kernels: {error:?}"),
    }
}

/// Back to burn's tensor.
pub(crate) fn tensor<const D: usize>(cube: CubeTensor) -> Tensor<D> {
    Tensor::from_primitive::<CubeBackend>(cube)
}

/// The numbers of a tensor row by row, without gaps.
pub(crate) fn rows(tensor: CubeTensor) -> CubeTensor {
    into_contiguous(tensor)
}

/// A tensor of any numbers on the device of `beside`.
pub(crate) fn empty(shape: impl Into<Shape>, beside: &CubeTensor) -> CubeTensor {
    let (client, device) = (beside.client.clone(), beside.device.clone());
    empty_device_contiguous_dtype(client, device, shape.into(), DType::F32)
}

/// Workgroups of [`THREADS`] for `threads` threads that go by `ABSOLUTE_POS`; more than asked for, so that a kernel must let those
/// past the end go.
pub(crate) fn groups(threads: usize) -> CubeCount {
    let groups = (threads as u32).div_ceil(THREADS).max(1);
    match groups > GROUPS {
        true => CubeCount::Static(GROUPS, groups.div_ceil(GROUPS), 1),
        false => CubeCount::Static(groups, 1, 1),
    }
}

/// The largest of the given steps that divides `count`.
pub(crate) fn largest_step(count: usize, steps: &[usize]) -> usize {
    let fitting = steps
        .iter()
        .copied()
        .filter(|step| count.is_multiple_of(*step));
    fitting.max().unwrap_or(1)
}

/// The sizes of a tensor.
pub(crate) fn dims<const D: usize>(tensor: &CubeTensor) -> [usize; D] {
    tensor.shape().dims()
}
