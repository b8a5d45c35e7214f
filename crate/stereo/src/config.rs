//! How stereo is done: what a caller may choose.

use crate::StereoError;

/// How depth is made from posed colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoConfig {
    /// Pictures are scaled down to fit into this width and height, in pixels; never up.
    pub size: (u32, u32),
    /// Inverse-depth planes of the sweep.
    pub planes: usize,
    /// Depth of the nearest plane, in metres.
    pub near_m: f32,
    /// Depth of the farthest plane, in metres.
    pub far_m: f32,
    /// Source views a keyframe is compared with, at most.
    pub sources: usize,
}

impl Default for StereoConfig {
    /// 320x240, 128 planes from 0.4 to 6 m, 12 source views.
    fn default() -> Self {
        Self {
            size: (320, 240),
            planes: 128,
            near_m: 0.4,
            far_m: 6.0,
            sources: 12,
        }
    }
}

impl StereoConfig {
    /// Says whether the numbers make sense.
    ///
    /// # Errors
    /// [`StereoError::Setting`] with what would make sense.
    pub fn check(&self) -> Result<(), StereoError> {
        let fault = |what, found: String| Err(StereoError::Setting { what, found });
        let (width, height) = self.size;
        if !(32..=2048).contains(&width) || !(32..=2048).contains(&height) {
            let found = format!("{width}x{height}");
            return fault("a working size between 32 and 2048 pixels a side", found);
        }
        if !(16..=256).contains(&self.planes) {
            return fault("between 16 and 256 depth planes", self.planes.to_string());
        }
        if !(self.near_m >= 0.05 && self.near_m < self.far_m && self.far_m <= 100.0) {
            let found = format!("{} m to {} m", self.near_m, self.far_m);
            return fault(
                "depths from at least 0.05 m to at most 100 m, the nearer first",
                found,
            );
        }
        if !(1..=32).contains(&self.sources) {
            return fault("between 1 and 32 source views", self.sources.to_string());
        }
        Ok(())
    }
}
