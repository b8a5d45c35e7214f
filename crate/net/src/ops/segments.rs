//! Rows of a table that belong together: the pairs of a voxel, one after the other.

use burn::backend::{
    Backend, TensorMetadata, get_device_settings,
    tensor::{FloatTensor, IntTensor},
};
use burn::tensor::{Device, Int, Tensor, TensorData};

/// Which rows of a `[P, C]` table belong to which of `N` segments. The rows of a segment are consecutive; a segment may
/// have none.
#[derive(Clone, Debug)]
pub struct Segments {
    /// `[N + 1]`: rows `offsets[n]..offsets[n + 1]` are those of segment `n`.
    pub offsets: Tensor<1, Int>,
    /// `[P]`: the segment of a row.
    pub of_row: Tensor<1, Int>,
    /// Rows in all.
    pub rows: usize,
    /// Segments in all.
    pub count: usize,
    /// Rows of the longest segment.
    pub longest: usize,
}

impl Segments {
    /// The segments that end where the next begins. `offsets` starts at 0, never falls, and ends with the number of rows.
    pub fn new(offsets: &[i32], device: &Device) -> Self {
        let lengths = offsets.windows(2).map(|o| (o[1] - o[0]) as usize);
        let of_row: Vec<i32> = (0..)
            .zip(lengths.clone())
            .flat_map(|(segment, length)| std::iter::repeat_n(segment, length))
            .collect();
        Self {
            rows: of_row.len(),
            count: offsets.len().saturating_sub(1),
            longest: lengths.max().unwrap_or(0),
            offsets: Tensor::from_data(TensorData::from(offsets), device),
            of_row: Tensor::from_data(TensorData::from(of_row.as_slice()), device),
        }
    }

    /// Rows of each segment, `[N]`.
    pub fn lengths(&self) -> Tensor<1> {
        let start = self.offsets.clone().slice(0..self.count);
        let end = self.offsets.clone().slice(1..self.count + 1);
        (end - start).float()
    }
}

/// First row and last row (relative to the first) of each segment, `[N]`; -1 where it has none.
fn bounds<B: Backend>(offsets: IntTensor<B>) -> (IntTensor<B>, IntTensor<B>) {
    let count = offsets.shape()[0] - 1;
    let first = B::int_slice(offsets.clone(), &[(0..count).into()]);
    let end = B::int_slice(offsets, &[(1..count + 1).into()]);
    let last = B::int_sub_scalar(B::int_sub(end, first.clone()), 1.into());
    (first, last)
}

/// For plain forms that walk all segments at once: in step `s` every segment shows its row `s`.
pub(crate) struct Walk<B: Backend> {
    first: IntTensor<B>,
    last: IntTensor<B>,
    rows: usize,
}

impl<B: Backend> Walk<B> {
    /// A walk with one entry a segment.
    pub fn by_segment(offsets: IntTensor<B>, rows: usize) -> Self {
        let (first, last) = bounds::<B>(offsets);
        Self { first, last, rows }
    }

    /// A walk with one entry a row, which is shown the rows of its own segment.
    pub fn by_row(offsets: IntTensor<B>, of_row: IntTensor<B>) -> Self {
        let rows = of_row.shape()[0];
        let (first, last) = bounds::<B>(offsets);
        Self {
            first: B::int_select(first, 0, of_row.clone()),
            last: B::int_select(last, 0, of_row),
            rows,
        }
    }

    /// The row shown in step `s` and 1 or, where the segment has no such row, another row of it and 0, `[.., 1]`.
    pub fn step(&self, s: usize) -> (IntTensor<B>, FloatTensor<B>) {
        let device = self.first.device();
        let settings = get_device_settings::<B>(&device);
        let within = B::int_clamp_max(self.last.clone(), (s as i64).into());
        let row = B::int_add(self.first.clone(), within);
        // An empty segment has no row of its own to show.
        let row = B::int_clamp(row, 0.into(), (self.rows as i64 - 1).into());
        let there =
            B::int_greater_equal_elem(self.last.clone(), (s as i64).into(), settings.bool_dtype);
        let there = B::bool_into_float(there, settings.float_dtype);
        let entries = there.shape()[0];
        (row, B::float_reshape(there, [entries, 1].into()))
    }
}

/// Rows of `table` by index.
pub(crate) fn take<B: Backend>(table: &FloatTensor<B>, rows: &IntTensor<B>) -> FloatTensor<B> {
    B::float_select(table.clone(), 0, rows.clone())
}
