//! The winning plane of every pixel, between two planes where the costs beside it say so.

use crate::{
    lanes::{least_of, less},
    sweep::Spacing,
};
use rayon::prelude::*;

/// Planes this near to the winner do not count as another choice.
const SAME: usize = 2;
/// Paths that a smoothed cost is the sum of.
const PATHS: f32 = 8.0;

/// What matching gives, before anyone else is asked; `[height * width]` each.
#[derive(Clone, Debug)]
pub struct Raw {
    /// Inverse depth in 1/m.
    pub rho: Vec<f32>,
    /// Mean correlation with the counted sources at the winning plane, before smoothing.
    pub zncc: Vec<f32>,
    /// How much worse the best plane elsewhere is, in cost a path.
    pub unique: Vec<f32>,
}

/// Winner takes all: the first least of `sum`, moved to the least of the parabola through it and its neighbours. `cost` and `sum`
/// are `[height * width * offsets]`, planes innermost; `base` and `offsets` (1/m, evenly spaced) as in the sweep.
pub fn winners(cost: &[f32], sum: &[f32], base: Option<&[f32]>, offsets: &[f32]) -> Raw {
    let planes = offsets.len();
    let pixels = cost.len() / planes.max(1);
    let spacing = Spacing::of(offsets);
    let winner = |at: usize| {
        let cells = at * planes..(at + 1) * planes;
        let (cost, sum) = (&cost[cells.clone()], &sum[cells]);
        let least = least_of(sum);
        let best = sum.iter().position(|&sum| sum == least).unwrap_or(0);
        let shift = match best {
            0 => 0.0,
            _ if best + 1 == planes => 0.0,
            _ => vertex(sum[best - 1], sum[best], sum[best + 1]),
        };
        let (before, after) = (best.saturating_sub(SAME), (best + SAME + 1).min(planes));
        let second = less(least_of(&sum[..before]), least_of(&sum[after..]));
        let base = base.map_or(0.0, |base| base[at]);
        let rho = base + spacing.at(best as f32 + shift);
        (rho, (1.0 - cost[best], (second - sum[best]) / PATHS))
    };
    let (rho, (zncc, unique)) = (0..pixels).into_par_iter().map(winner).unzip();
    Raw { rho, zncc, unique }
}

/// Where between -0.5 and 0.5 the parabola through three values at -1, 0 and 1 is least.
fn vertex(before: f32, at: f32, after: f32) -> f32 {
    let bend = before - 2.0 * at + after;
    if bend <= 1e-6 {
        return 0.0;
    }
    (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
}
