//! What the processor adds and multiplies at once.

/// A register of 32-bit floats.
///
/// # Safety
/// Its functions may be called only where the processor has the register's instructions; pointers as for reading and
/// writing `LANES` floats.
pub(super) trait Register: Copy {
    /// Floats in it.
    const LANES: usize;
    /// How many of them a tile may be wide, so that `ROWS` times as many sums stay in registers.
    const MOST: usize;
    unsafe fn zero() -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// `self + factor * by`, one factor for all.
    unsafe fn plus(self, factor: f32, by: Self) -> Self;
}

/// Any processor: four floats, which compilers keep in a register of 128 bits.
#[derive(Clone, Copy)]
pub(super) struct Plain([f32; 4]);

impl Register for Plain {
    const LANES: usize = 4;
    const MOST: usize = 1;

    #[inline(always)]
    unsafe fn zero() -> Self {
        Self([0.0; 4])
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
    unsafe fn plus(self, factor: f32, by: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + factor * by.0[i]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use super::Register;
    use std::arch::x86_64::*;

    macro_rules! register {
        ($name:ident, $of:ty, $lanes:literal, $most:literal, $zero:ident, $load:ident, $store:ident, $splat:ident, $fma:ident) => {
            #[derive(Clone, Copy)]
            pub(in super::super) struct $name($of);

            impl Register for $name {
                const LANES: usize = $lanes;
                const MOST: usize = $most;

                #[inline(always)]
                unsafe fn zero() -> Self {
                    Self(unsafe { $zero() })
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
                unsafe fn plus(self, factor: f32, by: Self) -> Self {
                    Self(unsafe { $fma($splat(factor), by.0, self.0) })
                }
            }
        };
    }

    // 32 registers: 24 sums. 16 registers: 8 sums.
    register!(
        Avx512,
        __m512,
        16,
        3,
        _mm512_setzero_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_set1_ps,
        _mm512_fmadd_ps
    );
    register!(
        Avx2,
        __m256,
        8,
        1,
        _mm256_setzero_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_set1_ps,
        _mm256_fmadd_ps
    );
}
