//! How much the kernels compute and move: for rates beside what a device could do.
//!
//! Float operations only, as written: add, multiply, compare, select, min, max, divide, root and rounding count one
//! each; integers, indices and conversions nothing. Bytes are those that must cross memory at least once; what a cache
//! serves again is not counted. With `k = 2 radius + 1`, `s` sources, half of them kept, two windows a thread:
//!
//! | kernel | for each | operations | bytes |
//! |---|---|---|---|
//! | warp | pixel, plane, source | 29 | 2 |
//! | windows | pixel, plane, source | 3.25 (k + 1) + 4 (k - 1) + 33 | 2 + 2 |
//! | best share | pixel, plane | s (2 ⌈s / 2⌉ + 2) + 3 ⌈s / 2⌉ + 8 | 2 s + 2 |
//! | paths | pixel, plane, 8 directions | 9 | 2 + 8 |
//! | winners | pixel, plane | 6 | 4 |

/// Operations and bytes of a keyframe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Float operations.
    pub flops: f64,
    /// Bytes that cross memory.
    pub bytes: f64,
}

/// The kernels of a keyframe in the order in which they run, by name.
pub fn work_by_kernel(
    width: usize,
    height: usize,
    planes: usize,
    sources: usize,
    radius: usize,
) -> [(&'static str, Work); 5] {
    let cells = (width * height * planes) as f64;
    let side = (2 * radius + 1) as f64;
    let s = sources as f64;
    let kept = (s * 0.5).ceil();
    let of = |count: f64, flops: f64, bytes: f64| Work {
        flops: count * flops,
        bytes: count * bytes,
    };
    let correlate = 3.25 * (side + 1.0) + 4.0 * (side - 1.0) + 33.0;
    let select = s * (2.0 * kept + 2.0) + 3.0 * kept + 8.0;
    [
        ("warp", of(cells * s, 29.0, 2.0)),
        ("windows", of(cells * s, correlate, 4.0)),
        ("best share", of(cells, select, 2.0 * s + 2.0)),
        ("paths", of(cells * 8.0, 9.0, 10.0)),
        ("winners", of(cells, 6.0, 4.0)),
    ]
}

/// The work of one keyframe: `width` x `height` pixels, `planes` hypotheses, `sources` source views, windows of
/// `2 radius + 1` pixels a side.
pub fn work(width: usize, height: usize, planes: usize, sources: usize, radius: usize) -> Work {
    let kernels = work_by_kernel(width, height, planes, sources, radius);
    kernels.iter().fold(Work::default(), |sum, (_, w)| Work {
        flops: sum.flops + w.flops,
        bytes: sum.bytes + w.bytes,
    })
}
