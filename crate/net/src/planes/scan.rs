//! The selective scan over a plane: every state gathers its input from all pixels, weighed by a distance that the features
//! decide (method 3.1, Eq. 2 and 3 of the paper).

use burn::module::{Module, Param};
use burn::nn::conv::Conv2d;
use burn::nn::{Initializer, conv::Conv2dConfig};
use burn::tensor::{Device, Distribution, Tensor, activation::softplus};

use super::layer::{convolved, of_channels, pointwise};
use crate::ops::linrec::linrec;

/// Along rows, then along columns, each in both directions. With constant steps this is
/// `sum over pixels j of exp(u d (|dx| + |dy|)) x_j`, up to the second pass's gain: exponential decay with Manhattan distance.
#[derive(Module, Debug)]
pub struct SeparableScan {
    rows: Pass,
    columns: Pass,
}

impl SeparableScan {
    /// `states` recurrences whose steps come from `channels` features through `rank` numbers.
    pub fn init(channels: usize, rank: usize, states: usize, device: &Device) -> Self {
        Self {
            rows: Pass::init(channels, rank, states, device),
            columns: Pass::init(channels, rank, states, device),
        }
    }

    /// Input `[V, M, h, w]`, steps from features `[V, C, h, w]`; `[V, M, h, w]`.
    pub fn forward(&self, x: Tensor<4>, features: Tensor<4>) -> Tensor<4> {
        // Exact zero-order hold of dL/ds = u L + x over a step d: gain (e^{du} - 1) / u.
        let step = self.rows.step(features.clone());
        let u = self.rows.rate();
        let keep = (step * u.clone()).exp();
        let input = (keep.clone() - 1.0) / u * x;
        let along_rows = both_ways(keep, input);

        // Here the input is scaled by |u|: slow states would otherwise gain up to a thousandfold a second time.
        let step = self.columns.step(features);
        let keep = (step * self.columns.rate()).exp();
        let input = (-keep.clone() + 1.0) * along_rows;
        both_ways(keep.swap_dims(2, 3), input.swap_dims(2, 3)).swap_dims(2, 3)
    }
}

/// Forward plus backward along the last axis; each pixel's own input counts once.
fn both_ways(keep: Tensor<4>, input: Tensor<4>) -> Tensor<4> {
    let forward = linrec(keep.clone(), input.clone(), false);
    let backward = linrec(keep, input.clone(), true);
    forward + backward - input
}

/// One direction's steps and rates.
#[derive(Module, Debug)]
struct Pass {
    /// `C -> rank`.
    reduce: Conv2d,
    /// `rank -> M`; its bias is the step's before softplus.
    expand: Conv2d,
    /// `ln(-u)` of each state.
    log_rate: Param<Tensor<1>>,
}

impl Pass {
    fn init(channels: usize, rank: usize, states: usize, device: &Device) -> Self {
        let narrow: Conv2dConfig = pointwise(channels, rank).with_bias(false);
        let mut expand = pointwise(rank, states).init(device);
        // Steps start log-uniform in [1e-3, 1e-1], as Mamba's: softplus(bias) = step.
        let log_step = Distribution::Uniform(1e-3_f64.ln(), 1e-1_f64.ln());
        let step = Tensor::<1>::random([states], log_step, device).exp();
        expand.bias = Some(Param::from_tensor((step.exp() - 1.0).log()));
        // S4D-Real: rates -1, -2, ... -M.
        let rates: Vec<f32> = (1..=states).map(|m| (m as f32).ln()).collect();
        Self {
            reduce: narrow.init(device),
            expand,
            log_rate: Param::from_tensor(Tensor::from_floats(rates.as_slice(), device)),
        }
    }

    /// The step `d > 0` of each state at each pixel.
    fn step(&self, features: Tensor<4>) -> Tensor<4> {
        let low = convolved(&self.reduce, features);
        softplus(convolved(&self.expand, low), 1.0)
    }

    /// `u < 0`, to be broadcast.
    fn rate(&self) -> Tensor<4> {
        -of_channels(self.log_rate.val().exp())
    }
}

/// A weight for states that are driven by all channels: `w` of Eq. 3, N(0, 1 / C).
pub(super) fn driving(channels: usize, states: usize, device: &Device) -> Conv2d {
    pointwise(channels, states)
        .with_bias(false)
        .with_initializer(Initializer::Normal {
            mean: 0.0,
            std: (channels as f64).sqrt().recip(),
        })
        .init(device)
}

/// Rank of the step's projection for a level of `channels`.
pub(super) fn rank(channels: usize) -> usize {
    channels.div_ceil(16)
}
