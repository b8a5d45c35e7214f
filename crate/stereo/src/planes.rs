//! Local planes: what a keyframe's depth looks like when every pixel lies on the plane through its neighbours.
//!
//! A plane in space is affine in inverse depth, so around each pixel `rho(dx, dy) = c + a dx + b dy` is fitted by weighted
//! least squares to the trusted neighbours of similar grey and similar inverse depth; Cauchy weights let edges be edges.

use rayon::prelude::*;

/// Neighbours of the worst match still count this much.
const LEAST_WEIGHT: f32 = 0.01;
/// A correlation up to here says nothing.
const NO_MATCH: f32 = 0.05;
/// Weight of a pixel's own inverse depth where nothing else is trusted.
const OWN: f32 = 1e-6;

/// How planes are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanesConfig {
    /// Neighbours up to this many pixels away, across and down.
    pub radius: i32,
    /// Every n-th of them.
    pub stride: i32,
    /// Difference in grey at which a neighbour counts half.
    pub gray: f32,
    /// Relative difference in inverse depth at which a neighbour counts half.
    pub relative: f32,
    /// Pull of the slopes towards zero, in squared pixels: a few neighbours in a row do not tilt the plane.
    pub ridge: f32,
}

/// How much each pixel is trusted, from its correlation.
pub fn weights(zncc: &[f32]) -> Vec<f32> {
    let weight = |z: &f32| (z - NO_MATCH).clamp(LEAST_WEIGHT, 1.0);
    zncc.iter().map(weight).collect()
}

/// The inverse depth of each pixel's local plane at the pixel, in 1/m. `rho`, `weight` and `gray` have `[height * width]` values.
pub fn local_planes(
    rho: &[f32],
    weight: &[f32],
    gray: &[f32],
    (width, height): (usize, usize),
    config: &PlanesConfig,
) -> Vec<f32> {
    let fit = |at: usize| {
        let (x, y) = ((at % width) as i32, (at / width) as i32);
        let (own_gray, own_rho) = (gray[at], rho[at]);
        let steps = |centre: i32, size: usize| {
            let inside = move |d: &i32| (0..size as i32).contains(&(centre + d));
            let steps = (-config.radius..=config.radius).step_by(config.stride as usize);
            steps.filter(inside)
        };
        let mut sums = Sums::default();
        for dy in steps(y, height) {
            for dx in steps(x, width) {
                let there = (y + dy) as usize * width + (x + dx) as usize;
                let off = rho[there] - own_rho;
                let by_gray = (gray[there] - own_gray) / config.gray;
                let by_rho = off / (config.relative * own_rho);
                let similar = (1.0 + by_gray * by_gray) * (1.0 + by_rho * by_rho);
                sums.add(weight[there] / similar, dx as f32, dy as f32, off);
            }
        }
        (own_rho + sums.at_centre(config.ridge)).max(crate::sample::LEAST_RHO)
    };
    let mut planes = vec![0.0; rho.len()];
    planes
        .par_iter_mut()
        .enumerate()
        .for_each(|(at, plane)| *plane = fit(at));
    planes
}

/// Weighted sums of positions and offsets.
#[derive(Default)]
struct Sums {
    one: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
    v: f32,
    xv: f32,
    yv: f32,
}

impl Sums {
    fn add(&mut self, weight: f32, x: f32, y: f32, value: f32) {
        let (wx, wy, wv) = (weight * x, weight * y, weight * value);
        self.one += weight;
        self.x += wx;
        self.y += wy;
        self.xx += wx * x;
        self.xy += wx * y;
        self.yy += wy * y;
        self.v += wv;
        self.xv += wv * x;
        self.yv += wv * y;
    }

    /// The fitted plane's value at (0, 0).
    fn at_centre(&self, ridge: f32) -> f32 {
        let one = self.one + OWN;
        let (x, y, v) = (self.x / one, self.y / one, self.v / one);
        let xx = self.xx - one * x * x + ridge * one;
        let yy = self.yy - one * y * y + ridge * one;
        let xy = self.xy - one * x * y;
        let (xv, yv) = (self.xv - one * x * v, self.yv - one * y * v);
        let determinant = xx * yy - xy * xy;
        if determinant <= 1e-9 {
            return v;
        }
        let a = (xv * yy - yv * xy) / determinant;
        let b = (yv * xx - xv * xy) / determinant;
        v - a * x - b * y
    }
}
