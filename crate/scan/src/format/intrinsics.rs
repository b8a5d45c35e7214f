//! Calibration files: a 3x3 or 4x4 matrix, or `fx fy cx cy`, and the cameras made of them.

use crate::camera::Camera;
use crate::error::ScanError;
use crate::finding::{Finding, FindingLog, Severity};
use crate::numbers::{NotANumber, Number, numbers};

use super::folder::Folder;

/// Focal lengths and principal point in pixels, not yet tied to a picture size.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Intrinsics {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    /// Where they come from, for messages.
    pub origin: String,
}

const EXPECTED: &str = "a 3x3 calibration matrix in pixels: fx 0 cx, 0 fy cy, 0 0 1";
const ADVICE: &str =
    "Write the colour camera's focal lengths fx, fy and principal point cx, cy there, in pixels";

fn error(finding: Finding) -> ScanError {
    ScanError::Intrinsics(Box::new(finding.expected(EXPECTED).advice(ADVICE)))
}

/// The first of `names` that the folder has, read.
pub(super) fn find(folder: &Folder<'_>, names: &[&str]) -> Result<Option<Intrinsics>, ScanError> {
    let Some(path) = names
        .iter()
        .find(|name| folder.has(name))
        .map(|name| folder.join(name))
    else {
        return Ok(None);
    };
    let text = folder.read_text(&path)?;
    parse(&path, &text).map(Some)
}

/// The error for a folder without the file.
pub(super) fn missing(path: &str) -> ScanError {
    error(
        Finding::new(Severity::Error, "intrinsics-missing")
            .at(path)
            .found("no such file"),
    )
}

fn parse(path: &str, text: &str) -> Result<Intrinsics, ScanError> {
    let finding = |code, line| Finding::new(Severity::Error, code).at(path).line(line);
    let values = numbers(text).map_err(|NotANumber { word, line }| {
        error(finding("intrinsics-not-a-number", line).found(format!("the word \"{word}\"")))
    })?;
    let [fx, fy, cx, cy] = match values.len() {
        4 => [0, 1, 2, 3],
        9 => [0, 4, 2, 5],
        16 => [0, 5, 2, 6],
        count => {
            let line = values.last().map_or(1, |number| number.line);
            return Err(error(
                finding("intrinsics-wrong-count", line).found(format!("{count} numbers")),
            ));
        }
    }
    .map(|index: usize| values[index]);
    if let Some(Number { value, line }) = values.iter().find(|number| !number.value.is_finite()) {
        return Err(error(
            finding("intrinsics-not-finite", *line).found(value.to_string()),
        ));
    }
    for (name, Number { value, line }) in [("fx", fx), ("fy", fy)] {
        if value <= 0.0 {
            return Err(error(
                finding("intrinsics-not-positive", line).found(format!("{name} = {value}")),
            ));
        }
    }
    Ok(Intrinsics {
        fx: fx.value,
        fy: fy.value,
        cx: cx.value,
        cy: cy.value,
        origin: path.to_owned(),
    })
}

impl Intrinsics {
    pub(super) fn new(origin: &str, [fx, fy, cx, cy]: [f64; 4]) -> Self {
        Intrinsics {
            fx,
            fy,
            cx,
            cy,
            origin: origin.to_owned(),
        }
    }

    /// The camera of pictures of a size; tells when the calibration hardly belongs to it.
    pub(super) fn camera(&self, (width, height): (u32, u32), log: &mut FindingLog) -> Camera {
        let (w, h) = (f64::from(width), f64::from(height));
        let doubt = Finding::new(Severity::Warning, "intrinsics-doubtful")
            .at(&self.origin)
            .advice(
                "The calibration seems to belong to another picture size: scale it to this one",
            );
        let inside = |at: f64, side: f64| (0.0..=side - 1.0).contains(&at);
        let half_view_deg = |side: f64, focal: f64| (side / (2.0 * focal)).atan().to_degrees();
        let view_deg = 2.0 * half_view_deg(w, self.fx);
        if !inside(self.cx, w) || !inside(self.cy, h) {
            log.add(
                doubt
                    .expected(format!("a principal point inside {width}x{height} pixels"))
                    .found(format!("{}, {}", self.cx, self.cy)),
            );
        } else if !(15.0..=150.0).contains(&view_deg) {
            log.add(
                doubt
                    .expected("a field of view between 15 and 150 degrees")
                    .found(format!("{view_deg:.0} degrees (fx = {})", self.fx)),
            );
        }
        Camera {
            width,
            height,
            fx: self.fx,
            fy: self.fy,
            cx: self.cx,
            cy: self.cy,
        }
    }
}

/// The depth camera of a scan whose depth is registered to colour: the colour camera at the depth's size.
pub(super) fn registered(
    color: &Camera,
    (width, height): (u32, u32),
    log: &mut FindingLog,
) -> Camera {
    let aspect = |w: u32, h: u32| f64::from(w) / f64::from(h);
    let ratio = aspect(width, height) / aspect(color.width, color.height);
    if (ratio - 1.0).abs() > 0.02 {
        log.add(
            Finding::new(Severity::Warning, "depth-aspect")
                .expected(format!(
                    "depth of the shape of the {}x{} colour pictures",
                    color.width, color.height
                ))
                .found(format!("{width}x{height} pixels"))
                .advice("Export depth registered to colour, or give the depth camera its own calibration"),
        );
    }
    color.scaled(width, height)
}
