//! Do poses and depth belong together? A surface seen by one keyframe must lie where a later one sees it. Where it
//! does not, the usual mistakes (inverse poses, other camera axes, another depth unit) are tried, and the one that
//! makes them agree is named.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::camera::Camera;
use crate::finding::{Finding, FindingLog, Severity};
use crate::image::DepthImage;
use crate::scan::Scan;

use super::Look;

/// Pairs of keyframes compared.
const PAIRS: usize = 12;
/// Distance and turn of the camera between the two.
const PARTNER_M: f64 = 0.4;
const PARTNER_TURN_DEG: f64 = 20.0;
/// Relative difference in depth within which two views agree.
const TOLERANCE: f64 = 0.05;
/// Good scans reach 0.99; wrong poses stay between 0.2 and 0.6.
const DOUBTFUL_SHARE: f64 = 0.75;
/// An explanation must do clearly better than the poses as they are.
const CONVINCING_GAIN: f64 = 0.15;
const GRID: u32 = 40;

struct View {
    /// In the world of the user's files: a wrong convention there is not one in the canonical world.
    pose: DAffine3,
    camera: Camera,
    depth: DepthImage,
}

/// Share of comparable pixels of neighbouring keyframes that agree; `None` without enough overlapping depth.
pub(super) fn examine(
    scan: &Scan,
    keys: &[usize],
    look: Look,
    log: &mut FindingLog,
) -> Option<f64> {
    let pairs = match look {
        Look::All => PAIRS,
        Look::Sample(frames) => PAIRS.min(frames / 2),
    };
    let view = |key: usize| {
        let depth = scan.depth(key).ok()??;
        let frame = &scan.frames()[key];
        Some(View {
            pose: scan.scan_from_canonical() * frame.pose,
            camera: frame.depth_camera,
            depth,
        })
    };
    let pairs: Vec<(View, View)> = super::chosen(keys.len(), Look::Sample(pairs))
        .into_iter()
        .filter_map(|at| Some((view(keys[at])?, view(partner(scan, &keys[at..])?)?)))
        .collect();
    let share = |change: &dyn Fn(DAffine3) -> DAffine3, depth_factor: f64| {
        let mut tally = Tally::default();
        for (from, to) in &pairs {
            tally.compare(from, to, change, depth_factor);
            tally.compare(to, from, change, depth_factor);
        }
        tally.share()
    };
    let as_is = share(&|pose| pose, 1.0)?;
    if as_is < DOUBTFUL_SHARE {
        let flip = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)));
        let unit = |wrong: &str| {
            let units_per_m = scan.depth_units_per_m();
            format!("Depth seems to be {wrong}: this layout stores a metre as {units_per_m}")
        };
        let explanations: [(String, f64); 5] = [
            (
                "The poses seem to be world-to-camera: store their inverses".to_owned(),
                share(&|pose| pose.inverse(), 1.0).unwrap_or(0.0),
            ),
            (
                "The poses seem to use OpenGL camera axes (y up, z backward): negate their second and third columns".to_owned(),
                share(&|pose| pose * flip, 1.0).unwrap_or(0.0),
            ),
            (
                "The poses seem to be world-to-camera with OpenGL axes: invert them, then negate the second and third columns".to_owned(),
                share(&|pose| pose.inverse() * flip, 1.0).unwrap_or(0.0),
            ),
            (
                unit("5 times too large"),
                share(&|pose| pose, 0.2).unwrap_or(0.0),
            ),
            (
                unit("5 times too small"),
                share(&|pose| pose, 5.0).unwrap_or(0.0),
            ),
        ];
        let best = explanations
            .into_iter()
            .filter(|(_, share)| *share > as_is + CONVINCING_GAIN)
            .max_by(|a, b| a.1.total_cmp(&b.1));
        log.add(
            Finding::new(Severity::Warning, "poses-disagree")
                .expected("views whose depths agree where they overlap")
                .found(format!("agreement in {:.0} % of the pixels", as_is * 100.0))
                .advice(match best {
                    Some((advice, share)) => {
                        format!("{advice} (agreement would be {:.0} %)", share * 100.0)
                    }
                    None => "Check poses, calibration and depth unit: the surface will be smeared"
                        .to_owned(),
                })
                .frames(scan.frames().len()),
        );
    }
    Some(as_is)
}

/// The first later keyframe that stands far enough from the first one for wrong poses to show, and still sees much
/// of the same.
fn partner(scan: &Scan, keys: &[usize]) -> Option<usize> {
    let (first, later) = keys.split_first()?;
    let from = &scan.frames()[*first].pose;
    let far_enough = |key: &&usize| {
        let to = &scan.frames()[**key].pose;
        let turned = from.matrix3.z_axis.angle_between(to.matrix3.z_axis);
        from.translation.distance(to.translation) > PARTNER_M
            || turned.to_degrees() > PARTNER_TURN_DEG
    };
    later.iter().find(far_enough).copied()
}

#[derive(Default)]
struct Tally {
    compared: usize,
    agree: usize,
}

impl Tally {
    fn share(&self) -> Option<f64> {
        (self.compared >= 200).then(|| self.agree as f64 / self.compared as f64)
    }

    /// Carries a grid of pixels of one view into the other. What lies in front of a pixel's surface there
    /// contradicts it; what lies behind may be hidden, so it does not count.
    fn compare(
        &mut self,
        from: &View,
        to: &View,
        change: &dyn Fn(DAffine3) -> DAffine3,
        depth_factor: f64,
    ) {
        let to_from_from = change(to.pose).inverse() * change(from.pose);
        let (width, height) = (from.depth.width, from.depth.height);
        let step = (width / GRID).max(1) as usize;
        for v in (0..height).step_by(step) {
            for u in (0..width).step_by(step) {
                let Some(depth_m) = depth_at(&from.depth, u.into(), v.into(), depth_factor) else {
                    continue;
                };
                let pixel = DVec2::new(u.into(), v.into());
                let point = from.camera.unproject(pixel, depth_m);
                let point = to_from_from.transform_point3(point);
                let seen = to.camera.project(point);
                let Some(seen_m) = seen.and_then(|pixel| {
                    depth_at(&to.depth, pixel.x.round(), pixel.y.round(), depth_factor)
                }) else {
                    continue;
                };
                let behind = point.z > seen_m * (1.0 + TOLERANCE);
                if !behind {
                    self.compared += 1;
                    self.agree += usize::from(point.z > seen_m * (1.0 - TOLERANCE));
                }
            }
        }
    }
}

fn depth_at(depth: &DepthImage, u: f64, v: f64, factor: f64) -> Option<f64> {
    let inside = u >= 0.0 && v >= 0.0 && u < f64::from(depth.width) && v < f64::from(depth.height);
    let index = || v as usize * depth.width as usize + u as usize;
    let depth_m = inside.then(|| f64::from(depth.depth_m[index()]) * factor)?;
    (depth_m > 0.0).then_some(depth_m)
}
