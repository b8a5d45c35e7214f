//! The sparse convolution and its maps against their definitions.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::{
    Tensor,
    tensor::{Device, TensorData},
};
use common::{devices::values, numbers, relative_error};
use glam::{IVec3, ivec3};
use net::{
    decode::{
        children, halved,
        maps::{pooling, submanifold},
    },
    ops::sparse_conv::{KernelMap, sparse_conv},
};
use std::collections::{BTreeSet, HashMap};

/// Some of the sites of a box around the origin.
fn sites(size: [i32; 3]) -> Vec<IVec3> {
    let [x, y, z] = size;
    let all = (0..x * y * z).map(|i| ivec3(i % x, i / x % y, i / (x * y)) - ivec3(x, y, z) / 2);
    let chosen = numbers("some", (x * y * z) as usize, 1.0);
    all.zip(chosen)
        .filter(|(_, v)| *v < 0.0)
        .map(|(site, _)| site)
        .collect()
}

/// The three kinds over the same sites.
fn maps(sites: &[IVec3], device: &Device) -> [(&'static str, KernelMap, usize); 3] {
    let down = pooling(sites, &halved(sites), device);
    [
        ("submanifold", submanifold(sites, device), 27),
        ("stride 2", down.clone(), 8),
        ("transposed", down.transposed(), 8),
    ]
}

async fn rows(map: &burn::Tensor<2, burn::tensor::Int>) -> Vec<i32> {
    let data = map.clone().into_data_async().await.unwrap();
    data.try_to_vec::<i32>().unwrap()
}

on_each_device! {
    /// Both directions of each map name the same pairs, and those that the offsets say.
    async fn maps_are_who_lies_where(device: Device) {
        let sites = sites([13, 9, 11]);
        let halves = halved(&sites);
        let row = |sites: &[IVec3]| -> HashMap<IVec3, usize> {
            sites.iter().copied().zip(0..).collect()
        };
        let (site_row, half_row) = (row(&sites), row(&halves));
        for (name, map, taps) in maps(&sites, &device) {
            // Triples of output row, tap, input row.
            let mut expected = BTreeSet::new();
            for (n, site) in sites.iter().enumerate() {
                if name == "submanifold" {
                    for tap in 0..27 {
                        let offset = ivec3(tap % 3 - 1, tap / 3 % 3 - 1, tap / 9 - 1);
                        if let Some(m) = site_row.get(&(*site + offset)) {
                            expected.insert((n, tap as usize, *m));
                        }
                    }
                } else {
                    let half = site.div_euclid(IVec3::splat(2));
                    let child = *site - 2 * half;
                    let tap = (child.x + 2 * child.y + 4 * child.z) as usize;
                    let m = half_row[&half];
                    let pair = if name == "transposed" { (n, tap, m) } else { (m, tap, n) };
                    expected.insert(pair);
                }
            }
            let read = |rows: Vec<i32>, absent: usize| -> BTreeSet<(usize, usize, usize)> {
                let present = rows.iter().enumerate().filter(move |(_, r)| **r != absent as i32);
                present.map(|(i, r)| (i / taps, i % taps, *r as usize)).collect()
            };
            let gather = read(rows(&map.gather).await, map.inputs);
            assert_eq!(gather, expected, "{name}");
            let scatter = read(rows(&map.scatter).await, map.outputs);
            let turned: BTreeSet<_> = scatter.into_iter().map(|(m, tap, n)| (n, tap, m)).collect();
            assert_eq!(turned, expected, "{name}");
        }
    }
}

#[cfg_attr(target_family = "wasm", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_family = "wasm"), test)]
fn children_are_in_order_and_halves_their_parents() {
    let found = children(&[ivec3(3, -2, 0), ivec3(-1, 5, 7)]);
    assert_eq!(found.len(), 16);
    assert_eq!(
        found[..3],
        [ivec3(6, -4, 0), ivec3(7, -4, 0), ivec3(6, -3, 0)]
    );
    assert_eq!(found[4], ivec3(6, -4, 1));
    assert_eq!(found[15], ivec3(-1, 11, 15));
    assert_eq!(halved(&found), [ivec3(3, -2, 0), ivec3(-1, 5, 7)]);
    assert_eq!(halved(&[]), []);
    assert_eq!(children(&[]), []);
}

fn tensor<const D: usize>(values: &[f32], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}

/// The sum over pairs in 64 bits.
fn by_definition(x: &[f32], w: &[f32], shape: [usize; 3], gather: &[i32]) -> Vec<f64> {
    let [taps, inputs, outputs] = shape;
    let mut y = vec![0.0; gather.len() / taps * outputs];
    for (i, m) in gather.iter().enumerate() {
        let (n, tap, m) = (i / taps, i % taps, *m as usize);
        // The number of input rows stands for none.
        let Some(x) = x.get(m * inputs..(m + 1) * inputs) else {
            continue;
        };
        for (c, x) in x.iter().enumerate() {
            for o in 0..outputs {
                let w = w[(tap * inputs + c) * outputs + o];
                y[n * outputs + o] += f64::from(*x) * f64::from(w);
            }
        }
    }
    y
}

on_each_device! {
    /// With channels that fill no register evenly, and those that do.
    async fn is_the_sum_over_taps(device: Device) {
        let sites = sites([17, 12, 10]);
        for (name, map, taps) in maps(&sites, &device) {
            let gather = rows(&map.gather).await;
            // A new shape costs a GPU a compilation, and its form is the same for all.
            let shapes = match device == Device::flex() {
                true => vec![(1, 1), (5, 3), (8, 16), (19, 37), (32, 32), (33, 65), (16, 128)],
                false => vec![(5, 3)],
            };
            for (inputs, outputs) in shapes {
                let x = numbers("x", map.inputs * inputs, 1.0);
                let w = numbers("w", taps * inputs * outputs, 1.0);
                let expected = by_definition(&x, &w, [taps, inputs, outputs], &gather);
                let x = tensor(&x, [map.inputs, inputs], &device);
                let w = tensor(&w, [taps, inputs, outputs], &device);
                let y = sparse_conv(x, w, &map);
                assert_eq!(y.dims(), [map.outputs, outputs]);
                let expected: Vec<f32> = expected.iter().map(|v| *v as f32).collect();
                let off = relative_error(&values(y).await, &expected);
                assert!(off < 1e-5, "{name}, {inputs} to {outputs}: {off:e}");
            }
        }
    }
}

on_each_device! {
    /// Tensors that are views of others.
    async fn takes_views(device: Device) {
        let sites = sites([7, 6, 5]);
        for (name, map, taps) in maps(&sites, &device) {
            let x = tensor(&numbers("x", map.inputs * 6, 1.0), [6, map.inputs], &device);
            let w = tensor(&numbers("w", taps * 12, 1.0), [taps, 3, 4], &device);
            let (x, w) = (x.slice([1..5, 0..map.inputs]).transpose(), w.swap_dims(1, 2));
            let copied = |t: TensorData| Tensor::<2>::from_data(t, &device);
            let x2 = copied(x.clone().into_data_async().await.unwrap());
            let w2 = Tensor::from_data(w.clone().into_data_async().await.unwrap(), &device);
            let expected = values(sparse_conv(x2, w2, &map)).await;
            assert_eq!(values(sparse_conv(x, w, &map)).await, expected, "{name}");
        }
    }
}

#[cfg(not(target_family = "wasm"))]
mod gradients {
    use super::*;
    use burn::tensor::{Gradients, Int};

    /// Out of burn's operations, which derive its gradient: the gather as one, then a product.
    fn composed(features: Tensor<2>, weight: Tensor<3>, map: &KernelMap) -> Tensor<2> {
        let [taps, inputs, outputs] = weight.dims();
        let zero = Tensor::zeros([1, inputs], &features.device());
        let rows = Tensor::cat(vec![features, zero], 0);
        let index: Tensor<1, Int> = map.gather.clone().reshape([map.outputs * taps]);
        let gathered = rows.select(0, index).reshape([map.outputs, taps * inputs]);
        gathered.matmul(weight.reshape([taps * inputs, outputs]))
    }

    /// Gradients of `sum(c * convolution(x, w))` by `convolve`.
    fn found(
        convolve: fn(Tensor<2>, Tensor<3>, &KernelMap) -> Tensor<2>,
        map: &KernelMap,
        [taps, inputs, outputs]: [usize; 3],
        device: &Device,
    ) -> [Vec<f32>; 2] {
        let made = |name, count| numbers(name, count, 1.0);
        let x = made("x", map.inputs * inputs);
        let w = made("w", taps * inputs * outputs);
        let c = made("c", map.outputs * outputs);
        let x = tensor(&x, [map.inputs, inputs], device).require_grad();
        let w = tensor(&w, [taps, inputs, outputs], device).require_grad();
        let y = convolve(x.clone(), w.clone(), map);
        let c = tensor(&c, [map.outputs, outputs], device);
        let gradients: Gradients = (y * c).sum().backward();
        [
            pollster::block_on(values(x.grad(&gradients).unwrap())),
            pollster::block_on(values(w.grad(&gradients).unwrap())),
        ]
    }

    fn devices() -> Vec<Device> {
        let gpu = common::devices::gpu();
        if gpu.is_none() {
            println!("skipped on the GPU: no Vulkan, Metal or DirectX adapter on this machine");
        }
        let devices = std::iter::once(Device::flex()).chain(gpu);
        devices.map(|device| device.autodiff()).collect()
    }

    #[test]
    fn are_those_of_the_composed_form() {
        for device in devices() {
            for (name, map, taps) in maps(&sites([15, 12, 9]), &device) {
                for (inputs, outputs) in [(3, 5), (8, 24), (33, 16), (40, 70)] {
                    let shape = [taps, inputs, outputs];
                    let [x, w] = found(sparse_conv, &map, shape, &device);
                    let [by_x, by_w] = found(composed, &map, shape, &device);
                    let off = [relative_error(&x, &by_x), relative_error(&w, &by_w)];
                    assert!(off[0] < 1e-5 && off[1] < 1e-5, "{name} {shape:?}: {off:?}");
                }
            }
        }
    }

    /// The sum is linear in every number, so that central differences are exact up to rounding.
    #[test]
    fn are_those_of_finite_differences() {
        for device in devices() {
            for (name, map, taps) in maps(&sites([5, 4, 4]), &device) {
                let (inputs, outputs) = (3, 2);
                let [of_x, of_w] = found(sparse_conv, &map, [taps, inputs, outputs], &device);
                let c = numbers("c", map.outputs * outputs, 1.0);
                let gather = pollster::block_on(rows(&map.gather));
                let value = |x: &[f32], w: &[f32]| -> f64 {
                    let y = by_definition(x, w, [taps, inputs, outputs], &gather);
                    y.iter().zip(&c).map(|(y, c)| y * f64::from(*c)).sum()
                };
                let x = numbers("x", map.inputs * inputs, 1.0);
                let w = numbers("w", taps * inputs * outputs, 1.0);
                let differences = |at: &[f32], every: usize, value: &dyn Fn(&[f32]) -> f64| {
                    let moved = |i: usize, by: f32| {
                        let mut at = at.to_vec();
                        at[i] += by;
                        (value(&at), f64::from(at[i]))
                    };
                    let one = |i| {
                        let (up, down) = (moved(i, 0.5), moved(i, -0.5));
                        ((up.0 - down.0) / (up.1 - down.1)) as f32
                    };
                    (0..at.len()).step_by(every).map(one).collect::<Vec<_>>()
                };
                let some = |gradient: &[f32], every| -> Vec<f32> {
                    gradient.iter().step_by(every).copied().collect()
                };
                let off = relative_error(&some(&of_x, 5), &differences(&x, 5, &|x| value(x, &w)));
                assert!(off < 1e-4, "{name}, features: {off:e}");
                let off = relative_error(&some(&of_w, 7), &differences(&w, 7, &|w| value(&x, w)));
                assert!(off < 1e-4, "{name}, weight: {off:e}");
            }
        }
    }
}
