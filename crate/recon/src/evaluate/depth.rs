//! How good one depth map is against what the sensor measured from the same place.

use super::EvaluateError;
use glam::DVec2;
use mesh::metrics::{self, Depth2d};
use scan::{Camera, Scan};
use serde::Serialize;

/// What the sensor says beyond this does not count, in metres: the same as in [`Depth2d`].
const FAR_M: f32 = 10.0;

/// Figures of one depth map, or of many.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthFigures {
    /// Errors where there is both a prediction and a measurement, per pixel of the sensor's picture; over many maps the
    /// mean of theirs.
    #[serde(flatten)]
    pub errors: Depth2d,
    /// Share of the pixels that the sensor measured, 0 to 1, that have a prediction. NaN where it measured none.
    pub coverage: f64,
    /// Pixels that the sensor measured, above 0 and below 10 m.
    pub measured: usize,
    /// How many of those have a prediction.
    pub predicted: usize,
    /// Depth maps behind these figures.
    pub maps: usize,
}

/// Compares a predicted depth map with the sensor's depth of the same frame.
///
/// `depth_m` holds metres along the optical axis, row by row, 0 = unknown, as `camera` sees them from the frame's pose. Each
/// pixel of the sensor's picture takes the prediction of the pixel nearest to its own ray: both cameras share the
/// pose, so that no depth is needed to find it. `None` for a frame without the sensor's depth.
///
/// # Errors
/// A map of another size than its camera, or a depth picture that cannot be decoded.
pub fn compare_depth(
    scan: &Scan,
    frame: usize,
    camera: &Camera,
    depth_m: &[f32],
) -> Result<Option<DepthFigures>, EvaluateError> {
    let expected = camera.width as usize * camera.height as usize;
    if depth_m.len() != expected {
        return Err(EvaluateError::MapSize {
            width: camera.width,
            height: camera.height,
            expected,
            found: depth_m.len(),
        });
    }
    let Some(truth) = scan.depth(frame)? else {
        return Ok(None);
    };
    let sensor = &scan.frames()[frame].depth_camera;
    let sampled = sample(sensor, camera, depth_m);
    let pairs = || sampled.iter().zip(&truth.depth_m);
    let measured = pairs().filter(|&(_, &g)| g > 0.0 && g < FAR_M);
    let predicted = measured.clone().filter(|&(&p, _)| p > 0.0).count();
    let measured = measured.count();
    let errors = metrics::depth_2d(&sampled, &truth.depth_m);
    Ok(errors.map(|errors| DepthFigures {
        errors,
        coverage: predicted as f64 / measured as f64,
        measured,
        predicted,
        maps: 1,
    }))
}

/// The figures of many maps: the mean of their errors, and the coverage of all their pixels together. `None` of none.
pub fn mean_depth(maps: &[DepthFigures]) -> Option<DepthFigures> {
    let errors: Vec<Depth2d> = maps.iter().map(|map| map.errors).collect();
    let measured = maps.iter().map(|map| map.measured).sum();
    let predicted = maps.iter().map(|map| map.predicted).sum();
    Some(DepthFigures {
        errors: metrics::depth::mean(&errors)?,
        coverage: predicted as f64 / measured as f64,
        measured,
        predicted,
        maps: maps.iter().map(|map| map.maps).sum(),
    })
}

/// What `camera`'s map says at each pixel of `at`'s picture; 0 outside of it.
fn sample(at: &Camera, camera: &Camera, depth_m: &[f32]) -> Vec<f32> {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let rows = (0..at.height).flat_map(|y| (0..at.width).map(move |x| (x, y)));
    rows.map(|(x, y)| {
        let ray = at.unproject(DVec2::new(f64::from(x), f64::from(y)), 1.0);
        let pixel = camera.project(ray).map(|pixel| (pixel + 0.5).floor());
        match pixel {
            Some(DVec2 { x, y }) if x >= 0.0 && y >= 0.0 && x < width && y < height => {
                depth_m[y as usize * camera.width as usize + x as usize]
            }
            _ => 0.0,
        }
    })
    .collect()
}
