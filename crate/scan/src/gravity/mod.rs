//! Which way is up. Meshes, cameras and the network all want world Z up; some formats promise it, others start in
//! the first camera's frame. There the cameras give a guess (people hold them level and upright), and the floor,
//! ceiling, tables and walls seen by depth give the precise answer.

mod direction;
mod eigen;
mod patches;

use glam::{DMat3, DQuat, DVec3};
use serde::Serialize;

use crate::finding::{Finding, FindingLog, Severity};
use crate::frame::{Frame, mean_camera_up};
use crate::image::DepthImage;

/// How the up direction is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GravitySource {
    /// The format fixes it.
    Format,
    /// Estimated from the cameras and, where there is depth, the room's planes.
    Estimated,
}

/// The up direction of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Gravity {
    /// How it is known.
    pub source: GravitySource,
    /// Unit vector in the world of the user's files.
    pub up_in_scan: DVec3,
    /// Angle between that and the files' +Z, in degrees: how far the canonical world is turned.
    pub rotated_deg: f64,
    /// Angle between the cameras' guess and the room's planes, in degrees; `None` when no planes were used.
    pub planes_from_cameras_deg: Option<f64>,
}

/// Depth pictures looked at to find the room's planes.
const DEPTH_PICTURES: usize = 16;

/// Cosine of the angle between the cameras' mean up and world up below which a format's promise is doubted.
const DOUBTFUL_UP: f64 = 0.5;

/// The shortest rotation that brings `up` to +Z.
pub(crate) fn to_z_up(up: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(up.normalize(), DVec3::Z))
}

fn gravity(source: GravitySource, up_in_scan: DVec3) -> Gravity {
    Gravity {
        source,
        up_in_scan,
        rotated_deg: up_in_scan.angle_between(DVec3::Z).to_degrees(),
        planes_from_cameras_deg: None,
    }
}

/// Gravity as the format promises it (`up`, in the frames' world), checked against the cameras.
pub(crate) fn of_format(
    frames: &[Frame],
    scan_from_draft: DMat3,
    up: DVec3,
    log: &mut FindingLog,
) -> Gravity {
    let agreement = mean_camera_up(frames).dot(up);
    if agreement < DOUBTFUL_UP {
        log.add(
            Finding::new(Severity::Warning, "gravity-doubtful")
                .expected("cameras held upright in the format's world (mean up at least 0.5 along it)")
                .found(format!("{agreement:.2}"))
                .advice("Check that poses are camera-to-world with x right, y down, z forward, and that the world is gravity aligned")
                .frames(frames.len()),
        );
    }
    gravity(GravitySource::Format, scan_from_draft * up)
}

/// Gravity of a scan whose format does not give it. `depth` decodes a frame's depth picture, if it can.
pub(crate) fn estimate(
    frames: &[Frame],
    depth: impl Fn(&Frame) -> Option<DepthImage>,
    log: &mut FindingLog,
) -> Gravity {
    let guess = of_cameras(frames);
    let with_depth: Vec<&Frame> = frames.iter().filter(|f| f.depth.is_some()).collect();
    let count = with_depth.len().min(DEPTH_PICTURES);
    let spread = (0..count).map(|i| with_depth[(2 * i + 1) * with_depth.len() / (2 * count)]);
    let patches = patches::of_frames(spread.filter_map(|frame| Some((frame, depth(frame)?))));
    let right: Vec<DVec3> = frames.iter().map(|f| f.pose.matrix3.x_axis).collect();
    match direction::refine(guess, &right, &patches) {
        Some(up) => Gravity {
            planes_from_cameras_deg: Some(up.angle_between(guess).to_degrees()),
            ..gravity(GravitySource::Estimated, up)
        },
        None => {
            let found = if with_depth.is_empty() {
                "no depth"
            } else {
                "neither a level surface nor walls facing two ways in a sample of the depth pictures"
            };
            log.add(
                Finding::new(Severity::Warning, "gravity-from-cameras")
                    .expected("a floor, tables or walls to find the up direction, which this format does not give")
                    .found(found)
                    .advice("Up is taken from how the cameras were held and may be tilted by some degrees")
                    .frames(frames.len()),
            );
            gravity(GravitySource::Estimated, guess)
        }
    }
}

/// The up direction from the cameras alone: perpendicular to their x axes (cameras are rarely rolled, but often
/// pitched) and, as far as those leave it open, along their mean image-up.
fn of_cameras(frames: &[Frame]) -> DVec3 {
    const MEAN_UP_WEIGHT: f64 = 0.05;
    let mean_up = mean_camera_up(frames).normalize_or(DVec3::Z);
    let spread_of_right: DMat3 = frames
        .iter()
        .map(|frame| outer(frame.pose.matrix3.x_axis))
        .fold(DMat3::ZERO, |sum, m| sum + m)
        * (frames.len().max(1) as f64).recip();
    let up = eigen::smallest(spread_of_right - outer(mean_up) * MEAN_UP_WEIGHT);
    if up.dot(mean_up) < 0.0 { -up } else { up }
}

/// v v^T
fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}
