//! The scan itself: frames in canonical form, pictures decoded on demand.

use std::rc::Rc;

use glam::{DAffine3, DMat3};

use crate::camera::Camera;
use crate::error::{FrameError, ScanError};
use crate::finding::{Finding, FindingLog, Severity};
use crate::format::{self, Format, Recognised};
use crate::frame::{Frame, ImageRef};
use crate::gravity::{self, Gravity};
use crate::image::{self, ColorImage, DecodeFault, DepthCode, DepthImage};
use crate::source::Source;

/// A recognised scan: poses and cameras of every usable frame in memory, pictures in the source.
pub struct Scan {
    source: Rc<dyn Source>,
    name: String,
    format: Format,
    frames: Vec<Frame>,
    findings: Vec<Finding>,
    depth_code: DepthCode,
    gravity: Gravity,
    scan_from_canonical: DMat3,
}

/// Recognises a scan by its content, one or more folders down if need be, and reads its poses and calibration.
///
/// No picture is decoded but for about a dozen depth pictures of a scan whose format does not say where up is.
///
/// # Errors
/// When nothing can be made of it: no files, no known layout, no poses, no usable frame, no calibration.
pub fn open(source: Rc<dyn Source>) -> Result<Scan, ScanError> {
    let mut log = FindingLog::default();
    let Recognised {
        format,
        name,
        mut draft,
    } = format::recognise(source.as_ref(), &mut log)?;
    let gravity = match draft.up {
        Some(up) => gravity::of_format(&draft.frames, draft.scan_from_draft, up, &mut log),
        None => {
            let depth =
                |frame: &Frame| decode_depth(source.as_ref(), frame, draft.depth_code).ok()?;
            gravity::estimate(&draft.frames, depth, &mut log)
        }
    };
    let canonical_from_draft =
        gravity::to_z_up(draft.scan_from_draft.transpose() * gravity.up_in_scan);
    let turn = DAffine3::from_mat3(canonical_from_draft);
    for frame in &mut draft.frames {
        frame.pose = turn * frame.pose;
    }
    Ok(Scan {
        source,
        name,
        format,
        frames: draft.frames,
        findings: log.finish(),
        depth_code: draft.depth_code,
        gravity,
        scan_from_canonical: draft.scan_from_draft * canonical_from_draft.transpose(),
    })
}

impl Scan {
    /// What the scan is called: its folder's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The layout it was recognised as.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The usable frames, in time order.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// What was noticed when the scan was opened, worst first.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Whether any frame has depth.
    pub fn has_depth(&self) -> bool {
        self.frames.iter().any(|frame| frame.depth.is_some())
    }

    /// Whether any frame has colour.
    pub fn has_color(&self) -> bool {
        self.frames.iter().any(|frame| frame.color.is_some())
    }

    /// Where up is, and how that is known.
    pub fn gravity(&self) -> &Gravity {
        &self.gravity
    }

    /// The world of the user's own files from the canonical world: a rotation about the origin. For left-handed
    /// files (ICL-NUIM) it also mirrors (determinant -1), and triangles must then be turned round.
    pub fn scan_from_canonical(&self) -> DAffine3 {
        DAffine3::from_mat3(self.scan_from_canonical)
    }

    /// Decodes a frame's colour picture; nothing is kept.
    ///
    /// # Errors
    /// When there is none, or it is cut short, broken, or of another size than `color_camera`.
    pub fn color(&self, frame: usize) -> Result<ColorImage, FrameError> {
        let frame = self.frame(frame)?;
        let Some(ImageRef { path }) = &frame.color else {
            return Err(FrameError::Missing(Box::new(
                frame_finding("color-missing", &frame.name)
                    .expected("a colour picture")
                    .found("none"),
            )));
        };
        let image = decode(self.source.as_ref(), path, image::decode_color)?;
        check_size(path, (image.width, image.height), &frame.color_camera)?;
        Ok(image)
    }

    /// Decodes a frame's depth picture; nothing is kept. `None` for a frame without depth.
    ///
    /// # Errors
    /// When it is cut short, broken, or of another size than `depth_camera`.
    pub fn depth(&self, frame: usize) -> Result<Option<DepthImage>, FrameError> {
        decode_depth(self.source.as_ref(), self.frame(frame)?, self.depth_code)
    }

    pub(crate) fn depth_units_per_m(&self) -> f32 {
        self.depth_code.units_per_m
    }

    fn frame(&self, index: usize) -> Result<&Frame, FrameError> {
        self.frames.get(index).ok_or_else(|| {
            FrameError::Missing(Box::new(
                frame_finding("frame-missing", &self.name)
                    .expected(format!("a frame index below {}", self.frames.len()))
                    .found(index.to_string()),
            ))
        })
    }
}

fn frame_finding(code: &'static str, file: &str) -> Finding {
    Finding::new(Severity::Error, code)
        .at(file)
        .advice("The picture is left out; copy or export it again")
        .frames(1)
}

fn decode_depth(
    source: &dyn Source,
    frame: &Frame,
    code: DepthCode,
) -> Result<Option<DepthImage>, FrameError> {
    let Some(ImageRef { path }) = &frame.depth else {
        return Ok(None);
    };
    let image = decode(source, path, |bytes| image::decode_depth(bytes, code))?;
    check_size(path, (image.width, image.height), &frame.depth_camera)?;
    Ok(Some(image))
}

fn decode<T>(
    source: &dyn Source,
    path: &str,
    decoder: impl Fn(&[u8]) -> Result<T, DecodeFault>,
) -> Result<T, FrameError> {
    let bytes = source.read(path).map_err(|error| {
        FrameError::Unreadable(Box::new(
            frame_finding("image-unreadable", path)
                .expected("a file that can be read")
                .found(error.to_string()),
        ))
    })?;
    decoder(&bytes).map_err(|DecodeFault { expected, found }| {
        FrameError::Undecodable(Box::new(
            frame_finding("image-broken", path)
                .expected(expected)
                .found(found),
        ))
    })
}

fn check_size(path: &str, (width, height): (u32, u32), camera: &Camera) -> Result<(), FrameError> {
    if (width, height) == (camera.width, camera.height) {
        return Ok(());
    }
    Err(FrameError::WrongSize(Box::new(
        frame_finding("image-size", path)
            .expected(format!(
                "{}x{} pixels, as most of its kind",
                camera.width, camera.height
            ))
            .found(format!("{width}x{height}"))
            .advice("The picture is left out; export it in the size of the others"),
    )))
}
