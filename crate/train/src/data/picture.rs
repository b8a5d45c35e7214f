//! Pictures at the working size, with the cameras that belong to them.

use glam::{Affine3A, DAffine3, Vec2};
use mesh::camera::Pinhole;
use scan::{Camera, ColorImage, DepthImage};

/// How a picture of any size becomes one of the working size: the largest centred part of the same shape, scaled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Left edge, upper edge, width and height of the part, in pixels of the given picture.
    part: [f32; 4],
    /// Width and height of the result.
    size: [u32; 2],
}

impl Fit {
    /// For pictures of `width` x `height` pixels.
    pub fn new(width: u32, height: u32, size: [u32; 2]) -> Self {
        let (w, h) = (width as f32, height as f32);
        let aspect = size[0] as f32 / size[1] as f32;
        let (part_w, part_h) = if w > h * aspect {
            (h * aspect, h)
        } else {
            (w, w / aspect)
        };
        Self {
            part: [0.5 * (w - part_w), 0.5 * (h - part_h), part_w, part_h],
            size,
        }
    }

    /// The camera of the result. With pixel centres at integers, column x of the result covers the part from
    /// `left + x s` to `left + (x + 1) s`, s = part / size.
    pub fn camera(&self, camera: &Camera) -> Pinhole {
        let [left, top, width, height] = self.part;
        let (sx, sy) = (self.size[0] as f32 / width, self.size[1] as f32 / height);
        Pinhole {
            width: self.size[0],
            height: self.size[1],
            fx: camera.fx as f32 * sx,
            fy: camera.fy as f32 * sy,
            cx: (camera.cx as f32 + 0.5 - left) * sx - 0.5,
            cy: (camera.cy as f32 + 0.5 - top) * sy - 0.5,
        }
    }

    /// The picture, `[3, H, W]`, 0 to 255: every pixel is the mean of what it covers.
    pub fn color(&self, image: &ColorImage) -> Vec<f32> {
        let [left, top, width, height] = self.part;
        let [out_w, out_h] = self.size.map(|n| n as usize);
        let columns = cover(left, width, out_w, image.width as usize);
        let rows = cover(top, height, out_h, image.height as usize);
        let in_w = image.width as usize;
        let mut result = vec![0.0; 3 * out_w * out_h];
        let mut line = vec![0.0_f32; 3 * in_w];
        for (y, row) in rows.iter().enumerate() {
            line.fill(0.0);
            for &(from, weight) in row {
                let pixels = &image.rgb[3 * in_w * from..3 * in_w * (from + 1)];
                for (sum, &value) in line.iter_mut().zip(pixels) {
                    *sum += weight * f32::from(value);
                }
            }
            for (x, column) in columns.iter().enumerate() {
                for channel in 0..3 {
                    let mean = column
                        .iter()
                        .map(|&(from, weight)| weight * line[3 * from + channel]);
                    result[(channel * out_h + y) * out_w + x] = mean.sum();
                }
            }
        }
        result
    }

    /// Depth at the centres of the result's pixels, `[H, W]`, from the nearest pixel of a depth image at the same place
    /// that may have another camera; 0 where nothing was measured.
    pub fn depth(&self, color: &Camera, image: &DepthImage, depth_camera: &Camera) -> Vec<f32> {
        let camera = self.camera(color);
        let depth_camera = pinhole(depth_camera);
        let (width, height) = (image.width as usize, image.height as usize);
        let mut result = Vec::with_capacity(camera.pixels());
        for v in 0..camera.height {
            for u in 0..camera.width {
                let ray = camera.ray(Vec2::new(u as f32, v as f32));
                // Half up, so that exact halves fall to the same side in every row.
                let at = (depth_camera.project(ray) + 0.5).floor();
                let inside =
                    at.x >= 0.0 && at.y >= 0.0 && at.x < width as f32 && at.y < height as f32;
                result.push(if inside {
                    image.depth_m[at.x as usize + width * at.y as usize]
                } else {
                    0.0
                });
            }
        }
        result
    }
}

/// The scan's camera in single precision.
pub fn pinhole(camera: &Camera) -> Pinhole {
    Pinhole {
        width: camera.width,
        height: camera.height,
        fx: camera.fx as f32,
        fy: camera.fy as f32,
        cx: camera.cx as f32,
        cy: camera.cy as f32,
    }
}

/// A pose in single precision.
pub fn single(pose: &DAffine3) -> Affine3A {
    Affine3A::from_mat3_translation(pose.matrix3.as_mat3(), pose.translation.as_vec3())
}

/// For each of `count` equal stretches of `[start, start + len)`: the pixels it covers and their shares.
fn cover(start: f32, len: f32, count: usize, limit: usize) -> Vec<Vec<(usize, f32)>> {
    let step = len / count as f32;
    (0..count)
        .map(|i| {
            let low = start + i as f32 * step;
            let high = low + step;
            let pixels = low.max(0.0) as usize..(high.ceil() as usize).clamp(1, limit);
            let shares = pixels.map(|p| {
                let overlap = high.min(p as f32 + 1.0) - low.max(p as f32);
                (p, overlap.max(0.0))
            });
            let shares: Vec<(usize, f32)> = shares.filter(|(_, share)| *share > 0.0).collect();
            let sum: f32 = shares.iter().map(|(_, share)| share).sum();
            shares
                .into_iter()
                .map(|(p, share)| (p, share / sum))
                .collect()
        })
        .collect()
}

/// Mirrors what a camera sees: itself, and two pictures of its width.
pub fn mirror_view(camera: &mut Pinhole, pictures: [&mut [f32]; 2]) {
    camera.cx = camera.width as f32 - 1.0 - camera.cx;
    for picture in pictures {
        mirror(picture, camera.width as usize);
    }
}

/// Mirrors rows of `width` values in place.
pub fn mirror(values: &mut [f32], width: usize) {
    values.chunks_exact_mut(width).for_each(<[f32]>::reverse);
}
