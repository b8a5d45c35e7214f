//! The way forward: each lane of a register is a query of its own, so that nothing is ever added up across lanes. The scores
//! of a register's queries are held, never those of all.

use std::f32::consts::{LN_2, LOG2_E};

use super::super::functions::ln;
use super::super::register::{Register, on_best_register};
use super::flex::{Scratch, Table};

/// Attention in the segments between `offsets`: row by row the result, and the logarithm of each head's sum of exponentials.
/// All begin with the first segment.
pub(super) struct Segments<'a> {
    pub table: Table<'a>,
    pub offsets: &'a [i32],
    pub scratch: &'a mut Scratch,
    pub out: &'a mut [f32],
    pub log_sum: &'a mut [f32],
}

on_best_register!(pub(super) fn run(Segments));

impl Segments<'_> {
    /// # Safety
    /// The processor has the register's instructions.
    #[inline(always)]
    unsafe fn run<W: Register>(self) {
        let Some(start) = self.offsets.first() else {
            return;
        };
        for bounds in self.offsets.windows(2) {
            let [first, end] = [bounds[0], bounds[1]].map(|row| (row - start) as usize);
            // A voxel that no view sees.
            if first == end {
                continue;
            }
            let (table, rows) = (self.table.starting_at(first), end - first);
            let [out, log_sum] = [&mut *self.out, &mut *self.log_sum];
            let out = &mut out[first * table.channels..end * table.channels];
            let log_sum = &mut log_sum[first * table.heads..end * table.heads];
            for head in 0..table.heads {
                let mut of_head = OfHead {
                    parts: table.parts.map(|part| &part[head * table.width()..]),
                    table,
                    rows,
                    head,
                    scratch: self.scratch,
                    out,
                    log_sum,
                };
                let mut query = 0;
                while query < rows {
                    // SAFETY: the caller's; half of a register asks for no more than the whole.
                    query += unsafe {
                        if rows - query <= W::Half::LANES {
                            of_head.queries::<W::Half>(query)
                        } else {
                            of_head.queries::<W>(query)
                        }
                    };
                }
            }
        }
    }
}

/// One head of one segment.
struct OfHead<'a> {
    table: Table<'a>,
    /// The head's channels of queries, keys and values, from the segment's first row on.
    parts: [&'a [f32]; 3],
    rows: usize,
    head: usize,
    scratch: &'a mut Scratch,
    /// The segment's.
    out: &'a mut [f32],
    /// The segment's.
    log_sum: &'a mut [f32],
}

impl OfHead<'_> {
    /// As many queries from `first` on as the register has lanes; says how many.
    ///
    /// # Safety
    /// The processor has the register's instructions.
    #[inline(always)]
    unsafe fn queries<W: Register>(&mut self, first: usize) -> usize {
        let (width, stride, rows) = (self.table.width(), self.table.stride, self.rows);
        let count = W::LANES.min(rows - first);
        let [query, key, value] = self.parts;
        let Scratch {
            keys: queries,
            values: mixed,
            scores,
            ..
        } = &mut *self.scratch;
        // Scores are powers of two, so that their exponential is one.
        let scale = LOG2_E / (width as f32).sqrt();
        queries.clear();
        queries.resize(width * W::LANES, 0.0);
        for lane in 0..count {
            let query = &query[(first + lane) * stride..][..width];
            for (packed, value) in queries.chunks_exact_mut(W::LANES).zip(query) {
                packed[lane] = scale * value;
            }
        }
        scores.resize(rows * W::LANES, 0.0);
        mixed.resize(width * W::LANES, 0.0);
        let mut sums = [[0.0; 16]; 2];
        // SAFETY: the caller's.
        unsafe {
            products::<W>(Factors(key, stride, 1), queries, scores);
            let [most, sum] = weigh::<W>(scores);
            most.store(sums[0].as_mut_ptr());
            sum.store(sums[1].as_mut_ptr());
            products::<W>(Factors(value, 1, stride), scores, mixed);
        }
        let [most, sum] = sums;
        let (heads, channels) = (self.table.heads, self.table.channels);
        let outs = self.out[first * channels..].chunks_exact_mut(channels);
        for (lane, out) in outs.take(count).enumerate() {
            let share = 1.0 / sum[lane];
            let out = &mut out[self.head * width..][..width];
            for (out, mixed) in out.iter_mut().zip(mixed.chunks_exact(W::LANES)) {
                *out = share * mixed[lane];
            }
            self.log_sum[(first + lane) * heads + self.head] = LN_2 * most[lane] + ln(sum[lane]);
        }
        count
    }
}

/// A matrix in a slice, and how far the next row and the next column are.
#[derive(Clone, Copy)]
struct Factors<'a>(&'a [f32], usize, usize);

/// `sums[i] = sum over d of factors[i][d] * terms[d]`; `terms` and `sums` are rows of one register.
///
/// # Safety
/// The processor has the register's instructions.
#[inline(always)]
unsafe fn products<W: Register>(factors: Factors<'_>, terms: &[f32], sums: &mut [f32]) {
    let Factors(factors, row, column) = factors;
    let [depth, count] = [terms.len(), sums.len()].map(|length| length / W::LANES);
    assert!(depth > 0 && count > 0 && (count - 1) * row + (depth - 1) * column < factors.len());
    let mut done = 0;
    while done < count {
        // SAFETY: the last factor was asked for just now, and a tile's rows are there.
        unsafe {
            let factors = factors.as_ptr().add(done * row);
            let sums = sums.as_mut_ptr().add(done * W::LANES);
            let terms = (terms.as_ptr(), depth);
            done += match count - done {
                8.. => tile::<W, 8>((factors, row, column), terms, sums),
                4.. => tile::<W, 4>((factors, row, column), terms, sums),
                _ => tile::<W, 1>((factors, row, column), terms, sums),
            };
        }
    }
}

/// `N` rows of [`products`], which stay in registers; says how many.
///
/// # Safety
/// The processor has the register's instructions, and `N` rows are there.
#[inline(always)]
unsafe fn tile<W: Register, const N: usize>(
    (factors, row, column): (*const f32, usize, usize),
    (terms, depth): (*const f32, usize),
    sums: *mut f32,
) -> usize {
    unsafe {
        let mut kept = [W::zero(); N];
        for d in 0..depth {
            let term = W::load(terms.add(d * W::LANES));
            for (n, kept) in kept.iter_mut().enumerate() {
                *kept = kept.plus(*factors.add(n * row + d * column), term);
            }
        }
        for (n, kept) in kept.iter().enumerate() {
            kept.store(sums.add(n * W::LANES));
        }
    }
    N
}

/// Turns scores, a register a key, into `2^(score - largest)`; gives the largest of each lane, and the sum.
///
/// # Safety
/// The processor has the register's instructions.
#[inline(always)]
unsafe fn weigh<W: Register>(scores: &mut [f32]) -> [W; 2] {
    unsafe {
        let mut most = W::splat(f32::NEG_INFINITY);
        for score in scores.chunks_exact(W::LANES) {
            most = W::load(score.as_ptr()).larger(most);
        }
        let mut sum = W::zero();
        for score in scores.chunks_exact_mut(W::LANES) {
            let weight = W::load(score.as_ptr()).sub(most).exp2();
            weight.store(score.as_mut_ptr());
            sum = sum.add(weight);
        }
        [most, sum]
    }
}
