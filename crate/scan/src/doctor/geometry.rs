//! Is the camera's path that of a person with a camera in a room, in metres?

use glam::DVec3;

use crate::finding::{Finding, FindingLog, Severity};
use crate::frame::{Frame, mean_camera_up};
use crate::gravity::Gravity;

use super::median;

/// The path in figures.
pub(super) struct Path {
    pub length_m: f64,
    pub extent_m: f64,
    pub height_spread_m: f64,
    pub keyframe_baseline_m: Option<f64>,
    pub camera_tilt_deg: f64,
}

/// A camera does not move this far between two frames of one recording.
const JUMP_M: f64 = 1.0;
const FEW_KEYFRAMES: usize = 10;

pub(super) fn examine(
    frames: &[Frame],
    keys: &[usize],
    gravity: &Gravity,
    log: &mut FindingLog,
) -> Path {
    let path = measure(frames, keys);
    let mut warn = |code, expected: &str, found: String, advice: &str| {
        log.add(
            Finding::new(Severity::Warning, code)
                .expected(expected)
                .found(found)
                .advice(advice)
                .frames(frames.len()),
        );
    };
    if path.extent_m > 50.0 {
        warn(
            "scale-doubtful",
            "camera positions within 50 m",
            format!("{:.1} m", path.extent_m),
            "Poses must be in metres: are these millimetres, or does one pose lie far off?",
        );
    } else if path.extent_m < 0.5 && frames.len() > 1 {
        warn(
            "scale-doubtful",
            "camera positions at least 0.5 m apart",
            format!("{:.3} m", path.extent_m),
            "Poses must be in metres, and the camera has to move for a surface to be seen from several sides",
        );
    } else if path.height_spread_m > 1.5 {
        warn(
            "height-spread",
            "camera heights within 1.5 m",
            format!("{:.2} m", path.height_spread_m),
            "Check the up direction; on stairs or a ladder this is normal",
        );
    }
    if let Some(baseline_m) = path.keyframe_baseline_m.filter(|b| *b > 0.3) {
        warn(
            "frames-far-apart",
            "neighbouring keyframes 1 to 30 cm apart",
            format!("{:.0} cm (median)", baseline_m * 100.0),
            "Move more slowly or keep more frames of the recording",
        );
    }
    if keys.len() < FEW_KEYFRAMES {
        warn(
            "few-keyframes",
            "at least 10 clearly different views",
            format!("{}", keys.len()),
            "The surface will have holes: record the room from more places",
        );
    }
    if path.camera_tilt_deg > 60.0 {
        warn(
            "gravity-doubtful",
            "cameras held upright (mean image-up within 60 degrees of world up)",
            format!("{:.0} degrees", path.camera_tilt_deg),
            "Check that poses are camera-to-world with x right, y down, z forward",
        );
    } else if let Some(off_deg) = gravity.planes_from_cameras_deg.filter(|deg| *deg > 30.0) {
        warn(
            "gravity-doubtful",
            "the room's level surfaces within 30 degrees of how the cameras were held",
            format!("{off_deg:.0} degrees"),
            "Check that the floor lies flat in the picture",
        );
    }
    jumps(frames, log);
    path
}

fn measure(frames: &[Frame], keys: &[usize]) -> Path {
    let centre = |frame: &Frame| frame.pose.translation;
    let length_m = frames
        .windows(2)
        .map(|pair| centre(&pair[0]).distance(centre(&pair[1])))
        .sum();
    let low = frames.iter().map(centre).fold(DVec3::INFINITY, DVec3::min);
    let high = frames
        .iter()
        .map(centre)
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    let baselines = keys
        .windows(2)
        .map(|pair| centre(&frames[pair[0]]).distance(centre(&frames[pair[1]])))
        .collect();
    let up = mean_camera_up(frames).normalize_or(DVec3::Z);
    Path {
        length_m,
        extent_m: low.distance(high),
        height_spread_m: high.z - low.z,
        keyframe_baseline_m: median(baselines),
        camera_tilt_deg: up.angle_between(DVec3::Z).to_degrees(),
    }
}

/// Steps that no camera makes: tracking was lost there and came back elsewhere.
fn jumps(frames: &[Frame], log: &mut FindingLog) {
    let step_m = |pair: &[Frame]| pair[0].pose.translation.distance(pair[1].pose.translation);
    let usual_m = median(frames.windows(2).map(step_m).collect()).unwrap_or(0.0);
    let limit_m = JUMP_M.max(10.0 * usual_m);
    let far: Vec<&[Frame]> = frames
        .windows(2)
        .filter(|pair| step_m(pair) > limit_m)
        .collect();
    if let [first, ..] = far.as_slice() {
        log.add(
            Finding::new(Severity::Warning, "pose-jump")
                .at(&first[1].name)
                .expected(format!("steps of less than {limit_m:.1} m between frames"))
                .found(format!("{:.1} m, and {} such steps in all", step_m(first), far.len()))
                .advice("If the parts do not fit together in the result, tracking was lost here: use the part before or after")
                .frames(far.len()),
        );
    }
}
