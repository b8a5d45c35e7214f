//! Poses from text: a camera-to-world matrix or a quaternion with a translation, checked to be a rigid motion.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::finding::{Finding, Severity};
use crate::numbers::{NotANumber, Number, numbers};
use crate::source::SourceError;

/// Code of the finding for NaN and infinite values, which ScanNet writes for frames where tracking was lost.
pub(crate) const NOT_FINITE: &str = "pose-not-finite";

/// Largest accepted entry of |R^T R - I|.
const ROTATION_TOLERANCE: f64 = 1e-3;

const FRAME_LEFT_OUT: &str = "The frame is left out; correct its pose or remove the frame";

fn fault(code: &'static str, file: &str, line: u32) -> Finding {
    Finding::new(Severity::Error, code)
        .at(file)
        .line(line)
        .advice(FRAME_LEFT_OUT)
        .frames(1)
}

/// A pose file that is there but cannot be read.
pub(crate) fn unreadable(file: &str, error: &SourceError) -> Box<Finding> {
    let finding = Finding::new(Severity::Error, "pose-unreadable")
        .at(file)
        .expected("a file that can be read")
        .found(error.to_string())
        .advice(FRAME_LEFT_OUT)
        .frames(1);
    Box::new(finding)
}

/// A row-major 4x4 (or 3x4) camera-to-world matrix, translation in metres.
pub(crate) fn from_matrix_text(file: &str, text: &str) -> Result<DAffine3, Box<Finding>> {
    let expected = "a 4x4 camera-to-world matrix (16 numbers)";
    let values = numbers(text).map_err(|NotANumber { word, line }| {
        fault("pose-not-a-number", file, line)
            .expected(expected)
            .found(format!("the word \"{word}\""))
    })?;
    if values.len() != 16 && values.len() != 12 {
        let last_line = values.last().map_or(1, |number| number.line);
        let found = format!("{} numbers", values.len());
        return Err(fault("pose-wrong-count", file, last_line)
            .expected(expected)
            .found(found)
            .into());
    }
    check_finite(file, &values)?;
    check_last_row(file, &values)?;
    let value = |row: usize, column: usize| values[4 * row + column].value;
    let row = |r: usize| DVec3::new(value(r, 0), value(r, 1), value(r, 2));
    let rotation = DMat3::from_cols(row(0), row(1), row(2)).transpose();
    let translation = DVec3::new(value(0, 3), value(1, 3), value(2, 3));
    rigid(file, values[0].line, rotation, translation)
}

/// The fourth row, where there is one, must be 0 0 0 1.
fn check_last_row(file: &str, values: &[Number]) -> Result<(), Box<Finding>> {
    let last = [0.0, 0.0, 0.0, 1.0];
    let is_last = |mut numbers: [f64; 4]| {
        numbers.iter_mut().zip(last).for_each(|(n, l)| *n -= l);
        numbers.iter().all(|difference| difference.abs() <= 1e-6)
    };
    let Some(row) = values.get(12..16) else {
        return Ok(());
    };
    let row = [0, 1, 2, 3].map(|column| row[column].value);
    if is_last(row) {
        return Ok(());
    }
    let finding = fault("pose-last-row", file, values[12].line)
        .expected("the last row 0 0 0 1")
        .found(row.map(|value| value.to_string()).join(" "));
    let transposed = is_last([3, 7, 11, 15].map(|index| values[index].value));
    Err(Box::new(if transposed {
        finding.advice(
            "The matrix looks transposed: write it row by row, with the translation in the last column. \
             The frame is left out",
        )
    } else {
        finding
    }))
}

/// `tx ty tz qx qy qz qw`: camera centre in metres and the camera-to-world rotation as a quaternion of length 1.
pub(crate) fn from_quaternion(file: &str, values: &[Number; 7]) -> Result<DAffine3, Box<Finding>> {
    check_finite(file, values)?;
    let [tx, ty, tz, qx, qy, qz, qw] = values.map(|number| number.value);
    let quaternion = DQuat::from_xyzw(qx, qy, qz, qw);
    // Files carry four decimals, so the length is off by up to 1e-4; 1 % leaves room for coarser ones.
    if (quaternion.length() - 1.0).abs() > 1e-2 {
        return Err(fault("pose-no-rotation", file, values[0].line)
            .expected("a quaternion qx qy qz qw of length 1")
            .found(format!("length {:.4}", quaternion.length()))
            .into());
    }
    Ok(DAffine3::from_rotation_translation(
        quaternion.normalize(),
        DVec3::new(tx, ty, tz),
    ))
}

fn check_finite(file: &str, values: &[Number]) -> Result<(), Box<Finding>> {
    match values.iter().find(|number| !number.value.is_finite()) {
        Some(Number { value, line }) => Err(fault(NOT_FINITE, file, *line)
            .expected("finite numbers")
            .found(value.to_string())
            .into()),
        None => Ok(()),
    }
}

/// Accepts a proper rotation (|R^T R - I| <= 1e-3, det +1) and removes its rounding.
fn rigid(
    file: &str,
    line: u32,
    rotation: DMat3,
    translation: DVec3,
) -> Result<DAffine3, Box<Finding>> {
    let expected = "a rotation in the upper left 3x3 (orthonormal columns, determinant +1)";
    let gram = rotation.transpose() * rotation;
    let largest = |m: DMat3| {
        m.to_cols_array()
            .iter()
            .fold(0.0_f64, |most, entry| most.max(entry.abs()))
    };
    let error = largest(gram - DMat3::IDENTITY);
    if error > ROTATION_TOLERANCE {
        let scale = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
        let only_scaled =
            scale > 0.0 && largest(gram * scale.recip() - DMat3::IDENTITY) <= ROTATION_TOLERANCE;
        let finding = fault("pose-no-rotation", file, line).expected(expected);
        return Err(Box::new(if only_scaled {
            finding
                .found(format!("a rotation scaled by {:.4}", scale.sqrt()))
                .advice("Divide the 3x3 part by that scale and keep the translation in metres. The frame is left out")
        } else {
            finding.found(format!("|R^T R - I| = {error:.4}"))
        }));
    }
    if rotation.determinant() < 0.0 {
        return Err(fault("pose-mirrored", file, line)
            .expected(expected)
            .found("determinant -1, a mirror image")
            .advice("One camera axis has the wrong sign: poses need x right, y down, z forward. The frame is left out")
            .into());
    }
    Ok(DAffine3::from_rotation_translation(
        DQuat::from_mat3(&rotation).normalize(),
        translation,
    ))
}
