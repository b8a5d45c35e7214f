//! Flex tensors as slices.

use std::ops::{Deref, Range};

use burn::tensor::{Bytes, DType, Shape};
use burn_flex::{FlexTensor, Layout};

/// Numbers of a tensor, row by row.
pub(crate) struct Numbers(FlexTensor);

impl Deref for Numbers {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        self.0.storage()
    }
}

/// The numbers of a 32-bit float tensor; only a tensor that is a view of another is copied.
pub(crate) fn read(tensor: FlexTensor) -> Numbers {
    Numbers(tensor.to_contiguous())
}

/// A tensor of `numbers`, row by row.
pub(crate) fn tensor(numbers: Vec<f32>, shape: Shape) -> FlexTensor {
    FlexTensor::new(
        Bytes::from_elems(numbers),
        Layout::contiguous(shape),
        DType::F32,
    )
}

/// Ranges of segments with about `rows` rows each; segment `n` has rows `offsets[n]..offsets[n + 1]`. They depend on the
/// segments alone, not on the number of threads: sums over parts come out alike everywhere.
pub(crate) fn parts(offsets: &[i32], rows: usize) -> Vec<Range<usize>> {
    let count = offsets.len().saturating_sub(1);
    let mut parts = Vec::new();
    let mut start = 0;
    for segment in 0..count {
        if (offsets[segment + 1] - offsets[start]) as usize >= rows || segment + 1 == count {
            parts.push(start..segment + 1);
            start = segment + 1;
        }
    }
    parts
}

/// The rows of each part, `width` numbers a row.
pub(crate) fn split_rows<'a>(
    mut table: &'a mut [f32],
    offsets: &[i32],
    parts: &[Range<usize>],
    width: usize,
) -> Vec<&'a mut [f32]> {
    let mut split = Vec::with_capacity(parts.len());
    for part in parts {
        let rows = (offsets[part.end] - offsets[part.start]) as usize;
        let (here, rest) = table.split_at_mut(rows * width);
        split.push(here);
        table = rest;
    }
    split
}

/// The planes of `table` `[V, C, pixels]` in pieces of `length` pixels, the last of a plane being shorter: for each view and
/// piece, in this order, the slices of all its channels.
pub(crate) fn pieces(
    table: &mut [f32],
    channels: usize,
    pixels: usize,
    length: usize,
) -> Vec<Vec<&mut [f32]>> {
    let mut all = Vec::new();
    for view in table.chunks_exact_mut(channels * pixels) {
        let first = all.len();
        all.resize_with(first + pixels.div_ceil(length), || {
            Vec::with_capacity(channels)
        });
        for plane in view.chunks_exact_mut(pixels) {
            for (piece, part) in all[first..].iter_mut().zip(plane.chunks_mut(length)) {
                piece.push(part);
            }
        }
    }
    all
}
