//! The sampling as one step of differentiation, which keeps its inputs alone.

use burn::backend::Autodiff;
use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;

use super::{AffineSampling, AffineSamplingGradient};
use crate::ops::hand_on;

#[derive(Debug)]
struct Sampled;

impl<B: AffineSamplingGradient> Backward<B, 2> for Sampled {
    type State = [FloatTensor<B>; 2];

    fn backward(
        self,
        ops: Ops<Self::State, 2>,
        grads: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let grad = grads.consume::<B>(&ops.node);
        let [planes, maps] = ops.state;
        let (of_planes, of_maps) = B::affine_sample_backward(planes, maps, grad);
        let inputs = ops.parents.map(|parent| parent.map(|parent| parent.id));
        hand_on::<B, _>(grads, inputs, [of_planes, of_maps]);
    }
}

impl<B: AffineSamplingGradient, C: CheckpointStrategy> AffineSampling for Autodiff<B, C> {
    fn affine_sample(planes: FloatTensor<Self>, maps: FloatTensor<Self>) -> FloatTensor<Self> {
        let prepared = Sampled.prepare::<C>([planes.node(), maps.node()]);
        let (planes, maps) = (planes.into_primitive(), maps.into_primitive());
        match prepared.compute_bound().stateful() {
            OpsKind::Tracked(prepared) => {
                let sampled = B::affine_sample(planes.clone(), maps.clone());
                prepared.finish([planes, maps], sampled)
            }
            OpsKind::UnTracked(prepared) => prepared.finish(B::affine_sample(planes, maps)),
        }
    }
}
