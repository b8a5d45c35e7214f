//! 7-Scenes (Shotton et al., CVPR 2013): `frame-NNNNNN.color.png`, `.depth.png` in millimetres, `.pose.txt`
//! camera-to-world, all in one folder. Many RGB-D exports borrow the layout with a `camera-intrinsics.txt`, beside
//! the frames or one folder up, and depth registered to colour. The world is that of the first camera: up is unknown.

use glam::DMat3;

use crate::camera::Camera;
use crate::error::ScanError;
use crate::finding::{Finding, FindingLog, Severity};
use crate::image::DepthCode;

use super::folder::Folder;
use super::intrinsics::{self, Intrinsics};
use super::numbered::{self, FileTable, FrameFiles};
use super::{Draft, Likeness};

const INTRINSICS: &str = "camera-intrinsics.txt";

/// The Kinect of the original data set; it ships without calibration.
const ORIGINAL_SIZE: (u32, u32) = (640, 480);
const ORIGINAL_COLOR: [f64; 4] = [525.0, 525.0, 320.0, 240.0];
const ORIGINAL_DEPTH: [f64; 4] = [585.0, 585.0, 320.0, 240.0];

enum Kind {
    Color,
    Depth,
    Pose,
}

fn kind(name: &str) -> Option<(&str, Kind)> {
    let (rest, extension) = name.rsplit_once('.')?;
    let (stem, kind) = rest.rsplit_once('.')?;
    match (kind, extension) {
        ("color", "jpg" | "jpeg" | "png") => Some((stem, Kind::Color)),
        ("depth", "png") => Some((stem, Kind::Depth)),
        ("pose", "txt") => Some((stem, Kind::Pose)),
        _ => None,
    }
}

pub(super) fn likeness(folder: &Folder<'_>) -> Likeness {
    let (mut pictures, mut poses) = (false, false);
    for (_, kind) in folder.files().iter().filter_map(|name| kind(name)) {
        match kind {
            Kind::Pose => poses = true,
            Kind::Color | Kind::Depth => pictures = true,
        }
    }
    match (pictures, poses) {
        (true, true) => Likeness::Complete,
        (false, false) => Likeness::None,
        _ => Likeness::Partial,
    }
}

pub(super) fn draft(folder: &Folder<'_>, log: &mut FindingLog) -> Result<Draft, ScanError> {
    let mut table = FileTable::new();
    for name in folder.files() {
        if let Some((stem, kind)) = kind(name) {
            let files: &mut FrameFiles = table.entry(numbered::frame_key(stem)).or_default();
            *match kind {
                Kind::Color => &mut files.color,
                Kind::Depth => &mut files.depth,
                Kind::Pose => &mut files.pose,
            } = Some(folder.join(name));
        }
    }
    if table.values().all(|files| files.pose.is_none()) {
        let example = table.keys().next().map_or("frame-000000", |(_, stem)| stem);
        let file = folder.join(&format!("{example}.pose.txt"));
        return Err(numbered::no_poses(file, table.len()));
    }
    let cameras = cameras(folder, &table, log)?;
    Ok(Draft {
        frames: numbered::frames(folder, &table, cameras, false, log),
        depth_code: DepthCode::MILLIMETRES,
        up: None,
        scan_from_draft: DMat3::IDENTITY,
    })
}

fn cameras(
    folder: &Folder<'_>,
    table: &FileTable,
    log: &mut FindingLog,
) -> Result<(Camera, Camera), ScanError> {
    let color_size = folder.usual_size(numbered::paths(table, |f| f.color.as_ref()));
    let depth_size = folder.usual_size(numbered::paths(table, |f| f.depth.as_ref()));
    let color_or_depth = color_size.or(depth_size).unwrap_or(ORIGINAL_SIZE);
    let found = match intrinsics::find(folder, &[INTRINSICS])? {
        None => match folder.parent() {
            Some(parent) => intrinsics::find(&parent, &[INTRINSICS])?,
            None => None,
        },
        found => found,
    };
    if let Some(found) = found {
        let color = found.camera(color_or_depth, log);
        let depth = intrinsics::registered(&color, depth_size.unwrap_or(color_or_depth), log);
        return Ok((color, depth));
    }
    let is_original = is_sequence_name(folder.name())
        && [color_size, depth_size]
            .into_iter()
            .flatten()
            .all(|size| size == ORIGINAL_SIZE)
        && numbered::paths(table, |f| f.color.as_ref()).all(|path| path.ends_with(".png"));
    if !is_original {
        return Err(intrinsics::missing(&folder.join(INTRINSICS)));
    }
    log.add(
        Finding::new(Severity::Info, "published-calibration")
            .at(folder.join(INTRINSICS))
            .expected("a calibration file")
            .found("none, as in the original 7-Scenes data")
            .advice(
                "The published calibration is used (depth 585, colour 525 pixels). Poses are the depth camera's; \
                 the colour camera sits about 2.5 cm beside it, so colours are a few pixels off",
            ),
    );
    let camera = |values| Intrinsics::new(INTRINSICS, values).camera(ORIGINAL_SIZE, log);
    let [color, depth] = [ORIGINAL_COLOR, ORIGINAL_DEPTH].map(camera);
    Ok((color, depth))
}

/// `seq-01`, as the original data names its folders.
fn is_sequence_name(name: &str) -> bool {
    name.strip_prefix("seq-")
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
}
