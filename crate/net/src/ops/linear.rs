//! A linear layer of each row of a table as one kernel, and the layer normalisation before it as another: what WebGPU runs where
//! nothing is differentiated.

use burn::backend::{Flex, ops::FloatTensorOps};
use burn::nn::{LayerNorm, Linear};
use burn::tensor::Tensor;
use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

use super::cube::{self, THREADS, dims, empty, groups, largest_step, numbers, rows, tensor};

/// Rows of a thread: weights that are read once serve them all. As many as a sparse convolution's.
const ROWS: usize = 4;
/// Added to variances.
const EPSILON: f32 = 1e-5;

/// What `layer` gives for each row of `x` `[P, I]`.
pub(crate) fn of_rows(layer: &Linear, x: Tensor<2>) -> Tensor<2> {
    if !cube::runs_on(&x.device()) {
        if cube::NO_OTHER {
            return on_processor(layer, x);
        }
        return layer.forward(x);
    }
    let around = Around {
        bias: layer.bias.as_ref().map(|bias| numbers(bias.val())),
        ..Around::default()
    };
    let matrix = Matrix::whole(numbers(layer.weight.val()));
    tensor(linear(numbers(x), matrix, around))
}

/// The same by the processor's own matrix product.
fn on_processor(layer: &Linear, x: Tensor<2>) -> Tensor<2> {
    let flex = |tensor: Tensor<2>| match tensor.try_into_primitive::<Flex>() {
        Ok(flex) => flex,
        Err(error) => panic!("a tensor of the processor: {error:?}"),
    };
    let product = Flex::float_matmul(flex(x), flex(layer.weight.val()));
    let product = Tensor::<2>::from_primitive::<Flex>(product);
    match &layer.bias {
        Some(bias) => product + bias.val().unsqueeze(),
        None => product,
    }
}

/// What `norm` gives for each row of `x` `[P, C]`.
pub(crate) fn normed_rows(norm: &LayerNorm, x: Tensor<2>) -> Tensor<2> {
    match &norm.beta {
        Some(beta) if cube::runs_on(&x.device()) => {
            let [gamma, beta] = [&norm.gamma, beta].map(|values| numbers(values.val()));
            tensor(row_norm(numbers(x), gamma, beta))
        }
        _ => norm.forward(x),
    }
}

/// A part of a matrix `[.., width]`: its row `first_row`, and the ones after it, from `first_column` on.
#[derive(Clone)]
pub(crate) struct Matrix {
    /// The whole matrix, row by row, or a list that begins with it.
    pub numbers: CubeTensor,
    /// Length of its rows.
    pub width: usize,
    /// Row for the first of a table's channels.
    pub first_row: usize,
    /// Column of the first of the result's channels.
    pub first_column: usize,
    /// Channels of the result.
    pub outputs: usize,
}

impl Matrix {
    /// All of `weight` `[I, O]`.
    pub fn whole(weight: CubeTensor) -> Self {
        let [_, width] = dims(&weight);
        Self {
            numbers: rows(weight),
            width,
            first_row: 0,
            first_column: 0,
            outputs: width,
        }
    }

    /// From row `first_row` on.
    pub fn below(&self, first_row: usize) -> Self {
        Self {
            first_row,
            ..self.clone()
        }
    }

    /// Some columns.
    pub fn columns(&self, first_column: usize, outputs: usize) -> Self {
        Self {
            first_column,
            outputs,
            ..self.clone()
        }
    }
}

/// What a linear layer has besides its matrix.
#[derive(Default)]
pub(crate) struct Around {
    /// Of each column of the whole matrix.
    pub bias: Option<CubeTensor>,
    /// Added to the result, `[P, O]`.
    pub added: Option<CubeTensor>,
    /// Whether the table's numbers go through the SiLU first.
    pub silu: bool,
    /// Whether negative results become 0.
    pub relu: bool,
}

/// `[P, O]` from `table` `[P, I]`.
pub(crate) fn linear(table: CubeTensor, matrix: Matrix, around: Around) -> CubeTensor {
    let [count, inputs] = dims(&table);
    let out = empty([count, matrix.outputs], &table);
    if count == 0 {
        return out;
    }
    let fits = [matrix.width, matrix.first_column, matrix.outputs];
    let step = match fits.iter().all(|size| size.is_multiple_of(4)) {
        true => 4,
        false => 1,
    };
    let tile = largest_step(matrix.outputs / step, &[2, 3]);
    let [biased, added] = [around.bias.is_some(), around.added.is_some()];
    // A binding cannot stay empty, nor shorter than a vector: what is not read may be anything else.
    let bias = around.bias.map_or_else(|| matrix.numbers.clone(), rows);
    let other = around.added.map_or_else(|| matrix.numbers.clone(), rows);
    // SAFETY: threads past the last row end at once; the matrix has a row for each channel of the table.
    unsafe {
        linear_kernel::launch_unchecked(
            &out.client,
            CubeCount::Static(
                (count as u32).div_ceil(THREADS * ROWS as u32),
                (matrix.outputs / (step * tile)) as u32,
                1,
            ),
            CubeDim::new_1d(THREADS),
            step,
            rows(table).into_buffer_arg(),
            matrix.numbers.into_buffer_arg(),
            bias.into_buffer_arg(),
            other.into_buffer_arg(),
            out.clone().into_buffer_arg(),
            count as u32,
            inputs as u32,
            (matrix.outputs / step) as u32,
            (matrix.width / step) as u32,
            matrix.first_row as u32,
            (matrix.first_column / step) as u32,
            if around.relu { 0.0 } else { f32::MIN },
            tile,
            biased,
            added,
            around.silu,
        );
    }
    out
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn linear_kernel<M: Size>(
    table: &[f32],
    weight: &[Vector<f32, M>],
    bias: &[Vector<f32, M>],
    added_to: &[Vector<f32, M>],
    out: &mut [Vector<f32, M>],
    count: u32,
    inputs: u32,
    outputs: u32,
    stride: u32,
    first_row: u32,
    first_column: u32,
    least: f32,
    #[comptime] tile: usize,
    #[comptime] biased: bool,
    #[comptime] added: bool,
    #[comptime] silu: bool,
) {
    let first = CUBE_POS_X * comptime!(THREADS * ROWS as u32) + UNIT_POS_X;
    if first >= count {
        terminate!();
    }
    let column = CUBE_POS_Y as usize * tile;
    let mut sums = Array::<Vector<f32, M>>::new(comptime!(ROWS * tile));
    #[unroll]
    for s in 0..comptime!(ROWS * tile) {
        sums[s] = Vector::new(0.0f32);
    }
    let mut at = (first_row * stride + first_column) as usize + column;
    let mut from = Array::<usize>::new(ROWS);
    #[unroll]
    for r in 0..ROWS {
        // The last rows of a ragged end repeat the last of all, and are not written.
        let row = (first + comptime!(r as u32 * THREADS)).min(count - 1);
        from[r] = (row * inputs) as usize;
    }
    for channel in 0..inputs as usize {
        let mut x = Array::<Vector<f32, M>>::new(ROWS);
        #[unroll]
        for r in 0..ROWS {
            let mut value = table[from[r] + channel];
            if comptime!(silu) {
                value /= 1.0f32 + (0.0f32 - value).exp();
            }
            x[r] = Vector::new(value);
        }
        #[unroll]
        for t in 0..tile {
            let w = weight[at + t];
            #[unroll]
            for r in 0..ROWS {
                sums[r * tile + t] += x[r] * w;
            }
        }
        at += stride as usize;
    }
    #[unroll]
    for r in 0..ROWS {
        let row = first + comptime!(r as u32 * THREADS);
        if row < count {
            #[unroll]
            for t in 0..tile {
                let mut value = sums[r * tile + t];
                let to = (row * outputs) as usize + column + t;
                if comptime!(biased) {
                    value += bias[first_column as usize + column + t];
                }
                if comptime!(added) {
                    value += added_to[to];
                }
                out[to] = value.max(Vector::new(least));
            }
        }
    }
}

/// `gamma (x - mean) / sqrt(variance + 1e-5) + beta` of each row of `table` `[P, C]`.
pub(crate) fn row_norm(table: CubeTensor, gamma: CubeTensor, beta: CubeTensor) -> CubeTensor {
    let [count, channels] = dims(&table);
    let out = empty([count, channels], &table);
    if count == 0 {
        return out;
    }
    let width = largest_step(channels, &[2, 4]);
    // SAFETY: threads past the last row end at once.
    unsafe {
        row_norm_kernel::launch_unchecked(
            &out.client,
            groups(count),
            CubeDim::new_1d(THREADS),
            width,
            rows(table).into_buffer_arg(),
            rows(gamma).into_buffer_arg(),
            rows(beta).into_buffer_arg(),
            out.clone().into_buffer_arg(),
            count as u32,
            (channels / width) as u32,
            EPSILON,
            width,
        );
    }
    out
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn row_norm_kernel<N: Size>(
    table: &[Vector<f32, N>],
    gamma: &[Vector<f32, N>],
    beta: &[Vector<f32, N>],
    out: &mut [Vector<f32, N>],
    count: u32,
    channels: u32,
    epsilon: f32,
    #[comptime] width: usize,
) {
    let row = ABSOLUTE_POS;
    if row >= count as usize {
        terminate!();
    }
    let channels = channels as usize;
    let first = row * channels;
    let share = 1.0f32 / (channels * width) as f32;
    let mut sums = Vector::<f32, N>::new(0.0f32);
    for v in 0..channels {
        sums += table[first + v];
    }
    let mut mean = 0.0f32;
    #[unroll]
    for c in 0..width {
        mean += sums.extract(c);
    }
    let mean = Vector::<f32, N>::new(mean * share);
    let mut squares = Vector::<f32, N>::new(0.0f32);
    for v in 0..channels {
        let off = table[first + v] - mean;
        squares = fma(off, off, squares);
    }
    let mut variance = 0.0f32;
    #[unroll]
    for c in 0..width {
        variance += squares.extract(c);
    }
    let scale = Vector::<f32, N>::new(1.0f32 / (variance * share + epsilon).sqrt());
    for v in 0..channels {
        let off = (table[first + v] - mean) * scale;
        out[first + v] = fma(off, gamma[v], beta[v]);
    }
}
