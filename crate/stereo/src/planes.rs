//! Local planes in inverse depth.
use rayon::prelude::*;

#[derive(Clone, Debug)]
pub struct PlanesConfig {
    pub radius: i32,
    pub stride: i32,
    pub gray: f32,
    pub rel: f32,
    pub rounds: usize,
    pub ridge: f32,
}

/// Weighted least-squares plane of inverse depth around each pixel (a plane in space is affine in inverse depth), evaluated there.
pub fn local_planes(
    rho: &[f32],
    weight: &[f32],
    gray: &[f32],
    w: usize,
    h: usize,
    c: &PlanesConfig,
) -> Vec<f32> {
    let mut now = rho.to_vec();
    for _ in 0..c.rounds {
        let prev = &now;
        let next: Vec<f32> = (0..w * h)
            .into_par_iter()
            .map(|p| {
                let (x, y) = ((p % w) as i32, (p / w) as i32);
                let (g0, r0) = (gray[p], prev[p]);
                let (mut s, mut sx, mut sy, mut sxx, mut sxy, mut syy, mut sr, mut sxr, mut syr) =
                    (1e-6f32, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-6 * r0, 0.0, 0.0);
                let mut dy = -c.radius;
                while dy <= c.radius {
                    let yy = y + dy;
                    if yy >= 0 && yy < h as i32 {
                        let mut dx = -c.radius;
                        while dx <= c.radius {
                            let xx = x + dx;
                            if xx >= 0 && xx < w as i32 {
                                let q = yy as usize * w + xx as usize;
                                let dg = (gray[q] - g0) / c.gray;
                                let dr = (prev[q] - r0) / (c.rel * r0);
                                let k = weight[q] / (1.0 + dg * dg) / (1.0 + dr * dr);
                                let (fx, fy) = (dx as f32, dy as f32);
                                s += k;
                                sx += k * fx;
                                sy += k * fy;
                                sxx += k * fx * fx;
                                sxy += k * fx * fy;
                                syy += k * fy * fy;
                                let d = rho[q] - r0;
                                sr += k * d;
                                sxr += k * d * fx;
                                syr += k * d * fy;
                            }
                            dx += c.stride;
                        }
                    }
                    dy += c.stride;
                }
                sr -= 1e-6 * r0;
                // ridge on the slopes
                let ridge = c.ridge * s;
                let (mx, my, mr) = (sx / s, sy / s, sr / s);
                let (cxx, cxy, cyy) = (
                    sxx - s * mx * mx + ridge,
                    sxy - s * mx * my,
                    syy - s * my * my + ridge,
                );
                let (cxr, cyr) = (sxr - s * mx * mr, syr - s * my * mr);
                let det = cxx * cyy - cxy * cxy;
                let (a, b) = if det > 1e-9 {
                    ((cxr * cyy - cyr * cxy) / det, (cyr * cxx - cxr * cxy) / det)
                } else {
                    (0.0, 0.0)
                };
                (r0 + mr - a * mx - b * my).max(1e-3)
            })
            .collect();
        now = next;
    }
    now
}
