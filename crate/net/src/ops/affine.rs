//! Planes seen through an affine map.

#[cfg(not(target_family = "wasm"))]
mod backward;
mod flex;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Int, Tensor, TensorData};
use burn_flex::FlexTensor;

use super::{cube, on_processor, planar};

/// Samples each of `planes` `[V, C, h, w]` at the affine image of its pixels, bilinearly, the edge repeated outside.
/// `maps` is `[V, 6]`, rows of `[a11 a12 a13; a21 a22 a23]`: `x' = a11 x + a12 y + a13`, `y' = a21 x + a22 y + a23`, in
/// coordinates from the middle of the plane whose unit is half its height along both axes, so that a rotation is one (method
/// 3.2; torch's `affine_grid` with `align_corners = false`, with `x` times `w / h` before and divided after).
///
/// Where a map leads exactly to a pixel, its gradient is the difference to the next pixel to the right and below. On the
/// processor one operation that keeps its inputs alone, on a GPU without gradients one kernel; elsewhere tensor operations.
pub fn affine_sample(planes: Tensor<4>, maps: Tensor<2>) -> Tensor<4> {
    if on_processor(&planes.device()) {
        return Tensor::from_dispatch(<Dispatch as AffineSampling>::affine_sample(
            planes.into_dispatch(),
            maps.into_dispatch(),
        ));
    }
    if cube::runs_on(&planes.device()) {
        return planar::affine_sample(planes, maps);
    }
    composed(planes, maps)
}

/// The processor's form of [`affine_sample`].
#[backend_extension(Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait AffineSampling: Backend {
    /// See [`affine_sample`].
    fn affine_sample(planes: FloatTensor<Self>, maps: FloatTensor<Self>) -> FloatTensor<Self>;
}

/// The way back, which a backend needs to be differentiated.
pub trait AffineSamplingGradient: AffineSampling {
    /// Gradients of `planes` and `maps` from the output's.
    fn affine_sample_backward(
        planes: FloatTensor<Self>,
        maps: FloatTensor<Self>,
        grad: FloatTensor<Self>,
    ) -> (FloatTensor<Self>, FloatTensor<Self>);
}

impl AffineSampling for Flex {
    fn affine_sample(planes: FlexTensor, maps: FlexTensor) -> FlexTensor {
        flex::forward(planes, maps)
    }
}

impl AffineSamplingGradient for Flex {
    fn affine_sample_backward(
        planes: FlexTensor,
        maps: FlexTensor,
        grad: FlexTensor,
    ) -> (FlexTensor, FlexTensor) {
        flex::backward(planes, maps, grad)
    }
}

/// [`affine_sample`] by tensor operations, on any device.
pub fn composed(planes: Tensor<4>, maps: Tensor<2>) -> Tensor<4> {
    let [views, channels, height, width] = planes.dims();
    let pixels = height * width;
    let device = planes.device();
    // In pixels from the middle the map has the same first two columns, and the third times h / 2: exact at the identity.
    let middle = [width, height].map(|side| (side as f32 - 1.0) / 2.0);
    let x: Vec<f32> = (0..pixels)
        .map(|p| (p % width) as f32 - middle[0])
        .collect();
    let y: Vec<f32> = (0..pixels)
        .map(|p| (p / width) as f32 - middle[1])
        .collect();
    let row =
        |values: Vec<f32>| Tensor::<2>::from_data(TensorData::new(values, [1, pixels]), &device);
    let (x, y) = (row(x), row(y));
    let entry = |i: usize| maps.clone().narrow(1, i, 1);
    let mapped = |first: usize, middle: f32, size: usize| {
        let from_middle = entry(first) * x.clone()
            + entry(first + 1) * y.clone()
            + entry(first + 2) * (height as f32 / 2.0);
        let at = (from_middle + middle).clamp(0.0, size as f32 - 1.0);
        let low = at.clone().detach().floor();
        (at - low.clone(), low)
    };
    let (right, column) = mapped(0, middle[0], width);
    let (down, row) = mapped(3, middle[1], height);

    let flat = planes.reshape([views, channels, pixels]);
    let corner = |dx: f32, dy: f32| {
        let column = (column.clone() + dx).clamp(0.0, width as f32 - 1.0);
        let row = (row.clone() + dy).clamp(0.0, height as f32 - 1.0);
        let index: Tensor<2, Int> = (row * width as f32 + column).int();
        let index: Tensor<3, Int> = index.reshape([views, 1, pixels]);
        flat.clone().gather(2, index.repeat_dim(1, channels))
    };
    let right = right.reshape([views, 1, pixels]);
    let down = down.reshape([views, 1, pixels]);
    let between = |a: Tensor<3>, b: Tensor<3>, at: &Tensor<3>| a.clone() + (b - a) * at.clone();
    let top = between(corner(0.0, 0.0), corner(1.0, 0.0), &right);
    let bottom = between(corner(0.0, 1.0), corner(1.0, 1.0), &right);
    between(top, bottom, &down).reshape([views, channels, height, width])
}
