//! The room while it is still coarse: something to look at until the next level is there.

use super::super::{Fusion, RunError};
use crate::event::{Flow, Sink};
use burn::tensor::Device;
use glam::IVec3;
use net::{Level, guide::Guidance};
use std::{array, collections::HashSet};
use volume::{BRICK_EDGE, Evidence, Point, VolumeConfig};

/// Where coarse surfaces are shown.
pub(super) struct Preview<'a> {
    /// The volume whose surface they stand in for.
    pub config: VolumeConfig,
    /// Where that lies.
    pub device: &'a Device,
    /// Where site 0 lies, in fine voxels of the canonical world; a multiple of a coarse voxel.
    pub corner: IVec3,
}

impl Preview<'_> {
    /// Hands over the surface at and beside a level's `kept` sites, without colours and in place of all that was handed over before. The
    /// network says of these levels' voxels only whether there is a surface near; where it is among them is stereo's word, so
    /// that nothing is shown of what stereo did not see.
    pub async fn show(
        &self,
        level: Level,
        sites: &[IVec3],
        says: &[Guidance],
        kept: &[usize],
        sink: &mut impl Sink,
    ) -> Result<Flow, RunError> {
        if sink.eye().is_none() {
            return Ok(Flow::Continue);
        }
        let voxel_size_m = level.voxel_size_m();
        let fine = (voxel_size_m / Level::Fine.voxel_size_m()).round() as i32;
        let corner = self.corner / fine;
        // A surface passes between voxels: one that is kept shows it only with those around.
        let kept: HashSet<IVec3> = kept.iter().map(|&site| sites[site]).collect();
        let around: [IVec3; 27] =
            array::from_fn(|i| IVec3::new(i as i32 % 3, i as i32 / 3 % 3, i as i32 / 9) - 1);
        let near = |site: IVec3| around.into_iter().any(|step| kept.contains(&(site + step)));
        let said = sites.iter().zip(says);
        let points = said
            .filter(|&(&site, said)| said.weight > 0.0 && near(site))
            .map(|(&site, said)| Point {
                place: corner + site,
                distance: said.distance,
                color: None,
                evidence: Evidence::default(),
            });
        let config = VolumeConfig {
            voxel_size_m,
            truncation_m: 3.0 * voxel_size_m,
            color: false,
            ..self.config
        };
        let mut shown = Fusion {
            volume: config.init(self.device)?,
            frames: 0,
            next_surface: 0,
            stopped: false,
        };
        shown.volume.set_points(&points.collect::<Vec<_>>())?;
        sink.surface(voxel_size_m * BRICK_EDGE as f32);
        shown.hand_over(sink, |_, _| ()).await?;
        Ok(match shown.stopped {
            true => Flow::Stop,
            false => Flow::Continue,
        })
    }
}
