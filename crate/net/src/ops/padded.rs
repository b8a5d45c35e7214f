//! Planes laid out for convolution: padded, and dealt out by the stride.

use super::wide::wide;

/// How a plane is laid out for the loops: padded with zeros, and its rows and columns dealt out by their number modulo the
/// stride, into `stride^2` parts of `rows * columns`. A kernel tap then is a constant offset, and all pixels of the output
/// are one run over the part's row length.
pub(super) struct Layout {
    height: usize,
    width: usize,
    kernel: usize,
    stride: usize,
    rows: usize,
    pub columns: usize,
}

impl Layout {
    pub fn new(height: usize, width: usize, kernel: usize, stride: usize) -> Self {
        let padded = |side: usize| (side + kernel - 1).div_ceil(stride);
        Self {
            height,
            width,
            kernel,
            stride,
            rows: padded(height),
            columns: padded(width),
        }
    }

    pub fn part(&self) -> usize {
        self.rows * self.columns
    }

    /// Numbers of all parts; the last tap's run may end behind the last part.
    pub fn len(&self) -> usize {
        self.stride * self.stride * self.part() + self.reach()
    }

    pub fn out(&self) -> [usize; 2] {
        [self.height, self.width].map(|side| side.div_ceil(self.stride))
    }

    /// Length of the run that holds all output pixels.
    pub fn run(&self) -> usize {
        self.out()[0] * self.columns
    }

    /// The largest offset of a tap within its part.
    pub fn reach(&self) -> usize {
        (self.kernel - 1) / self.stride * (self.columns + 1)
    }

    /// Numbers of the plane.
    pub fn pixels(&self) -> usize {
        self.height * self.width
    }

    /// Taps of the kernel.
    pub fn taps(&self) -> usize {
        self.kernel * self.kernel
    }

    /// Where the numbers that a tap reads begin.
    pub fn offset(&self, tap: usize) -> usize {
        let (part, offset) = self.tap(tap);
        part * self.part() + offset
    }

    /// The part that a tap reads, and its offset in there.
    pub fn tap(&self, tap: usize) -> (usize, usize) {
        let (y, x, s) = (tap / self.kernel, tap % self.kernel, self.stride);
        (y % s * s + x % s, y / s * self.columns + x / s)
    }

    /// Where row `y` of the plane lies: for columns modulo the stride, the first column's place and the plane's first column.
    fn row(&self, y: usize) -> impl Iterator<Item = (usize, usize)> {
        let (s, pad) = (self.stride, self.kernel / 2);
        let padded = y + pad;
        let first_row = padded % s * s;
        let (part, columns) = (self.part(), self.columns);
        (0..s).map(move |x| {
            let phase = (x + pad) % s;
            let start = (first_row + phase) * part + padded / s * columns + (x + pad) / s;
            (start, x)
        })
    }

    /// The plane into the parts; what lies between is zero already.
    pub fn deal(&self, plane: &[f32], parts: &mut [f32]) {
        for (y, row) in plane.chunks_exact(self.width).enumerate() {
            for (start, first) in self.row(y) {
                let from = &row[first.min(row.len())..];
                let to = &mut parts[start..];
                match self.stride {
                    1 => to[..from.len()].copy_from_slice(from),
                    2 => every_second(from, to),
                    stride => {
                        let from = from.iter().step_by(stride);
                        to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
                    }
                }
            }
        }
    }

    /// The parts back into the plane.
    pub fn collect(&self, parts: &[f32], plane: &mut [f32]) {
        for (y, row) in plane.chunks_exact_mut(self.width).enumerate() {
            for (start, first) in self.row(y) {
                let length = row.len();
                let to = row[first.min(length)..].iter_mut().step_by(self.stride);
                for (to, from) in to.zip(&parts[start..]) {
                    *to = *from;
                }
            }
        }
    }

    /// An output plane into a run, after `before` zeros.
    pub fn spread(&self, plane: &[f32], before: usize, run: &mut [f32]) {
        let rows = run[before..].chunks_mut(self.columns);
        for (to, from) in rows.zip(plane.chunks_exact(self.out()[1])) {
            to[..from.len()].copy_from_slice(from);
        }
    }
}

wide! {
    /// The first of each two numbers.
    fn every_second(from: &[f32], to: &mut [f32]) {
        let (pairs, last) = from.as_chunks::<2>();
        let (whole, rest) = to.split_at_mut(pairs.len());
        for (to, [first, _]) in whole.iter_mut().zip(pairs) {
            *to = *first;
        }
        if let [last] = last {
            rest[0] = *last;
        }
    }
}
