//! The linear recurrence, against its definition and against finite differences.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::tensor::{Device, Tensor, TensorData};
use common::devices::values;
use net::ops::linrec::linrec;

/// The definition, in 64 bits, on rows of `length`.
fn by_definition(a: &[f32], x: &[f32], length: usize, reverse: bool) -> Vec<f64> {
    let mut s = vec![0.0; x.len()];
    for row in (0..x.len()).step_by(length) {
        let mut state = 0.0;
        for i in 0..length {
            let t = row + if reverse { length - 1 - i } else { i };
            state = f64::from(a[t]) * state + f64::from(x[t]);
            s[t] = state;
        }
    }
    s
}

/// Factors between 0 and 1, inputs between -1 and 1.
fn made(length: usize, rows: usize) -> (Vec<f32>, Vec<f32>) {
    let a = common::numbers("factors", rows * length, 0.5);
    let a = a.iter().map(|v| v + 0.5).collect();
    (a, common::numbers("inputs", rows * length, 1.0))
}

fn tensor(values: &[f32], shape: [usize; 3], device: &Device) -> Tensor<3> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}

on_each_device! {
    async fn follows_its_definition_in_both_directions(device: Device) {
        for length in [1, 2, 7, 64, 161] {
            let (a, x) = made(length, 6);
            let shape = [2, 3, length];
            for reverse in [false, true] {
                let expected: Vec<f32> = by_definition(&a, &x, length, reverse)
                    .iter()
                    .map(|v| *v as f32)
                    .collect();
                let s = linrec(tensor(&a, shape, &device), tensor(&x, shape, &device), reverse);
                let off = common::relative_error(&values(s).await, &expected);
                assert!(off < 1e-6, "length {length}, reverse {reverse}: {off:e}");
            }
        }
    }
}

on_each_device! {
    /// As a scan along columns gives it: an axis that is not the last one in memory.
    async fn takes_a_view_of_other_order(device: Device) {
        let (a, x) = made(5, 6);
        let given = |v: &[f32]| tensor(v, [2, 3, 5], &device);
        let s = linrec(given(&a).swap_dims(1, 2), given(&x).swap_dims(1, 2), false);
        let contiguous = |v: Vec<f32>| tensor(&v, [2, 5, 3], &device);
        let a = contiguous(values(given(&a).swap_dims(1, 2)).await);
        let x = contiguous(values(given(&x).swap_dims(1, 2)).await);
        let expected = values(linrec(a, x, false)).await;
        assert_eq!(values(s).await, expected);
    }
}

/// Gradients of `sum(w * linrec(a, x))` against central differences of the definition in 64 bits, which is a polynomial of
/// degree one in each number: they are exact up to rounding.
#[cfg(not(target_family = "wasm"))]
fn gradients_on(device: Device) {
    let (length, shape) = (9, [1, 2, 9]);
    let (a, x) = made(length, 2);
    let weights = common::numbers("weights", a.len(), 1.0);
    for reverse in [false, true] {
        let value = |a: &[f32], x: &[f32]| -> f64 {
            let s = by_definition(a, x, length, reverse);
            s.iter().zip(&weights).map(|(s, w)| s * f64::from(*w)).sum()
        };
        let step = 1.0 / 64.0;
        let differences = |at: &[f32], value: &dyn Fn(&[f32]) -> f64| -> Vec<f32> {
            (0..at.len())
                .map(|i| {
                    let moved = |by: f32| {
                        let mut at = at.to_vec();
                        at[i] += by;
                        (value(&at), f64::from(at[i]))
                    };
                    let (up, down) = (moved(step), moved(-step));
                    ((up.0 - down.0) / (up.1 - down.1)) as f32
                })
                .collect()
        };
        let of_a = differences(&a, &|a| value(a, &x));
        let of_x = differences(&x, &|x| value(&a, x));

        let (ta, tx) = (
            tensor(&a, shape, &device).require_grad(),
            tensor(&x, shape, &device).require_grad(),
        );
        let s = linrec(ta.clone(), tx.clone(), reverse);
        let grads = (s * tensor(&weights, shape, &device)).sum().backward();
        for (name, tensor, expected) in [("factors", ta, of_a), ("inputs", tx, of_x)] {
            let found = pollster::block_on(values(tensor.grad(&grads).unwrap()));
            let off = common::relative_error(&found, &expected);
            assert!(off < 1e-5, "{name}, reverse {reverse}: {off:e}");
        }
    }
}

#[cfg(not(target_family = "wasm"))]
#[test]
fn gradients_are_those_of_finite_differences_flex() {
    gradients_on(Device::flex().autodiff());
}

#[cfg(not(target_family = "wasm"))]
#[test]
fn gradients_are_those_of_finite_differences_gpu() {
    match common::devices::gpu() {
        Some(device) => gradients_on(device.autodiff()),
        None => println!("skipped: no Vulkan, Metal or DirectX adapter on this machine"),
    }
}
