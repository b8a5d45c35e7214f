//! Depth as the sensor measured it: decoded keyframe by keyframe.

use super::{Fusion, RunError, color};
use crate::{
    convert::depth_view,
    event::{Flow, Sink, Stage},
};
use scan::Scan;

/// Fuses the sensor's depth of every keyframe. One whose depth cannot be decoded is reported and left out.
pub(super) async fn fuse(
    scan: &Scan,
    keyframes: &[usize],
    fusion: &mut Fusion,
    sink: &mut impl Sink,
) -> Result<(), RunError> {
    sink.stage(Stage::Fusing, keyframes.len());
    for (done, &frame) in keyframes.iter().enumerate() {
        if sink.checkpoint().await == Flow::Stop {
            fusion.stopped = true;
            break;
        }
        match scan.depth(frame) {
            Ok(Some(depth)) => {
                let color = color(scan, frame, sink);
                let view = depth_view(&scan.frames()[frame], &depth, color.as_ref());
                fusion.take(&view, sink).await?;
            }
            Ok(None) => (),
            Err(error) => sink.finding(error.finding().clone()),
        }
        sink.progress(done + 1);
    }
    Ok(())
}
