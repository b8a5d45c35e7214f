use crate::view::{View, warp};
use rayon::prelude::*;

/// number of sources that agree within rel and px, per pixel, and mean of the agreeing inverse depths (in the reference), itself included
pub fn agree(
    reference: &View,
    rho: &[f32],
    sources: &[(&View, &[f32])],
    rel: f32,
    px: f32,
) -> (Vec<u8>, Vec<f32>) {
    let w = reference.camera.width as usize;
    let forth: Vec<_> = sources.iter().map(|(s, _)| warp(reference, s)).collect();
    let back: Vec<_> = sources.iter().map(|(s, _)| warp(s, reference)).collect();
    rho.par_iter()
        .enumerate()
        .map(|(p, &r)| {
            let (x, y) = ((p % w) as f32, (p / w) as f32);
            let (mut n, mut sum) = (0u8, r);
            for (k, (s, other)) in sources.iter().enumerate() {
                let (sw, sh) = (s.camera.width as usize, s.camera.height as usize);
                let f = &forth[k];
                let z = f.a[6] * x + f.a[7] * y + f.a[8] + f.b[2] * r;
                if z <= 1e-6 {
                    continue;
                }
                let u = (f.a[0] * x + f.a[1] * y + f.a[2] + f.b[0] * r) / z;
                let v = (f.a[3] * x + f.a[4] * y + f.a[5] + f.b[1] * r) / z;
                let (ui, vi) = ((u + 0.5).floor(), (v + 0.5).floor());
                if !(ui >= 0.0 && vi >= 0.0 && ui < sw as f32 && vi < sh as f32) {
                    continue;
                }
                let ro = other[vi as usize * sw + ui as usize];
                if ro <= 0.0 {
                    continue;
                }
                let b = &back[k];
                let zb = b.a[6] * ui + b.a[7] * vi + b.a[8] + b.b[2] * ro;
                if zb <= 1e-6 {
                    continue;
                }
                let ub = (b.a[0] * ui + b.a[1] * vi + b.a[2] + b.b[0] * ro) / zb;
                let vb = (b.a[3] * ui + b.a[4] * vi + b.a[5] + b.b[1] * ro) / zb;
                // inverse depth in the reference: depth_ref = zb * depth_src
                let rr = ro / zb;
                let e = ((ub - x) * (ub - x) + (vb - y) * (vb - y)).sqrt();
                if e <= px && (r / rr - 1.0).abs() <= rel {
                    n += 1;
                    sum += rr;
                }
            }
            (n, sum / (f32::from(n) + 1.0))
        })
        .unzip()
}
