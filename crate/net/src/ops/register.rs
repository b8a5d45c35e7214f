//! What the processor adds and multiplies at once.

/// A register of 32-bit floats.
///
/// # Safety
/// Its functions may be called only where the processor has the register's instructions; pointers as for reading and
/// writing `LANES` floats.
pub(crate) trait Register: Copy {
    /// Floats in it.
    const LANES: usize;
    /// How many of them a tile of eight rows may be wide, so that all sums stay in registers.
    const MOST: usize;
    /// A register of half as many lanes for what would leave more than half of this one empty, or this one.
    type Half: Register;
    unsafe fn zero() -> Self;
    /// One number in all lanes.
    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn add(self, by: Self) -> Self;
    unsafe fn sub(self, by: Self) -> Self;
    /// `self * by + plus`.
    unsafe fn mul_add(self, by: Self, plus: Self) -> Self;
    /// `self` where it is larger, `than` elsewhere: where one of them is not a number too.
    unsafe fn larger(self, than: Self) -> Self;
    /// `self * 2^n`, `n` being the lowest bits of `exponent`.
    unsafe fn raised(self, exponent: Self) -> Self;

    /// `self + factor * by`, one factor for all.
    #[inline(always)]
    unsafe fn plus(self, factor: f32, by: Self) -> Self {
        unsafe { Self::splat(factor).mul_add(by, self) }
    }

    /// `2^self` for 128 > self; below -126 the value there. Not a number stays none.
    #[inline(always)]
    unsafe fn exp2(self) -> Self {
        // Adding this rounds to whole numbers and leaves them in the low bits.
        const ROUND: f32 = 12_582_912.0;
        // (2^f - 1) / f for |f| <= 1/2, so that the power's relative error is the least; 2^0 is 1.
        const POWERS: [f32; 6] = [
            1.535_336_2e-4,
            1.339_887_5e-3,
            9.618_437e-3,
            5.550_332_4e-2,
            2.402_264_8e-1,
            std::f32::consts::LN_2,
        ];
        unsafe {
            let x = Self::splat(-126.0).larger(self);
            let shifted = x.add(Self::splat(ROUND));
            let rest = x.sub(shifted.sub(Self::splat(ROUND)));
            let mut sum = Self::splat(POWERS[0]);
            for power in &POWERS[1..] {
                sum = sum.mul_add(rest, Self::splat(*power));
            }
            sum.mul_add(rest, Self::splat(1.0)).raised(shifted)
        }
    }
}

/// Any processor: four floats, which compilers keep in a register of 128 bits.
#[derive(Clone, Copy)]
pub(crate) struct Plain([f32; 4]);

impl Plain {
    #[inline(always)]
    fn with(self, by: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], by.0[i])))
    }
}

impl Register for Plain {
    const LANES: usize = 4;
    const MOST: usize = 1;
    type Half = Self;

    #[inline(always)]
    unsafe fn zero() -> Self {
        Self([0.0; 4])
    }

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        Self(unsafe { from.cast::<[f32; 4]>().read_unaligned() })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { to.cast::<[f32; 4]>().write_unaligned(self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, by: Self) -> Self {
        self.with(by, |a, b| a + b)
    }

    #[inline(always)]
    unsafe fn sub(self, by: Self) -> Self {
        self.with(by, |a, b| a - b)
    }

    #[inline(always)]
    unsafe fn mul_add(self, by: Self, plus: Self) -> Self {
        // In two steps: not every processor has the fused one, and without it that is slow.
        self.with(by, |a, b| a * b).with(plus, |a, b| a + b)
    }

    #[inline(always)]
    unsafe fn larger(self, than: Self) -> Self {
        self.with(than, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    unsafe fn raised(self, exponent: Self) -> Self {
        self.with(exponent, |a, n| {
            f32::from_bits(a.to_bits().wrapping_add(n.to_bits() << 23))
        })
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86 {
    use super::Register;
    use std::arch::x86_64::*;

    macro_rules! register {
        ($name:ident($of:ty), $lanes:literal, $most:literal, $half:ty, $zero:ident, $splat:ident, $load:ident, $store:ident,
         $add:ident, $sub:ident, $fma:ident, $max:ident,
         $bits:ident, $floats:ident, $shift:ident, $whole_add:ident) => {
            #[derive(Clone, Copy)]
            pub(crate) struct $name($of);

            impl Register for $name {
                const LANES: usize = $lanes;
                const MOST: usize = $most;
                type Half = $half;

                #[inline(always)]
                unsafe fn zero() -> Self {
                    Self(unsafe { $zero() })
                }

                #[inline(always)]
                unsafe fn splat(value: f32) -> Self {
                    Self(unsafe { $splat(value) })
                }

                #[inline(always)]
                unsafe fn load(from: *const f32) -> Self {
                    Self(unsafe { $load(from) })
                }

                #[inline(always)]
                unsafe fn store(self, to: *mut f32) {
                    unsafe { $store(to, self.0) }
                }

                #[inline(always)]
                unsafe fn add(self, by: Self) -> Self {
                    Self(unsafe { $add(self.0, by.0) })
                }

                #[inline(always)]
                unsafe fn sub(self, by: Self) -> Self {
                    Self(unsafe { $sub(self.0, by.0) })
                }

                #[inline(always)]
                unsafe fn mul_add(self, by: Self, plus: Self) -> Self {
                    Self(unsafe { $fma(self.0, by.0, plus.0) })
                }

                #[inline(always)]
                unsafe fn larger(self, than: Self) -> Self {
                    Self(unsafe { $max(self.0, than.0) })
                }

                #[inline(always)]
                unsafe fn raised(self, exponent: Self) -> Self {
                    Self(unsafe {
                        let by = $shift::<23>($bits(exponent.0));
                        $floats($whole_add($bits(self.0), by))
                    })
                }
            }
        };
    }

    // 32 registers: 24 sums. 16 registers: 8 sums.
    register!(
        Avx512(__m512),
        16,
        3,
        Avx2,
        _mm512_setzero_ps,
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_fmadd_ps,
        _mm512_max_ps,
        _mm512_castps_si512,
        _mm512_castsi512_ps,
        _mm512_slli_epi32,
        _mm512_add_epi32
    );
    register!(
        Avx2(__m256),
        8,
        1,
        Self,
        _mm256_setzero_ps,
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_fmadd_ps,
        _mm256_max_ps,
        _mm256_castps_si256,
        _mm256_castsi256_ps,
        _mm256_slli_epi32,
        _mm256_add_epi32
    );
}

/// Declares a function that runs work in the widest registers that the processor has. `Work::run::<W>` is unsafe, generic
/// over a [`Register`], and inlined.
macro_rules! on_best_register {
    ($(#[$doc:meta])* $visible:vis fn $name:ident($of:ident)) => {
        $(#[$doc])*
        $visible fn $name(work: $of) {
            #[cfg(target_arch = "x86_64")]
            {
                use $crate::ops::register::x86::{Avx2, Avx512};

                #[target_feature(enable = "avx512f")]
                fn avx512(work: $of) {
                    // SAFETY: the caller asked for it.
                    unsafe { work.run::<Avx512>() }
                }

                #[target_feature(enable = "avx2,fma")]
                fn avx2(work: $of) {
                    // SAFETY: the caller asked for it.
                    unsafe { work.run::<Avx2>() }
                }

                if std::arch::is_x86_feature_detected!("avx512f") {
                    // SAFETY: the processor was asked just now.
                    return unsafe { avx512(work) };
                }
                if std::arch::is_x86_feature_detected!("avx2")
                    && std::arch::is_x86_feature_detected!("fma")
                {
                    // SAFETY: the processor was asked just now.
                    return unsafe { avx2(work) };
                }
            }
            // SAFETY: it needs no instructions of its own.
            unsafe { work.run::<$crate::ops::register::Plain>() }
        }
    };
}
pub(crate) use on_best_register;

#[cfg(test)]
mod tests {
    use super::*;

    #[inline(always)]
    unsafe fn powers<W: Register>(xs: &[f32]) -> Vec<f32> {
        let mut found = vec![0.0; xs.len()];
        for (x, found) in xs
            .chunks_exact(W::LANES)
            .zip(found.chunks_exact_mut(W::LANES))
        {
            unsafe { W::load(x.as_ptr()).exp2().store(found.as_mut_ptr()) };
        }
        found
    }

    fn check(powers: impl Fn(&[f32]) -> Vec<f32>) {
        let xs: Vec<f32> = (0..1 << 16).map(|i| -126.0 + i as f32 * 0.0035).collect();
        for (x, found) in xs.iter().zip(powers(&xs)) {
            let expected = f64::from(*x).exp2();
            let off = (f64::from(found) - expected).abs() / expected;
            assert!(off < 2.0 * f64::from(f32::EPSILON), "2^{x}: {found}");
        }
        let mut edges = [0.0; 16];
        edges[..3].copy_from_slice(&[f32::NAN, f32::NEG_INFINITY, 1.0]);
        let found = powers(&edges);
        assert!(found[0].is_nan() && found[1] < 2e-38);
        assert_eq!(found[2..], [[2.0].as_slice(), &[1.0; 13]].concat());
    }

    #[test]
    fn powers_of_two_in_every_register() {
        // SAFETY: any processor has it.
        check(|xs| unsafe { powers::<Plain>(xs) });
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx512f")]
            fn wide(xs: &[f32]) -> Vec<f32> {
                unsafe { powers::<x86::Avx512>(xs) }
            }
            #[target_feature(enable = "avx2,fma")]
            fn narrow(xs: &[f32]) -> Vec<f32> {
                unsafe { powers::<x86::Avx2>(xs) }
            }
            if std::arch::is_x86_feature_detected!("avx2")
                && std::arch::is_x86_feature_detected!("fma")
            {
                // SAFETY: the processor was asked just now.
                check(|xs| unsafe { narrow(xs) });
            } else {
                println!("skipped: no AVX2 on this processor");
            }
            if std::arch::is_x86_feature_detected!("avx512f") {
                // SAFETY: the processor was asked just now.
                check(|xs| unsafe { wide(xs) });
            } else {
                println!("skipped: no AVX-512 on this processor");
            }
        }
    }
}
