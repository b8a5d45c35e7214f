//! The selective scan of a plane along one axis, in both directions (method 3.1).

#[cfg(not(target_family = "wasm"))]
mod backward;
mod flex;
mod fused;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Tensor, activation::softplus};
use burn_flex::FlexTensor;

use super::linrec::linrec;
use super::{cube, on_processor};

/// Which way a scan goes, and how its input is scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Along rows; the input's gain is `(e^{du} - 1) / u`, exact zero-order hold over a step `d` (Eq. 3).
    Rows,
    /// Along columns; the gain is `1 - e^{du}`, the same for an input scaled by `|u|`: what already went along rows would
    /// otherwise gain up to a thousandfold a second time.
    Columns,
}

/// `L_t = forward_t + backward_t - v_t`, so that a pixel's own input counts once, where along the axis of `pass`
/// `forward_t = a_t forward_{t-1} + v_t`, `backward_t = a_t backward_{t+1} + v_t`, `a = e^{du}`, `v = gain(d, u) x`,
/// `d = softplus(step)`, `u = -e^{log_rate}`.
///
/// `x` and `step` are `[V, M, h, w]`, `log_rate` is `[M]`. On the processor one operation that keeps its inputs alone, on a GPU
/// without gradients one kernel; elsewhere tensor operations around [`linrec`].
pub fn selective_scan(x: Tensor<4>, step: Tensor<4>, log_rate: Tensor<1>, pass: Pass) -> Tensor<4> {
    assert_eq!(x.dims(), step.dims(), "inputs and steps of a scan");
    if on_processor(&x.device()) {
        return Tensor::from_dispatch(<Dispatch as SelectiveScan>::selective_scan(
            x.into_dispatch(),
            step.into_dispatch(),
            log_rate.into_dispatch(),
            pass,
        ));
    }
    if cube::runs_on(&x.device()) {
        return fused::scan(x, step, log_rate, pass);
    }
    composed(x, step, log_rate, pass)
}

/// [`selective_scan`] by tensor operations, on any device.
pub fn composed(x: Tensor<4>, step: Tensor<4>, log_rate: Tensor<1>, pass: Pass) -> Tensor<4> {
    let [states] = log_rate.dims();
    let rate = -log_rate.exp().reshape([1, states, 1, 1]);
    let keep = (softplus(step, 1.0) * rate.clone()).exp();
    match pass {
        Pass::Rows => both_ways(keep.clone(), (keep - 1.0) / rate * x),
        Pass::Columns => {
            let input = (-keep.clone() + 1.0) * x;
            both_ways(keep.swap_dims(2, 3), input.swap_dims(2, 3)).swap_dims(2, 3)
        }
    }
}

fn both_ways(keep: Tensor<4>, input: Tensor<4>) -> Tensor<4> {
    let forward = linrec(keep.clone(), input.clone(), false);
    let backward = linrec(keep, input.clone(), true);
    forward + backward - input
}

/// The processor's form of [`selective_scan`].
#[backend_extension(Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait SelectiveScan: Backend {
    /// See [`selective_scan`].
    fn selective_scan(
        x: FloatTensor<Self>,
        step: FloatTensor<Self>,
        log_rate: FloatTensor<Self>,
        pass: Pass,
    ) -> FloatTensor<Self>;
}

/// The way back, which a backend needs to be differentiated.
pub trait SelectiveScanGradient: SelectiveScan {
    /// Gradients of `x`, `step` and `log_rate` from the output's.
    fn selective_scan_backward(
        x: FloatTensor<Self>,
        step: FloatTensor<Self>,
        log_rate: FloatTensor<Self>,
        grad: FloatTensor<Self>,
        pass: Pass,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>);
}

impl SelectiveScan for Flex {
    fn selective_scan(
        x: FlexTensor,
        step: FlexTensor,
        log_rate: FlexTensor,
        pass: Pass,
    ) -> FlexTensor {
        flex::forward(x, step, log_rate, pass)
    }
}

impl SelectiveScanGradient for Flex {
    fn selective_scan_backward(
        x: FlexTensor,
        step: FlexTensor,
        log_rate: FlexTensor,
        grad: FlexTensor,
        pass: Pass,
    ) -> (FlexTensor, FlexTensor, FlexTensor) {
        flex::backward(x, step, log_rate, grad, pass)
    }
}
