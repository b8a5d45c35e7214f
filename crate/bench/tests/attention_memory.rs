//! Attention's memory is that of its inputs, however many views see a voxel.

#![cfg(not(target_family = "wasm"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use bench::allocation::Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

const ROWS: usize = 32768;
const CHANNELS: usize = 16;

/// The most bytes that both passes hold over `ROWS` rows in segments of `views`.
fn peak(views: usize, plain: bool) -> usize {
    common::attention(&ALLOCATOR, [ROWS / views, views, CHANNELS], plain, true)
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
