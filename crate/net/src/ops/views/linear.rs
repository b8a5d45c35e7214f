//! Linear layers over some rows: products with the weights where they lie.

use std::ops::Range;

use gemm::Parallelism;

use super::super::lanes::each;
use super::super::wide::wide;

/// A matrix in a slice: where one row and one column further is.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    pub data: &'a [f32],
    pub steps: [usize; 2],
}

impl<'a> Matrix<'a> {
    /// Rows of `stride` numbers, of which the first are meant.
    pub fn rows(data: &'a [f32], stride: usize) -> Self {
        Self {
            data,
            steps: [stride, 1],
        }
    }

    /// Columns for rows.
    pub fn transposed(self) -> Self {
        let [row, column] = self.steps;
        Self {
            steps: [column, row],
            ..self
        }
    }
}

/// `to += a b`, with `a` of `m` rows and `k` columns and `b` of `n` columns; `to` has rows of `stride` numbers.
pub(super) fn add_product(
    to: &mut [f32],
    stride: usize,
    [m, k, n]: [usize; 3],
    a: Matrix<'_>,
    b: Matrix<'_>,
) {
    if m * k * n == 0 {
        return;
    }
    let last = |[rows, columns]: [usize; 2], [row, column]: [usize; 2]| {
        (rows - 1) * row + (columns - 1) * column
    };
    assert!(last([m, n], [stride, 1]) < to.len());
    assert!(last([m, k], a.steps) < a.data.len());
    assert!(last([k, n], b.steps) < b.data.len());
    let steps = |matrix: &Matrix<'_>| matrix.steps.map(|step| step as isize);
    let ([a_row, a_column], [b_row, b_column]) = (steps(&a), steps(&b));
    // SAFETY: the last element of each matrix lies in its slice, as just asked, and `to` is borrowed alone.
    unsafe {
        gemm::gemm(
            m,
            n,
            k,
            to.as_mut_ptr(),
            1,
            stride as isize,
            true,
            a.data.as_ptr(),
            a_column,
            a_row,
            b.data.as_ptr(),
            b_column,
            b_row,
            1.0,
            1.0,
            false,
            false,
            false,
            Parallelism::None,
        );
    }
}

/// Where a linear layer's weight `[inputs, outputs]` and bias lie among all weights.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    pub weight: Range<usize>,
    pub bias: Range<usize>,
    pub inputs: usize,
    pub outputs: usize,
}

impl Linear {
    /// The layer whose weight begins at `start`, which moves to its end.
    pub fn take(start: &mut usize, inputs: usize, outputs: usize) -> Self {
        let weight = *start..*start + inputs * outputs;
        let bias = weight.end..weight.end + outputs;
        *start = bias.end;
        Self {
            weight,
            bias,
            inputs,
            outputs,
        }
    }

    /// `y += x W + b`; rows of `x` and `y` have `x_stride` and `y_stride` numbers.
    pub fn add(
        &self,
        weights: &[f32],
        rows: usize,
        x: (&[f32], usize),
        (y, y_stride): (&mut [f32], usize),
    ) {
        add_to_rows(&weights[self.bias.clone()], rows, y_stride, y);
        self.add_weighted(weights, rows, x, (y, y_stride));
    }

    /// `y = x W + b` into rows without gaps.
    pub fn set(&self, weights: &[f32], rows: usize, x: (&[f32], usize), y: &mut [f32]) {
        for y in y[..rows * self.outputs].chunks_exact_mut(self.outputs) {
            y.copy_from_slice(&weights[self.bias.clone()]);
        }
        self.add_weighted(weights, rows, x, (y, self.outputs));
    }

    fn add_weighted(
        &self,
        weights: &[f32],
        rows: usize,
        (x, x_stride): (&[f32], usize),
        (y, y_stride): (&mut [f32], usize),
    ) {
        let weight = Matrix::rows(&weights[self.weight.clone()], self.outputs);
        let size = [rows, self.inputs, self.outputs];
        add_product(y, y_stride, size, Matrix::rows(x, x_stride), weight);
    }

    /// `dW += x^T dy`, `db += sum dy`.
    pub fn add_gradients(
        &self,
        grads: &mut [f32],
        rows: usize,
        (x, x_stride): (&[f32], usize),
        (dy, dy_stride): (&[f32], usize),
    ) {
        add_rows(dy, rows, dy_stride, &mut grads[self.bias.clone()]);
        let weight = &mut grads[self.weight.clone()];
        let size = [self.inputs, rows, self.outputs];
        let x = Matrix::rows(x, x_stride).transposed();
        add_product(weight, self.outputs, size, x, Matrix::rows(dy, dy_stride));
    }

    /// `dx = dy W^T` into rows without gaps.
    pub fn input_gradient(
        &self,
        weights: &[f32],
        rows: usize,
        (dy, dy_stride): (&[f32], usize),
        dx: &mut [f32],
    ) {
        dx[..rows * self.inputs].fill(0.0);
        let weight = Matrix::rows(&weights[self.weight.clone()], self.outputs).transposed();
        let size = [rows, self.outputs, self.inputs];
        add_product(dx, self.inputs, size, Matrix::rows(dy, dy_stride), weight);
    }
}

wide! {
    /// Adds the same numbers to the beginning of each row.
    fn add_to_rows(numbers: &[f32], rows: usize, stride: usize, to: &mut [f32]) {
        for row in 0..rows {
            each(&mut to[row * stride..][..numbers.len()], [numbers], |to, [number]| to + number);
        }
    }
}

wide! {
    /// Adds up the beginnings of rows.
    fn add_rows(from: &[f32], rows: usize, stride: usize, sums: &mut [f32]) {
        for row in 0..rows {
            each(sums, [&from[row * stride..]], |sum, [number]| sum + number);
        }
    }
}
