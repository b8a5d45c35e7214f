//! Bytes that attention among a voxel's views holds on the processor, as a table.
//!
//! `cargo bench --workspace --bench attention_memory`

#![allow(clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use bench::allocation::Counting;
use common::attention;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

const VOXELS: usize = 1_000;
const CHANNELS: usize = 40;

fn main() {
    // Threads and their scratch come up once.
    attention(&ALLOCATOR, [VOXELS, 20, CHANNELS], false, false);
    println!(
        "| views | fused, MB | bytes a view | tensor operations, MB | bytes a view | scores of all pairs of views alone, MB |"
    );
    println!("|---|---|---|---|---|---|");
    for views in [20, 60, 100] {
        let forms = [false, true]
            .map(|plain| attention(&ALLOCATOR, [VOXELS, views, CHANNELS], plain, false));
        let cells =
            forms.map(|bytes| format!("{:.2} | {}", bytes as f64 / 1e6, bytes / (VOXELS * views)));
        // What a softmax over a matrix would keep: a number for each head and pair of views.
        let scores = 4 * VOXELS * net::fusion::HEADS * views * views;
        println!(
            "| {views} | {} | {:.2} |",
            cells.join(" | "),
            scores as f64 / 1e6
        );
    }
}
