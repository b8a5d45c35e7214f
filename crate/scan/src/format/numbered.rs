//! Layouts with one file for each picture and pose of a frame, named alike: reads the poses and tells which frames
//! lack what.

use std::collections::BTreeMap;

use crate::camera::Camera;
use crate::error::ScanError;
use crate::finding::{Finding, FindingLog, Severity};
use crate::frame::{Frame, ImageRef};
use crate::pose;

use super::folder::Folder;

/// Sorts `frame-2` before `frame-10`: the last number in the name, then the name.
pub(super) type FrameKey = (u64, String);

pub(super) fn frame_key(stem: &str) -> FrameKey {
    let digits: String = stem
        .chars()
        .rev()
        .skip_while(|c| !c.is_ascii_digit())
        .take_while(char::is_ascii_digit)
        .collect();
    let number = digits.chars().rev().collect::<String>().parse();
    (number.unwrap_or(0), stem.to_owned())
}

/// Paths of one frame's files.
#[derive(Debug, Default, Clone)]
pub(super) struct FrameFiles {
    pub color: Option<String>,
    pub depth: Option<String>,
    pub pose: Option<String>,
}

pub(super) type FileTable = BTreeMap<FrameKey, FrameFiles>;

/// The paths of one kind, in frame order.
pub(super) fn paths<'t>(
    table: &'t FileTable,
    kind: impl Fn(&'t FrameFiles) -> Option<&'t String>,
) -> impl Iterator<Item = &'t str> {
    table.values().filter_map(kind).map(String::as_str)
}

/// Reads the poses and leaves out frames that lack a picture or a usable pose, with findings.
///
/// `lost_is_normal`: the format writes infinite values where tracking was lost, so they are one finding, not many.
pub(super) fn frames(
    folder: &Folder<'_>,
    table: &FileTable,
    (color_camera, depth_camera): (Camera, Camera),
    lost_is_normal: bool,
    log: &mut FindingLog,
) -> Vec<Frame> {
    report_gaps(table, log);
    let mut lost: Vec<&str> = Vec::new();
    let mut frames = Vec::new();
    for ((_, name), files) in table {
        let Some(pose_path) = &files.pose else {
            continue;
        };
        if files.color.is_none() && files.depth.is_none() {
            continue;
        }
        let pose = folder
            .read_text(pose_path)
            .map_err(|error| pose::unreadable(pose_path, &error))
            .and_then(|text| pose::from_matrix_text(pose_path, &text));
        let pose = match pose {
            Ok(pose) => pose,
            Err(finding) if lost_is_normal && finding.code == pose::NOT_FINITE => {
                lost.push(pose_path);
                continue;
            }
            Err(finding) => {
                log.add(*finding);
                continue;
            }
        };
        let image = |path: &Option<String>| path.clone().map(|path| ImageRef { path });
        frames.push(Frame {
            name: name.clone(),
            pose,
            color: image(&files.color),
            depth: image(&files.depth),
            color_camera,
            depth_camera,
            timestamp_s: None,
        });
    }
    if let [first, ..] = lost.as_slice() {
        log.add(
            Finding::new(Severity::Info, "tracking-lost")
                .at(*first)
                .expected("finite poses")
                .found(format!("{} frames where tracking was lost", lost.len()))
                .advice("These frames are left out; nothing needs to be done")
                .frames(lost.len()),
        );
    }
    frames
}

/// One finding for each way in which the counts of pictures and poses differ.
fn report_gaps(table: &FileTable, log: &mut FindingLog) {
    let count = |has: fn(&FrameFiles) -> bool| table.values().filter(|files| has(files)).count();
    let poses = count(|f| f.pose.is_some());
    let colors = count(|f| f.color.is_some());
    let depths = count(|f| f.depth.is_some());
    let mut gap = |has: fn(&FrameFiles) -> Option<&String>,
                   lacks: fn(&FrameFiles) -> bool,
                   expected: String,
                   lack: &str,
                   advice: &str| {
        let odd: Vec<&String> = table
            .values()
            .filter(|f| lacks(f))
            .filter_map(has)
            .collect();
        if let [first, ..] = odd.as_slice() {
            log.add(
                Finding::new(Severity::Warning, "counts-differ")
                    .at(first.as_str())
                    .expected(expected)
                    .found(format!("{} without {lack}, this file first", odd.len()))
                    .advice(advice)
                    .frames(odd.len()),
            );
        }
    };
    gap(
        |f| f.color.as_ref().or(f.depth.as_ref()),
        |f| f.pose.is_none(),
        format!(
            "a pose for each frame ({colors} colour and {depths} depth pictures, {poses} poses)"
        ),
        "a pose",
        "Frames without a pose are left out; add the missing pose files",
    );
    gap(
        |f| f.pose.as_ref(),
        |f| f.color.is_none() && f.depth.is_none(),
        format!(
            "a picture for each pose ({poses} poses, {colors} colour and {depths} depth pictures)"
        ),
        "a picture",
        "Poses without a picture are left out; add the missing pictures",
    );
    if depths > 0 {
        gap(
            |f| f.color.as_ref(),
            |f| f.depth.is_none() && f.pose.is_some(),
            format!("depth for each colour picture ({colors} colour, {depths} depth)"),
            "depth",
            "These frames give colour only; add the missing depth pictures",
        );
    }
    if colors > 0 {
        gap(
            |f| f.depth.as_ref(),
            |f| f.color.is_none() && f.pose.is_some(),
            format!("colour for each depth picture ({depths} depth, {colors} colour)"),
            "colour",
            "These frames give depth only; add the missing colour pictures",
        );
    }
}

/// The error for a folder in which no frame has a pose.
pub(super) fn no_poses(file: String, pictures: usize) -> ScanError {
    ScanError::NoPoses(Box::new(
        Finding::new(Severity::Error, "no-poses")
            .at(file)
            .expected("a camera-to-world pose for each picture")
            .found(format!("{pictures} pictures and no pose"))
            .advice("Add one text file per frame with the 4x4 camera-to-world matrix in metres (x right, y down, z forward)"),
    ))
}
