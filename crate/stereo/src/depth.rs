use rayon::prelude::*;

pub struct Raw {
    pub rho: Vec<f32>,
    pub zncc: Vec<f32>,
    pub unique: Vec<f32>,
}

/// winner takes all with parabola; zncc is 1 - unsmoothed cost at the winner; unique: (second best sum - best)/8 outside +-2
pub fn winners(cost: &[f32], sum: &[f32], base: Option<&[f32]>, offsets: &[f32]) -> Raw {
    let d = offsets.len();
    let n = cost.len() / d;
    let out: Vec<(f32, f32, f32)> = (0..n)
        .into_par_iter()
        .map(|p| {
            let s = &sum[p * d..p * d + d];
            let c = &cost[p * d..p * d + d];
            let mut best = 0;
            for i in 1..d {
                if s[i] < s[best] {
                    best = i;
                }
            }
            let mut frac = 0.0;
            if best > 0 && best < d - 1 {
                let (a, b, e) = (s[best - 1], s[best], s[best + 1]);
                let k = a - 2.0 * b + e;
                if k > 1e-6 {
                    frac = (0.5 * (a - e) / k).clamp(-0.5, 0.5);
                }
            }
            let step = if d > 1 { offsets[1] - offsets[0] } else { 0.0 };
            let rho = offsets[best] + frac * step + base.map_or(0.0, |b| b[p]);
            let mut second = f32::MAX;
            for i in 0..d {
                if i.abs_diff(best) > 2 && s[i] < second {
                    second = s[i];
                }
            }
            (rho, 1.0 - c[best], (second - s[best]) / 8.0)
        })
        .collect();
    Raw {
        rho: out.iter().map(|o| o.0).collect(),
        zncc: out.iter().map(|o| o.1).collect(),
        unique: out.iter().map(|o| o.2).collect(),
    }
}
