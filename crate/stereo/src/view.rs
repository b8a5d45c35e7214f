use glam::{DAffine3, DMat3, DVec3};
use scan::{Camera, ColorImage};

#[derive(Clone)]
pub struct View {
    pub camera: Camera,
    pub pose: DAffine3,
    pub gray: Vec<f32>,
}

impl View {
    pub fn size(&self) -> (usize, usize) {
        (self.camera.width as usize, self.camera.height as usize)
    }
}

pub fn fit(camera: &Camera, max_w: u32, max_h: u32) -> Camera {
    let s = (f64::from(max_w) / f64::from(camera.width))
        .min(f64::from(max_h) / f64::from(camera.height))
        .min(1.0);
    let w = (f64::from(camera.width) * s).round().max(1.0) as u32;
    let h = (f64::from(camera.height) * s).round().max(1.0) as u32;
    camera.scaled(w, h)
}

/// area-averaging resize of luma
pub fn gray(image: &ColorImage, w: u32, h: u32) -> Vec<f32> {
    let (iw, ih) = (image.width as usize, image.height as usize);
    let (w, h) = (w as usize, h as usize);
    let luma: Vec<f32> = image
        .rgb
        .chunks_exact(3)
        .map(|p| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]))
        .collect();
    let spans = |from: usize, to: usize| -> Vec<Vec<(usize, f32)>> {
        let s = from as f64 / to as f64;
        (0..to)
            .map(|i| {
                let (a, b) = (i as f64 * s, (i + 1) as f64 * s);
                let mut out = Vec::new();
                let mut k = a.floor() as usize;
                while (k as f64) < b && k < from {
                    let ov = (b.min(k as f64 + 1.0) - a.max(k as f64)) / s;
                    if ov > 1e-9 {
                        out.push((k, ov as f32));
                    }
                    k += 1;
                }
                out
            })
            .collect()
    };
    let xs = spans(iw, w);
    let ys = spans(ih, h);
    let mut rows = vec![0.0f32; ih * w];
    for y in 0..ih {
        for (x, span) in xs.iter().enumerate() {
            rows[y * w + x] = span.iter().map(|&(k, o)| luma[y * iw + k] * o).sum();
        }
    }
    let mut out = vec![0.0f32; h * w];
    for (y, span) in ys.iter().enumerate() {
        for &(k, o) in span {
            for x in 0..w {
                out[y * w + x] += rows[k * w + x] * o;
            }
        }
    }
    out
}

/// source pixel (homogeneous) = a * [x, y, 1] + b * rho
#[derive(Clone, Copy, Debug)]
pub struct Warp {
    pub a: [f32; 9],
    pub b: [f32; 3],
}

pub fn intrinsics(c: &Camera) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(c.fx, 0.0, 0.0),
        DVec3::new(0.0, c.fy, 0.0),
        DVec3::new(c.cx, c.cy, 1.0),
    )
}

pub fn warp(reference: &View, source: &View) -> Warp {
    let m = source.pose.inverse() * reference.pose;
    let ks = intrinsics(&source.camera);
    let kr = intrinsics(&reference.camera).inverse();
    let a = (ks * m.matrix3 * kr).transpose().to_cols_array();
    let b = (ks * m.translation).to_array();
    Warp {
        a: a.map(|v| v as f32),
        b: b.map(|v| v as f32),
    }
}
