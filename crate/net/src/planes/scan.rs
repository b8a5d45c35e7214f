//! The selective scan over a plane: every state gathers its input from all pixels, weighed by a distance that the features
//! decide (method 3.1, Eq. 2 and 3 of the paper).

use burn::module::{Module, Param};
use burn::nn::conv::Conv2d;
use burn::nn::{Initializer, conv::Conv2dConfig};
use burn::tensor::{Device, Distribution, Tensor};

use super::layer::{convolved, pointwise};
use crate::ops::scan::{self, selective_scan};

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
        let along_rows = self.rows.scan(x, features.clone(), scan::Pass::Rows);
        self.columns.scan(along_rows, features, scan::Pass::Columns)
    }
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

    fn scan(&self, x: Tensor<4>, features: Tensor<4>, pass: scan::Pass) -> Tensor<4> {
        let step = convolved(&self.expand, convolved(&self.reduce, features));
        selective_scan(x, step, self.log_rate.val(), pass)
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
