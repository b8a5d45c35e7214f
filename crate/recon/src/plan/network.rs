//! What the network's source may be told.

use super::{Limits, PlanError};
use net::{Level, NetConfig, planes};
use scan::{Camera, Frame};

/// Voxels of the network's finest level, in metres.
pub(super) const VOXEL_M: f32 = Level::Fine.voxel_size_m();

/// Fine voxels near a surface in each brick that is foreseen from the cameras: measured on five scans of 20 to 145 keyframes,
/// where it was 63 to 172.
const SITES_A_BRICK: usize = 180;

/// Which of the keyframes that see a tile are used, when there are more than [`NetworkConfig::views_a_tile`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewChoice {
    /// One after the other the keyframe that adds most to what the tile's points have seen of them so far.
    #[default]
    Coverage,
    /// Evenly at random, as VoRTX does.
    Random,
}

/// How the network works on a scan (method 1.3, 1.4). What it is made of lies in its weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetworkConfig {
    /// Pictures are scaled down to fit into this many pixels, width and height.
    pub size: (u32, u32),
    /// Each tile of the room is made from at most this many keyframes; the scan as a whole from many more.
    pub views_a_tile: usize,
    /// Edges of a tile in voxels of 4 cm along x, y, z; multiples of 4. Tiles bound the views and the memory of fusion;
    /// they leave no seams.
    pub tile: [u32; 3],
    /// The room is expected up to here from the cameras, in metres.
    pub reach_m: f32,
    /// How views are chosen.
    pub choice: ViewChoice,
    /// Seed of that choice: the same seed gives the same mesh.
    pub seed: u64,
    /// What the network is made of, for the plan to count bytes by; a run goes by its weights.
    pub net: NetConfig,
}

impl Default for NetworkConfig {
    /// VoRTX's: 640 x 480 pixels, 60 views a tile of 96 x 96 x 48 voxels, frusta cut at 4 m.
    fn default() -> Self {
        Self {
            size: (640, 480),
            views_a_tile: 60,
            tile: [96, 96, 48],
            reach_m: 4.0,
            choice: ViewChoice::default(),
            seed: 0,
            net: NetConfig::full(),
        }
    }
}

/// Settings that go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// 160 x 120 pixels and 20 views a tile: for [`NetConfig::small`] on a processor.
    Small,
    /// 320 x 240 pixels and 60 views a tile: a quarter of the full work on pictures (method 2.4).
    Medium,
    /// 640 x 480 pixels and 100 views a tile: the paper's.
    Full,
}

impl Preset {
    /// The preset that suits weights of these widths: pictures of the size that such a network is trained on.
    pub fn of(config: &NetConfig) -> Self {
        let full = NetConfig::full();
        if config.planes.iter().sum::<usize>() < full.planes.iter().sum() {
            Self::Small
        } else {
            Self::Full
        }
    }

    /// What it sets.
    pub fn config(self) -> NetworkConfig {
        let (size, views_a_tile, net) = match self {
            Self::Small => ((160, 120), 20, NetConfig::small()),
            Self::Medium => ((320, 240), 60, NetConfig::full()),
            Self::Full => ((640, 480), 100, NetConfig::full()),
        };
        NetworkConfig {
            size,
            views_a_tile,
            net,
            ..NetworkConfig::default()
        }
    }
}

impl NetworkConfig {
    /// Bytes that the network works on, about: its pictures' planes, and at the finest level what goes into the 3D network and
    /// what comes of it in its first layers.
    pub(super) fn bytes(&self, keyframes: usize, bricks: usize) -> usize {
        let pixels = self.size.0 as usize * self.size.1 as usize;
        let planes = self.net.planes.iter().zip(Level::ALL.map(Level::stride));
        let planes: usize = planes
            .map(|(width, stride)| width * pixels / (stride * stride))
            .sum();
        // The planes proper and a second of each where the network has one.
        let planes = 2 * planes * size_of::<f32>() * keyframes;
        planes + 2 * self.fine_sites(bricks) * self.net.row_bytes(Level::Fine)
    }

    /// Fine voxels that may be expected.
    pub(super) fn fine_sites(&self, bricks: usize) -> usize {
        bricks * SITES_A_BRICK
    }

    /// What is said where the finest level may have more voxels than a tensor holds on the network's device.
    pub(super) fn cap_remark(&self, bricks: usize, limits: &Limits) -> Option<String> {
        let most = limits.binding_bytes / self.net.row_bytes(Level::Fine);
        let expected = self.fine_sites(bricks);
        (limits.network_is_bound && expected > most).then(|| {
            format!(
                "up to {expected} voxels of {:.0} cm may lie near surfaces, and this device's largest buffer holds {most}: beyond that \
                 the surest are kept",
                VOXEL_M * 100.0
            )
        })
    }

    /// Says whether the numbers make sense.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        let fault = |what, found: String| Err(PlanError::Setting { what, found });
        let (width, height) = self.size;
        let sides = 32..=4096;
        if !sides.contains(&width) || !sides.contains(&height) {
            let found = format!("{width}x{height}");
            return fault("a picture size between 32x32 and 4096x4096", found);
        }
        if self.views_a_tile < 2 {
            let found = format!("{}", self.views_a_tile);
            return fault(
                "at least 2 views, for the network compares them; 20 to 100 are usual",
                found,
            );
        }
        let edge = |edge: &u32| edge.is_multiple_of(4) && (8..=256).contains(edge);
        if !self.tile.iter().all(edge) {
            let [x, y, z] = self.tile;
            let found = format!("{x} x {y} x {z}");
            return fault(
                "edges of a tile between 8 and 256 voxels, in multiples of 4",
                found,
            );
        }
        if !(0.5..=20.0).contains(&self.reach_m) {
            let found = format!("{} m", self.reach_m);
            return fault("a reach between 0.5 and 20 m", found);
        }
        Ok(())
    }
}

/// The size that pictures of this camera are brought to: as large as fits, with their proportions.
pub(crate) fn working_size(camera: &Camera, size: (u32, u32)) -> (u32, u32) {
    let fitted = stereo::view::fit(camera, size);
    (fitted.width, fitted.height)
}

/// Whether the network takes the pictures of these keyframes; the first one says what they are scaled to.
pub(super) fn check_pictures<'a>(
    config: &NetworkConfig,
    mut keyframes: impl Iterator<Item = &'a Frame>,
) -> Result<(), PlanError> {
    let Some(first) = keyframes.next() else {
        return Ok(());
    };
    let (width, height) = working_size(&first.color_camera, config.size);
    Ok(planes::check_size(width as usize, height as usize)?)
}
