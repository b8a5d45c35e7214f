use glam::DVec3;
use scan::Frame;

/// up to n sources of each keyframe, best first
pub fn choose(
    frames: &[Frame],
    keys: &[usize],
    n: usize,
    baseline: f64,
    sigma: f64,
) -> Vec<Vec<usize>> {
    (0..keys.len())
        .map(|i| {
            let r = &frames[keys[i]];
            let mut scored: Vec<(f64, usize)> = (0..keys.len())
                .filter(|&j| j != i)
                .filter_map(|j| {
                    let s = &frames[keys[j]];
                    let b = (r.pose.translation - s.pose.translation).length();
                    if b < 0.03 {
                        return None;
                    }
                    // overlap: share of a grid of points at some depths that fall in the source
                    let c = &r.color_camera;
                    let m = s.pose.inverse() * r.pose;
                    let (mut seen, mut all) = (0.0, 0.0);
                    for z in [1.5, 3.0] {
                        for gy in 0..5 {
                            for gx in 0..5 {
                                let px = glam::DVec2::new(
                                    (gx as f64 + 0.5) / 5.0 * c.width as f64,
                                    (gy as f64 + 0.5) / 5.0 * c.height as f64,
                                );
                                let p: DVec3 = m.transform_point3(c.unproject(px, z));
                                all += 1.0;
                                if let Some(q) = s.color_camera.project(p) {
                                    if q.x >= 0.0
                                        && q.y >= 0.0
                                        && q.x < s.color_camera.width as f64
                                        && q.y < s.color_camera.height as f64
                                    {
                                        seen += 1.0;
                                    }
                                }
                            }
                        }
                    }
                    let overlap: f64 = seen / all;
                    if overlap < 0.25 {
                        return None;
                    }
                    let l = (b / baseline).ln();
                    let score = overlap * (-0.5 * l * l / (sigma * sigma)).exp();
                    Some((score, j))
                })
                .collect();
            scored.sort_by(|a, b| b.0.total_cmp(&a.0));
            scored.truncate(n);
            scored.into_iter().map(|s| s.1).collect()
        })
        .collect()
}
