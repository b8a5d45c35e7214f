//! How steady results stay when fewer views are used: the paper's stability indicators (its Table 5).
//!
//! The paper mixes two conventions of the standard deviation, so both are here and a report must say which it prints.

/// Divisor of the variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deviation {
    /// n - 1: the runs are a sample.
    Sample,
    /// n: the runs are all there is.
    Population,
}

/// Coefficient of variation, sigma / mu, as a fraction. NaN when `values` has fewer numbers than sigma needs.
pub fn coefficient_of_variation(values: &[f64], deviation: Deviation) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let divisor = match deviation {
        Deviation::Sample => count - 1.0,
        Deviation::Population => count,
    };
    (squares / divisor).sqrt() / mean
}

/// Performance retention rate, P_few / P_many, as a fraction (the paper: 60 and 100 views).
pub fn performance_retention(few: f64, many: f64) -> f64 {
    few / many
}

/// Mean retention over several metrics given as (few, many); the paper: precision, recall and F-score.
pub fn mean_performance_retention(metrics: &[(f64, f64)]) -> f64 {
    let sum: f64 = metrics
        .iter()
        .map(|&(few, many)| performance_retention(few, many))
        .sum();
    sum / metrics.len() as f64
}

/// Maximum performance drop as the paper defines it, (P_many - P_few) / P_many, as a fraction. Blind to a peak between
/// the two.
pub fn max_drop(few: f64, many: f64) -> f64 {
    (many - few) / many
}

/// Stability index: the product over metrics of 1 - (max - min) / max. Each slice holds one metric at every number of
/// views; the paper: F-score, precision, recall.
pub fn stability_index(metrics: &[&[f64]]) -> f64 {
    let steadiness = |values: &&[f64]| {
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        lowest / highest
    };
    metrics.iter().map(steadiness).product()
}
