//! A source view at the hypotheses of a row of pixels.

use crate::{
    lanes::{less, more, whole},
    view::{View, Warp},
    window::in_steps,
};

/// What a source sees is at least so far before it, as a multiple of the reference's depth.
const LEAST_Z: f32 = 1e-6;
/// An inverse depth cannot be less, in 1/m.
pub(crate) const LEAST_RHO: f32 = 1e-3;

/// A source's grey values in steps, and a row and a pixel of zeros: each has a right and a lower neighbour, however small the picture.
pub(crate) struct Picture {
    steps: Vec<f32>,
    size: (usize, usize),
}

impl Picture {
    /// With so many steps to a grey level.
    pub(crate) fn new(source: &View, steps: f32) -> Self {
        let size = source.size();
        let mut steps = in_steps(&source.gray, steps);
        steps.resize(size.0 * (size.1 + 1) + 1, 0.0);
        Self { steps, size }
    }

    /// Samples one row of a source at the hypotheses of a plane; `seen` is 1 where the sample lies in the source, else 0 and the
    /// nearest pixel of its border stands in.
    #[inline(always)]
    pub(crate) fn sample_row(
        &self,
        warp: &Warp,
        y: usize,
        base: Option<&[f32]>,
        offset: f32,
        out: &mut [i32],
        seen: &mut [f32],
    ) {
        let width = out.len();
        let (columns, rows) = self.size;
        // A hair inside: the neighbours are of the picture too, where it has any.
        let last = |pixels: usize| more(pixels as f32 - 1.001, 0.0);
        let (last_u, last_v) = (last(columns), last(rows));
        let Warp { a, b } = warp;
        let y = y as f32;
        let start = [a[1] * y + a[2], a[4] * y + a[5], a[7] * y + a[8]];
        let gray = &self.steps[..columns * (rows + 1) + 1];
        let (mut at, mut fu, mut fv) = ([0u32; 64], [0.0f32; 64], [0.0f32; 64]);
        for from in (0..width).step_by(64) {
            let n = (width - from).min(64);
            // Always all 64, and no index that could be out of bounds: that is what makes this loop one of vectors.
            let mut rhos = [offset; 64];
            if let Some(base) = base {
                for (rho, base) in rhos.iter_mut().zip(&base[from..from + n]) {
                    *rho = more(base + offset, LEAST_RHO);
                }
            }
            let mut inside = [0.0f32; 64];
            for i in 0..64 {
                let (x, rho) = ((from as i32 + i as i32) as f32, rhos[i]);
                let z = a[6] * x + start[2] + b[2] * rho;
                let (u, v) = (
                    a[0] * x + start[0] + b[0] * rho,
                    a[3] * x + start[1] + b[1] * rho,
                );
                // 0 <= u / z <= last with z > 0, without the division.
                let room = less(less(u, last_u * z - u), less(v, last_v * z - v));
                inside[i] = if less(z - LEAST_Z, room) >= 0.0 {
                    1.0
                } else {
                    0.0
                };
                let inv = 1.0 / more(z, LEAST_Z);
                let (u, v) = (u * inv, v * inv);
                let (cu, cv) = (less(more(u, 0.0), last_u), less(more(v, 0.0), last_v));
                // SAFETY: clamped to the picture just now, NaN included (`more` gives 0).
                let (iu, iv): (i32, i32) =
                    unsafe { (cu.to_int_unchecked(), cv.to_int_unchecked()) };
                fu[i] = cu - iu as f32;
                fv[i] = cv - iv as f32;
                at[i] = (iv * columns as i32 + iu) as u32;
            }
            seen[from..from + n].copy_from_slice(&inside[..n]);
            // Pairs of neighbours are fetched one by one, and weighed many at a time.
            let (mut upper, mut lower) = ([[0.0f32; 2]; 64], [[0.0f32; 2]; 64]);
            for ((upper, lower), &at) in upper.iter_mut().zip(&mut lower).zip(&at) {
                // SAFETY: `at` is in the picture, and its neighbours are there: see `Picture`.
                unsafe {
                    let here = gray.as_ptr().add(at as usize);
                    *upper = here.cast::<[f32; 2]>().read();
                    *lower = here.add(columns).cast::<[f32; 2]>().read();
                }
            }
            let mut samples = [0i32; 64];
            for i in 0..64 {
                let ([p, q], [r, s]) = (upper[i], lower[i]);
                let top = p + (q - p) * fu[i];
                let bottom = r + (s - r) * fu[i];
                samples[i] = whole(top + (bottom - top) * fv[i]);
            }
            out[from..from + n].copy_from_slice(&samples[..n]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Picture;
    use crate::view::{View, Warp};
    use glam::DAffine3;
    use scan::Camera;

    #[test]
    fn around_the_smallest_pictures_their_border_stands_in() {
        for (width, height) in [(1, 1), (1, 3), (3, 1), (2, 2), (70, 2)] {
            let camera = Camera {
                width,
                height,
                fx: 50.0,
                fy: 50.0,
                cx: 0.0,
                cy: 0.0,
            };
            let view = View {
                camera,
                pose: DAffine3::IDENTITY,
                gray: vec![200.0; (width * height) as usize],
            };
            let picture = Picture::new(&view, 64.0);
            for (x_px, y_px) in [(0.0, 0.0), (-3.5, -2.25), (2.5, 0.75), (f32::NAN, 1e30)] {
                let warp = Warp {
                    a: [1.0, 0.0, x_px, 0.0, 1.0, y_px, 0.0, 0.0, 1.0],
                    b: [0.0; 3],
                };
                let (mut samples, mut seen) = ([0; 80], [0.0; 80]);
                picture.sample_row(&warp, 1, None, 0.5, &mut samples, &mut seen);
                assert_eq!(samples, [(200 - 128) * 64; 80], "{width}x{height}");
            }
        }
    }
}
