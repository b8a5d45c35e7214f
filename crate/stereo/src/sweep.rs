use crate::view::{View, Warp, warp};
use rayon::prelude::*;

pub const NONE: f32 = -2.0;

#[derive(Clone, Debug)]
pub struct SweepConfig { pub radius: usize, pub noise_var: f32, pub best: f32 }

/// cost[(y*W+x)*D+d] in 0..2 ; 1 where unknown. rho = base + offsets[d]
pub fn sweep(reference: &View, sources: &[&View], base: Option<&[f32]>, offsets: &[f32], c: &SweepConfig) -> Vec<f32> {
    let (w, h) = (reference.camera.width as usize, reference.camera.height as usize);
    let d = offsets.len();
    let band = 16usize;
    let mut cost = vec![1.0f32; w * h * d];
    let warps: Vec<Warp> = sources.iter().map(|s| warp(reference, s)).collect();
    cost.par_chunks_mut(band * w * d).enumerate().for_each(|(i, out)| {
        let y0 = i * band;
        let y1 = (y0 + band).min(h);
        band_cost(reference, sources, &warps, base, offsets, c, y0, y1, out);
    });
    cost
}

#[allow(clippy::too_many_arguments)]
fn band_cost(reference: &View, sources: &[&View], warps: &[Warp], base: Option<&[f32]>, offsets: &[f32], c: &SweepConfig, y0: usize, y1: usize, out: &mut [f32]) {
    let (w, h) = (reference.camera.width as usize, reference.camera.height as usize);
    let r = c.radius;
    let d = offsets.len();
    let (h0, h1) = (y0.saturating_sub(r), (y1 + r).min(h));
    let rows = h1 - h0;
    let gray = &reference.gray[h0 * w..h1 * w];
    let n_px = (y1 - y0) * w;
    // reference sums
    let mut tmp = vec![0.0f32; w];
    let mut sr = vec![0.0f32; n_px];
    let mut srr = vec![0.0f32; n_px];
    let mut count = vec![0.0f32; n_px];
    let sq: Vec<f32> = gray.iter().map(|v| v * v).collect();
    let ones = vec![1.0f32; rows * w];
    for y in y0..y1 {
        let (a, b) = (y.saturating_sub(r) - h0, (y + r + 1).min(h) - h0);
        let o = (y - y0) * w;
        boxrow(gray, w, a, b, r, &mut tmp, &mut sr[o..o + w]);
        boxrow(&sq, w, a, b, r, &mut tmp, &mut srr[o..o + w]);
        boxrow(&ones, w, a, b, r, &mut tmp, &mut count[o..o + w]);
    }
    let mut ws = vec![0.0f32; rows * w];
    let mut wss = vec![0.0f32; rows * w];
    let mut wrs = vec![0.0f32; rows * w];
    let mut valid = vec![false; rows * w];
    let mut scores = vec![NONE; sources.len() * n_px];
    let (mut s1, mut s2, mut s3) = (vec![0.0f32; w], vec![0.0f32; w], vec![0.0f32; w]);
    for (di, &off) in offsets.iter().enumerate() {
        for (si, (src, wp)) in sources.iter().zip(warps).enumerate() {
            let (sw, sh) = (src.camera.width as usize, src.camera.height as usize);
            let (mx, my) = (sw as f32 - 1.001, sh as f32 - 1.001);
            for y in h0..h1 {
                let o = (y - h0) * w;
                let yf = y as f32;
                let (u0, v0, z0) = (wp.a[1] * yf + wp.a[2], wp.a[4] * yf + wp.a[5], wp.a[7] * yf + wp.a[8]);
                for x in 0..w {
                    let rho = base.map_or(off, |b| (b[y * w + x] + off).max(1e-3));
                    let xf = x as f32;
                    let z = wp.a[6] * xf + z0 + wp.b[2] * rho;
                    let inv = 1.0 / z;
                    let u = (wp.a[0] * xf + u0 + wp.b[0] * rho) * inv;
                    let v = (wp.a[3] * xf + v0 + wp.b[1] * rho) * inv;
                    let ok = z > 1e-6 && u >= 0.0 && v >= 0.0 && u <= mx && v <= my;
                    let (u, v) = (u.max(0.0).min(mx), v.max(0.0).min(my));
                    let (ui, vi) = (u as usize, v as usize);
                    let (fu, fv) = (u - ui as f32, v - vi as f32);
                    let at = vi * sw + ui;
                    let g = &src.gray;
                    let top = g[at] + (g[at + 1] - g[at]) * fu;
                    let bot = g[at + sw] + (g[at + sw + 1] - g[at + sw]) * fu;
                    let s = top + (bot - top) * fv;
                    ws[o + x] = s;
                    wss[o + x] = s * s;
                    wrs[o + x] = s * gray[o + x];
                    valid[o + x] = ok;
                }
            }
            for y in y0..y1 {
                let (a, b) = (y.saturating_sub(r) - h0, (y + r + 1).min(h) - h0);
                boxrow(&ws, w, a, b, r, &mut tmp, &mut s1);
                boxrow(&wss, w, a, b, r, &mut tmp, &mut s2);
                boxrow(&wrs, w, a, b, r, &mut tmp, &mut s3);
                let o = (y - y0) * w;
                let sc = &mut scores[si * n_px + o..si * n_px + o + w];
                let va = &valid[(y - h0) * w..(y - h0) * w + w];
                for x in 0..w {
                    let n = count[o + x];
                    let inv = 1.0 / n;
                    let cov = s3[x] - s1[x] * sr[o + x] * inv;
                    let vr = (srr[o + x] - sr[o + x] * sr[o + x] * inv).max(0.0) + c.noise_var * n;
                    let vs = (s2[x] - s1[x] * s1[x] * inv).max(0.0) + c.noise_var * n;
                    let z = cov / (vr * vs).sqrt();
                    sc[x] = if va[x] { z } else { NONE };
                }
            }
        }
        // best share of the sources that see it
        let ns = sources.len();
        let mut vals = [0.0f32; 32];
        for p in 0..n_px {
            let mut n = 0;
            for s in 0..ns {
                let v = scores[s * n_px + p];
                if v > NONE {
                    let mut k = n;
                    while k > 0 && vals[k - 1] < v { vals[k] = vals[k - 1]; k -= 1; }
                    vals[k] = v;
                    n += 1;
                }
            }
            if n > 0 {
                let k = ((n as f32 * c.best).ceil() as usize).max(1);
                let mean = vals[..k].iter().sum::<f32>() / k as f32;
                out[p * d + di] = 1.0 - mean;
            }
        }
    }
}

fn boxrow(src: &[f32], w: usize, a: usize, b: usize, r: usize, tmp: &mut [f32], out: &mut [f32]) {
    tmp.fill(0.0);
    for y in a..b {
        for (t, s) in tmp.iter_mut().zip(&src[y * w..y * w + w]) { *t += s; }
    }
    out.fill(0.0);
    for k in 0..=r {
        for (o, t) in out[..w - k].iter_mut().zip(&tmp[k..]) { *o += t; }
    }
    for k in 1..=r {
        for (o, t) in out[k..].iter_mut().zip(&tmp[..w - k]) { *o += t; }
    }
}
