//! Planes sampled at projected voxels (method 1.5).
//!
//! `out_p = sum_k w_pk table[corner_p + step_k]`: bilinear interpolation between the four pixels around pair `p`'s
//! coordinates `(u, v)`, in pixels of the plane with the first centre at 0 (align_corners in PyTorch's terms). A plane's
//! pixels are rows of `C` channels. Coordinates have no gradient.

use burn::backend::{
    Backend, TensorMetadata, backend_extension, get_device_settings,
    tensor::{FloatTensor, IntTensor},
};
use burn::tensor::{IndexingUpdateOp, Int, Tensor};
use burn_cubecl::{CubeBackend, tensor::CubeTensor};

use super::cube;
use super::segments::take;

#[cfg(not(target_family = "wasm"))]
use burn::backend::Autodiff;

pub(crate) mod flex;
mod fused;

/// Where rows are read from a table of planes, pixel by pixel: row `x + width * (y + height * view)`.
#[derive(Clone, Debug)]
pub struct Places {
    /// Row of the upper left of the four pixels, `[P]`. The other three lie in the same plane.
    pub corner: Tensor<1, Int>,
    /// How far right of it, 0 to 1, `[P]`.
    pub right: Tensor<1>,
    /// How far below it, 0 to 1, `[P]`.
    pub down: Tensor<1>,
    /// Columns and rows of a plane.
    pub plane: [usize; 2],
}

/// `[P, C]` from `planes [V, C, h, w]`.
pub fn sample(planes: Tensor<4>, places: &Places) -> Tensor<2> {
    let [views, channels, height, width] = planes.dims();
    let table = planes
        .permute([0, 2, 3, 1])
        .reshape([views * height * width, channels]);
    let out = <burn::backend::Dispatch as RowsExtension>::sample_rows(
        table.into_dispatch(),
        places.corner.clone().into_dispatch(),
        places.right.clone().into_dispatch(),
        places.down.clone().into_dispatch(),
        places.plane,
    );
    Tensor::from_dispatch(out)
}

/// The operation by backend.
#[backend_extension(Cube, Flex, Autodiff: cfg(not(target_family = "wasm")))]
pub trait RowsExtension: Backend {
    /// See [`sample`]; `table` is `[V * h * w, C]`.
    fn sample_rows(
        table: FloatTensor<Self>,
        corner: IntTensor<Self>,
        right: FloatTensor<Self>,
        down: FloatTensor<Self>,
        plane: [usize; 2],
    ) -> FloatTensor<Self>;
}

/// [`Places`] on a backend.
#[derive(Clone, Debug)]
pub struct At<B: Backend> {
    /// Row of the upper left pixel.
    pub corner: IntTensor<B>,
    /// How far right of it.
    pub right: FloatTensor<B>,
    /// How far below it.
    pub down: FloatTensor<B>,
    /// Columns and rows of a plane.
    pub plane: [usize; 2],
}

/// Both directions of the operation, in tensor operations unless a backend has better.
pub trait RowsPasses: Backend {
    /// `[P, C]` from the table `[R, C]`.
    fn rows_forward(table: FloatTensor<Self>, at: &At<Self>) -> FloatTensor<Self> {
        plain_forward::<Self>(table, at)
    }

    /// Gradient of the table of `rows` rows.
    fn rows_backward(grad: FloatTensor<Self>, rows: usize, at: &At<Self>) -> FloatTensor<Self> {
        plain_backward::<Self>(grad, rows, at)
    }
}

impl RowsPasses for CubeBackend {
    fn rows_forward(table: CubeTensor, at: &At<Self>) -> CubeTensor {
        if cube::plain() {
            return plain_forward::<Self>(table, at);
        }
        fused::forward(table, at)
    }
}

impl<B: RowsPasses> RowsExtension for B {
    fn sample_rows(
        table: FloatTensor<Self>,
        corner: IntTensor<Self>,
        right: FloatTensor<Self>,
        down: FloatTensor<Self>,
        plane: [usize; 2],
    ) -> FloatTensor<Self> {
        let at = At {
            corner,
            right,
            down,
            plane,
        };
        Self::rows_forward(table, &at)
    }
}

#[cfg(not(target_family = "wasm"))]
mod trained {
    use burn::backend::autodiff::{
        checkpoint::{base::Checkpointer, strategy::CheckpointStrategy},
        grads::Gradients,
        ops::{Backward, Ops, OpsKind},
    };

    use super::*;

    #[derive(Debug)]
    struct RowsBackward;

    impl<B: RowsPasses> Backward<B, 1> for RowsBackward {
        type State = (usize, At<B>);

        fn backward(
            self,
            ops: Ops<Self::State, 1>,
            grads: &mut Gradients,
            _checkpointer: &mut Checkpointer,
        ) {
            let grad = grads.consume::<B>(&ops.node);
            let (rows, at) = ops.state;
            if let [Some(node)] = ops.parents {
                grads.register::<B>(node.id, B::rows_backward(grad, rows, &at));
            }
        }
    }

    impl<B: RowsPasses, C: CheckpointStrategy> RowsExtension for Autodiff<B, C> {
        fn sample_rows(
            table: FloatTensor<Self>,
            corner: IntTensor<Self>,
            right: FloatTensor<Self>,
            down: FloatTensor<Self>,
            plane: [usize; 2],
        ) -> FloatTensor<Self> {
            let at = At::<B> {
                corner,
                right: right.into_primitive(),
                down: down.into_primitive(),
                plane,
            };
            let nodes = [table.node()];
            let table = table.into_primitive();
            let rows = table.shape()[0];
            let out = B::rows_forward(table, &at);
            match RowsBackward.prepare::<C>(nodes).compute_bound().stateful() {
                OpsKind::Tracked(prep) => prep.finish((rows, at), out),
                OpsKind::UnTracked(prep) => prep.finish(out),
            }
        }
    }
}

/// From a pixel to the one right of it and to the one below, in rows. A plane of one column or row has no such pixel;
/// the weight is 0 then.
pub(crate) fn strides([width, height]: [usize; 2]) -> [usize; 2] {
    [usize::from(width > 1), if height > 1 { width } else { 0 }]
}

/// The four rows of each pair and their weights `[P, 1]`.
fn corners<B: Backend>(at: &At<B>) -> [(IntTensor<B>, FloatTensor<B>); 4] {
    let pairs = at.corner.shape()[0];
    let column = |t: &FloatTensor<B>| B::float_reshape(t.clone(), [pairs, 1].into());
    let other = |t: &FloatTensor<B>| B::float_add_scalar(B::float_neg(t.clone()), 1.0.into());
    let [right, down] = [column(&at.right), column(&at.down)];
    let [left, up] = [other(&right), other(&down)];
    let [across, below] = strides(at.plane);
    let row = |step: usize| B::int_add_scalar(at.corner.clone(), (step as i64).into());
    [
        (row(0), B::float_mul(left.clone(), up.clone())),
        (row(across), B::float_mul(right.clone(), up)),
        (row(below), B::float_mul(left, down.clone())),
        (row(across + below), B::float_mul(right, down)),
    ]
}

/// The operation in tensor operations.
pub fn plain_forward<B: Backend>(table: FloatTensor<B>, at: &At<B>) -> FloatTensor<B> {
    let [a, b, c, d] =
        corners::<B>(at).map(|(row, weight)| B::float_mul(take::<B>(&table, &row), weight));
    B::float_add(B::float_add(a, b), B::float_add(c, d))
}

/// The transpose: every pair's gradient goes to its four rows by the same weights.
pub fn plain_backward<B: Backend>(grad: FloatTensor<B>, rows: usize, at: &At<B>) -> FloatTensor<B> {
    let device = grad.device();
    let settings = get_device_settings::<B>(&device);
    let channels = grad.shape()[1];
    let zeros = B::float_zeros([rows, channels].into(), &device, settings.float_dtype);
    corners::<B>(at)
        .into_iter()
        .fold(zeros, |sum, (row, weight)| {
            let part = B::float_mul(grad.clone(), weight);
            B::float_select_assign(sum, 0, row, part, IndexingUpdateOp::Add)
        })
}
