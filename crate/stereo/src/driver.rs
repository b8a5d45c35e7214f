//! The way through a scan: keyframe by keyframe, with no more pictures in memory than the next steps need.

use crate::{
    StereoConfig, StereoError, consistency, depth, planes,
    smooth::{self, SmoothConfig},
    sources,
    sweep::{self, SweepConfig},
    view::{self, View},
};
use scan::{Camera, Finding, Scan};
use std::{collections::HashMap, rc::Rc};

/// Depth of one keyframe, at the working size.
#[derive(Clone, Debug)]
pub struct DepthMap {
    /// Index of the frame in the scan.
    pub frame: usize,
    /// The camera of the maps; the frame's own pose.
    pub camera: Camera,
    /// What may be relied on: metres along the optical axis, row by row; 0 where nothing is known.
    pub depth_m: Vec<f32>,
    /// How much each pixel of `depth_m` may be relied on, 0 to 1; 0 where nothing is known.
    pub confidence: Vec<f32>,
    /// Every pixel's best guess before it was compared with other views, in metres.
    pub raw_depth_m: Vec<f32>,
}

/// What one step of the work gave.
#[derive(Debug)]
pub enum Step {
    /// A part of a keyframe's work is done.
    Working,
    /// A keyframe was matched with its sources; its depth comes once its neighbours are matched too.
    Matched,
    /// A keyframe's depth.
    Depth(DepthMap),
    /// Something about a frame that the user should know; it is left out.
    Finding(Finding),
    /// All keyframes are through.
    Done,
}

/// Pictures kept at the working size.
const VIEWS_KEPT: usize = 48;

/// Stereo over a scan.
pub struct Stereo {
    pub config: StereoConfig,
    pub tuning: Tuning,
    keyframes: Vec<usize>,
    sources: Vec<Vec<usize>>,
    views: HashMap<usize, (Rc<View>, usize)>,
    clock: usize,
    raws: HashMap<usize, depth::Raw>,
    next: usize,
}

/// Numbers under exploration.
#[derive(Clone, Debug)]
pub struct Tuning {
    pub sweep: SweepConfig,
    pub smooth: SmoothConfig,
    pub min_zncc: f32,
    pub rounds: usize,
    pub fine: usize,
    pub fine_step: f32,
    pub planes: planes::PlanesConfig,
    pub sweep2: SweepConfig,
    pub smooth2: SmoothConfig,
    pub need: usize,
    pub rel: f32,
    pub px: f32,
}

impl StereoConfig {
    /// Chooses source views; nothing is decoded yet.
    pub fn init(&self, scan: &Scan, keyframes: &[usize]) -> Result<Stereo, StereoError> {
        self.check()?;

        let sources = sources::choose(scan.frames(), keyframes, self.sources, 0.25, 0.6);
        if sources.iter().all(Vec::is_empty) {
            return Err(StereoError::NoParallax {
                keyframes: keyframes.len(),
                least_m: 0.03,
            });
        }
        Ok(Stereo {
            config: *self,
            tuning: Tuning {
                sweep: SweepConfig {
                    radius: 2,
                    noise_var: 1.0,
                    best: 0.5,
                },
                smooth: SmoothConfig {
                    p1: 0.1,
                    p2: 1.0,
                    edge: 10.0,
                },
                rounds: 1,
                fine: 8,
                fine_step: 0.25,
                planes: planes::PlanesConfig {
                    radius: 8,
                    stride: 2,
                    gray: 10.0,
                    rel: 0.03,
                    rounds: 1,
                    ridge: 1.0,
                },
                sweep2: SweepConfig {
                    radius: 2,
                    noise_var: 1.0,
                    best: 0.5,
                },
                smooth2: SmoothConfig {
                    p1: 0.05,
                    p2: 0.3,
                    edge: 10.0,
                },
                min_zncc: 0.1,
                need: 2,
                rel: 0.05,
                px: 2.0,
            },
            keyframes: keyframes.to_vec(),
            sources,
            views: HashMap::new(),
            clock: 0,
            raws: HashMap::new(),
            next: 0,
        })
    }
}

impl Stereo {
    /// Does the next step.
    pub async fn advance(&mut self, scan: &Scan) -> Result<Step, StereoError> {
        if self.next == self.keyframes.len() {
            return Ok(Step::Done);
        }
        let k = self.next;
        let unmatched = std::iter::once(k)
            .chain(self.sources[k].iter().copied())
            .find(|j| !self.raws.contains_key(j));
        if let Some(j) = unmatched {
            return match self.match_keyframe(scan, j) {
                Ok(()) => Ok(Step::Matched),
                Err(finding) => {
                    for s in &mut self.sources {
                        s.retain(|&x| x != j);
                    }
                    self.keyframes.len();
                    if j == k {
                        self.next += 1;
                    }
                    Ok(Step::Finding(finding))
                }
            };
        }
        self.next += 1;
        let map = self.filter(scan, k);
        let still = |j: usize| {
            j >= self.next
                || (self.next..self.keyframes.len()).any(|m| self.sources[m].contains(&j))
        };
        let gone: Vec<usize> = self.raws.keys().copied().filter(|&j| !still(j)).collect();
        for j in gone {
            self.raws.remove(&j);
        }
        Ok(Step::Depth(map))
    }

    fn view(&mut self, scan: &Scan, k: usize) -> Result<Rc<View>, Finding> {
        self.clock += 1;
        if let Some((view, used)) = self.views.get_mut(&k) {
            *used = self.clock;
            return Ok(view.clone());
        }
        let frame = &scan.frames()[self.keyframes[k]];
        let image = scan
            .color(self.keyframes[k])
            .map_err(|e| e.finding().clone())?;
        let camera = view::fit(&frame.color_camera, self.config.size.0, self.config.size.1);
        let view = Rc::new(View {
            camera,
            pose: frame.pose,
            gray: view::gray(&image, camera.width, camera.height),
        });
        if self.views.len() >= VIEWS_KEPT
            && let Some(&oldest) = self
                .views
                .iter()
                .min_by_key(|(_, (_, used))| *used)
                .map(|(k, _)| k)
        {
            self.views.remove(&oldest);
        }
        self.views.insert(k, (view.clone(), self.clock));
        Ok(view)
    }

    fn match_keyframe(&mut self, scan: &Scan, k: usize) -> Result<(), Finding> {
        let reference = self.view(scan, k)?;
        let mut sources = Vec::new();
        for s in self.sources[k].clone() {
            if let Ok(v) = self.view(scan, s) {
                sources.push(v);
            }
        }
        let s: Vec<&View> = sources.iter().map(|v| &**v).collect();
        let (near, far, n) = (
            1.0 / self.config.near_m,
            1.0 / self.config.far_m,
            self.config.planes,
        );
        let offsets: Vec<f32> = (0..n)
            .map(|i| far + (near - far) * i as f32 / (n - 1) as f32)
            .collect();
        let (w, h) = (
            reference.camera.width as usize,
            reference.camera.height as usize,
        );
        let cost = sweep::sweep(&reference, &s, None, &offsets, &self.tuning.sweep);
        let sum = smooth::smooth(&cost, &reference.gray, w, h, n, &self.tuning.smooth);
        let mut raw = depth::winners(&cost, &sum, None, &offsets);
        let t = &self.tuning;
        let step = (near - far) / (n - 1) as f32;
        for _ in 0..t.rounds {
            let weight: Vec<f32> = raw
                .zncc
                .iter()
                .map(|z| (z - 0.05).clamp(0.01, 1.0))
                .collect();
            let base = planes::local_planes(&raw.rho, &weight, &reference.gray, w, h, &t.planes);
            if t.fine == 0 {
                raw.rho = base;
                continue;
            }
            let half = t.fine as i32;
            let offsets: Vec<f32> = (-half..=half)
                .map(|i| i as f32 * step * t.fine_step)
                .collect();
            let cost = sweep::sweep(&reference, &s, Some(&base), &offsets, &t.sweep2);
            let sum = smooth::smooth(&cost, &reference.gray, w, h, offsets.len(), &t.smooth2);
            raw = depth::winners(&cost, &sum, Some(&base), &offsets);
        }
        self.raws.insert(k, raw);
        Ok(())
    }

    fn filter(&mut self, scan: &Scan, k: usize) -> DepthMap {
        let t = self.tuning.clone();
        let reference = self.view(scan, k).ok();
        let list = self.sources[k].clone();
        let views: Vec<Rc<View>> = list
            .iter()
            .filter_map(|&j| self.view(scan, j).ok())
            .collect();
        let Some(reference) = reference else {
            unreachable!()
        };
        let raw = &self.raws[&k];
        let s: Vec<(&View, &[f32])> = list
            .iter()
            .zip(&views)
            .map(|(j, v)| (&**v, self.raws[j].rho.as_slice()))
            .collect();
        let (count, _) = consistency::agree(&reference, &raw.rho, &s, t.rel, t.px);
        let need = t.need.min(s.len()).max(1);
        let keep: Vec<bool> = (0..count.len())
            .map(|p| count[p] as usize >= need && raw.zncc[p] >= t.min_zncc)
            .collect();
        DepthMap {
            frame: self.keyframes[k],
            camera: reference.camera,
            depth_m: raw
                .rho
                .iter()
                .zip(&keep)
                .map(|(r, k)| if *k { 1.0 / r } else { 0.0 })
                .collect(),
            confidence: keep.iter().map(|&k| if k { 1.0 } else { 0.0 }).collect(),
            raw_depth_m: raw.rho.iter().map(|r| 1.0 / r).collect(),
        }
    }
}
