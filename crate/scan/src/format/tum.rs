//! TUM RGB-D (Sturm et al., IROS 2012): `rgb.txt` and `depth.txt` list pictures by time, `groundtruth.txt` holds
//! `time tx ty tz qx qy qz qw` camera-to-world, depth is in 1/5000 m and registered to colour, Z is up.
//!
//! ICL-NUIM (Handa et al., ICRA 2014) uses the same files but for `associations.txt` and `*.gt.freiburg`. Its world
//! is left-handed with Y up and its cameras have y up. Mirroring world and camera at y = 0 (S c2w S with
//! S = diag(1, -1, 1)) gives OpenCV cameras with a positive focal length in a right-handed world where -Y is up; the
//! mirror is undone when something is exported.

use std::collections::HashSet;

use glam::{DAffine3, DMat3, DVec3};

use crate::camera::Camera;
use crate::error::ScanError;
use crate::finding::{Finding, FindingLog, Severity};
use crate::frame::{Frame, ImageRef};
use crate::image::DepthCode;

use super::folder::Folder;
use super::intrinsics::{self, Intrinsics};
use super::timed::{self, MAX_DIFFERENCE_S, Timed};
use super::{Draft, Likeness};

const COLOR_LIST: &str = "rgb.txt";
const DEPTH_LIST: &str = "depth.txt";
const TRAJECTORY: &str = "groundtruth.txt";
const ASSOCIATIONS: [&str; 2] = ["associations.txt", "association.txt"];
const ICL_TRAJECTORY: &str = ".gt.freiburg";
const INTRINSICS: [&str; 2] = ["camera-intrinsics.txt", "intrinsics.txt"];

const SIZE: (u32, u32) = (640, 480);
const ICL_CAMERA: [f64; 4] = [481.2, 480.0, 319.5, 239.5];
const DEFAULT_CAMERA: [f64; 4] = [525.0, 525.0, 319.5, 239.5];

/// The data set's three Kinects: words in the folder's name, colour calibration, whether the lens distorts.
const CAMERAS: [([&str; 2], [f64; 4], bool); 3] = [
    (["freiburg1", "fr1"], [517.3, 516.5, 318.6, 255.3], true),
    (["freiburg2", "fr2"], [520.9, 521.0, 325.1, 249.7], true),
    (["freiburg3", "fr3"], [535.4, 539.2, 320.1, 247.6], false),
];

fn icl_trajectory<'a>(folder: &Folder<'a>) -> Option<&'a str> {
    let mut files = folder.files().iter();
    files.find(|name| name.ends_with(ICL_TRAJECTORY)).copied()
}

fn associations(folder: &Folder<'_>) -> Option<&'static str> {
    ASSOCIATIONS.into_iter().find(|name| folder.has(name))
}

pub(super) fn likeness(folder: &Folder<'_>) -> Likeness {
    let pictures =
        folder.has(COLOR_LIST) || folder.has(DEPTH_LIST) || associations(folder).is_some();
    let poses = folder.has(TRAJECTORY) || icl_trajectory(folder).is_some();
    match (pictures, poses) {
        (true, true) => Likeness::Complete,
        (true, false) | (false, true) => Likeness::Partial,
        (false, false) => Likeness::None,
    }
}

/// Path, and the line it is listed on.
type Pictures = Vec<Timed<(String, u32)>>;
type Picture<'a> = &'a Timed<(String, u32)>;

pub(super) fn draft(folder: &Folder<'_>, log: &mut FindingLog) -> Result<Draft, ScanError> {
    let (colors, depths) = picture_lists(folder, log)?;
    let (mut trajectory, mirrored) = trajectory(folder, colors.len().max(depths.len()), log)?;
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    if mirrored {
        for entry in &mut trajectory {
            let turned = DAffine3::from_mat3(mirror) * entry.value * DAffine3::from_mat3(mirror);
            entry.value = turned;
        }
    }
    let cameras = cameras(folder, &colors, &depths, mirrored, log)?;
    let (up, scan_from_draft) = if mirrored {
        (DVec3::NEG_Y, mirror)
    } else {
        (DVec3::Z, DMat3::IDENTITY)
    };
    Ok(Draft {
        frames: frames(folder, &colors, &depths, &trajectory, cameras, log),
        depth_code: DepthCode {
            units_per_m: 5000.0,
            invalid: None,
        },
        up: Some(up),
        scan_from_draft,
    })
}

/// Colour and depth pictures in time order, with paths inside the source; files that are not there are told.
fn picture_lists(
    folder: &Folder<'_>,
    log: &mut FindingLog,
) -> Result<(Pictures, Pictures), ScanError> {
    let has_lists = folder.has(COLOR_LIST) || folder.has(DEPTH_LIST);
    let mut columns = [(COLOR_LIST, 0), (DEPTH_LIST, 0)];
    if let Some(file) = associations(folder).filter(|_| !has_lists) {
        // ICL-NUIM writes depth first, the data set's own tool colour first: the folder's name in the path tells.
        let text = folder.read_text(&folder.join(file))?;
        let mut first = timed::pictures(file, &text, 0, &mut FindingLog::default()).into_iter();
        let depth_first = first.next().is_some_and(|p| p.value.0.starts_with("depth"));
        columns = [
            (file, usize::from(depth_first)),
            (file, usize::from(!depth_first)),
        ];
    }
    let [color, depth] = columns.map(|(name, column)| picture_list(folder, name, column, log));
    Ok((color?, depth?))
}

fn picture_list(
    folder: &Folder<'_>,
    name: &str,
    column: usize,
    log: &mut FindingLog,
) -> Result<Pictures, ScanError> {
    if !folder.has(name) {
        return Ok(Vec::new());
    }
    let path = folder.join(name);
    let text = folder.read_text(&path)?;
    let mut list = timed::pictures(&path, &text, column, log);
    list.retain_mut(|picture| {
        let (picture_path, line) = &picture.value;
        let here = folder.has(picture_path);
        if !here {
            log.add(
                Finding::new(Severity::Warning, "picture-missing")
                    .at(&path)
                    .line(*line)
                    .expected(format!("the picture {picture_path}"))
                    .found("no such file")
                    .advice("It is left out; copy the whole scan")
                    .frames(1),
            );
        }
        picture.value.0 = folder.join(picture_path);
        here
    });
    Ok(list)
}

/// The trajectory, and whether it is in ICL-NUIM's left-handed world.
fn trajectory(
    folder: &Folder<'_>,
    pictures: usize,
    log: &mut FindingLog,
) -> Result<(Vec<Timed<DAffine3>>, bool), ScanError> {
    let (name, mirrored) = match icl_trajectory(folder) {
        Some(name) if !folder.has(TRAJECTORY) => (name, true),
        _ => (TRAJECTORY, false),
    };
    let path = folder.join(name);
    let text = if folder.has(name) {
        folder.read_text(&path)?
    } else {
        String::new()
    };
    let trajectory = timed::trajectory(&path, &text, log);
    if trajectory.is_empty() {
        let found = match (folder.has(name), log.first_error_in(&path)) {
            (false, _) => format!("no such file ({pictures} pictures)"),
            (true, None) => "no pose in it".to_owned(),
            (true, Some(first)) => format!("no usable pose in it; the first fault: {first}"),
        };
        return Err(ScanError::NoPoses(Box::new(
            Finding::new(Severity::Error, "no-poses")
                .at(path)
                .expected("a camera-to-world pose a line: time tx ty tz qx qy qz qw")
                .found(found)
                .advice("Add the camera's trajectory in metres and seconds"),
        )));
    }
    Ok((trajectory, mirrored))
}

fn cameras(
    folder: &Folder<'_>,
    colors: &Pictures,
    depths: &Pictures,
    icl: bool,
    log: &mut FindingLog,
) -> Result<(Camera, Camera), ScanError> {
    let paths = |list: &'_ Pictures| folder.usual_size(list.iter().map(|p| p.value.0.as_str()));
    let (color_size, depth_size) = (paths(colors), paths(depths));
    let size = color_size.or(depth_size).unwrap_or(SIZE);
    let color = match intrinsics::find(folder, &INTRINSICS)? {
        Some(found) => found.camera(size, log),
        None => {
            let (origin, values) = published(folder, icl, log);
            let camera = Intrinsics::new(&origin, values).camera(SIZE, log);
            camera.scaled(size.0, size.1)
        }
    };
    let depth = intrinsics::registered(&color, depth_size.unwrap_or(size), log);
    Ok((color, depth))
}

/// The calibration of the data set's cameras, by the folder's name.
fn published(folder: &Folder<'_>, icl: bool, log: &mut FindingLog) -> (String, [f64; 4]) {
    let name = folder.name().to_lowercase();
    let file = folder.join(INTRINSICS[0]);
    let finding = |severity, code| {
        Finding::new(severity, code)
            .at(&file)
            .expected("a calibration file")
    };
    if icl {
        return (file, ICL_CAMERA);
    }
    let known = CAMERAS
        .into_iter()
        .find(|(words, _, _)| words.iter().any(|word| name.contains(word)));
    let Some((_, values, distorts)) = known else {
        log.add(
            finding(Severity::Warning, "calibration-assumed")
                .found(format!("none, and \"{name}\" names no camera of the data set"))
                .advice("The Kinect's usual 525, 525, 319.5, 239.5 is used; add the file with fx 0 cx, 0 fy cy, 0 0 1"),
        );
        return (file, DEFAULT_CAMERA);
    };
    let lens = if distorts {
        "; the lens distortion of this camera is not undone"
    } else {
        ""
    };
    log.add(
        finding(Severity::Info, "published-calibration")
            .found("none, as in the original data")
            .advice(format!("The published calibration of {name} is used{lens}")),
    );
    (file, values)
}

/// Frames at the times of the colour pictures, or of depth where there is no colour.
fn frames(
    folder: &Folder<'_>,
    colors: &Pictures,
    depths: &Pictures,
    trajectory: &[Timed<DAffine3>],
    (color_camera, depth_camera): (Camera, Camera),
    log: &mut FindingLog,
) -> Vec<Frame> {
    let pairs: Vec<(Option<Picture<'_>>, Option<Picture<'_>>)> = if colors.is_empty() {
        depths.iter().map(|depth| (None, Some(depth))).collect()
    } else {
        let partners = timed::partners(colors, depths);
        report_unpaired(colors, depths, &partners, log);
        let partner = |at: Option<usize>| at.map(|index| &depths[index]);
        let pair = |(color, at)| (Some(color), partner(at));
        colors.iter().zip(partners).map(pair).collect()
    };
    let image = |picture: Picture<'_>| ImageRef {
        path: picture.value.0.clone(),
    };
    let mut frames = Vec::new();
    let mut unposed = Vec::new();
    let mut apart_s: f64 = 0.0;
    for (color, depth) in pairs {
        // Depth carries the geometry, so the pose is taken at its moment.
        let (Some(main), Some(moment)) = (color.or(depth), depth.or(color)) else {
            continue;
        };
        apart_s = apart_s.max((moment.time_s - main.time_s).abs());
        let Some(pose) = timed::pose_at(trajectory, moment.time_s) else {
            unposed.push(main);
            continue;
        };
        let name = main.value.0.rsplit('/').next().unwrap_or_default();
        frames.push(Frame {
            name: name
                .rsplit_once('.')
                .map_or(name, |(stem, _)| stem)
                .to_owned(),
            pose,
            color: color.map(image),
            depth: depth.map(image),
            color_camera,
            depth_camera,
            timestamp_s: Some(main.time_s),
        });
    }
    report_gap(
        &unposed,
        "a pose",
        "These frames are left out; check that both files use the same clock",
        log,
    );
    log.add(
        Finding::new(Severity::Info, "matched-by-time")
            .at(folder.path())
            .expected("pictures and poses at the same moments")
            .found(format!(
                "colour and depth up to {:.1} ms apart",
                apart_s * 1000.0
            ))
            .advice("Poses are interpolated at the depth picture's moment"),
    );
    frames
}

/// Colour pictures without depth, and depth pictures without colour.
fn report_unpaired(
    colors: &Pictures,
    depths: &Pictures,
    partners: &[Option<usize>],
    log: &mut FindingLog,
) {
    if depths.is_empty() {
        return;
    }
    let alone = |(color, partner): (_, &Option<usize>)| partner.is_none().then_some(color);
    let colors: Vec<Picture<'_>> = colors.iter().zip(partners).filter_map(alone).collect();
    report_gap(&colors, "depth", "These frames give colour only", log);

    let used: HashSet<usize> = partners.iter().flatten().copied().collect();
    let unused = |(index, depth)| (!used.contains(&index)).then_some(depth);
    let depths: Vec<Picture<'_>> = depths.iter().enumerate().filter_map(unused).collect();
    report_gap(&depths, "colour", "These depth pictures are left out", log);
}

fn report_gap(odd: &[Picture<'_>], lack: &str, advice: &str, log: &mut FindingLog) {
    if let [first, ..] = odd {
        let limit_ms = MAX_DIFFERENCE_S * 1000.0;
        log.add(
            Finding::new(Severity::Warning, "counts-differ")
                .at(&first.value.0)
                .expected(format!("{lack} within {limit_ms:.0} ms of each picture"))
                .found(format!("{} without, this one first", odd.len()))
                .advice(advice)
                .frames(odd.len()),
        );
    }
}
