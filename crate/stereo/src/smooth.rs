use rayon::prelude::*;

#[derive(Clone, Debug)]
pub struct SmoothConfig {
    pub p1: f32,
    pub p2: f32,
    pub edge: f32,
}

/// sum over eight paths
pub fn smooth(
    cost: &[f32],
    gray: &[f32],
    w: usize,
    h: usize,
    d: usize,
    c: &SmoothConfig,
) -> Vec<f32> {
    let mut sum = vec![0.0f32; cost.len()];
    let p2 = |a: usize, b: usize| (c.p2 / (1.0 + (gray[a] - gray[b]).abs() / c.edge)).max(c.p1);
    sum.par_chunks_mut(w * d).enumerate().for_each(|(y, out)| {
        let (mut l, mut m) = (vec![0.0f32; d], vec![0.0f32; d]);
        for back in [false, true] {
            let mut least = 0.0;
            for i in 0..w {
                let x = if back { w - 1 - i } else { i };
                let at = y * w + x;
                let cst = &cost[at * d..at * d + d];
                if i == 0 {
                    m.copy_from_slice(cst);
                    least = m.iter().copied().fold(f32::MAX, f32::min);
                } else {
                    let prev = if back { at + 1 } else { at - 1 };
                    least = step(cst, &l, least, c.p1, p2(at, prev), &mut m);
                }
                for (o, v) in out[x * d..x * d + d].iter_mut().zip(&m) {
                    *o += v;
                }
                std::mem::swap(&mut l, &mut m);
            }
        }
    });
    for up in [false, true] {
        let mut prev = vec![0.0f32; 3 * w * d];
        let mut prev_min = vec![0.0f32; 3 * w];
        let mut cur = vec![0.0f32; 3 * w * d];
        let mut cur_min = vec![0.0f32; 3 * w];
        for i in 0..h {
            let y = if up { h - 1 - i } else { i };
            let py = if up { y + 1 } else { y.wrapping_sub(1) };
            cur.par_chunks_mut(3 * d)
                .zip(cur_min.par_chunks_mut(3))
                .zip(sum[y * w * d..(y + 1) * w * d].par_chunks_mut(d))
                .with_min_len(32)
                .enumerate()
                .for_each(|(x, ((cur, cur_min), out))| {
                    let at = y * w + x;
                    let cst = &cost[at * d..at * d + d];
                    for (k, dx) in [-1i32, 0, 1].into_iter().enumerate() {
                        let px = x as i32 + dx;
                        let m = &mut cur[k * d..k * d + d];
                        if i == 0 || px < 0 || px >= w as i32 {
                            m.copy_from_slice(cst);
                            cur_min[k] = m.iter().copied().fold(f32::MAX, f32::min);
                        } else {
                            let px = px as usize;
                            let l = &prev[(px * 3 + k) * d..(px * 3 + k) * d + d];
                            cur_min[k] =
                                step(cst, l, prev_min[px * 3 + k], c.p1, p2(at, py * w + px), m);
                        }
                        for (o, v) in out.iter_mut().zip(&*m) {
                            *o += v;
                        }
                    }
                });
            std::mem::swap(&mut prev, &mut cur);
            std::mem::swap(&mut prev_min, &mut cur_min);
        }
    }
    sum
}

#[inline(always)]
fn step(cost: &[f32], l: &[f32], least: f32, p1: f32, p2: f32, out: &mut [f32]) -> f32 {
    let d = cost.len();
    let far = least + p2;
    let (cost, l, out) = (&cost[..d], &l[..d], &mut out[..d]);
    for i in 1..d - 1 {
        let v = l[i].min(far).min((l[i - 1].min(l[i + 1])) + p1);
        out[i] = cost[i] + v - least;
    }
    out[0] = cost[0] + l[0].min(far).min(l[1] + p1) - least;
    out[d - 1] = cost[d - 1] + l[d - 1].min(far).min(l[d - 2] + p1) - least;
    let mut m = [f32::MAX; 8];
    let ch = out.chunks_exact(8);
    let rest = ch.remainder();
    for c in ch {
        for k in 0..8 {
            m[k] = if c[k] < m[k] { c[k] } else { m[k] };
        }
    }
    let mut r = m.iter().copied().fold(f32::MAX, f32::min);
    for &v in rest {
        r = r.min(v);
    }
    r
}
