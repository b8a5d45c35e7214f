//! One keyframe's picture at the working size, and the way from one view's pixels to another's.

use glam::{DAffine3, DMat3, DVec3};
use scan::{Camera, ColorImage};

/// Noise is looked for in windows of this radius, a few pixels apart, in the blankest of so many.
const NOISE_RADIUS: usize = 2;
const NOISE_STRIDE: usize = 3;
const BLANKEST: usize = 20;

/// A posed grey picture.
#[derive(Clone, Debug)]
pub struct View {
    /// Its camera, at the picture's size.
    pub camera: Camera,
    /// World from camera, metres.
    pub pose: DAffine3,
    /// Luma of each pixel, 0 to 255, row by row.
    pub gray: Vec<f32>,
}

impl View {
    /// A colour picture brought to the size of `camera`.
    pub fn new(image: &ColorImage, camera: Camera, pose: DAffine3) -> Self {
        let size = (camera.width as usize, camera.height as usize);
        let gray = shrink(
            &luma(image),
            (image.width as usize, image.height as usize),
            size,
        );
        Self { camera, pose, gray }
    }

    /// The variance of the camera's noise in squared grey levels, as far as the picture tells: what is left where it is
    /// blankest, the 5th percentile of the variances in windows of 5x5.
    pub fn noise_var(&self) -> f32 {
        let (width, height) = self.size();
        let side = 2 * NOISE_RADIUS + 1;
        let columns = (0..width.saturating_sub(side)).step_by(NOISE_STRIDE);
        let rows = (0..height.saturating_sub(side)).step_by(NOISE_STRIDE);
        let corners = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
        let variance = |corner: usize| {
            let rows = (0..side).map(|row| &self.gray[corner + row * width..][..side]);
            let (sum, squares) = rows
                .flatten()
                .fold((0.0, 0.0), |(s, ss), v| (s + v, ss + v * v));
            let count = (side * side) as f32;
            (squares / count - (sum / count) * (sum / count)).max(0.0)
        };
        let mut variances: Vec<f32> = corners.map(variance).collect();
        if variances.is_empty() {
            return 0.0;
        }
        let rank = variances.len() / BLANKEST;
        *variances.select_nth_unstable_by(rank, f32::total_cmp).1
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.camera.width as usize, self.camera.height as usize)
    }
}

/// The camera scaled down to fit into `size` with its proportions kept; never scaled up.
pub fn fit(camera: &Camera, size: (u32, u32)) -> Camera {
    let across = f64::from(size.0) / f64::from(camera.width);
    let down = f64::from(size.1) / f64::from(camera.height);
    let scale = across.min(down).min(1.0);
    let scaled = |length: u32| (f64::from(length) * scale).round().max(1.0) as u32;
    camera.scaled(scaled(camera.width), scaled(camera.height))
}

/// ITU-R BT.601 luma.
fn luma(image: &ColorImage) -> Vec<f32> {
    let pixels = image.rgb.chunks_exact(3);
    let luma =
        |p: &[u8]| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]);
    pixels.map(luma).collect()
}

/// Resizes by averaging over the area that each new pixel covers, so that nothing is aliased.
pub fn shrink(from: &[f32], (width, height): (usize, usize), to: (usize, usize)) -> Vec<f32> {
    if (width, height) == to {
        return from.to_vec();
    }
    let (columns, rows) = (shares(width, to.0), shares(height, to.1));
    let mut narrow = vec![0.0f32; height * to.0];
    for (row, out) in from.chunks_exact(width).zip(narrow.chunks_exact_mut(to.0)) {
        for (out, share) in out.iter_mut().zip(&columns) {
            *out = share.iter().map(|&(at, part)| row[at] * part).sum();
        }
    }
    let mut small = vec![0.0f32; to.0 * to.1];
    for (out, share) in small.chunks_exact_mut(to.0).zip(&rows) {
        for &(at, part) in share {
            for (out, value) in out.iter_mut().zip(&narrow[at * to.0..]) {
                *out += value * part;
            }
        }
    }
    small
}

/// For each of `to` new pixels in a line of `from`: which old ones it covers, and the part of it that each fills.
fn shares(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    let scale = from as f64 / to as f64;
    let share = |i: usize| {
        let (start, end) = (i as f64 * scale, (i + 1) as f64 * scale);
        let covered = start.floor() as usize..(end.ceil() as usize).min(from);
        let part = |at: usize| (end.min(at as f64 + 1.0) - start.max(at as f64)) / scale;
        let parts = covered.map(|at| (at, part(at) as f32));
        parts.filter(|&(_, part)| part > 0.0).collect()
    };
    (0..to).map(share).collect()
}

/// From a pixel `(x, y)` of one view with inverse depth `rho` (1/m) to another view: `a [x, y, 1] + b rho` is the pixel there
/// times a scale `w`; `rho / w` is the inverse depth there (Hartley and Zisserman, section 9.6: the infinite homography plus
/// the epipole).
#[derive(Clone, Copy, Debug)]
pub struct Warp {
    /// `K' R K^-1`, by rows.
    pub a: [f32; 9],
    /// `K' t`.
    pub b: [f32; 3],
}

impl Warp {
    /// The pixel in the other view and the inverse depth there; `None` behind it.
    pub fn apply(&self, x: f32, y: f32, rho: f32) -> Option<(f32, f32, f32)> {
        let Self { a, b } = self;
        let w = a[6] * x + a[7] * y + a[8] + b[2] * rho;
        (w > 1e-6).then(|| {
            let u = (a[0] * x + a[1] * y + a[2] + b[0] * rho) / w;
            let v = (a[3] * x + a[4] * y + a[5] + b[1] * rho) / w;
            (u, v, rho / w)
        })
    }
}

/// The way from `reference` to `source`.
pub fn warp(reference: &View, source: &View) -> Warp {
    let source_from_reference = source.pose.inverse() * reference.pose;
    let to_pixels = intrinsics(&source.camera);
    let from_pixels = intrinsics(&reference.camera).inverse();
    let a = to_pixels * source_from_reference.matrix3 * from_pixels;
    let b = to_pixels * source_from_reference.translation;
    Warp {
        a: a.transpose().to_cols_array().map(|v| v as f32),
        b: b.to_array().map(|v| v as f32),
    }
}

fn intrinsics(camera: &Camera) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(camera.fx, 0.0, 0.0),
        DVec3::new(0.0, camera.fy, 0.0),
        DVec3::new(camera.cx, camera.cy, 1.0),
    )
}
