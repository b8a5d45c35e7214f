//! One sweep of one keyframe, done in steps: in a browser's worker nothing else happens during a step.

use crate::{
    Recipe, StereoError,
    depth::{self, Raw},
    fused::FusedMatcher,
    planes,
    smooth::{self, SmoothConfig},
    sweep::{self, SweepConfig},
    view::View,
};
use std::rc::Rc;

/// Rows that a step of the processor's form takes: all where threads share them, a few where there is one.
const ROWS_A_STEP: usize = if cfg!(target_family = "wasm") {
    32
} else {
    usize::MAX
};

/// A sweep that is going on.
pub(crate) struct Pass {
    /// Index of the keyframe among the keyframes.
    pub(crate) keyframe: usize,
    /// Whether it is the second, around local planes.
    pub(crate) fine: bool,
    reference: Rc<View>,
    sources: Vec<(usize, Rc<View>)>,
    base: Option<Vec<f32>>,
    offsets: Vec<f32>,
    sweep: SweepConfig,
    smooth: SmoothConfig,
    /// Of the rows that are done.
    cost: Vec<f32>,
    rows_done: usize,
}

impl Pass {
    /// The first sweep of a keyframe, over all planes: inverse depths `planes` in 1/m.
    pub(crate) fn coarse(
        keyframe: usize,
        reference: Rc<View>,
        sources: Vec<(usize, Rc<View>)>,
        planes: Vec<f32>,
        recipe: &Recipe,
    ) -> Self {
        Self {
            keyframe,
            fine: false,
            reference,
            sources,
            base: None,
            offsets: planes,
            sweep: recipe.sweep,
            smooth: recipe.smooth,
            cost: Vec::new(),
            rows_done: 0,
        }
    }

    /// The second sweep, around the local planes of what this one found.
    pub(crate) fn refined(self, found: &Raw, recipe: &Recipe) -> Self {
        let (gray, size) = (&self.reference.gray, self.reference.size());
        let weights = planes::weights(&found.zncc);
        let base = planes::local_planes(&found.rho, &weights, gray, size, &recipe.planes);
        let step = self.offsets[1] - self.offsets[0];
        Self {
            fine: true,
            base: Some(base),
            offsets: recipe.fine_offsets(step),
            sweep: recipe.fine_sweep,
            smooth: recipe.fine_smooth,
            cost: Vec::new(),
            rows_done: 0,
            ..self
        }
    }

    /// The correlation of each pixel at the depth that was found, in the wider window of [`Recipe::proof`] and with the
    /// noise that the picture has; 0 where no source sees the point.
    pub(crate) fn prove(&self, found: &Raw, recipe: &Recipe) -> Vec<f32> {
        let sources: Vec<&View> = self.sources.iter().map(|(_, view)| &**view).collect();
        let at_depth = Some(found.rho.as_slice());
        let config = SweepConfig {
            noise_var: recipe.proof.noise_var.max(self.reference.noise_var()),
            ..recipe.proof
        };
        let cost = sweep::sweep(&self.reference, &sources, at_depth, &[0.0], &config);
        cost.iter().map(|cost| 1.0 - cost).collect()
    }

    /// Goes on, on the device if there are kernels for it; the result once there is one.
    pub(crate) async fn advance(
        &mut self,
        kernels: Option<&mut FusedMatcher>,
    ) -> Result<Option<Raw>, StereoError> {
        let base = self.base.as_deref();
        if let Some(kernels) = kernels {
            let sources: Vec<(usize, &View)> =
                self.sources.iter().map(|(k, view)| (*k, &**view)).collect();
            let (sweep, smooth) = (&self.sweep, &self.smooth);
            let matched = kernels.match_view(
                &self.reference,
                &sources,
                base,
                &self.offsets,
                sweep,
                smooth,
            );
            return matched.await.map(Some);
        }
        let size = self.reference.size();
        if self.rows_done < size.1 {
            let sources: Vec<&View> = self.sources.iter().map(|(_, view)| &**view).collect();
            let rows = self.rows_done..size.1.min(self.rows_done.saturating_add(ROWS_A_STEP));
            self.rows_done = rows.end;
            let cost = sweep::sweep_rows(
                &self.reference,
                &sources,
                base,
                &self.offsets,
                &self.sweep,
                rows,
            );
            if self.cost.is_empty() {
                self.cost = cost;
            } else {
                self.cost.extend(cost);
            }
            return Ok(None);
        }
        let (gray, planes) = (&self.reference.gray, self.offsets.len());
        let sum = smooth::smooth(&self.cost, gray, size, planes, &self.smooth);
        Ok(Some(depth::winners(&self.cost, &sum, base, &self.offsets)))
    }
}
