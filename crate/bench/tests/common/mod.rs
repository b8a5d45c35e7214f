//! Bytes that attention holds.

use bench::allocation::Counting;
use bench::input::numbers;
use burn::backend::Flex;
use burn::tensor::Device;
use net::ops::attention::{AttentionPasses, Shared, plain_backward, plain_forward};
use net::ops::segments::Segments;

/// The most bytes that attention holds at once on the processor, beyond its inputs: `voxels` that `views` see each, with `channels`; in
/// the processor's loops or in tensor operations, and with the way back or without. `counting` is the process's allocator.
pub fn attention(
    counting: &Counting,
    [voxels, views, channels]: [usize; 3],
    plain: bool,
    back: bool,
) -> usize {
    let device = Device::flex();
    let offsets: Vec<i32> = (0..=voxels).map(|n| (n * views) as i32).collect();
    let segments = Segments::new(&offsets, &device);
    let shared = Shared::<Flex> {
        offsets: segments.offsets.try_into_primitive::<Flex>().unwrap(),
        of_row: segments.of_row.try_into_primitive::<Flex>().unwrap(),
        longest: segments.longest,
        heads: net::fusion::HEADS,
    };
    let [query, key, value, grad] = [(); 4].map(|()| {
        let table = numbers([voxels * views, channels], &device);
        table.try_into_primitive::<Flex>().unwrap()
    });
    let inputs = [query, key, value];
    counting.peak(|| {
        let (out, log_sum) = if plain {
            let [query, key, value] = inputs.clone();
            plain_forward::<Flex>(query, key, value, &shared)
        } else {
            Flex::attention_forward(inputs.clone(), &shared)
        };
        if !back {
            return vec![out, log_sum];
        }
        let gradients = if plain {
            plain_backward::<Flex>(inputs, out, log_sum, grad, &shared)
        } else {
            Flex::attention_backward(inputs, out, log_sum, grad, &shared)
        };
        gradients.into()
    })
}
