//! What a lattice point rests on, as one number: how many frames measured a surface within the truncation distance of it,
//! and the sum of their confidences. Both are sums, so that the order of frames makes no difference, and integers below
//! 2^24, which f32 holds exactly.

use mesh::soup::Evidence;

/// Added for a frame.
pub(crate) const FRAME: f32 = 65536.0;
/// Added for a frame of confidence 1, beside [`FRAME`].
pub(crate) const SURE: f32 = 511.0;
/// Where a point has as many frames as this stands for, no more are counted: sums of [`SURE`] stay below [`FRAME`].
pub(crate) const FULL: f32 = 127.0 * FRAME;

/// As it stands in the field.
pub(crate) fn packed(evidence: Evidence) -> f32 {
    let frames = evidence.views() as f32;
    // A confidence of 0 is not the same as none.
    let sure = evidence
        .confidence()
        .map_or(0.0, |c| (c * SURE * frames).round().max(1.0));
    frames * FRAME + sure
}
