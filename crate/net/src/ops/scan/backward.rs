//! The scan as one step of differentiation, which keeps its inputs alone.

use burn::backend::Autodiff;
use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;

use super::{Pass, SelectiveScan, SelectiveScanGradient};
use crate::ops::hand_on;

#[derive(Debug)]
struct Scanned;

impl<B: SelectiveScanGradient> Backward<B, 3> for Scanned {
    type State = ([FloatTensor<B>; 3], Pass);

    fn backward(
        self,
        ops: Ops<Self::State, 3>,
        grads: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let grad = grads.consume::<B>(&ops.node);
        let ([x, step, log_rate], pass) = ops.state;
        let found = B::selective_scan_backward(x, step, log_rate, grad, pass);
        let inputs = ops.parents.map(|parent| parent.map(|parent| parent.id));
        hand_on::<B, _>(grads, inputs, [found.0, found.1, found.2]);
    }
}

impl<B: SelectiveScanGradient, C: CheckpointStrategy> SelectiveScan for Autodiff<B, C> {
    fn selective_scan(
        x: FloatTensor<Self>,
        step: FloatTensor<Self>,
        log_rate: FloatTensor<Self>,
        pass: Pass,
    ) -> FloatTensor<Self> {
        let prepared = Scanned.prepare::<C>([x.node(), step.node(), log_rate.node()]);
        let [x, step, log_rate] = [x, step, log_rate].map(|tensor| tensor.into_primitive());
        match prepared.compute_bound().stateful() {
            OpsKind::Tracked(prepared) => {
                let y = B::selective_scan(x.clone(), step.clone(), log_rate.clone(), pass);
                prepared.finish(([x, step, log_rate], pass), y)
            }
            OpsKind::UnTracked(prepared) => {
                prepared.finish(B::selective_scan(x, step, log_rate, pass))
            }
        }
    }
}
