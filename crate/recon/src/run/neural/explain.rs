//! What went wrong, in words that say what was found and what to do.

use super::{RunError, levels::Fault, tiles::Tiling};
use glam::DVec3;
use scan::{Finding, GravitySource, Scan, Severity};

/// Keyframes that a finding names before it says how many more there are.
const NAMED: usize = 3;

/// No two keyframes see the same.
pub(super) fn no_overlap(scan: &Scan, keyframes: &[usize]) -> RunError {
    RunError::NoOverlap {
        keyframes: keyframes.len(),
        cameras: cameras(scan, keyframes),
    }
}

/// Keyframes that see what no other sees.
pub(super) fn alone(scan: &Scan, keyframes: &[usize], tiling: &Tiling) -> Option<Finding> {
    let alone: Vec<usize> = tiling.alone().collect();
    if alone.is_empty() {
        return None;
    }
    let name = |&keyframe: &usize| scan.frames()[keyframes[keyframe]].name.as_str();
    let names: Vec<&str> = alone.iter().take(NAMED).map(name).collect();
    let more = match alone.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some(Finding {
        severity: Severity::Warning,
        code: "no-overlap",
        file: None,
        line: None,
        expected: "keyframes that see what others see too".to_owned(),
        found: format!(
            "{} of {} that see nothing any other sees: {}{more}",
            alone.len(),
            keyframes.len(),
            names.join(", ")
        ),
        advice: "What only they show is guessed from one picture each. Check their poses, or scan with more overlap".to_owned(),
        frames_affected: alone.len(),
    })
}

/// A fault of the levels.
pub(super) fn fault(fault: Fault, scan: &Scan, keyframes: &[usize]) -> RunError {
    match fault {
        Fault::Run(error) => error,
        Fault::Nothing { level, sites } => RunError::NothingOccupied {
            sites,
            voxel_cm: (level.voxel_size_m() * 100.0).round() as u32,
            keyframes: keyframes.len(),
            cameras: cameras(scan, keyframes),
            up: up(scan),
        },
    }
}

/// The space that the cameras move in, which tells a wrong unit.
fn cameras(scan: &Scan, keyframes: &[usize]) -> String {
    let places = keyframes.iter().map(|&f| scan.frames()[f].pose.translation);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for place in places {
        (low, high) = (low.min(place), high.max(place));
    }
    let size = (high - low).max(DVec3::ZERO);
    format!("{:.1} x {:.1} x {:.1} m", size.x, size.y, size.z)
}

fn up(scan: &Scan) -> String {
    let gravity = scan.gravity();
    let turned = format!("{:.0} degrees from the files' Z", gravity.rotated_deg);
    match gravity.source {
        GravitySource::Format => format!("as the layout of the files says, {turned}"),
        GravitySource::Estimated => format!("estimated, {turned}"),
    }
}
