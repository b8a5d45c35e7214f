//! Which frames are worth the work: neighbours that see almost the same are skipped.

use crate::frame::Frame;

/// A frame is kept when it moved or turned more than this since the last kept one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyframeRule {
    /// Movement of the camera centre, in metres.
    pub translation_m: f64,
    /// Angle between the optical axes, in degrees.
    pub rotation_deg: f64,
}

impl Default for KeyframeRule {
    /// 10 cm or 15 degrees, the rule of VoRTX and NeuralRecon.
    fn default() -> Self {
        KeyframeRule {
            translation_m: 0.1,
            rotation_deg: 15.0,
        }
    }
}

/// Indices of the keyframes, ascending. The first frame is always kept; each later one is compared with the last
/// kept frame only.
pub fn keyframes(frames: &[Frame], rule: KeyframeRule) -> Vec<usize> {
    let cos_limit = rule.rotation_deg.to_radians().cos();
    let mut kept: Vec<usize> = Vec::new();
    for (index, frame) in frames.iter().enumerate() {
        let new_view = kept.last().is_none_or(|&last| {
            let before = &frames[last].pose;
            let moved_m = frame.pose.translation.distance(before.translation);
            let cos_turned = frame.pose.matrix3.z_axis.dot(before.matrix3.z_axis);
            moved_m > rule.translation_m || cos_turned < cos_limit
        });
        if new_view {
            kept.push(index);
        }
    }
    kept
}
