//! The gradient of batch normalisation in training.

use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, AutodiffBackend};

use super::BatchNormalisation;
use crate::ops::hand_on;

#[derive(Debug)]
struct Normalised;

impl<B: BatchNormalisation> Backward<B, 3> for Normalised {
    /// Input, gamma, beta, mean, variance; epsilon and whether a ReLU follows.
    type State = ([FloatTensor<B>; 5], f64, bool);

    fn backward(
        self,
        ops: Ops<Self::State, 3>,
        grads: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let grad = grads.consume::<B>(&ops.node);
        let ([x, gamma, beta, mean, variance], epsilon, relu) = ops.state;
        let found = B::normalised_backward(x, gamma, beta, mean, variance, grad, epsilon, relu);
        let inputs = ops.parents.map(|parent| parent.map(|parent| parent.id));
        hand_on::<B, _>(grads, inputs, [found.0, found.1, found.2]);
    }
}

impl<B: BatchNormalisation, C: CheckpointStrategy> BatchNormalisation for Autodiff<B, C> {
    fn normalised(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        epsilon: f64,
        relu: bool,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>) {
        let prepared = Normalised.prepare::<C>([x.node(), gamma.node(), beta.node()]);
        let [x, gamma, beta] = [x, gamma, beta].map(|tensor| tensor.into_primitive());
        let (y, mean, variance) =
            B::normalised(x.clone(), gamma.clone(), beta.clone(), epsilon, relu);
        let y = match prepared.compute_bound().stateful() {
            OpsKind::Tracked(prepared) => {
                let kept = [x, gamma, beta, mean.clone(), variance.clone()];
                prepared.finish((kept, epsilon, relu), y)
            }
            OpsKind::UnTracked(prepared) => prepared.finish(y),
        };
        (y, Self::from_inner(mean), Self::from_inner(variance))
    }
}
