//! The numbers that stereo goes by. They were chosen on real scans and on rooms made by rule; ARCHITECTURE.md has the
//! figures.

use crate::{planes::PlanesConfig, smooth::SmoothConfig, sweep::SweepConfig};

/// How a keyframe is matched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// How views are compared over the whole range of depth.
    pub sweep: SweepConfig,
    /// How neighbours agree there.
    pub smooth: SmoothConfig,
    /// The local planes around which the second sweep goes.
    pub planes: PlanesConfig,
    /// Hypotheses of the second sweep on each side of the plane.
    pub fine_reach: usize,
    /// Their distance, as a share of the first sweep's.
    pub fine_step: f32,
    /// How views are compared the second time.
    pub fine_sweep: SweepConfig,
    /// How neighbours agree the second time: on how far they lie off their planes.
    pub fine_smooth: SmoothConfig,
    /// How views are compared once more at the depth that was found, in a wider window: noise that happened to match in the
    /// narrow one does not fill it, faint texture does. Its variance of noise is the least; a picture may have more.
    pub proof: SweepConfig,
    /// A depth is kept from this correlation on in that comparison.
    pub least_proof: f32,
    /// A depth that two sources agree with is kept from this confidence on.
    pub least_confidence: f32,
    /// A depth that a single source agrees with is kept from this confidence on.
    pub least_confidence_alone: f32,
}

impl Default for Recipe {
    fn default() -> Self {
        let sweep = SweepConfig {
            radius: 2,
            noise_var: 0.1,
            best: 0.5,
        };
        Self {
            sweep,
            smooth: SmoothConfig {
                p1: 0.1,
                p2: 1.0,
                edge: 10.0,
            },
            planes: PlanesConfig {
                radius: 8,
                stride: 2,
                gray: 10.0,
                relative: 0.03,
                ridge: 1.0,
            },
            fine_reach: 8,
            fine_step: 0.25,
            fine_sweep: sweep,
            fine_smooth: SmoothConfig {
                p1: 0.07,
                p2: 0.45,
                edge: 10.0,
            },
            proof: SweepConfig { radius: 4, ..sweep },
            least_proof: 0.3,
            least_confidence: 0.2,
            least_confidence_alone: 0.3,
        }
    }
}

impl Recipe {
    /// Offsets of the second sweep in 1/m, for planes that lie `step` apart in the first.
    pub fn fine_offsets(&self, step: f32) -> Vec<f32> {
        let reach = self.fine_reach as i32;
        (-reach..=reach)
            .map(|i| i as f32 * step * self.fine_step)
            .collect()
    }
}
