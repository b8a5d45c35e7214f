//! Attention among the rows of a segment, and pooling of them: against the NumPy reference, and forwards against backwards.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::devices::values;
use common::golden::{check, part};
use net::ops::attention::attention;
use net::ops::pool::{Pooling, pool};
use net::ops::segments::Segments;
use serde_json::Value;

const CHANNELS: usize = 24;
const POOLED: usize = 8;

fn golden() -> Value {
    serde_json::from_str(include_str!("../../../tests/golden/net_fusion.json")).unwrap()
}

/// Segments of the reference, two of them empty.
fn segments(device: &Device) -> Segments {
    let golden = golden();
    let lengths = part(&golden, "attention/lengths").as_array().unwrap();
    let mut offsets = vec![0];
    for length in lengths {
        offsets.push(offsets[offsets.len() - 1] + length.as_i64().unwrap() as i32);
    }
    let segments = Segments::new(&offsets, device);
    assert_eq!(
        [segments.rows, segments.count, segments.longest],
        [35, 10, 12]
    );
    segments
}

fn table(name: &str, rows: usize, channels: usize, scale: f32, device: &Device) -> Tensor<2> {
    let values = common::numbers(name, rows * channels, scale);
    Tensor::from_data(TensorData::new(values, [rows, channels]), device)
}

fn query_key_value(device: &Device) -> [Tensor<2>; 3] {
    ["query", "key", "value"].map(|name| table(name, 35, CHANNELS, 2.0, device))
}

fn tokens_and_logits(device: &Device) -> (Tensor<2>, Tensor<1>) {
    let logits = table("logits", 35, 1, 3.0, device).flatten(0, 1);
    (table("tokens", 35, POOLED, 1.0, device), logits)
}

on_each_device! {
    /// Masked dense attention of the reference.
    async fn attention_is_that_of_the_reference(device: Device) {
        let [query, key, value] = query_key_value(&device);
        let out = attention(query, key, value, &segments(&device), 2);
        check(&values(out).await, part(&golden(), "attention/out"), 1e-5, "attention");
    }
}

on_each_device! {
    /// Softmax with the null view, and the plain mean.
    async fn pooling_is_that_of_the_reference(device: Device) {
        for (pooling, name) in [(Pooling::Softmax, "softmax"), (Pooling::Mean, "mean")] {
            let (tokens, logits) = tokens_and_logits(&device);
            let out = values(pool(tokens, logits, &segments(&device), pooling)).await;
            check(&out, part(&golden(), &format!("pool/{name}/out")), 1e-5, name);
            // Segment 1 has no rows.
            assert_eq!(out[POOLED..2 * POOLED], [0.0; POOLED]);
        }
    }
}

on_each_device! {
    /// Logits far from 0 neither overflow nor lose the null view.
    async fn extreme_scores_stay_finite(device: Device) {
        let segments = Segments::new(&[0, 2, 4], &device);
        let tokens = Tensor::<2>::ones([4, 2], &device);
        let logits = Tensor::<1>::from_floats([200.0, -200.0, -200.0, -300.0], &device);
        let out = values(pool(tokens, logits, &segments, Pooling::Softmax)).await;
        assert_eq!(out, [1.0, 1.0, 0.0, 0.0]);
        let strong = Tensor::<2>::ones([4, 2], &device) * 40.0;
        let value = Tensor::<2>::from_floats([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]], &device);
        let out = values(attention(strong.clone(), strong, value, &segments, 1)).await;
        let error = common::relative_error(&out, &[2.0, 3.0, 2.0, 3.0, 6.0, 7.0, 6.0, 7.0]);
        assert!(error < 1e-6, "relative error {error}");
    }
}

on_each_device! {
    /// Where nothing is seen at all there is nothing to pool.
    async fn nothing_pools_to_zeros(device: Device) {
        let segments = Segments::new(&[0, 0, 0], &device);
        let tokens = Tensor::<2>::zeros([0, 3], &device);
        let out = pool(tokens, Tensor::zeros([0], &device), &segments, Pooling::Softmax);
        assert_eq!(out.dims(), [2, 3]);
        assert_eq!(values(out).await, [0.0; 6]);
    }
}

#[cfg(not(target_family = "wasm"))]
mod gradients {
    use burn::backend::{Autodiff, Flex};
    use net::ops::{attention as attention_op, pool as pool_op};

    use super::*;
    use common::golden::check_slopes;

    fn slopes_of_attention(device: Device) {
        let device = device.autodiff();
        let inputs = query_key_value(&device).map(Tensor::require_grad);
        let [query, key, value] = inputs.clone();
        let out = attention(query, key, value, &segments(&device), 2);
        let by = table("attention", 35, CHANNELS, 1.0, &device);
        let grads = (out * by).sum().backward();
        for (input, name) in inputs.iter().zip(["query", "key", "value"]) {
            let grad = input
                .grad(&grads)
                .unwrap()
                .into_data()
                .try_to_vec::<f32>()
                .unwrap();
            let golden = golden();
            let expected = part(&golden, &format!("attention/slopes/{name}"));
            check_slopes(&grad, expected, 1e-5, name);
        }
    }

    fn slopes_of_pooling(device: Device) {
        let device = device.autodiff();
        for (pooling, name) in [(Pooling::Softmax, "softmax"), (Pooling::Mean, "mean")] {
            let (tokens, logits) = tokens_and_logits(&device);
            let (tokens, logits) = (tokens.require_grad(), logits.require_grad());
            let out = pool(tokens.clone(), logits.clone(), &segments(&device), pooling);
            let by = table("pool", 10, POOLED, 1.0, &device);
            let grads = (out * by).sum().backward();
            let of_tokens = tokens.grad(&grads).unwrap().into_data();
            let of_logits = logits.grad(&grads).unwrap().into_data();
            for (grad, input) in [(of_tokens, "tokens"), (of_logits, "logits")] {
                let golden = golden();
                let expected = part(&golden, &format!("pool/{name}/slopes/{input}"));
                check_slopes(&grad.try_to_vec::<f32>().unwrap(), expected, 1e-5, input);
            }
        }
    }

    on_each_device! {
        /// Backward passes against differences of the reference.
        async fn gradients_are_the_slopes_of_the_reference(device: Device) {
            slopes_of_attention(device.clone());
            slopes_of_pooling(device);
        }
    }

    type Trained = Autodiff<Flex>;

    fn trained<const D: usize>(tensor: Tensor<D>) -> burn::backend::tensor::FloatTensor<Trained> {
        tensor.try_into_primitive::<Trained>().unwrap()
    }

    fn whole(int: Tensor<1, burn::tensor::Int>) -> burn::backend::tensor::IntTensor<Trained> {
        int.try_into_primitive::<Trained>().unwrap()
    }

    fn gradient<const D: usize>(of: &Tensor<D>, grads: &burn::tensor::Gradients) -> Vec<f32> {
        of.grad(grads).unwrap().into_data().try_to_vec().unwrap()
    }

    /// The plain form, differentiated by burn, has the gradients of the handwritten backward pass, in loops and plain.
    #[test]
    fn backward_passes_are_what_automatic_differentiation_gives() {
        let device = Device::flex().autodiff();
        let segments = segments(&device);
        let by = || table("attention", 35, CHANNELS, 1.0, &device);
        let inputs = query_key_value(&device).map(Tensor::require_grad);
        let shared = attention_op::Shared::<Trained> {
            offsets: whole(segments.offsets.clone()),
            of_row: whole(segments.of_row.clone()),
            longest: segments.longest,
            heads: 2,
        };
        let [query, key, value] = inputs.clone().map(trained);
        let (out, _) = attention_op::plain_forward::<Trained>(query, key, value, &shared);
        let out = Tensor::<2>::from_primitive::<Trained>(out);
        let automatic = (out * by()).sum().backward();
        let [query, key, value] = inputs.clone();
        let written = (attention(query, key, value, &segments, 2) * by())
            .sum()
            .backward();

        let inner = Device::flex();
        let segments = super::segments(&inner);
        let shared = attention_op::Shared::<Flex> {
            offsets: segments.offsets.try_into_primitive::<Flex>().unwrap(),
            of_row: segments.of_row.try_into_primitive::<Flex>().unwrap(),
            longest: segments.longest,
            heads: 2,
        };
        let bare = || query_key_value(&inner).map(|t| t.try_into_primitive::<Flex>().unwrap());
        let [query, key, value] = bare();
        let (out, log_sum) = attention_op::plain_forward::<Flex>(query, key, value, &shared);
        let grad = table("attention", 35, CHANNELS, 1.0, &inner)
            .try_into_primitive::<Flex>()
            .unwrap();
        let plain = attention_op::plain_backward::<Flex>(bare(), out, log_sum, grad, &shared);
        for (input, plain) in inputs.iter().zip(plain) {
            let automatic = gradient(input, &automatic);
            assert!(automatic.iter().any(|g| g.abs() > 0.1));
            let error = common::relative_error(&gradient(input, &written), &automatic);
            assert!(error < 2e-6, "loops: relative error {error}");
            let plain = Tensor::<2>::from_primitive::<Flex>(plain)
                .into_data()
                .try_to_vec::<f32>()
                .unwrap();
            let error = common::relative_error(&plain, &automatic);
            assert!(error < 2e-6, "plain: relative error {error}");
        }
    }

    #[test]
    fn backward_of_pooling_is_what_automatic_differentiation_gives() {
        let device = Device::flex().autodiff();
        let segments = segments(&device);
        for pooling in [Pooling::Softmax, Pooling::Mean] {
            let by = || table("pool", 10, POOLED, 1.0, &device);
            let (tokens, logits) = tokens_and_logits(&device);
            let (tokens, logits) = (tokens.require_grad(), logits.require_grad());
            let shared = pool_op::Shared::<Trained> {
                offsets: whole(segments.offsets.clone()),
                of_row: whole(segments.of_row.clone()),
                longest: segments.longest,
                pooling,
            };
            let (out, _) = pool_op::plain_forward::<Trained>(
                trained(tokens.clone()),
                trained(logits.clone()),
                &shared,
            );
            let automatic = (Tensor::<2>::from_primitive::<Trained>(out) * by())
                .sum()
                .backward();
            let out = pool(tokens.clone(), logits.clone(), &segments, pooling);
            let written = (out * by()).sum().backward();
            let error = common::relative_error(
                &gradient(&tokens, &written),
                &gradient(&tokens, &automatic),
            );
            assert!(error < 2e-6, "{pooling:?}, tokens: relative error {error}");
            if pooling == Pooling::Softmax {
                let error = common::relative_error(
                    &gradient(&logits, &written),
                    &gradient(&logits, &automatic),
                );
                assert!(error < 2e-6, "logits: relative error {error}");
            }
        }
    }
}
