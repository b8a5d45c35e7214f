//! Loops in the processor's wide registers.

/// Declares a function that runs with the processor's wide registers where it has them: the same numbers, faster.
macro_rules! wide {
    ($(#[$doc:meta])* $visible:vis fn $name:ident$(<const $size:ident: usize>)?($($arg:ident: $of:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$doc])*
        $visible fn $name$(<const $size: usize>)?($($arg: $of),*) $(-> $result)? {
            #[inline(always)]
            fn anywhere$(<const $size: usize>)?($($arg: $of),*) $(-> $result)? $body

            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2$(<const $size: usize>)?($($arg: $of),*) $(-> $result)? {
                    anywhere$(::<$size>)?($($arg),*)
                }

                if std::arch::is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor was asked just now.
                    return unsafe { avx2$(::<$size>)?($($arg),*) };
                }
            }
            anywhere$(::<$size>)?($($arg),*)
        }
    };
}
pub(crate) use wide;
