//! The network as a source: keyframes, tiles, feature planes, then coarse, medium and fine voxels, and their distances in
//! the volume (method 1.3 to 1.7). Levels are done one after another over the whole scan, for the 3D network sees it at once.

mod color;
mod evidence;
mod explain;
mod guide;
mod kept;
mod levels;
mod network;
mod pictures;
mod preview;
mod tiles;
mod warm;

use super::{Fusion, RunError};
use crate::{
    event::{Flow, Sink, Stage},
    plan::NetworkConfig,
};
use burn::tensor::Device;
pub use evidence::Seen;
use levels::Field;
pub use levels::fused_at_once;
use net::Level;
pub use network::{Input, Network};
use pictures::Pictures;
use preview::Preview;
use scan::Scan;
use tiles::Tiling;
use volume::{BRICK_EDGE, Point};
pub use warm::warm_up_network;

/// Reconstructs the scan and fills the volume. A keyframe whose picture cannot be decoded is reported and left out. When
/// the sink stops it before the finest level is done, the volume is empty.
pub(super) async fn fuse(
    scan: &Scan,
    keyframes: &[usize],
    config: &NetworkConfig,
    network: &impl Network,
    device: &Device,
    fusion: &mut Fusion,
    sink: &mut impl Sink,
) -> Result<(), RunError> {
    let Some(tiling) = Tiling::new(scan, keyframes, config, sink).await else {
        fusion.stopped = true;
        return Ok(());
    };
    if !tiling.overlaps() {
        return Err(explain::no_overlap(scan, keyframes));
    }
    explain::alone(scan, keyframes, &tiling)
        .into_iter()
        .for_each(|finding| sink.finding(finding));

    let thinks_on = network.device();
    let used = tiling.used();
    sink.stage(Stage::Features, used.len());
    let mut pictures = Pictures::new(scan, keyframes, config.size);
    for (done, &keyframe) in used.iter().enumerate() {
        if sink.checkpoint().await == Flow::Stop {
            fusion.stopped = true;
            return Ok(());
        }
        if let Some((image, view)) = pictures.load(scan, keyframe, &thinks_on, sink) {
            pictures.keep(keyframe, view, network.planes(image, &[view]));
            fusion.frames += 1;
        }
        sink.progress(done + 1);
    }
    if fusion.frames < 2 {
        return Err(RunError::TooFewPictures {
            keyframes: keyframes.len(),
            found: fusion.frames,
        });
    }

    let guide = match network.guided() {
        false => None,
        true => match guide::maps(scan, keyframes, &thinks_on, sink).await? {
            Some(maps) => Some(maps),
            None => {
                fusion.stopped = true;
                return Ok(());
            }
        },
    };
    let scene = levels::Scene {
        tiling: &tiling,
        pictures: &pictures,
        guide: guide.as_deref(),
    };
    let preview = Preview {
        config: *fusion.volume.config(),
        device,
        corner: tiling.corner,
    };
    let field = levels::decode(&scene, network, &preview, sink).await;
    let field = match field.map_err(|fault| explain::fault(fault, scan, keyframes))? {
        Some(field) => field,
        None => {
            fusion.stopped = true;
            return Ok(());
        }
    };
    let surface = color::surface(&field);
    if surface.is_empty() {
        let nothing = levels::Fault::Nothing {
            level: Level::Fine,
            sites: field.sites.len(),
        };
        return Err(explain::fault(nothing, scan, keyframes));
    }
    let mut points = points(&field, &tiling);
    fill(fusion, &points)?;
    sink.surface(Level::Fine.voxel_size_m() * BRICK_EDGE as f32);
    fusion.hand_over(sink, |_, _| ()).await?;
    if fusion.stopped || !fusion.volume.config().color {
        return Ok(());
    }
    color::paint(
        scan,
        &pictures,
        &tiling,
        &surface,
        &mut points,
        fusion,
        sink,
    )
    .await?;
    fill(fusion, &points)
}

/// The field on the volume's lattice, without colours.
fn points(field: &Field, tiling: &Tiling) -> Vec<Point> {
    let known = field.sites.iter().zip(&field.distances);
    known
        .enumerate()
        .map(|(index, (&site, &distance))| Point {
            place: tiling.corner + site,
            distance,
            color: None,
            evidence: field.evidence.get(index).copied().unwrap_or_default(),
        })
        .collect()
}

fn fill(fusion: &mut Fusion, points: &[Point]) -> Result<(), RunError> {
    fusion
        .volume
        .set_points(points)
        .map_err(|error| match error {
            volume::VolumeError::TooManyBricks { limit, .. } => RunError::TooLarge { limit },
            other => RunError::Volume(other),
        })
}
