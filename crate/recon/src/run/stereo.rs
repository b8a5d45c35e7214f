//! Depth made from colour: matched keyframe by keyframe, fused as it comes.

use super::{Fusion, RunError, color};
use crate::{
    convert::stereo_view,
    event::{Flow, Sink, Stage},
};
use burn::tensor::Device;
use scan::{Finding, Frame, Scan, Severity};
use std::collections::HashSet;
use stereo::{DepthMap, Step, StereoConfig};
use volume::VolumeError;

/// A keyframe with depth in no more than one in so many pixels has none: those few are where noise looked alike.
const LEAST_SHARE: usize = 200;
/// Keyframes that a finding names before it says how many more there are.
const NAMED: usize = 3;

/// Makes depth of every keyframe and fuses it. One that gives none is told at the latest at the end; a volume that is full
/// ends the fusing, and what is in it stays.
pub(super) async fn fuse(
    scan: &Scan,
    keyframes: &[usize],
    config: &StereoConfig,
    device: &Device,
    fusion: &mut Fusion,
    sink: &mut impl Sink,
) -> Result<(), RunError> {
    sink.stage(Stage::Matching, keyframes.len());
    let mut stereo = config.init(scan, keyframes, device)?;
    let mut matched = 0;
    // Frames with depth, and what was told: a picture that cannot be used may come up with more than one keyframe.
    let mut given: HashSet<usize> = HashSet::new();
    let mut told: Vec<Finding> = Vec::new();
    loop {
        if sink.checkpoint().await == Flow::Stop {
            fusion.stopped = true;
            return Ok(());
        }
        match stereo.advance(scan).await? {
            Step::Working => (),
            Step::Matched => {
                matched += 1;
                sink.progress(matched);
            }
            Step::Depth(map) => {
                sink.depth_map(&map);
                let known = map.depth_m.iter().filter(|&&z| z > 0.0).count();
                if known * LEAST_SHARE <= map.depth_m.len() {
                    continue;
                }
                given.insert(map.frame);
                match take(scan, &map, fusion, sink).await {
                    Err(RunError::Volume(full @ VolumeError::TooManyBricks { .. })) => {
                        let left = keyframes.len() - (given.len() - 1);
                        sink.finding(volume_full(&full, left));
                        return Ok(());
                    }
                    result => result?,
                }
            }
            Step::Finding(finding) => {
                if !told.contains(&finding) {
                    sink.finding(finding.clone());
                    told.push(finding);
                }
            }
            Step::Done => break,
        }
    }
    sink.progress(keyframes.len());
    let silent = |frame: &&Frame| {
        let picture = frame.color.as_ref().map(|color| color.path.as_str());
        let about = |file: &str| Some(file) == picture || file == frame.name;
        !told.iter().any(|f| f.file.as_deref().is_some_and(about))
    };
    let without = keyframes.iter().filter(|frame| !given.contains(frame));
    let without: Vec<&Frame> = without.map(|&f| &scan.frames()[f]).filter(silent).collect();
    if !without.is_empty() {
        sink.finding(no_depth(&without, keyframes.len()));
    }
    Ok(())
}

async fn take(
    scan: &Scan,
    map: &DepthMap,
    fusion: &mut Fusion,
    sink: &mut impl Sink,
) -> Result<(), RunError> {
    let color = color(scan, map.frame, sink);
    let view = stereo_view(&scan.frames()[map.frame], map, color.as_ref());
    fusion.take(&view, sink).await
}

fn volume_full(error: &VolumeError, keyframes_left: usize) -> Finding {
    Finding {
        severity: Severity::Warning,
        code: "volume-full",
        file: None,
        line: None,
        expected: "room for the whole surface on this device".to_owned(),
        found: format!("that {error}"),
        advice: format!(
            "The mesh is of what came before; {keyframes_left} keyframes are not in it. Use larger voxels or fewer keyframes"
        ),
        frames_affected: keyframes_left,
    }
}

fn no_depth(frames: &[&Frame], keyframes: usize) -> Finding {
    let names: Vec<&str> = frames.iter().take(NAMED).map(|f| f.name.as_str()).collect();
    let more = match frames.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Finding {
        severity: Severity::Warning,
        code: "stereo-no-depth",
        file: None,
        line: None,
        expected: "depth from the colour of every keyframe".to_owned(),
        found: format!(
            "none in {} of {keyframes}: {}{more}",
            frames.len(),
            names.join(", ")
        ),
        advice: "They are left out: no other picture shows the same place from a little aside, or the place has no texture. \
                 Walk sideways while scanning"
            .to_owned(),
        frames_affected: frames.len(),
    }
}
