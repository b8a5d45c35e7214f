//! The doctor: looks into a scan before any work is done on it, and says in plain words what is wrong with it.

mod agreement;
mod geometry;

use serde::Serialize;

use crate::camera::Camera;
use crate::finding::{Finding, FindingLog, Severity};
use crate::format::Format;
use crate::gravity::GravitySource;
use crate::image::DepthImage;
use crate::keyframe::{KeyframeRule, keyframes};
use crate::scan::Scan;

/// How many pictures to decode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Every frame.
    All,
    /// At most this many frames, evenly spread.
    Sample(usize),
}

/// What the doctor found. Lengths in metres, angles in degrees, calibrations in pixels.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The scan's name.
    pub name: String,
    /// The layout.
    pub format: Format,
    /// Usable frames.
    pub frames: usize,
    /// Keyframes by the default rule.
    pub keyframes: usize,
    /// Frames with a colour picture.
    pub color_frames: usize,
    /// Frames with a depth picture.
    pub depth_frames: usize,
    /// Frames whose pictures were decoded.
    pub frames_examined: usize,
    /// Colour camera: picture size and calibration.
    pub color_camera: Option<Camera>,
    /// Depth camera: picture size and calibration.
    pub depth_camera: Option<Camera>,
    /// Mean share of depth pixels with a measurement, over the examined frames.
    pub depth_measured_share: Option<f64>,
    /// Median of the examined frames' median depth.
    pub depth_median_m: Option<f64>,
    /// Share of depth pixels that agree within 5 % with what a later keyframe, some 40 cm on, sees there.
    pub depth_agreement_share: Option<f64>,
    /// Length of the camera's path.
    pub path_length_m: f64,
    /// Diagonal of the box around the camera centres.
    pub path_extent_m: f64,
    /// Difference between the highest and the lowest camera centre.
    pub height_spread_m: f64,
    /// Median distance between neighbouring keyframes; `None` with a single one.
    pub keyframe_baseline_m: Option<f64>,
    /// Where up is.
    pub gravity: GravityReport,
    /// Everything noticed, worst first.
    pub findings: Vec<Finding>,
}

/// The gravity part of a [`Report`].
#[derive(Debug, Clone, Serialize)]
pub struct GravityReport {
    /// How it is known.
    pub source: GravitySource,
    /// Unit vector in the world of the user's files.
    pub up_in_scan: [f64; 3],
    /// Angle between that and the files' +Z.
    pub rotated_deg: f64,
    /// Angle between the cameras' guess and the room's planes, where both are known.
    pub planes_from_cameras_deg: Option<f64>,
    /// Angle between the cameras' mean image-up and world up.
    pub camera_tilt_deg: f64,
}

/// Rooms are seen from these distances.
const USUAL_DEPTH_M: std::ops::Range<f64> = 0.45..7.0;
/// A depth picture with less than this is called empty.
const EMPTY_SHARE: f64 = 0.05;

/// Examines a scan: decodes pictures of all or a sample of its frames, and checks poses, scale and gravity.
pub fn examine(scan: &Scan, depth_of_look: Look) -> Report {
    let frames = scan.frames();
    let mut log = FindingLog::default();
    log.extend(scan.findings().iter().cloned());

    let examined = chosen(frames.len(), depth_of_look);
    let pictures = look_at_pictures(scan, &examined, &mut log);
    let keys = keyframes(frames, KeyframeRule::default());
    let path = geometry::examine(frames, &keys, scan.gravity(), &mut log);
    let depth_agreement_share = agreement::examine(scan, &keys, depth_of_look, &mut log);

    let with = |has: fn(&&crate::Frame) -> bool| frames.iter().filter(has);
    let depth_median_m = median(pictures.depth_medians_m);
    if let Some(median_m) = depth_median_m.filter(|m| !USUAL_DEPTH_M.contains(m)) {
        log.add(
            Finding::new(Severity::Warning, "depth-unit-doubtful")
                .expected(format!(
                    "a median depth between {} and {} m",
                    USUAL_DEPTH_M.start, USUAL_DEPTH_M.end
                ))
                .found(format!("{median_m:.2} m"))
                .advice(format!(
                    "In this layout a metre is stored as {}: check that depth was exported so",
                    scan.depth_units_per_m()
                ))
                .frames(pictures.measured_shares.len()),
        );
    }
    let gravity = scan.gravity();
    Report {
        name: scan.name().to_owned(),
        format: scan.format(),
        frames: frames.len(),
        keyframes: keys.len(),
        color_frames: with(|f| f.color.is_some()).count(),
        depth_frames: with(|f| f.depth.is_some()).count(),
        frames_examined: examined.len(),
        color_camera: with(|f| f.color.is_some()).next().map(|f| f.color_camera),
        depth_camera: with(|f| f.depth.is_some()).next().map(|f| f.depth_camera),
        depth_measured_share: mean(&pictures.measured_shares),
        depth_median_m,
        depth_agreement_share,
        path_length_m: path.length_m,
        path_extent_m: path.extent_m,
        height_spread_m: path.height_spread_m,
        keyframe_baseline_m: path.keyframe_baseline_m,
        gravity: GravityReport {
            source: gravity.source,
            up_in_scan: gravity.up_in_scan.to_array(),
            rotated_deg: gravity.rotated_deg,
            planes_from_cameras_deg: gravity.planes_from_cameras_deg,
            camera_tilt_deg: path.camera_tilt_deg,
        },
        findings: log.finish(),
    }
}

/// Evenly spread indices below `count`.
fn chosen(count: usize, look: Look) -> Vec<usize> {
    match look {
        Look::Sample(wanted) if wanted < count => (0..wanted)
            .map(|i| (2 * i + 1) * count / (2 * wanted))
            .collect(),
        _ => (0..count).collect(),
    }
}

#[derive(Default)]
struct Pictures {
    measured_shares: Vec<f64>,
    depth_medians_m: Vec<f64>,
}

fn look_at_pictures(scan: &Scan, examined: &[usize], log: &mut FindingLog) -> Pictures {
    let mut seen = Pictures::default();
    for &index in examined {
        let frame = &scan.frames()[index];
        if frame.color.is_some()
            && let Err(error) = scan.color(index)
        {
            log.add(error.finding().clone());
        }
        match scan.depth(index) {
            Ok(None) => {}
            Ok(Some(depth)) => {
                let (share, median_m) = measured(&depth);
                seen.measured_shares.push(share);
                seen.depth_medians_m.extend(median_m);
                if let Some(image) = frame.depth.as_ref().filter(|_| share < EMPTY_SHARE) {
                    log.add(
                        Finding::new(Severity::Warning, "depth-empty")
                            .at(&image.path)
                            .expected(format!("a measurement in at least {:.0} % of the pixels", EMPTY_SHARE * 100.0))
                            .found(format!("{:.1} %", share * 100.0))
                            .advice("This frame adds almost nothing; the sensor was covered, too close or too far")
                            .frames(1),
                    );
                }
            }
            Err(error) => log.add(error.finding().clone()),
        }
    }
    seen
}

/// Share of pixels with a measurement, and their median depth.
fn measured(depth: &DepthImage) -> (f64, Option<f64>) {
    let valid: Vec<f64> = depth
        .depth_m
        .iter()
        .filter(|depth_m| **depth_m > 0.0)
        .map(|depth_m| f64::from(*depth_m))
        .collect();
    let share = valid.len() as f64 / depth.depth_m.len().max(1) as f64;
    (share, median(valid))
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}
