//! Milliseconds of a part, the first run apart from those that follow.

use burn::backend::ExecutionError;
use burn::tensor::Tensor;
use serde::Serialize;

/// Runs after which a part has been measured long enough, whatever was asked for.
const ENOUGH_MS: f64 = 20_000.0;

/// What a part took.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Times {
    /// The first run on this device: pipelines are compiled in it, memory is asked for.
    pub cold_ms: f64,
    /// The median of the runs after it.
    pub warm_ms: f64,
    /// How many those were.
    pub runs: usize,
}

/// Times `work`, which waits for its own results: once cold, once without the clock, then `runs` times, or less often where that
/// takes more than 20 s.
///
/// # Errors
/// Those of `work`.
pub async fn timed<E>(
    runs: usize,
    mut work: impl AsyncFnMut() -> Result<(), E>,
) -> Result<Times, E> {
    let start = now_ms();
    work().await?;
    let cold_ms = now_ms() - start;
    if cold_ms < ENOUGH_MS {
        work().await?;
    }
    let mut found = Vec::with_capacity(runs);
    while found.len() < runs.max(1) && (found.is_empty() || now_ms() - start < ENOUGH_MS) {
        let start = now_ms();
        work().await?;
        found.push(now_ms() - start);
    }
    Ok(Times {
        cold_ms,
        warm_ms: median(&mut found),
        runs: found.len(),
    })
}

/// The middle of `values`, which are sorted for it; 0 of none.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Waits for a tensor by reading one of its numbers.
///
/// # Errors
/// A device that was lost, or had not enough memory.
pub async fn wait<const D: usize>(tensor: &Tensor<D>) -> Result<(), ExecutionError> {
    let first = tensor.clone().flatten::<1>(0, D - 1).narrow(0, 0, 1);
    let read = first.into_data_async().await?;
    // The bytes come when they are looked at.
    std::hint::black_box(read.iter::<f32>().next());
    Ok(())
}

/// Milliseconds since some moment of this process.
#[cfg(not(target_family = "wasm"))]
pub fn now_ms() -> f64 {
    use std::{sync::OnceLock, time::Instant};
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e3
}

/// Milliseconds since the page or the process began.
#[cfg(target_family = "wasm")]
pub fn now_ms() -> f64 {
    use wasm_bindgen::prelude::wasm_bindgen;
    #[wasm_bindgen]
    extern "C" {
        #[wasm_bindgen(js_namespace = performance)]
        fn now() -> f64;
    }
    now()
}
