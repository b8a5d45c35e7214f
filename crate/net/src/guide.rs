//! Stereo's depth at voxels: given to the 3D network with the switch `guide`, and weighed against what it says.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use crate::sample::GuideMap;

/// Voxels of truncation, as in the truth (method 1.8).
const TRUNCATION: f32 = 3.0;

/// The network's distance counts as much as so many maps that are certain and near. Chosen on made-up rooms and two real
/// scans, where all from 3 to 12 were better than no mean: a network that learnt on small pictures knows surfaces less
/// exactly than stereo does where many views agree.
const NETWORK_WEIGHT: f32 = 3.0;

/// Beyond this depth in metres a map says less of where exactly a surface lies: stereo's error grows with its square.
const NEAR_M: f32 = 1.5;

/// What the maps say of a site.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guidance {
    /// Signed distance over the truncation distance, positive in free space.
    pub distance: f32,
    /// The sum of the maps' weights; 0 where none says anything.
    pub weight: f32,
}

impl Guidance {
    /// As the 3D network is given it: the weight cut at 1.
    pub fn channels(self) -> [f32; 2] {
        [self.distance, self.weight.min(1.0)]
    }

    /// The mean of the network's distance and this one, by their weights. Both over the same truncation distance.
    pub fn mean_with(self, network: f32) -> f32 {
        (NETWORK_WEIGHT * network + self.weight * self.distance) / (NETWORK_WEIGHT + self.weight)
    }
}

/// For each site the mean of `clamp((depth - z) / truncation, -1, 1)` over the maps that see it in front of their surface or
/// at most one truncation (three voxels) behind, weighed by their confidence: what the network is given.
pub fn guide_at(
    sites: &[IVec3],
    voxel_size_m: f32,
    origin_m: Vec3,
    maps: &[GuideMap],
) -> Vec<Guidance> {
    mean_at(sites, voxel_size_m, origin_m, maps, |_, confidence| {
        confidence
    })
}

/// The same mean with near maps weighing more, by the inverse square of their depth: what the network's own distance is
/// weighed against.
pub fn surface_at(
    sites: &[IVec3],
    voxel_size_m: f32,
    origin_m: Vec3,
    maps: &[GuideMap],
) -> Vec<Guidance> {
    mean_at(sites, voxel_size_m, origin_m, maps, |depth, confidence| {
        confidence * (NEAR_M / depth).min(1.0).powi(2)
    })
}

fn mean_at(
    sites: &[IVec3],
    voxel_size_m: f32,
    origin_m: Vec3,
    maps: &[GuideMap],
    weigh: impl Fn(f32, f32) -> f32 + Sync,
) -> Vec<Guidance> {
    let truncation = TRUNCATION * voxel_size_m;
    let cameras: Vec<_> = maps
        .iter()
        .map(|map| (map, map.view.world_from_camera.inverse()))
        .collect();
    sites
        .par_iter()
        .with_min_len(256)
        .map(|site| {
            let world = site.as_vec3() * voxel_size_m + origin_m;
            let [mut sum, mut weight] = [0.0; 2];
            for (map, camera_from_world) in &cameras {
                let point = camera_from_world.transform_point3(world);
                let Some((depth, confidence)) = look_up(map, point) else {
                    continue;
                };
                let distance = (depth - point.z) / truncation;
                if distance >= -1.0 {
                    let share = weigh(depth, confidence);
                    sum += share * distance.min(1.0);
                    weight += share;
                }
            }
            if weight > 0.0 {
                let distance = sum / weight;
                Guidance { distance, weight }
            } else {
                Guidance::default()
            }
        })
        .collect()
}

/// Depth and confidence at the pixel nearest to a point of the camera, where there are such.
fn look_up(map: &GuideMap, point: Vec3) -> Option<(f32, f32)> {
    if point.z <= 0.0 {
        return None;
    }
    let camera = &map.view.camera;
    let pixel = camera.project(point).round();
    let inside = pixel.x >= 0.0
        && pixel.y >= 0.0
        && pixel.x < camera.width as f32
        && pixel.y < camera.height as f32;
    let at = inside.then_some(pixel.x as usize + camera.width as usize * pixel.y as usize)?;
    let depth = *map.depth_m.get(at)?;
    let confidence = *map.confidence.get(at)?;
    (depth > 0.0 && confidence > 0.0).then_some((depth, confidence))
}
