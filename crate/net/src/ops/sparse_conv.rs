//! Convolution on a sparse set of lattice sites: submanifold, with stride 2, and its transpose are one operation over
//! different [`KernelMap`]s (method 1.7).

#[cfg(not(target_family = "wasm"))]
mod backward;
mod flex;
pub(crate) mod fused;
mod tile;

use super::{cube, flex as slices};
use burn::{
    Tensor,
    backend::{
        Backend, Dispatch, Flex, Slice, TensorMetadata, backend_extension,
        tensor::{FloatTensor, IntTensor},
    },
    tensor::{DType, Device, Int, Shape, TensorData},
};
use burn_cubecl::{CubeBackend, tensor::CubeTensor};
use burn_flex::FlexTensor;

/// Gathered rows take at most this much at a time: half of what WebGPU guarantees for a binding.
const GATHERED_BYTES: usize = 64 << 20;

/// Which input row meets which output row under which tap of a convolution with K taps.
#[derive(Clone, Debug)]
pub struct KernelMap {
    /// Rows of the input.
    pub inputs: usize,
    /// Rows of the output.
    pub outputs: usize,
    /// `[outputs, K]`: the input row under tap k, or `inputs` where there is none.
    pub gather: Tensor<2, Int>,
    /// `[inputs, K]`: the output row that takes the input row under tap k, or `outputs` where there is none.
    pub scatter: Tensor<2, Int>,
}

impl KernelMap {
    /// Takes both directions row by row, `taps` numbers a row; see the fields.
    pub fn new(gather: Vec<i32>, scatter: Vec<i32>, taps: usize, device: &Device) -> Self {
        let (outputs, inputs) = (gather.len() / taps, scatter.len() / taps);
        let upload = |rows, values| {
            Tensor::from_data(TensorData::new(values, [rows, taps]), (device, DType::I32))
        };
        Self {
            inputs,
            outputs,
            gather: upload(outputs, gather),
            scatter: upload(inputs, scatter),
        }
    }

    /// The map of the transposed convolution: from this one's outputs to its inputs.
    pub fn transposed(&self) -> Self {
        Self {
            inputs: self.outputs,
            outputs: self.inputs,
            gather: self.scatter.clone(),
            scatter: self.gather.clone(),
        }
    }
}

/// Convolves rows `[inputs, I]` with `weight` `[K, I, O]` to rows `[outputs, O]`: output n is the sum over taps k of
/// `features[gather[n, k]] · weight[k]`, absent rows being zero. No bias. Both ends of `map` need at least one row.
pub fn sparse_conv(features: Tensor<2>, weight: Tensor<3>, map: &KernelMap) -> Tensor<2> {
    Tensor::from_dispatch(<Dispatch as SparseConv>::sparse_conv(
        features.into_dispatch(),
        weight.into_dispatch(),
        map.gather.clone().into_dispatch(),
        map.scatter.clone().into_dispatch(),
    ))
}

/// [`sparse_conv`], then `scale` times it plus `shift`, channel by channel, plus `added` `[outputs, O]`, then, where asked, a ReLU; on
/// a device that [`cube::runs_on`] is true of.
pub(crate) fn sparse_conv_finished(
    features: Tensor<2>,
    weight: Tensor<3>,
    map: &KernelMap,
    factors: [Tensor<1>; 2],
    added: Option<Tensor<2>>,
    relu: bool,
) -> Tensor<2> {
    let finish = fused::Finish {
        factors: Some(factors.map(cube::numbers)),
        added: added.map(cube::numbers),
        relu,
    };
    let gather = cube::whole_numbers(map.gather.clone());
    let (features, weight) = (cube::numbers(features), cube::numbers(weight));
    cube::tensor(fused::convolve(features, weight, gather, finish))
}

/// The operation for burn's backends. Features `[M, I]`, weight `[K, I, O]`, gather `[N, K]`, scatter `[M, K]`.
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait SparseConv: Backend {
    /// Rows `[N, O]`. `scatter` serves the gradient.
    fn sparse_conv(
        features: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        gather: IntTensor<Self>,
        _scatter: IntTensor<Self>,
    ) -> FloatTensor<Self> {
        plain_forward::<Self>(features, weight, gather)
    }

    /// The gradient of the weight `[K, I, O]`, given that of the output `[N, O]`.
    fn sparse_conv_weight_gradient(
        features: FloatTensor<Self>,
        gradient: FloatTensor<Self>,
        gather: IntTensor<Self>,
    ) -> FloatTensor<Self> {
        let [_, inputs] = features.shape().dims();
        let [_, outputs] = gradient.shape().dims();
        let [rows, taps] = gather.shape().dims();
        let features = with_zero_row::<Self>(features);
        let products = blocks(rows, taps * inputs).map(|block| {
            let gathered = gathered::<Self>(&features, &gather, block.clone());
            let gradient = Self::float_slice(gradient.clone(), &[block.into(), Slice::full()]);
            Self::float_matmul(Self::float_transpose(gathered), gradient)
        });
        let sum = products.reduce(Self::float_add);
        let sum = sum.unwrap_or_else(|| {
            let shape = Shape::new([taps * inputs, outputs]);
            let dtype = gradient.dtype().into();
            Self::float_zeros(shape, &features.device(), dtype)
        });
        Self::float_reshape(sum, Shape::new([taps, inputs, outputs]))
    }
}

impl SparseConv for Flex {
    fn sparse_conv(
        features: FlexTensor,
        weight: FlexTensor,
        gather: FlexTensor,
        _scatter: FlexTensor,
    ) -> FlexTensor {
        let [taps, inputs, outputs] = weight.shape().dims();
        let [rows, _] = features.shape().dims();
        let [output_rows, _] = gather.shape().dims();
        let gather = gather.to_contiguous();
        let sizes = flex::Sizes {
            taps,
            rows,
            inputs,
            outputs,
        };
        let (features, weight) = (slices::read(features), slices::read(weight));
        let output = flex::convolve(&features, &weight, gather.storage::<i32>(), sizes);
        slices::tensor(output, Shape::new([output_rows, outputs]))
    }

    fn sparse_conv_weight_gradient(
        features: FlexTensor,
        gradient: FlexTensor,
        gather: FlexTensor,
    ) -> FlexTensor {
        let [rows, inputs] = features.shape().dims();
        let [_, outputs] = gradient.shape().dims();
        let [_, taps] = gather.shape().dims();
        let gather = gather.to_contiguous();
        let sizes = flex::Sizes {
            taps,
            rows,
            inputs,
            outputs,
        };
        let (features, gradient) = (slices::read(features), slices::read(gradient));
        let output = flex::weight_gradient(&features, &gradient, gather.storage::<i32>(), sizes);
        slices::tensor(output, Shape::new([taps, inputs, outputs]))
    }
}

impl SparseConv for CubeBackend {
    fn sparse_conv(
        features: CubeTensor,
        weight: CubeTensor,
        gather: CubeTensor,
        _scatter: CubeTensor,
    ) -> CubeTensor {
        if cube::plain() {
            return plain_forward::<Self>(features, weight, gather);
        }
        let finish = fused::Finish {
            factors: None,
            added: None,
            relu: false,
        };
        fused::convolve(features, weight, gather, finish)
    }
}

/// The operation in tensor operations, with what lies under the taps gathered into memory.
pub fn plain_forward<B: Backend>(
    features: FloatTensor<B>,
    weight: FloatTensor<B>,
    gather: IntTensor<B>,
) -> FloatTensor<B> {
    let [_, inputs, outputs] = weight.shape().dims();
    let [rows, taps] = gather.shape().dims();
    let weight = B::float_reshape(weight, Shape::new([taps * inputs, outputs]));
    let features = with_zero_row::<B>(features);
    let blocks = blocks(rows, taps * inputs).map(|block| {
        let gathered = gathered::<B>(&features, &gather, block);
        B::float_matmul(gathered, weight.clone())
    });
    joined::<B>(blocks.collect())
}

/// Rows whose gathered copies of `width` numbers each stay within [`GATHERED_BYTES`].
fn blocks(rows: usize, width: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let step = (GATHERED_BYTES / (4 * width)).max(1);
    (0..rows)
        .step_by(step)
        .map(move |start| start..(start + step).min(rows))
}

fn with_zero_row<B: Backend>(features: FloatTensor<B>) -> FloatTensor<B> {
    let [_, width] = features.shape().dims();
    let (device, dtype) = (features.device(), features.dtype());
    let zero = B::float_zeros(Shape::new([1, width]), &device, dtype.into());
    B::float_cat(vec![features, zero], 0)
}

/// `[block, K * I]`: what lies under the taps of each output row of the block.
fn gathered<B: Backend>(
    features: &FloatTensor<B>,
    gather: &IntTensor<B>,
    block: std::ops::Range<usize>,
) -> FloatTensor<B> {
    let [_, width] = features.shape().dims();
    let [_, taps] = gather.shape().dims();
    let rows = block.len();
    let index = B::int_slice(gather.clone(), &[block.into(), Slice::full()]);
    let index = B::int_reshape(index, Shape::new([rows * taps]));
    let gathered = B::float_select(features.clone(), 0, index);
    B::float_reshape(gathered, Shape::new([rows, taps * width]))
}

fn joined<B: Backend>(mut blocks: Vec<FloatTensor<B>>) -> FloatTensor<B> {
    if blocks.len() == 1 {
        blocks.swap_remove(0)
    } else {
        B::float_cat(blocks, 0)
    }
}
