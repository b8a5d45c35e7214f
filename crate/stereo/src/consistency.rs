//! What may be relied on: a depth that the source views' own depth bears out (Merrell et al. 2007, as a vote).
//!
//! The point of a reference pixel is projected into a source; the depth found there is brought back. The source agrees if that
//! lands within [`NEAR_PX`] of the pixel and within [`NEAR_RELATIVE`] of its depth.

use crate::view::{View, Warp, warp};
use rayon::prelude::*;

/// A point that comes back lands this near, in pixels,
const NEAR_PX: f32 = 2.0;
/// and its depth is this near, relative.
const NEAR_RELATIVE: f32 = 0.05;
/// Closely: half as far in pixels and this near in depth.
const CLOSE_RELATIVE: f32 = 0.02;
/// Uniqueness beyond this says no more.
const MOST_UNIQUE: f32 = 0.3;

/// What the sources say about one pixel's depth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Sources in whose picture the point lies.
    pub visible: u32,
    /// Those that agree.
    pub agree: u32,
    /// Those that agree closely.
    pub close: u32,
}

impl Verdict {
    /// How likely the depth is right (within 5 cm or 3 %), 0 to 1, given how unique its plane was; 0 if no source agrees.
    ///
    /// A logistic function of three shares. Fitted to sensor depth on two scans with all and with 60 % of the
    /// views, each alone gave almost the same coefficients.
    pub fn confidence(&self, unique: f32) -> f32 {
        if self.agree == 0 {
            return 0.0;
        }
        let visible = self.visible as f32 + 1.0;
        let (agree, close) = (self.agree as f32 / visible, self.close as f32 / visible);
        let unique = unique.min(MOST_UNIQUE) / MOST_UNIQUE;
        let score = -2.4 + 2.8 * agree + 3.1 * close + 1.5 * unique;
        1.0 / (1.0 + (-score).exp())
    }
}

/// A source as the judge needs it: there, back, and its own inverse depth.
struct Witness<'a> {
    to: Warp,
    back: Warp,
    rho: &'a [f32],
    size: (usize, usize),
}

/// The verdict on each pixel of `reference`, whose inverse depth is `rho` (1/m, `[height * width]`), by the inverse depth of
/// its sources.
pub fn judge<'a>(reference: &View, rho: &[f32], sources: &[(&View, &'a [f32])]) -> Vec<Verdict> {
    let width = reference.size().0;
    let witness = |&(source, rho): &(&View, &'a [f32])| Witness {
        to: warp(reference, source),
        back: warp(source, reference),
        rho,
        size: source.size(),
    };
    let witnesses: Vec<Witness<'_>> = sources.iter().map(witness).collect();
    let mut verdicts = vec![Verdict::default(); rho.len()];
    let pixels = verdicts.par_iter_mut().zip(rho).enumerate();
    pixels.for_each(|(at, (verdict, &rho))| {
        let (x, y) = ((at % width) as f32, (at / width) as f32);
        for witness in &witnesses {
            witness.ask(x, y, rho, verdict);
        }
    });
    verdicts
}

impl Witness<'_> {
    fn ask(&self, x: f32, y: f32, rho: f32, verdict: &mut Verdict) {
        let Some((u, v, _)) = self.to.apply(x, y, rho) else {
            return;
        };
        let (u, v) = ((u + 0.5).floor(), (v + 0.5).floor());
        let inside = u >= 0.0 && v >= 0.0 && u < self.size.0 as f32 && v < self.size.1 as f32;
        if !inside {
            return;
        }
        let found = self.rho[v as usize * self.size.0 + u as usize];
        if found <= 0.0 {
            return;
        }
        verdict.visible += 1;
        let Some((x_back, y_back, rho_back)) = self.back.apply(u, v, found) else {
            return;
        };
        let off_px = ((x_back - x) * (x_back - x) + (y_back - y) * (y_back - y)).sqrt();
        let off = (rho / rho_back - 1.0).abs();
        if off_px <= NEAR_PX && off <= NEAR_RELATIVE {
            verdict.agree += 1;
            if off_px <= 0.5 * NEAR_PX && off <= CLOSE_RELATIVE {
                verdict.close += 1;
            }
        }
    }
}
