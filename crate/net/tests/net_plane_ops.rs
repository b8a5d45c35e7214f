//! Operations of the planes: the processor's loops against the forms of tensor operations, and gradients against
//! differences.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[macro_use]
mod common;

use burn::nn::{BatchNorm, BatchNormConfig};
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Tensor, TensorData, activation, module};
use common::devices::values;
use net::ops::scan::Pass;
use net::ops::{affine, batch_norm, channel_norm, depthwise, pointwise, scan, silu, upsample};

fn made<const D: usize>(name: &str, shape: [usize; D], device: &Device) -> Tensor<D> {
    let numbers = common::numbers(name, shape.iter().product(), 1.0);
    Tensor::from_data(TensorData::new(numbers, shape), device)
}

async fn assert_close<const D: usize>(what: &str, found: Tensor<D>, expected: Tensor<D>) {
    assert_eq!(found.dims(), expected.dims(), "{what}");
    let off = common::relative_error(&values(found).await, &values(expected).await);
    assert!(off < 1e-5, "{what}: {off:e}");
}

/// Maps that turn, shift and shear, out of the plane too, and the identity.
fn maps(device: &Device) -> Tensor<2> {
    let maps = [
        [0.9, 0.3, 0.1, -0.35, 1.1, -0.2],
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    ];
    Tensor::from_floats(maps, device)
}

/// A batch normalisation with statistics and weights of its own.
fn norm(channels: usize, device: &Device) -> BatchNorm {
    common::filled(BatchNormConfig::new(channels).init(device))
}

on_each_device! {
    async fn what_runs_here_gives_what_tensor_operations_give(device: Device) {
        for (height, width) in [(1, 1), (5, 9), (17, 34)] {
            let size = format!("{height} x {width}");
            let x = || made("x", [2, 6, height, width], &device);
            for (kernel, stride) in [(3, 1), (3, 2), (5, 1), (5, 2)] {
                let weight = made("kernels", [6, 1, kernel, kernel], &device);
                let options = ConvOptions::new([stride; 2], [kernel / 2; 2], [1; 2], 6);
                let expected = module::conv2d(x(), weight.clone(), None, options);
                let what = format!("depthwise {kernel}, stride {stride}, {size}");
                assert_close(&what, depthwise::depthwise(x(), weight, stride), expected).await;
            }

            let weight = made("weights", [4, 6, 1, 1], &device);
            for bias in [None, Some(made("bias", [4], &device))] {
                let options = ConvOptions::new([1; 2], [0; 2], [1; 2], 1);
                let expected = module::conv2d(x(), weight.clone(), bias.clone(), options);
                let found = pointwise::pointwise(x(), weight.clone(), bias);
                assert_close(&format!("pointwise {size}"), found, expected).await;
            }

            let norm = norm(6, &device);
            let expected = norm.forward(x());
            let found = batch_norm::batch_norm(&norm, x(), false);
            assert_close(&format!("batch norm {size}"), found, expected.clone()).await;
            let found = batch_norm::batch_norm(&norm, x(), true);
            assert_close(&format!("with ReLU {size}"), found, activation::relu(expected)).await;

            let (gamma, beta) = (made("gamma", [6], &device), made("beta", [6], &device));
            let expected = channel_norm::composed(x(), gamma.clone(), beta.clone());
            let found = channel_norm::channel_norm(x(), gamma, beta);
            assert_close(&format!("channel norm {size}"), found, expected).await;

            assert_close(&format!("silu {size}"), silu::silu(x() * 8.0), activation::silu(x() * 8.0)).await;
            assert_close(&format!("upsample {size}"), upsample::upsample2(x()), upsample::composed(x())).await;

            let expected = affine::composed(x(), maps(&device));
            let found = affine::affine_sample(x(), maps(&device));
            assert_close(&format!("affine {size}"), found, expected).await;

            let step = || made("step", [2, 6, height, width], &device) * 4.0 - 2.0;
            let log_rate = || made("log rate", [6], &device) * 2.0;
            for pass in [Pass::Rows, Pass::Columns] {
                let expected = scan::composed(x(), step(), log_rate(), pass);
                let found = scan::selective_scan(x(), step(), log_rate(), pass);
                assert_close(&format!("scan {pass:?} {size}"), found, expected).await;
            }
        }
    }
}

on_each_device! {
    /// A slow state of a long row: the gain of a step of 1e-3 must not drown in the rounding of 1.
    async fn small_steps_keep_their_gain(device: Device) {
        let x = Tensor::<4>::ones([1, 1, 1, 160], &device);
        let step = Tensor::<4>::full([1, 1, 1, 160], (1e-3_f64.exp() - 1.0).ln(), &device);
        let log_rate = Tensor::<1>::zeros([1], &device);
        let found = values(scan::selective_scan(x, step, log_rate, Pass::Rows)).await;
        let (keep, gain) = ((-1e-3_f64).exp(), -(-1e-3_f64).exp_m1());
        // Two geometric series that share their first number.
        let expected: Vec<f32> = (0..160)
            .map(|t| {
                let sum = |n: i32| (1.0 - keep.powi(n)) / (1.0 - keep);
                (gain * (sum(t + 1) + sum(160 - t) - 1.0)) as f32
            })
            .collect();
        let off = common::relative_error(&found, &expected);
        assert!(off < 2e-4, "{off:e}");
    }
}

#[cfg(not(target_family = "wasm"))]
mod gradients {
    use super::*;

    type Inputs<'a> = [(&'a str, Vec<f32>, Vec<usize>)];

    /// `sum(weights * of(inputs))` in 64 bits from the outputs, and the gradients of all inputs.
    fn value(inputs: &Inputs, device: &Device, of: &dyn Fn(&[Tensor<4>]) -> Tensor<4>) -> f64 {
        let tensors: Vec<Tensor<4>> = tensors(inputs, device);
        let out = of(&tensors).into_data().try_to_vec::<f32>().unwrap();
        let weights = common::numbers("weights of the sum", out.len(), 1.0);
        let products = out
            .iter()
            .zip(weights)
            .map(|(o, w)| f64::from(*o) * f64::from(w));
        products.sum()
    }

    fn tensors(inputs: &Inputs, device: &Device) -> Vec<Tensor<4>> {
        let tensor = |(_, values, shape): &(&str, Vec<f32>, Vec<usize>)| {
            let mut four = [1; 4];
            four[4 - shape.len()..].copy_from_slice(shape);
            Tensor::from_data(TensorData::new(values.clone(), four), device)
        };
        inputs.iter().map(tensor).collect()
    }

    /// Gradients on `device` against central differences of the same operation on flex, extrapolated from two steps.
    fn check(what: &str, inputs: &Inputs, step: f32, of: impl Fn(&[Tensor<4>]) -> Tensor<4>) {
        let autodiff = Device::flex().autodiff();
        let given: Vec<Tensor<4>> = tensors(inputs, &autodiff)
            .into_iter()
            .map(Tensor::require_grad)
            .collect();
        let out = of(&given);
        let weights = common::numbers("weights of the sum", out.shape().num_elements(), 1.0);
        let weights = Tensor::<4>::from_data(TensorData::new(weights, out.shape()), &autodiff);
        let grads = (out * weights).sum().backward();
        for (which, (name, values, shape)) in inputs.iter().enumerate() {
            let found = given[which]
                .grad(&grads)
                .unwrap()
                .into_data()
                .try_to_vec::<f32>()
                .unwrap();
            let difference = |i: usize, step: f32| {
                let moved = |by: f32| {
                    let mut values = values.clone();
                    values[i] += by;
                    let at = f64::from(values[i]);
                    let mut inputs = inputs.to_vec();
                    inputs[which] = (name, values, shape.clone());
                    (value(&inputs, &Device::flex().autodiff(), &of), at)
                };
                let (up, down) = (moved(step), moved(-step));
                (up.0 - down.0) / (up.1 - down.1)
            };
            // Not all of a long one.
            let every = values.len().div_ceil(40);
            let (some, expected): (Vec<f32>, Vec<f32>) = (0..values.len())
                .step_by(every)
                .map(|i| {
                    let fine = difference(i, step);
                    let coarse = difference(i, 2.0 * step);
                    (found[i], ((4.0 * fine - coarse) / 3.0) as f32)
                })
                .unzip();
            let off = common::relative_error(&some, &expected);
            assert!(
                off < 1e-3,
                "{what}, {name}: {off:e}\n{some:?}\n{expected:?}"
            );
        }
    }

    fn input<'a>(
        name: &'a str,
        shape: &[usize],
        scale: f32,
        plus: f32,
    ) -> (&'a str, Vec<f32>, Vec<usize>) {
        let numbers = common::numbers(name, shape.iter().product(), scale);
        (
            name,
            numbers.iter().map(|v| v + plus).collect(),
            shape.to_vec(),
        )
    }

    fn flat<const D: usize>(tensor: &Tensor<4>) -> Tensor<D> {
        let dims = tensor.dims();
        let mut shape = [0; D];
        shape.copy_from_slice(&dims[4 - D..]);
        tensor.clone().reshape(shape)
    }

    const SHAPE: [usize; 4] = [2, 3, 5, 7];

    #[test]
    fn of_depthwise_convolution() {
        for (kernel, stride) in [(3, 1), (3, 2), (5, 1), (5, 2)] {
            let inputs = [
                input("x", &SHAPE, 1.0, 0.0),
                input("kernels", &[3, 1, kernel, kernel], 1.0, 0.0),
            ];
            check(&format!("{kernel}, stride {stride}"), &inputs, 0.25, |x| {
                depthwise::depthwise(x[0].clone(), x[1].clone(), stride)
            });
        }
    }

    #[test]
    fn of_pointwise_convolution() {
        let inputs = [
            input("x", &SHAPE, 1.0, 0.0),
            input("weight", &[4, 3, 1, 1], 1.0, 0.0),
            input("bias", &[4], 1.0, 0.0),
        ];
        check("biased", &inputs, 0.25, |x| {
            pointwise::pointwise(x[0].clone(), x[1].clone(), Some(flat(&x[2])))
        });
        check("without", &inputs[..2], 0.25, |x| {
            pointwise::pointwise(x[0].clone(), x[1].clone(), None)
        });
    }

    #[test]
    fn of_batch_normalisation() {
        let inputs = [
            input("x", &SHAPE, 1.0, 3.0),
            input("gamma", &[3], 1.0, 0.2),
            input("beta", &[3], 1.0, 0.0),
        ];
        // Two clusters far from the kink of the ReLU, across which a difference would be none of a smooth function.
        let mut clustered = inputs.clone();
        for x in &mut clustered[0].1 {
            let off = *x - 3.0;
            *x = 3.0 + off.signum() + 0.2 * off;
        }
        clustered[1] = input("gamma", &[3], 0.3, 1.0);
        clustered[2] = input("beta", &[3], 0.2, 0.0);
        for (relu, inputs) in [(false, &inputs), (true, &clustered)] {
            check(&format!("ReLU {relu}"), inputs, 0.05, |x| {
                let mut norm = BatchNormConfig::new(3).init(&x[0].device());
                norm.gamma = norm.gamma.map(|_| flat(&x[1]));
                norm.beta = norm.beta.map(|_| flat(&x[2]));
                batch_norm::batch_norm(&norm, x[0].clone(), relu)
            });
        }
    }

    #[test]
    fn of_channel_normalisation() {
        let inputs = [
            input("x", &SHAPE, 1.0, 0.0),
            input("gamma", &[3], 1.0, 0.0),
            input("beta", &[3], 1.0, 0.0),
        ];
        check("channel norm", &inputs, 0.01, |x| {
            channel_norm::channel_norm(x[0].clone(), flat(&x[1]), flat(&x[2]))
        });
    }

    #[test]
    fn of_silu_and_upsampling() {
        let inputs = [input("x", &SHAPE, 4.0, 0.0)];
        check("silu", &inputs, 0.05, |x| silu::silu(x[0].clone()));
        check("upsample", &inputs, 0.25, |x| {
            upsample::upsample2(x[0].clone())
        });
    }

    #[test]
    fn of_the_scan() {
        let inputs = [
            input("x", &SHAPE, 1.0, 0.0),
            input("step", &SHAPE, 1.5, -1.0),
            input("log rate", &[3], 1.0, 0.0),
        ];
        for pass in [Pass::Rows, Pass::Columns] {
            check(&format!("{pass:?}"), &inputs, 0.03, |x| {
                scan::selective_scan(x[0].clone(), x[1].clone(), flat(&x[2]), pass)
            });
        }
    }

    /// Bilinear sampling bends where a sample crosses a pixel: the first of some maps whose samples all stay clear of that by
    /// more than the steps.
    #[test]
    fn of_affine_sampling() {
        let (height, width) = (4, 5);
        let clear = |map: &[f32]| {
            (0..height * width).all(|pixel| {
                let x = (pixel % width) as f32 - 2.0;
                let y = (pixel / width) as f32 - 1.5;
                let mapped = |row: &[f32]| row[0] * x + row[1] * y + row[2] * 2.0;
                [mapped(&map[..3]) + 2.0, mapped(&map[3..]) + 1.5]
                    .iter()
                    .all(|at| (at - at.round()).abs() > 0.02)
            })
        };
        let map = (0..1000)
            .map(|i| common::numbers(&format!("map {i}"), 6, 0.4))
            .map(|map| vec![map[0] + 1.0, map[1], map[2], map[3], map[4] + 1.0, map[5]])
            .find(|map| clear(map))
            .unwrap();
        let inputs = [
            input("planes", &[1, 3, height, width], 1.0, 0.0),
            ("map", map, vec![1, 6]),
        ];
        check("affine", &inputs, 1e-3, |x| {
            affine::affine_sample(x[0].clone(), flat(&x[1]))
        });
    }

    /// What the identity's gradient is said to be: the difference to the next pixel.
    #[test]
    fn of_the_identity_map_is_the_difference_to_the_next_pixel() {
        let device = Device::flex().autodiff();
        let planes = made("planes", [1, 1, 3, 4], &device);
        let map =
            Tensor::<2>::from_floats([[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]], &device).require_grad();
        let grads = affine::affine_sample(planes.clone(), map.clone())
            .sum()
            .backward();
        let found = map
            .grad(&grads)
            .unwrap()
            .into_data()
            .try_to_vec::<f32>()
            .unwrap();
        let p = planes.into_data().try_to_vec::<f32>().unwrap();
        let to_the_right: f32 = (0..3).map(|y| p[4 * y + 3] - p[4 * y]).sum();
        let down: f32 = (0..4).map(|x| p[8 + x] - p[x]).sum();
        assert!((found[2] - 1.5 * to_the_right).abs() < 1e-5, "{found:?}");
        assert!((found[5] - 1.5 * down).abs() < 1e-5, "{found:?}");
    }
}
