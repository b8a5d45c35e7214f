//! The GPU's rays meet what the processor's rays meet, and find the same light. Built with the feature `gpu` only.
#![cfg(feature = "gpu")]

use synth::{Frame, GpuTracer, TrainingScan};

const WIDTH: u32 = 160;
const HEIGHT: u32 = 120;

/// A tracer on the first adapter; `None`, said aloud, where there is none.
fn tracer() -> Option<GpuTracer> {
    match GpuTracer::open(true) {
        Ok(tracer) => {
            println!("on {}", tracer.name());
            Some(tracer)
        }
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}

/// Shares of pixels whose depth differs by more than 2 mm and whose colour by more than 12 of 255, and the mean
/// difference of colour.
fn differences(a: &Frame, b: &Frame) -> (f64, f64, f64) {
    let count = a.depth_m.len() as f64;
    let deep = a
        .depth_m
        .iter()
        .zip(&b.depth_m)
        .filter(|(a, b)| (*a - *b).abs() > 2e-3)
        .count();
    let apart = |a: &[u8; 3], b: &[u8; 3]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| a.abs_diff(*b))
            .max()
            .unwrap_or(0)
    };
    let colors: Vec<f64> = a
        .color
        .iter()
        .zip(&b.color)
        .map(|(a, b)| f64::from(apart(a, b)))
        .collect();
    let far = colors.iter().filter(|d| **d > 12.0).count();
    (
        deep as f64 / count,
        far as f64 / count,
        colors.iter().sum::<f64>() / count,
    )
}

#[test]
fn the_gpu_draws_what_the_processor_draws() {
    let Some(gpu) = tracer() else { return };
    let mut worst = (0.0f64, 0.0f64, 0.0f64);
    for seed in 0..8 {
        let scan = TrainingScan::new(seed, 12, WIDTH, HEIGHT);
        let gathered = gpu.gather(&scan, 2..10).expect("rays");
        assert_eq!(gathered.len(), 8);
        let mut sum = (0.0, 0.0, 0.0);
        for rays in &gathered {
            let (deep, far, mean) = differences(&scan.frame_of(rays), &scan.frame(rays.index));
            sum = (sum.0 + deep / 8.0, sum.1 + far / 8.0, sum.2 + mean / 8.0);
        }
        println!(
            "seed {seed}: depth differs in {:.5}, colour in {:.5}, by {:.3} in the mean",
            sum.0, sum.1, sum.2
        );
        worst = (worst.0.max(sum.0), worst.1.max(sum.1), worst.2.max(sum.2));
    }
    assert!(
        worst.0 < 1e-3,
        "depth differs by more than 2 mm in {} of the pixels",
        worst.0
    );
    assert!(
        worst.1 < 1e-2,
        "colour differs by more than 12 in {} of the pixels",
        worst.1
    );
    assert!(worst.2 < 1.0, "colour differs by {} in the mean", worst.2);
}

#[test]
fn the_gpu_says_the_same_twice() {
    let Some(gpu) = tracer() else { return };
    let scan = TrainingScan::new(3, 4, WIDTH, HEIGHT);
    let once = || scan.frame_of(&gpu.gather(&scan, 1..2).expect("rays")[0]);
    assert_eq!(once(), once());
    assert!(gpu.gather(&scan, 2..2).expect("nothing to do").is_empty());
}
