//! The layouts a scan can have on disk. Each knows its files, its depth unit, its calibration and its world; what
//! they hand on is the same [`Draft`]. No other crate knows a format's name.

mod folder;
mod intrinsics;
mod numbered;
mod scannet;
mod seven_scenes;
mod timed;
mod tum;

use std::fmt;

use glam::{DMat3, DVec3};
use serde::Serialize;

use crate::error::ScanError;
use crate::finding::{Finding, FindingLog, Severity};
use crate::frame::Frame;
use crate::image::DepthCode;
use crate::source::Source;

use self::folder::{Folder, Listing};

/// The layout a scan was recognised as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum Format {
    /// `frame-NNNNNN.{color,depth}.png` with `.pose.txt`; also the layout of many small RGB-D exports.
    #[serde(rename = "7-Scenes")]
    SevenScenes,
    /// An exported ScanNet folder: `color/`, `depth/`, `pose/`, `intrinsic/`.
    ScanNet,
    /// `rgb.txt`, `depth.txt`, `groundtruth.txt`; also ICL-NUIM with its `associations.txt`.
    #[serde(rename = "TUM RGB-D")]
    TumRgbd,
}

impl Format {
    const ALL: [Format; 3] = [Format::SevenScenes, Format::ScanNet, Format::TumRgbd];

    fn likeness(self, folder: &Folder<'_>) -> Likeness {
        match self {
            Format::SevenScenes => seven_scenes::likeness(folder),
            Format::ScanNet => scannet::likeness(folder),
            Format::TumRgbd => tum::likeness(folder),
        }
    }

    fn draft(self, folder: &Folder<'_>, log: &mut FindingLog) -> Result<Draft, ScanError> {
        match self {
            Format::SevenScenes => seven_scenes::draft(folder, log),
            Format::ScanNet => scannet::draft(folder, log),
            Format::TumRgbd => tum::draft(folder, log),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Format::SevenScenes => "7-Scenes",
            Format::ScanNet => "ScanNet",
            Format::TumRgbd => "TUM RGB-D",
        })
    }
}

/// How well a folder fits a format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Likeness {
    None,
    /// Some of its files are there: enough to say what is missing.
    Partial,
    /// Pictures and poses are there.
    Complete,
}

/// A scan before its gravity is known.
pub(crate) struct Draft {
    /// Usable frames in time order; poses in a right-handed world, OpenCV camera axes, metres.
    pub frames: Vec<Frame>,
    pub depth_code: DepthCode,
    /// The up direction in the frames' world, where the format fixes it.
    pub up: Option<DVec3>,
    /// The world of the user's files from the frames' world: the identity, or a mirror where the files' is left-handed.
    pub scan_from_draft: DMat3,
}

/// What [`recognise`] found.
pub(crate) struct Recognised {
    pub format: Format,
    pub name: String,
    pub draft: Draft,
}

/// Finds the scan in a source, itself or in one of its folders, and reads its poses and calibration.
pub(crate) fn recognise(
    source: &dyn Source,
    log: &mut FindingLog,
) -> Result<Recognised, ScanError> {
    let listing = Listing::new(source);
    if listing.is_empty() {
        let finding = Finding::new(Severity::Error, "empty")
            .expected("a folder with pictures and poses")
            .found("no files")
            .advice("Choose the folder that holds the scan's pictures and poses");
        let finding = match source.name() {
            "" => finding,
            name => finding.at(name),
        };
        return Err(ScanError::Empty(Box::new(finding)));
    }
    let candidates: Vec<(Likeness, Folder<'_>, Format)> = listing
        .folders()
        .flat_map(|folder| Format::ALL.map(|format| (format.likeness(&folder), folder, format)))
        .filter(|(likeness, _, _)| *likeness > Likeness::None)
        .collect();
    // Folders come outermost first, so the first of the best is the one to take.
    let best = candidates.iter().map(|(likeness, _, _)| *likeness).max();
    let mut fitting = candidates
        .iter()
        .filter(|(likeness, _, _)| Some(*likeness) == best);
    let Some((_, folder, format)) = fitting.next() else {
        return Err(ScanError::Unrecognised(Box::new(unrecognised(&listing))));
    };
    let others: Vec<&str> = fitting.map(|(_, other, _)| other.path()).collect();
    if let [other, ..] = others.as_slice() {
        log.add(
            Finding::new(Severity::Info, "several-scans")
                .at(folder.path())
                .expected("one scan")
                .found(format!("{} ({other} is another)", others.len() + 1))
                .advice("The first is used; choose a single folder for another"),
        );
    }
    let draft = format.draft(folder, log)?;
    if draft.frames.is_empty() {
        return Err(no_usable_frames(*format, folder, log));
    }
    Ok(Recognised {
        format: *format,
        name: folder.name().to_owned(),
        draft,
    })
}

fn unrecognised(listing: &Listing<'_>) -> Finding {
    let mut found = listing.sample_paths(4).join(", ");
    if listing.len() > 4 {
        found = format!("{} files such as {found}", listing.len());
    }
    Finding::new(Severity::Error, "unrecognised")
        .expected(
            "a scan as 7-Scenes (frame-000000.color.jpg, .depth.png, .pose.txt), ScanNet (color/, depth/, pose/, \
             intrinsic/) or TUM RGB-D (rgb.txt, depth.txt, groundtruth.txt)",
        )
        .found(found)
        .advice("Choose the folder that holds the scan, or export it in one of these layouts")
}

fn no_usable_frames(format: Format, folder: &Folder<'_>, log: &mut FindingLog) -> ScanError {
    let findings = std::mem::take(log).finish();
    let errors = findings.iter().filter(|f| f.severity == Severity::Error);
    let finding = match errors.clone().next() {
        Some(first) => Finding {
            found: format!(
                "{} (and no other frame is usable: {} errors)",
                first.found,
                errors.count()
            ),
            advice: format!(
                "No frame has both a picture and a usable pose. {}",
                first.advice
            ),
            ..first.clone()
        },
        None => Finding::new(Severity::Error, "no-usable-frames")
            .at(folder.path())
            .expected(format!("{format} frames with a picture and a pose"))
            .found(match findings.first() {
                Some(first) => format!("none: {}", first.found),
                None => "none".to_owned(),
            })
            .advice("Check that pictures and poses carry the same names or times"),
    };
    ScanError::NoUsableFrames(Box::new(finding))
}
