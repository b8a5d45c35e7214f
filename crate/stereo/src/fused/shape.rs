//! The sizes of a keyframe's work, and what fits on a device.

use super::smooth::{MOST_LANES, lanes};
use crate::{StereoError, sweep::Spacing, view::View};

/// The largest binding that WebGPU guarantees.
pub(super) const BINDING_BYTES: usize = 128 << 20;

/// The largest number of planes that a picture of this size can be swept with: their sums fill one binding.
pub fn most_planes(width: usize, height: usize) -> usize {
    let pixels = (width * height).max(1);
    let step = 4 * MOST_LANES;
    BINDING_BYTES / (4 * pixels) / step * step
}

/// The largest number of sources of this size that a picture of the same size can be compared with.
pub fn most_sources(width: usize, height: usize, radius: usize) -> usize {
    BINDING_BYTES / (8 * (width + 2 * radius) * (height + 2 * radius)).max(1)
}

/// The sizes of a keyframe's work.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) planes: usize,
    /// Inverse depth of the first plane (1/m), or its offset from the base.
    pub(super) first_rho: f32,
    /// From one plane to the next, in 1/m.
    pub(super) step: f32,
}

impl Shape {
    pub(super) fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Lanes of a line of the smoothing.
    pub(super) fn lanes(&self) -> usize {
        lanes(self.planes)
    }

    /// Planes with those that only fill up: groups of four divide evenly among the lanes.
    pub(super) fn padded(&self) -> usize {
        self.planes.next_multiple_of(4 * self.lanes())
    }
}

/// The sizes, if the kernels can do them.
pub(super) fn shape(
    reference: &View,
    sources: &[(usize, &View)],
    offsets: &[f32],
    radius: usize,
) -> Result<Shape, StereoError> {
    let fault = |what, found| Err(StereoError::Setting { what, found });
    let size = |view: &View| (view.camera.width as usize, view.camera.height as usize);
    let (width, height) = size(reference);
    let planes = offsets.len();
    if planes == 0 || planes > most_planes(width, height) {
        let most = most_planes(width, height);
        let found = format!("{planes} at {width}x{height}, where at most {most} fit");
        return fault("as many depth planes as fit in a buffer of 128 MiB", found);
    }
    let largest = sources
        .iter()
        .map(|(_, view)| size(view))
        .chain([(width, height)]);
    let largest = largest.fold((0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    let most = most_sources(largest.0, largest.1, radius);
    if sources.is_empty() || sources.len() > most {
        let found = format!(
            "{} at {width}x{height}, where at most {most} fit",
            sources.len()
        );
        return fault(
            "from one source view to as many as fit in a buffer of 128 MiB",
            found,
        );
    }
    let odd = sources.iter().find(|(_, view)| {
        let (width, height) = size(view);
        width < 2 || height < 2 || view.gray.len() != width * height
    });
    if let Some((_, view)) = odd {
        let (width, height) = size(view);
        let found = format!("{width}x{height} with {} values", view.gray.len());
        return fault(
            "source views of at least 2x2 pixels, a grey value each",
            found,
        );
    }
    let Spacing {
        first: first_rho,
        step,
    } = Spacing::of(offsets);
    let even =
        |(i, rho): (usize, &f32)| (rho - first_rho - step * i as f32).abs() <= 0.01 * step.abs();
    if !offsets.iter().enumerate().all(even) {
        let found = format!("{offsets:?}");
        return fault("evenly spaced offsets of inverse depth", found);
    }
    Ok(Shape {
        width,
        height,
        planes,
        first_rho,
        step,
    })
}
