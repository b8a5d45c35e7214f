//! 2D metrics: a rendered depth map against the sensor's.

use serde::Serialize;

/// Ground truth from this depth on does not count.
const FAR_M: f32 = 10.0;

/// Figures of one frame, or their mean over frames, after Table 2 of the paper and Eigen et al. 2014. With p the
/// rendered and g the measured depth, over the pixels with p > 0 and 0 < g < 10 m; NaN without such pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Depth2d {
    /// Mean of |p - g| / g.
    pub abs_rel: f64,
    /// Mean of |p - g|, metres.
    pub abs_diff: f64,
    /// Mean of (p - g)^2 / g, metres.
    pub sq_rel: f64,
    /// Root of the mean of (p - g)^2, metres.
    pub rmse: f64,
    /// Root of the mean of (ln p - ln g)^2.
    pub log_rmse: f64,
    /// Share with max(p / g, g / p) < 1.25.
    pub delta_1: f64,
    /// Share with max(p / g, g / p) < 1.25^2.
    pub delta_2: f64,
    /// Share with max(p / g, g / p) < 1.25^3.
    pub delta_3: f64,
    /// Share of all pixels with p > 0.
    pub completeness: f64,
}

/// Figures of one frame from two depth maps in metres, 0 = no data. `None` when the maps differ in size or have no
/// pixels.
pub fn depth_2d(pred: &[f32], gt: &[f32]) -> Option<Depth2d> {
    if pred.len() != gt.len() || pred.is_empty() {
        return None;
    }
    let mut sums = [0.0; 8];
    let mut valid = 0_usize;
    for (&p, &g) in pred.iter().zip(gt) {
        if !(p > 0.0 && g > 0.0 && g < FAR_M) {
            continue;
        }
        valid += 1;
        let (p, g) = (f64::from(p), f64::from(g));
        let difference = (p - g).abs();
        let ratio = (p / g).max(g / p);
        let below = |power| f64::from(u8::from(ratio < 1.25_f64.powi(power)));
        let terms = [
            difference / g,
            difference,
            difference * difference / g,
            difference * difference,
            (p.ln() - g.ln()).powi(2),
            below(1),
            below(2),
            below(3),
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term;
        }
    }
    let mean = sums.map(|sum| sum / valid as f64);
    let rendered = pred.iter().filter(|&&p| p > 0.0).count();
    Some(Depth2d {
        abs_rel: mean[0],
        abs_diff: mean[1],
        sq_rel: mean[2],
        rmse: mean[3].sqrt(),
        log_rmse: mean[4].sqrt(),
        delta_1: mean[5],
        delta_2: mean[6],
        delta_3: mean[7],
        completeness: rendered as f64 / pred.len() as f64,
    })
}

/// The mean over frames, each figure over the frames that have it. `None` without frames.
pub fn mean(frames: &[Depth2d]) -> Option<Depth2d> {
    if frames.is_empty() {
        return None;
    }
    let over = |figure: fn(&Depth2d) -> f64| {
        let known = frames.iter().map(figure).filter(|value| !value.is_nan());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    };
    Some(Depth2d {
        abs_rel: over(|f| f.abs_rel),
        abs_diff: over(|f| f.abs_diff),
        sq_rel: over(|f| f.sq_rel),
        rmse: over(|f| f.rmse),
        log_rmse: over(|f| f.log_rmse),
        delta_1: over(|f| f.delta_1),
        delta_2: over(|f| f.delta_2),
        delta_3: over(|f| f.delta_3),
        completeness: over(|f| f.completeness),
    })
}
