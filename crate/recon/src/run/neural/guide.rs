//! Stereo's depth for networks that were trained with it as a guide.

use super::kept;
use crate::{
    convert::{pinhole, pose},
    event::{Flow, Sink, Stage},
    run::RunError,
};
use burn::{
    Tensor,
    tensor::{DType, Device, TensorData},
};
use net::{View, guide::Guidance, model::GUIDE_CHANNELS, sample::GuideMap};
use scan::{Finding, Scan, Severity};
use stereo::{Step, StereoConfig, StereoError};

fn without(least_m: f64, keyframes: usize) -> Finding {
    Finding {
        severity: Severity::Warning,
        code: "no-guide",
        file: None,
        line: None,
        expected: format!("pictures of the same things from places at least {least_m} m apart, to guide the network by stereo"),
        found: format!("none among {keyframes} keyframes"),
        advice: "The network goes without its guide, and finds less. Walk sideways while scanning instead of turning on the spot"
            .to_owned(),
        frames_affected: keyframes,
    }
}

/// Depth with confidence of every keyframe that stereo can give some, made now or kept of an earlier run. `None` if the sink
/// stopped it.
pub(super) async fn maps(
    scan: &Scan,
    keyframes: &[usize],
    device: &Device,
    sink: &mut impl Sink,
) -> Result<Option<Vec<GuideMap>>, RunError> {
    let before = sink.kept(Stage::Matching);
    if let Some(maps) = before.and_then(|bytes| kept::read_guide(&bytes)) {
        return Ok(Some(maps));
    }
    let maps = matched(scan, keyframes, device, sink).await?;
    if let Some(maps) = &maps
        && sink.keeps()
    {
        sink.keep(Stage::Matching, kept::guide(maps));
    }
    Ok(maps)
}

async fn matched(
    scan: &Scan,
    keyframes: &[usize],
    device: &Device,
    sink: &mut impl Sink,
) -> Result<Option<Vec<GuideMap>>, RunError> {
    sink.stage(Stage::Matching, keyframes.len());
    let mut stereo = match StereoConfig::default().init(scan, keyframes, device) {
        Err(StereoError::NoParallax { least_m, .. }) => {
            sink.finding(without(least_m, keyframes.len()));
            return Ok(Some(Vec::new()));
        }
        other => other?,
    };
    let mut maps = Vec::new();
    let mut matched = 0;
    let mut told: Vec<Finding> = Vec::new();
    loop {
        if sink.checkpoint().await == Flow::Stop {
            return Ok(None);
        }
        match stereo.advance(scan).await? {
            Step::Working => (),
            Step::Matched => {
                matched += 1;
                sink.progress(matched);
            }
            Step::Depth(map) => {
                sink.depth_map(&map);
                maps.push(GuideMap {
                    view: View {
                        camera: pinhole(&map.camera),
                        world_from_camera: pose(&scan.frames()[map.frame]),
                    },
                    depth_m: map.depth_m,
                    confidence: map.confidence,
                });
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
    Ok(Some(maps))
}

/// What the maps say of sites as the 3D network is given it: `[N, 2]`.
pub(super) fn tensor(says: &[Guidance], device: &Device) -> Tensor<2> {
    let values: Vec<f32> = says.iter().flat_map(|said| said.channels()).collect();
    let data = TensorData::new(values, [says.len(), GUIDE_CHANNELS]);
    Tensor::from_data(data, (device, DType::F32))
}
