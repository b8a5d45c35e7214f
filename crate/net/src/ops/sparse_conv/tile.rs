//! The inner loops: a few rows by a few registers of columns, held in registers while a sum runs.

use crate::ops::register::Register;

/// Rows of a tile.
pub(super) const ROWS: usize = 8;

/// `sums[r] += factors[r][c] * columns[c]` over c < `depth`: `ROWS` output rows under one tap. A row of `columns` has
/// `width` floats, of which the tile takes `V` registers.
///
/// # Safety
/// `factors` have `depth` floats, `sums` `V` registers, `columns` `depth` rows; the sums overlap nothing else.
#[inline(always)]
unsafe fn rows_tile<W: Register, const V: usize>(
    factors: &[*const f32; ROWS],
    columns: *const f32,
    width: usize,
    depth: usize,
    sums: &[*mut f32; ROWS],
) {
    unsafe {
        let mut kept = [[W::zero(); V]; ROWS];
        for (kept, sums) in kept.iter_mut().zip(sums) {
            for (v, kept) in kept.iter_mut().enumerate() {
                *kept = W::load(sums.add(v * W::LANES));
            }
        }
        for c in 0..depth {
            let mut column = [W::zero(); V];
            for (v, column) in column.iter_mut().enumerate() {
                *column = W::load(columns.add(c * width + v * W::LANES));
            }
            for (kept, factors) in kept.iter_mut().zip(factors) {
                let factor = *factors.add(c);
                for (kept, column) in kept.iter_mut().zip(column) {
                    *kept = kept.plus(factor, column);
                }
            }
        }
        for (kept, sums) in kept.iter().zip(sums) {
            for (v, kept) in kept.iter().enumerate() {
                kept.store(sums.add(v * W::LANES));
            }
        }
    }
}

/// One tap's share of some output rows: `sums[row] += factors[source] · columns` for pairs of a row and a source. The number
/// of pairs is a multiple of [`ROWS`].
pub(super) struct Rows<'a> {
    /// Pairs of a row of `sums` and a row of `factors`; no row of `sums` twice within a tile, but for one that nobody reads.
    pub pairs: &'a [(u32, u32)],
    /// `[M, depth]`.
    pub factors: &'a [f32],
    /// `[depth, width]`.
    pub columns: &'a [f32],
    pub depth: usize,
    /// `[rows, width]`.
    pub sums: &'a mut [f32],
    /// A multiple of `LANES`.
    pub width: usize,
}

impl Rows<'_> {
    /// # Safety
    /// The processor has the register's instructions.
    #[inline(always)]
    pub unsafe fn run<W: Register>(self) {
        let Self {
            pairs,
            factors,
            columns,
            depth,
            sums,
            width,
        } = self;
        assert!(width.is_multiple_of(W::LANES) && pairs.len().is_multiple_of(ROWS));
        assert!(columns.len() == depth * width);
        let registers = width / W::LANES;
        for tile in pairs.chunks_exact(ROWS) {
            // Slicing checks the bounds once a row.
            let factors: [*const f32; ROWS] = std::array::from_fn(|r| {
                let source = tile[r].1 as usize;
                factors[source * depth..(source + 1) * depth].as_ptr()
            });
            let rows: [*mut f32; ROWS] = std::array::from_fn(|r| {
                let row = tile[r].0 as usize;
                sums[row * width..(row + 1) * width].as_mut_ptr()
            });
            let mut start = 0;
            while start < registers {
                let wide = (registers - start).min(W::MOST);
                // SAFETY: bounds as sliced; `wide` registers from `start` lie within a row of `width`.
                unsafe {
                    let columns = columns.as_ptr().add(start * W::LANES);
                    let sums = rows.map(|row| row.add(start * W::LANES));
                    match wide {
                        1 => rows_tile::<W, 1>(&factors, columns, width, depth, &sums),
                        2 => rows_tile::<W, 2>(&factors, columns, width, depth, &sums),
                        _ => rows_tile::<W, 3>(&factors, columns, width, depth, &sums),
                    }
                }
                start += wide;
            }
        }
    }
}

/// `sums[r] += left[pair][r] * right[pair]` over pairs: `R` rows of a tap's weight gradient.
///
/// # Safety
/// `left` and `right` point into rows that all pairs have: `R` floats and `V` registers each; `sums` has `R` rows of `width`.
#[inline(always)]
unsafe fn products_tile<W: Register, const R: usize, const V: usize>(
    pairs: &[(u32, u32)],
    (left, left_width): (*const f32, usize),
    (right, width): (*const f32, usize),
    sums: *mut f32,
) {
    unsafe {
        let mut kept = [[W::zero(); V]; R];
        for (row, source) in pairs {
            let right = right.add(*row as usize * width);
            let left = left.add(*source as usize * left_width);
            let mut column = [W::zero(); V];
            for (v, column) in column.iter_mut().enumerate() {
                *column = W::load(right.add(v * W::LANES));
            }
            for (r, kept) in kept.iter_mut().enumerate() {
                let factor = *left.add(r);
                for (kept, column) in kept.iter_mut().zip(column) {
                    *kept = kept.plus(factor, column);
                }
            }
        }
        for (r, kept) in kept.iter().enumerate() {
            for (v, kept) in kept.iter().enumerate() {
                let sums = sums.add(r * width + v * W::LANES);
                W::load(sums).plus(1.0, *kept).store(sums);
            }
        }
    }
}

/// One tap's share of the weight gradient: `sums[c] += left[source][c] * right[row]` over pairs of a row and a source.
pub(super) struct Products<'a> {
    /// Pairs of a row of `right` and a row of `left`.
    pub pairs: &'a [(u32, u32)],
    /// `[M, depth]`.
    pub left: &'a [f32],
    pub depth: usize,
    /// `[rows, width]`.
    pub right: &'a [f32],
    /// A multiple of `LANES`.
    pub width: usize,
    /// `[depth, width]`.
    pub sums: &'a mut [f32],
}

impl Products<'_> {
    /// # Safety
    /// The processor has the register's instructions.
    #[inline(always)]
    pub unsafe fn run<W: Register>(self) {
        let Self {
            pairs,
            left,
            depth,
            right,
            width,
            sums,
        } = self;
        assert!(width.is_multiple_of(W::LANES) && sums.len() == depth * width);
        let (rows, sources) = (right.len() / width, left.len() / depth);
        let within =
            |(row, source): &(u32, u32)| (*row as usize) < rows && (*source as usize) < sources;
        assert!(pairs.iter().all(within));
        let registers = width / W::LANES;
        let mut c = 0;
        while c < depth {
            let tall = match depth - c {
                8.. => 8,
                4.. => 4,
                2.. => 2,
                _ => 1,
            };
            let mut start = 0;
            while start < registers {
                let wide = (registers - start).min(W::MOST);
                // SAFETY: pairs name rows that are there; `tall` and `wide` stay within them.
                unsafe {
                    let left = (left.as_ptr().add(c), depth);
                    let right = (right.as_ptr().add(start * W::LANES), width);
                    let sums = sums.as_mut_ptr().add(c * width + start * W::LANES);
                    match (tall, wide) {
                        (8, 1) => products_tile::<W, 8, 1>(pairs, left, right, sums),
                        (8, 2) => products_tile::<W, 8, 2>(pairs, left, right, sums),
                        (8, _) => products_tile::<W, 8, 3>(pairs, left, right, sums),
                        (4, 1) => products_tile::<W, 4, 1>(pairs, left, right, sums),
                        (4, 2) => products_tile::<W, 4, 2>(pairs, left, right, sums),
                        (4, _) => products_tile::<W, 4, 3>(pairs, left, right, sums),
                        (2, 1) => products_tile::<W, 2, 1>(pairs, left, right, sums),
                        (2, 2) => products_tile::<W, 2, 2>(pairs, left, right, sums),
                        (2, _) => products_tile::<W, 2, 3>(pairs, left, right, sums),
                        (_, 1) => products_tile::<W, 1, 1>(pairs, left, right, sums),
                        (_, 2) => products_tile::<W, 1, 2>(pairs, left, right, sums),
                        (_, _) => products_tile::<W, 1, 3>(pairs, left, right, sums),
                    }
                }
                start += wide;
            }
            c += tall;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::register::Plain;
    #[cfg(target_arch = "x86_64")]
    use crate::ops::register::x86;

    /// Both kinds of work by one register against sums one by one, which are exact: all numbers are small and whole.
    fn check<W: Register>() {
        let whole = |count: usize, by: usize| -> Vec<f32> {
            (0..count).map(|i| (i * by % 7) as f32 - 3.0).collect()
        };
        for (depth, width) in [(1, 16), (8, 32), (7, 48), (30, 112)] {
            let pairs: Vec<(u32, u32)> = (0..24).map(|i| (i, i * 5 % 11)).collect();
            let left = whole(11 * depth, 3);
            let columns = whole(depth * width, 5);
            let mut sums = whole(24 * width, 2);
            let mut expected = sums.clone();
            for (row, source) in &pairs {
                let (row, source) = (*row as usize, *source as usize);
                for c in 0..depth {
                    for o in 0..width {
                        expected[row * width + o] +=
                            left[source * depth + c] * columns[c * width + o];
                    }
                }
            }
            let work = Rows {
                pairs: &pairs,
                factors: &left,
                columns: &columns,
                depth,
                sums: &mut sums,
                width,
            };
            // SAFETY: the callers asked the processor.
            unsafe { work.run::<W>() };
            assert_eq!(sums, expected);

            let right = whole(24 * width, 3);
            let mut sums = columns.clone();
            let mut expected = columns;
            for (row, source) in &pairs {
                let (row, source) = (*row as usize, *source as usize);
                for c in 0..depth {
                    for o in 0..width {
                        expected[c * width + o] +=
                            left[source * depth + c] * right[row * width + o];
                    }
                }
            }
            let work = Products {
                pairs: &pairs,
                left: &left,
                depth,
                right: &right,
                width,
                sums: &mut sums,
            };
            // SAFETY: as above.
            unsafe { work.run::<W>() };
            assert_eq!(sums, expected);
        }
    }

    #[test]
    fn every_register_gives_the_same() {
        check::<Plain>();
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2")
                && std::arch::is_x86_feature_detected!("fma")
            {
                check::<x86::Avx2>();
            } else {
                println!("skipped: no AVX2 on this processor");
            }
            if std::arch::is_x86_feature_detected!("avx512f") {
                check::<x86::Avx512>();
            } else {
                println!("skipped: no AVX-512 on this processor");
            }
        }
    }
}
