//! Gradients. That of the input is the same convolution with the map turned round and each tap's matrix transposed;
//! nothing gathered is kept from the way forward.

use super::SparseConv;
use burn::backend::{
    Autodiff, Backend,
    tensor::{FloatTensor, IntTensor},
};
use burn_autodiff::{
    NodeId,
    checkpoint::{base::Checkpointer, strategy::CheckpointStrategy},
    grads::Gradients,
    ops::{Backward, Ops, OpsKind},
};

#[derive(Debug)]
struct Gradient;

impl<B: Backend + SparseConv> Backward<B, 2> for Gradient {
    type State = (NodeId, NodeId, IntTensor<B>, IntTensor<B>);

    fn backward(
        self,
        ops: Ops<Self::State, 2>,
        grads: &mut Gradients,
        checkpointer: &mut Checkpointer,
    ) {
        let [of_features, of_weight] = ops.parents;
        let gradient = grads.consume::<B>(&ops.node);
        let (features, weight, gather, scatter) = ops.state;
        let features = checkpointer.retrieve_node_output::<FloatTensor<B>>(features);
        let weight = checkpointer.retrieve_node_output::<FloatTensor<B>>(weight);
        if let Some(node) = of_weight {
            let gradient =
                B::sparse_conv_weight_gradient(features, gradient.clone(), gather.clone());
            grads.register::<B>(node.id, gradient);
        }
        if let Some(node) = of_features {
            let weight = B::float_swap_dims(weight, 1, 2);
            let gradient = B::sparse_conv(gradient, weight, scatter, gather);
            grads.register::<B>(node.id, gradient);
        }
    }
}

impl<B: Backend + SparseConv, C: CheckpointStrategy> SparseConv for Autodiff<B, C> {
    fn sparse_conv(
        features: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        gather: IntTensor<Self>,
        scatter: IntTensor<Self>,
    ) -> FloatTensor<Self> {
        let prepared = Gradient
            .prepare::<C>([features.node(), weight.node()])
            .compute_bound()
            .stateful();
        match prepared {
            OpsKind::Tracked(mut prepared) => {
                let nodes = (prepared.checkpoint(&features), prepared.checkpoint(&weight));
                let output = B::sparse_conv(
                    features.into_primitive(),
                    weight.into_primitive(),
                    gather.clone(),
                    scatter.clone(),
                );
                prepared.finish((nodes.0, nodes.1, gather, scatter), output)
            }
            OpsKind::UnTracked(prepared) => prepared.finish(B::sparse_conv(
                features.into_primitive(),
                weight.into_primitive(),
                gather,
                scatter,
            )),
        }
    }
}
