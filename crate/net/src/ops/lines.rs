//! Weighted sums of runs of numbers: what a convolution is to the pixels of a line.

use super::register::{Register, on_best_register};

/// `out[m][i] = start[m] + sum over t of weights[t][m] * from[offsets[t] + i]`, and at least `least`.
pub(super) struct Lines<'a> {
    pub from: &'a [f32],
    /// Where each term begins, `[T]`.
    pub offsets: &'a [usize],
    /// `[T, M]`.
    pub weights: &'a [f32],
    /// `[M]`.
    pub start: &'a [f32],
    pub least: f32,
    /// `[M]`, all of one length.
    pub out: Vec<&'a mut [f32]>,
}

on_best_register!(pub(super) fn add_up(Lines));

impl Lines<'_> {
    /// # Safety
    /// The processor has the register's instructions.
    #[inline(always)]
    unsafe fn run<W: Register>(mut self) {
        let length = self.out.first().map_or(0, |out| out.len());
        let most = self.offsets.iter().max().copied().unwrap_or(0);
        assert!(most + length <= self.from.len());
        assert!(self.out.iter().all(|out| out.len() == length));
        assert!(self.weights.len() == self.offsets.len() * self.out.len());
        assert!(self.start.len() == self.out.len());
        let mut at = 0;
        // SAFETY: the caller's; registers end before the lines do.
        unsafe {
            while length - at >= W::LANES {
                at += match ((length - at) / W::LANES).min(W::MOST) {
                    1 => self.columns::<W, 1>(at),
                    2 => self.columns::<W, 2>(at),
                    _ => self.columns::<W, 3>(at),
                };
            }
            while length - at >= W::Half::LANES {
                at += self.columns::<W::Half, 1>(at);
            }
        }
        for at in at..length {
            self.column(at);
        }
    }

    /// `V` registers of all lines from `at` on; says how many numbers that is.
    ///
    /// # Safety
    /// The processor has the register's instructions, and the numbers are there.
    #[inline(always)]
    unsafe fn columns<W: Register, const V: usize>(&mut self, at: usize) -> usize {
        let lines = self.out.len();
        let mut done = 0;
        while done < lines {
            // SAFETY: the caller's; a tile's lines are there.
            done += unsafe {
                match lines - done {
                    8.. => self.tile::<W, 8, V>(done, at),
                    4.. => self.tile::<W, 4, V>(done, at),
                    _ => self.tile::<W, 1, V>(done, at),
                }
            };
        }
        V * W::LANES
    }

    /// `N` lines from `line` on, of which `V` registers from `at` on; says how many lines. All sums stay in registers.
    ///
    /// # Safety
    /// The processor has the register's instructions, and the lines and numbers are there.
    #[inline(always)]
    unsafe fn tile<W: Register, const N: usize, const V: usize>(
        &mut self,
        line: usize,
        at: usize,
    ) -> usize {
        let lines = self.out.len();
        unsafe {
            let mut kept = [[W::zero(); V]; N];
            for (kept, start) in kept.iter_mut().zip(&self.start[line..]) {
                *kept = [W::splat(*start); V];
            }
            let from = self.from.as_ptr().add(at);
            let mut weights = self.weights.as_ptr().add(line);
            for offset in self.offsets {
                let mut term = [W::zero(); V];
                for (v, term) in term.iter_mut().enumerate() {
                    *term = W::load(from.add(offset + v * W::LANES));
                }
                for (n, kept) in kept.iter_mut().enumerate() {
                    let weight = *weights.add(n);
                    for (kept, term) in kept.iter_mut().zip(term) {
                        *kept = kept.plus(weight, term);
                    }
                }
                // The last step ends behind the weights.
                weights = weights.wrapping_add(lines);
            }
            let least = W::splat(self.least);
            for (kept, out) in kept.iter().zip(&mut self.out[line..]) {
                let out = out.as_mut_ptr().add(at);
                for (v, kept) in kept.iter().enumerate() {
                    // In this order what is not a number stays none.
                    least.larger(*kept).store(out.add(v * W::LANES));
                }
            }
        }
        N
    }

    /// One number of all lines.
    fn column(&mut self, at: usize) {
        let lines = self.out.len();
        for (line, out) in self.out.iter_mut().enumerate() {
            let weights = self.weights[line..].iter().step_by(lines);
            let terms = self.offsets.iter().zip(weights);
            let sum = terms.fold(self.start[line], |sum, (offset, weight)| {
                sum + weight * self.from[offset + at]
            });
            out[at] = if sum < self.least { self.least } else { sum };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::register::Plain;

    fn check(run: impl Fn(Lines<'_>)) {
        let from: Vec<f32> = (0..400).map(|i| (i * 37 % 23) as f32 - 11.0).collect();
        for (lines, length) in [(1, 100), (2, 7), (4, 33), (13, 24), (8, 61), (17, 3)] {
            let offsets: Vec<usize> = (0..9).map(|t| t * 31 % 250).collect();
            let weights: Vec<f32> = (0..9 * lines).map(|i| (i * 5 % 7) as f32 - 3.0).collect();
            let start: Vec<f32> = (0..lines).map(|m| m as f32).collect();
            let mut out = vec![f32::NAN; lines * length];
            run(Lines {
                from: &from,
                offsets: &offsets,
                weights: &weights,
                start: &start,
                least: 0.0,
                out: out.chunks_exact_mut(length).collect(),
            });
            // Whole numbers: exact in any order.
            for (place, found) in out.iter().enumerate() {
                let (m, i) = (place / length, place % length);
                let terms = offsets.iter().enumerate();
                let sum = terms.map(|(t, offset)| weights[t * lines + m] * from[offset + i]);
                let expected = (start[m] + sum.sum::<f32>()).max(0.0);
                assert_eq!(*found, expected, "{lines} lines of {length}: {m}, {i}");
            }
        }
    }

    #[test]
    fn every_register_sums_all_terms() {
        check(add_up);
        // SAFETY: any processor has it.
        check(|lines| unsafe { lines.run::<Plain>() });
    }
}
