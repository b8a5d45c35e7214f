//! Attention's memory is that of its inputs, however many views see a voxel.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use burn::backend::Flex;
use burn::tensor::{Device, Tensor, TensorData};
use net::ops::attention::{AttentionPasses, Shared, plain_backward, plain_forward};
use net::ops::segments::Segments;

/// The system's allocator, which counts.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        MOST.fetch_max(now, Relaxed);
        // SAFETY: the caller's promises are the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promises are the system's.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const ROWS: usize = 32768;
const CHANNELS: usize = 16;

/// The most bytes that were held at once beyond those held before, during both passes over `ROWS` rows in segments of `views`.
fn peak(views: usize, plain: bool) -> usize {
    let device = Device::flex();
    let offsets: Vec<i32> = (0..=ROWS / views).map(|n| (n * views) as i32).collect();
    let segments = Segments::new(&offsets, &device);
    let shared = Shared::<Flex> {
        offsets: segments.offsets.try_into_primitive::<Flex>().unwrap(),
        of_row: segments.of_row.try_into_primitive::<Flex>().unwrap(),
        longest: segments.longest,
        heads: 2,
    };
    let [query, key, value, grad] = ["query", "key", "value", "grad"].map(|name| {
        let values = common::numbers(name, ROWS * CHANNELS, 1.0);
        let table = Tensor::<2>::from_data(TensorData::new(values, [ROWS, CHANNELS]), &device);
        table.try_into_primitive::<Flex>().unwrap()
    });
    let inputs = [query, key, value];
    let before = NOW.load(Relaxed);
    MOST.store(before, Relaxed);
    if plain {
        let [query, key, value] = inputs.clone();
        let (out, log_sum) = plain_forward::<Flex>(query, key, value, &shared);
        plain_backward::<Flex>(inputs, out, log_sum, grad, &shared);
    } else {
        let (out, log_sum) = Flex::attention_forward(inputs.clone(), &shared);
        Flex::attention_backward(inputs, out, log_sum, grad, &shared);
    }
    MOST.load(Relaxed) - before
}

#[test]
fn memory_does_not_grow_with_the_views() {
    let table = 4 * ROWS * CHANNELS;
    for (plain, tables) in [(false, 6), (true, 24)] {
        // Threads and their scratch come up once.
        peak(8, plain);
        let few = peak(8, plain);
        let many = peak(128, plain);
        assert!(few > 3 * table, "{few} bytes: the gradients alone are more");
        assert!(
            many < few + few / 7,
            "{few} bytes for 8 views, {many} for 128; plain: {plain}"
        );
        // Scores of 128 views by 128 would be 16 tables.
        assert!(
            many < tables * table,
            "{} tables; plain: {plain}",
            many / table
        );
    }
}
