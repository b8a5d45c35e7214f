//! ScanNet (Dai et al., CVPR 2017) as its exporter writes it: `color/N.jpg`, `depth/N.png` in millimetres,
//! `pose/N.txt` camera-to-world with -inf where tracking was lost, `intrinsic/intrinsic_{color,depth}.txt`. Z is up.

use glam::{DMat3, DVec3};

use crate::camera::Camera;
use crate::error::ScanError;
use crate::finding::{Finding, FindingLog, Severity};
use crate::image::DepthCode;

use super::folder::Folder;
use super::intrinsics;
use super::numbered::{self, FileTable, FrameFiles};
use super::{Draft, Likeness};

const COLOR_INTRINSICS: [&str; 2] = ["intrinsic/intrinsic_color.txt", "intrinsic_color.txt"];
const DEPTH_INTRINSICS: [&str; 2] = ["intrinsic/intrinsic_depth.txt", "intrinsic_depth.txt"];

/// Folder, file endings and the place of a path in the table.
type Kind = (
    &'static str,
    &'static [&'static str],
    fn(&mut FrameFiles) -> &mut Option<String>,
);

const KINDS: [Kind; 3] = [
    ("color", &["jpg", "jpeg", "png"], |files| &mut files.color),
    ("depth", &["png"], |files| &mut files.depth),
    ("pose", &["txt"], |files| &mut files.pose),
];

/// Stems and names of a folder's files of a kind.
fn stems<'a>(
    folder: &Folder<'a>,
    (name, extensions, _): Kind,
) -> impl Iterator<Item = (&'a str, &'a str)> {
    folder.files_in(name).iter().filter_map(move |file| {
        let (stem, extension) = file.rsplit_once('.')?;
        extensions.contains(&extension).then_some((stem, *file))
    })
}

pub(super) fn likeness(folder: &Folder<'_>) -> Likeness {
    let [color, depth, pose] = KINDS.map(|kind| stems(folder, kind).next().is_some());
    let calibrated = folder.has(COLOR_INTRINSICS[0]) || folder.has(DEPTH_INTRINSICS[0]);
    match (color || depth, pose) {
        (true, true) => Likeness::Complete,
        (true, false) if calibrated || (color && depth) => Likeness::Partial,
        _ => Likeness::None,
    }
}

pub(super) fn draft(folder: &Folder<'_>, log: &mut FindingLog) -> Result<Draft, ScanError> {
    let mut table = FileTable::new();
    for kind in KINDS {
        for (stem, file) in stems(folder, kind) {
            let files = table.entry(numbered::frame_key(stem)).or_default();
            *kind.2(files) = Some(folder.join(&format!("{}/{file}", kind.0)));
        }
    }
    if table.values().all(|files| files.pose.is_none()) {
        let example = table.keys().next().map_or("0", |(_, stem)| stem);
        let file = folder.join(&format!("pose/{example}.txt"));
        return Err(numbered::no_poses(file, table.len()));
    }
    let cameras = cameras(folder, &table, log)?;
    Ok(Draft {
        frames: numbered::frames(folder, &table, cameras, true, log),
        depth_code: DepthCode::MILLIMETRES,
        up: Some(DVec3::Z),
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
    // A scan without one kind of picture still gets both cameras.
    let (color_size, depth_size) = match (color_size, depth_size) {
        (Some(color), Some(depth)) => (color, depth),
        (Some(size), None) | (None, Some(size)) => (size, size),
        (None, None) => ((640, 480), (640, 480)),
    };
    let color = intrinsics::find(folder, &COLOR_INTRINSICS)?;
    let depth = intrinsics::find(folder, &DEPTH_INTRINSICS)?;
    match (color, depth) {
        (Some(color), Some(depth)) => {
            Ok((color.camera(color_size, log), depth.camera(depth_size, log)))
        }
        (Some(color), None) => {
            let camera = color.camera(color_size, log);
            if depth_size != color_size {
                log.add(derived(folder.join(DEPTH_INTRINSICS[0]), "colour"));
            }
            Ok((camera, intrinsics::registered(&camera, depth_size, log)))
        }
        (None, Some(depth)) => {
            let camera = depth.camera(depth_size, log);
            if depth_size != color_size {
                log.add(derived(folder.join(COLOR_INTRINSICS[0]), "depth"));
            }
            Ok((camera.scaled(color_size.0, color_size.1), camera))
        }
        (None, None) => Err(intrinsics::missing(&folder.join(COLOR_INTRINSICS[0]))),
    }
}

fn derived(file: String, from: &str) -> Finding {
    Finding::new(Severity::Warning, "intrinsics-derived")
        .at(file)
        .expected("a calibration matrix")
        .found("no such file")
        .advice(format!(
            "The {from} camera's calibration is scaled to its size; add the file for exact results"
        ))
}
