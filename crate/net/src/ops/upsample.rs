//! Bilinear upsampling by two.

use burn::tensor::Tensor;

/// Twice the height and width, bilinear, with half-pixel centres (`align_corners = false`): output `2 i` is
/// `(x_{i-1} + 3 x_i) / 4`, output `2 i + 1` is `(3 x_i + x_{i+1}) / 4`, and the edge repeats.
pub fn upsample2(x: Tensor<4>) -> Tensor<4> {
    doubled(doubled(x, 2), 3)
}

/// Along one axis.
fn doubled(x: Tensor<4>, axis: usize) -> Tensor<4> {
    let mut shape = x.dims();
    let length = shape[axis];
    let inner = x.clone().narrow(axis, 0, length - 1);
    let before = Tensor::cat(vec![x.clone().narrow(axis, 0, 1), inner], axis);
    let inner = x.clone().narrow(axis, 1, length - 1);
    let after = Tensor::cat(vec![inner, x.clone().narrow(axis, length - 1, 1)], axis);
    let x = x * 0.75;
    let even = x.clone() + before * 0.25;
    let odd = x + after * 0.25;
    shape[axis] *= 2;
    // Interleaved: a new axis right after the doubled one.
    Tensor::stack::<5>(vec![even, odd], axis + 1).reshape(shape)
}
