//! What the user may ask for, and what of it makes sense.

use super::{PlanError, network::NetworkConfig};
use scan::Scan;
use stereo::StereoConfig;

/// Where depth comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthSource {
    /// The scan's own depth images.
    Sensor,
    /// Plane-sweep stereo over the colour images.
    Stereo(StereoConfig),
    /// No depth at all: the network makes the surface from colour and poses at once.
    Network(NetworkConfig),
}

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Edge of a voxel in metres; the network has its own.
    pub voxel_size_m: f32,
    /// Take every n-th keyframe; at least 1.
    pub every: usize,
    /// Take this many of those keyframes, evenly spread from the first to the last; `None` for all. With the network this
    /// is for the whole scan; [`NetworkConfig::views_a_tile`] bounds what one place is made from.
    pub views: Option<usize>,
    /// Depth beyond this is not used, in metres; the network has [`NetworkConfig::reach_m`].
    pub max_depth_m: f32,
    /// Where depth comes from; `None` for the sensor's where the scan has depth, else stereo.
    pub depth: Option<DepthSource>,
}

impl Default for Options {
    /// 4 cm voxels, every keyframe, depth up to 5 m, from the sensor if there is one.
    fn default() -> Self {
        Self {
            voxel_size_m: 0.04,
            every: 1,
            views: None,
            max_depth_m: 5.0,
            depth: None,
        }
    }
}

impl Options {
    /// Says whether the numbers make sense.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        let fault = |what, found: String| Err(PlanError::Setting { what, found });
        if !(0.004..=1.0).contains(&self.voxel_size_m) {
            let found = format!("{} m", self.voxel_size_m);
            return fault("a voxel size between 0.004 and 1 m", found);
        }
        if !(0.1..=100.0).contains(&self.max_depth_m) {
            let found = format!("{} m", self.max_depth_m);
            return fault("a maximum depth between 0.1 and 100 m", found);
        }
        if self.every == 0 {
            return fault("to take every 1st, 2nd, 3rd … keyframe", "every 0th".into());
        }
        if self.views == Some(0) {
            return fault("to take at least 1 keyframe", "0 views".into());
        }
        Ok(())
    }

    /// Where depth will come from in this scan.
    pub(super) fn depth_source(&self, scan: &Scan) -> Result<DepthSource, PlanError> {
        let usual = if scan.has_depth() {
            DepthSource::Sensor
        } else {
            DepthSource::Stereo(StereoConfig::default())
        };
        let depth = self.depth.unwrap_or(usual);
        match &depth {
            DepthSource::Sensor if !scan.has_depth() => Err(PlanError::NoDepth {
                name: scan.name().to_owned(),
            }),
            DepthSource::Sensor => Ok(depth),
            DepthSource::Stereo(config) => {
                config.check()?;
                self.at_least_two()?;
                Ok(depth)
            }
            DepthSource::Network(config) => {
                config.check()?;
                self.at_least_two()?;
                Ok(depth)
            }
        }
    }

    /// One picture alone has nothing to be compared with.
    fn at_least_two(&self) -> Result<(), PlanError> {
        if self.views == Some(1) {
            return Err(PlanError::Setting {
                what: "to take at least 2 keyframes, for they are compared",
                found: "1 view".into(),
            });
        }
        Ok(())
    }

    /// The keyframes that are asked for, out of those that can be used.
    pub(super) fn chosen(&self, usable: impl Iterator<Item = usize>) -> Vec<usize> {
        let kept: Vec<usize> = usable.step_by(self.every).collect();
        match self.views {
            Some(views) if views < kept.len() => {
                spread(kept.len(), views).map(|i| kept[i]).collect()
            }
            _ => kept,
        }
    }
}

/// `count` indices below `total`, the first and the last among them, the others at equal distances, rounded half up.
fn spread(total: usize, count: usize) -> impl Iterator<Item = usize> {
    let gaps = (count - 1).max(1);
    (0..count).map(move |i| (2 * i * (total - 1) + gaps) / (2 * gaps))
}
