//! What the views of a voxel say to each other: a pre-norm transformer encoder (method 1.6).

use burn::module::Module;
use burn::nn::{Initializer, LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::activation::relu;
use burn::tensor::module::linear;
use burn::tensor::{Device, Tensor};

use crate::ops::{attention::attention, segments::Segments};

/// Heads of the attention.
pub const HEADS: usize = 2;

/// `x + O attention(LN x)`, then `x + W2 relu(W1 LN x)`, with biases everywhere.
#[derive(Module, Debug)]
pub struct EncoderLayer {
    norm_attention: LayerNorm,
    query_key_value: Linear,
    output: Linear,
    norm_mlp: LayerNorm,
    mlp_in: Linear,
    mlp_out: Linear,
}

impl EncoderLayer {
    /// For tokens of `channels` channels, which [`HEADS`] divides.
    pub fn new(channels: usize, device: &Device) -> Self {
        // PyTorch's multi-head attention starts so.
        let uniform = Initializer::XavierUniform { gain: 1.0 };
        let qkv = LinearConfig::new(channels, 3 * channels).with_initializer(uniform);
        Self {
            norm_attention: LayerNormConfig::new(channels).init(device),
            query_key_value: qkv.init(device),
            output: LinearConfig::new(channels, channels).init(device),
            norm_mlp: LayerNormConfig::new(channels).init(device),
            mlp_in: LinearConfig::new(channels, 2 * channels).init(device),
            mlp_out: LinearConfig::new(2 * channels, channels).init(device),
        }
    }

    /// All weights in one list, in the order of [`view_tokens`](crate::ops::views::view_tokens).
    pub(super) fn weights(&self) -> Vec<Tensor<1>> {
        let norm = |norm: &LayerNorm| {
            let shift = norm.beta.as_ref().map(|beta| beta.val());
            [Some(norm.gamma.val()), shift]
        };
        let parts = [
            norm(&self.norm_attention),
            flat(&self.query_key_value),
            flat(&self.output),
            norm(&self.norm_mlp),
            flat(&self.mlp_in),
            flat(&self.mlp_out),
        ];
        parts.into_iter().flatten().flatten().collect()
    }

    /// Tokens `[P, C]` of pairs in, the same out.
    pub fn forward(&self, tokens: Tensor<2>, segments: &Segments) -> Tensor<2> {
        let [_, channels] = tokens.dims();
        let normed = self.norm_attention.forward(tokens.clone());
        let weight = self.query_key_value.weight.val();
        let bias = self.query_key_value.bias.as_ref().map(|b| b.val());
        // Three tables instead of one wide one, so that more pairs fit in a device's largest binding.
        let [query, key, value] = [0, 1, 2].map(|part| {
            let columns = part * channels..(part + 1) * channels;
            let weight = weight.clone().slice([0..channels, columns.clone()]);
            let bias = bias.clone().map(|b| b.slice([columns]));
            linear(normed.clone(), weight, bias)
        });
        let heard = attention(query, key, value, segments, HEADS);
        let tokens = tokens + self.output.forward(heard);
        let hidden = relu(self.mlp_in.forward(self.norm_mlp.forward(tokens.clone())));
        tokens + self.mlp_out.forward(hidden)
    }
}

/// Weight, row by row, and bias of a linear layer.
pub(super) fn flat(linear: &Linear) -> [Option<Tensor<1>>; 2] {
    let weight = linear.weight.val().flatten(0, 1);
    [Some(weight), linear.bias.as_ref().map(|bias| bias.val())]
}
