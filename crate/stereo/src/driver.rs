//! The way through a scan: keyframe by keyframe, with no more pictures in memory than the next steps need.

use crate::{
    Recipe, StereoConfig, StereoError, consistency,
    depth::Raw,
    fused::{FusedMatcher, most_planes},
    pass::Pass,
    pose_check, sources,
    view::{self, View},
};
use burn::tensor::Device;
use scan::{Camera, Finding, Scan, Severity};
use std::{
    collections::{HashMap, HashSet},
    rc::Rc,
};

/// Pictures kept at the working size.
pub const VIEWS_KEPT: usize = 48;
/// Below this correlation with its neighbours a frame is not where its pose says.
const LEAST_CORRELATION: f32 = 0.25;
/// The first few keyframes give depth once this many of their sources are matched, the best first.
const FIRST_KEYFRAMES: usize = 4;
const FIRST_WITNESSES: usize = 4;
/// Neighbours that must have depth before a frame's pose is judged.
const LEAST_NEIGHBOURS: usize = 2;

/// Depth of one keyframe, at the working size.
#[derive(Clone, Debug)]
pub struct DepthMap {
    /// Index of the frame in the scan.
    pub frame: usize,
    /// The camera of the maps; the frame's own pose.
    pub camera: Camera,
    /// What may be relied on: metres along the optical axis, row by row; 0 where nothing is known.
    pub depth_m: Vec<f32>,
    /// How likely each pixel of `depth_m` is right, 0 to 1; 0 where nothing is known.
    pub confidence: Vec<f32>,
    /// Every pixel's best guess before it was compared with other views' depth, in metres; 0 where there is none.
    pub raw_depth_m: Vec<f32>,
}

/// What one step of the work gave.
#[derive(Debug)]
pub enum Step {
    /// A part of a keyframe's work is done.
    Working,
    /// A keyframe was matched with its sources; its depth comes once those are matched too.
    Matched,
    /// A keyframe's depth.
    Depth(DepthMap),
    /// Something about a frame that the user should know; it is left out.
    Finding(Finding),
    /// All keyframes are through.
    Done,
}

/// A matched keyframe.
struct Found {
    raw: Raw,
    /// The correlation at its depth in a wider window.
    proof: Vec<f32>,
}

/// Stereo over a scan.
pub struct Stereo {
    recipe: Recipe,
    config: StereoConfig,
    /// The kernels, where the device runs them.
    kernels: Option<FusedMatcher>,
    keyframes: Vec<usize>,
    /// Of each keyframe, as indices into `keyframes`.
    sources: Vec<Vec<usize>>,
    views: Views,
    /// The sweep that is going on.
    pass: Option<Pass>,
    found: HashMap<usize, Found>,
    /// Keyframes whose pose was judged.
    judged: HashSet<usize>,
    next: usize,
}

impl StereoConfig {
    /// Chooses the source views of every keyframe, which are indices into the scan's frames; nothing is decoded yet.
    ///
    /// # Errors
    /// Settings that make no sense, no two keyframes that see the same from different places, or a failing device.
    pub fn init(
        &self,
        scan: &Scan,
        keyframes: &[usize],
        device: &Device,
    ) -> Result<Stereo, StereoError> {
        self.check()?;
        let sources = sources::choose(scan.frames(), keyframes, self.sources);
        if sources.iter().all(Vec::is_empty) {
            return Err(StereoError::NoParallax {
                keyframes: keyframes.len(),
                least_m: sources::LEAST_BASELINE_M,
            });
        }
        let kernels = match FusedMatcher::runs_on(device) {
            true => Some(FusedMatcher::new(device)?),
            false => None,
        };
        Ok(Stereo {
            recipe: Recipe::default(),
            config: *self,
            kernels,
            keyframes: keyframes.to_vec(),
            sources,
            views: Views::default(),
            pass: None,
            found: HashMap::new(),
            judged: HashSet::new(),
            next: 0,
        })
    }
}

impl Stereo {
    /// Does the next step: a part of a keyframe's matching, or the filtering of one whose sources are matched.
    ///
    /// # Errors
    /// A failing device.
    pub async fn advance(&mut self, scan: &Scan) -> Result<Step, StereoError> {
        if let Some(pass) = self.pass.take() {
            return self.go_on(pass).await;
        }
        let Some(&frame) = self.keyframes.get(self.next) else {
            return Ok(Step::Done);
        };
        let keyframe = self.next;
        if self.sources[keyframe].is_empty() {
            self.next += 1;
            return Ok(Step::Depth(self.nothing(scan, frame)));
        }
        // The first surface should not wait for all that the first keyframes could be asked about.
        let witnesses = match keyframe < FIRST_KEYFRAMES {
            true => FIRST_WITNESSES,
            false => usize::MAX,
        };
        let asked = self.sources[keyframe].iter().take(witnesses);
        let around: Vec<usize> = std::iter::once(&keyframe).chain(asked).copied().collect();
        let has_depth = |k: &usize| self.found.contains_key(k) || self.sources[*k].is_empty();
        if let Some(&unmatched) = around.iter().find(|k| !has_depth(k)) {
            return Ok(match self.decode(scan, unmatched) {
                Err(finding) => Step::Finding(*finding),
                Ok((reference, sources)) => {
                    let planes = self.planes(&reference);
                    let recipe = &self.recipe;
                    let pass = Pass::coarse(unmatched, reference, sources, planes, recipe);
                    self.pass = Some(pass);
                    Step::Working
                }
            });
        }
        for k in around {
            if let Some(finding) = self.misplaced(scan, k) {
                return Ok(Step::Finding(finding));
            }
        }
        self.next += 1;
        let map = self.filter(scan, keyframe);
        self.forget();
        Ok(Step::Depth(map))
    }

    async fn go_on(&mut self, mut pass: Pass) -> Result<Step, StereoError> {
        let keyframe = pass.keyframe;
        Ok(match pass.advance(self.kernels.as_mut()).await? {
            None => {
                self.pass = Some(pass);
                Step::Working
            }
            Some(found) if !pass.fine => {
                self.pass = Some(pass.refined(&found, &self.recipe));
                Step::Working
            }
            Some(found) => {
                let proof = pass.prove(&found, &self.recipe);
                self.found.insert(keyframe, Found { raw: found, proof });
                Step::Matched
            }
        })
    }

    /// Inverse depth of the planes in 1/m, evenly spaced from the farthest to the nearest; on every device no more than a
    /// buffer of a WebGPU device holds.
    fn planes(&self, reference: &View) -> Vec<f32> {
        let (width, height) = reference.size();
        let count = self.config.planes.min(most_planes(width, height)).max(2);
        let (far, near) = (1.0 / self.config.far_m, 1.0 / self.config.near_m);
        let share = |i: usize| i as f32 / (count - 1) as f32;
        (0..count).map(|i| far + (near - far) * share(i)).collect()
    }

    /// A keyframe's picture and those of its sources. One that cannot be decoded is left out from now on, and told.
    #[allow(clippy::type_complexity)]
    fn decode(
        &mut self,
        scan: &Scan,
        keyframe: usize,
    ) -> Result<(Rc<View>, Vec<(usize, Rc<View>)>), Box<Finding>> {
        let mut views = Vec::new();
        for k in std::iter::once(keyframe).chain(self.sources[keyframe].clone()) {
            match self.views.get(scan, self.keyframes[k], self.config.size) {
                Ok(view) => views.push((k, view)),
                Err(finding) => {
                    self.leave_out(k);
                    return Err(finding);
                }
            }
        }
        let (_, reference) = views.remove(0);
        Ok((reference, views))
    }

    /// A finding if the keyframe, which has depth or none, is not where its pose says; it is then left out.
    fn misplaced(&mut self, scan: &Scan, keyframe: usize) -> Option<Finding> {
        if self.judged.contains(&keyframe) {
            return None;
        }
        let known = |k: &usize| self.found.contains_key(k);
        let neighbours: Vec<usize> = self.sources[keyframe]
            .iter()
            .copied()
            .filter(known)
            .collect();
        if neighbours.len() < LEAST_NEIGHBOURS {
            return None;
        }
        let frame = self.keyframes[keyframe];
        let size = self.config.size;
        let view = self.views.get(scan, frame, size).ok()?;
        let pictures: Vec<Rc<View>> = neighbours
            .iter()
            .map(|&k| self.views.get(scan, self.keyframes[k], size).ok())
            .collect::<Option<_>>()?;
        let raws = neighbours.iter().map(|k| &self.found[k].raw);
        let asked: Vec<(&View, &Raw)> = pictures.iter().map(|v| &**v).zip(raws).collect();
        let correlation = pose_check::correlation(&view, &asked)?;
        self.judged.insert(keyframe);
        if correlation >= LEAST_CORRELATION {
            return None;
        }
        self.leave_out(keyframe);
        let frame = &scan.frames()[frame];
        Some(Finding {
            severity: Severity::Warning,
            code: "stereo-pose",
            file: frame.color.as_ref().map(|color| color.path.clone()),
            line: None,
            expected: format!(
                "a picture that looks like its {} neighbours' at its pose: a correlation of at least {LEAST_CORRELATION}",
                neighbours.len()
            ),
            found: format!("{correlation:.2}"),
            advice: "The frame is left out: its pose is wrong, or its picture belongs to another"
                .to_owned(),
            frames_affected: 1,
        })
    }

    /// Nobody asks this keyframe any more, and it gives no depth.
    fn leave_out(&mut self, keyframe: usize) {
        self.sources[keyframe].clear();
        for sources in &mut self.sources {
            sources.retain(|&source| source != keyframe);
        }
        self.found.remove(&keyframe);
    }

    fn filter(&mut self, scan: &Scan, keyframe: usize) -> DepthMap {
        let frame = self.keyframes[keyframe];
        let size = self.config.size;
        let sources = self.sources[keyframe].clone();
        let witnesses: Vec<(usize, Rc<View>)> = sources
            .into_iter()
            .filter(|k| self.found.contains_key(k))
            .filter_map(|k| Some((k, self.views.get(scan, self.keyframes[k], size).ok()?)))
            .collect();
        let (Some(Found { raw, proof }), Ok(view)) =
            (self.found.get(&keyframe), self.views.get(scan, frame, size))
        else {
            return self.nothing(scan, frame);
        };
        let asked: Vec<(&View, &[f32])> = witnesses
            .iter()
            .map(|(k, view)| (&**view, self.found[k].raw.rho.as_slice()))
            .collect();
        let verdicts = consistency::judge(&view, &raw.rho, &asked);
        let recipe = &self.recipe;
        let judged = verdicts.iter().zip(&raw.unique).zip(proof);
        let confidence = judged.map(|((verdict, &unique), &proof)| {
            let least = match verdict.agree {
                0 | 1 => recipe.least_confidence_alone,
                _ => recipe.least_confidence,
            };
            let confidence = verdict.confidence(unique);
            if confidence >= least && proof >= recipe.least_proof {
                confidence
            } else {
                0.0
            }
        });
        let confidence: Vec<f32> = confidence.collect();
        let kept = raw.rho.iter().zip(&confidence);
        DepthMap {
            frame,
            camera: view.camera,
            depth_m: kept
                .map(|(rho, &c)| if c > 0.0 { 1.0 / rho } else { 0.0 })
                .collect(),
            confidence,
            raw_depth_m: raw.rho.iter().map(|rho| 1.0 / rho).collect(),
        }
    }

    /// The map of a frame about which nothing is known.
    fn nothing(&self, scan: &Scan, frame: usize) -> DepthMap {
        let camera = view::fit(&scan.frames()[frame].color_camera, self.config.size);
        let unknown = vec![0.0; camera.width as usize * camera.height as usize];
        DepthMap {
            frame,
            camera,
            depth_m: unknown.clone(),
            confidence: unknown.clone(),
            raw_depth_m: unknown,
        }
    }

    /// Drops the depth of keyframes that no later one asks for.
    fn forget(&mut self) {
        let to_come = self.next..self.sources.len();
        let asked: HashSet<usize> = self.sources[to_come.clone()]
            .iter()
            .flatten()
            .copied()
            .collect();
        self.found
            .retain(|k, _| to_come.contains(k) || asked.contains(k));
    }
}

/// Pictures at the working size; those used longest ago give way.
#[derive(Default)]
struct Views {
    kept: HashMap<usize, (Rc<View>, u64)>,
    clock: u64,
}

impl Views {
    fn get(
        &mut self,
        scan: &Scan,
        frame: usize,
        size: (u32, u32),
    ) -> Result<Rc<View>, Box<Finding>> {
        self.clock += 1;
        if let Some((view, used)) = self.kept.get_mut(&frame) {
            *used = self.clock;
            return Ok(view.clone());
        }
        let image = scan
            .color(frame)
            .map_err(|error| Box::new(error.finding().clone()))?;
        let info = &scan.frames()[frame];
        let view = Rc::new(View::new(
            &image,
            view::fit(&info.color_camera, size),
            info.pose,
        ));
        if self.kept.len() >= VIEWS_KEPT
            && let Some((&oldest, _)) = self.kept.iter().min_by_key(|(_, (_, used))| *used)
        {
            self.kept.remove(&oldest);
        }
        self.kept.insert(frame, (view.clone(), self.clock));
        Ok(view)
    }
}
