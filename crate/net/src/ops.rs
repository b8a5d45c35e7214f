//! Operations that burn does not have. Each is a trait of burn's backend extension with a plain body of tensor operations.

pub mod affine;
pub mod attention;
pub mod batch_norm;
pub mod channel_norm;
pub(crate) mod cube;
pub mod depthwise;
pub(crate) mod flex;
pub mod folded;
pub(crate) mod functions;
mod lanes;
pub(crate) mod linear;
mod lines;
pub mod linrec;
mod padded;
pub(crate) mod planar;
pub mod pointwise;
pub mod pool;
pub(crate) mod register;
pub mod rows;
pub mod scan;
pub mod segments;
pub mod silu;
pub mod sparse_conv;
pub mod upsample;
pub mod views;
pub(crate) mod wide;

use burn::backend::DispatchDevice;
#[cfg(not(target_family = "wasm"))]
use burn::backend::{
    Backend,
    autodiff::{NodeId, grads::Gradients},
    tensor::FloatTensor,
};
use burn::tensor::Device;

#[cfg(not(target_family = "wasm"))]
pub use cube::use_plain;

/// Whether `device` computes in flex's loops, with or without differentiation.
pub(crate) fn on_processor(device: &Device) -> bool {
    let plain = device.clone().without_autodiff();
    matches!(plain.as_dispatch(), DispatchDevice::Flex(_))
}

/// Hands an operation's gradients on to those of its inputs that want theirs.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn hand_on<B: Backend, const N: usize>(
    grads: &mut Gradients,
    inputs: [Option<NodeId>; N],
    found: [FloatTensor<B>; N],
) {
    for (input, found) in inputs.into_iter().zip(found) {
        if let Some(input) = input {
            grads.register::<B>(input, found);
        }
    }
}
