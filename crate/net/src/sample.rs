//! One training example: what is seen of a box of a room, and what is true in it.

use crate::View;

/// A crop of a scan with its truth. The crop's world has its origin at the crop's first lattice point: site `s` of a
/// level lies at `s * voxel_size_m`.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// The cameras, in the crop's world.
    pub views: Vec<View>,
    /// Pictures `[V, 3, H, W]`, sRGB, 0 to 255.
    pub images: Vec<f32>,
    /// Depth along the optical axis of each picture's pixels in metres, `[V, H, W]`; 0 where none was measured.
    pub depth_m: Vec<f32>,
    /// What is true at the lattice points.
    pub truth: Truth,
    /// Stereo's depth of what of the scan shows the crop, for the switch `guide`; empty without.
    pub guide: Vec<GuideMap>,
}

/// Truth on the three lattices of a crop. Point `(x, y, z)` of a level is element `x + nx * (y + ny * z)`.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Lattice points along x, y, z of the coarse, medium and fine level: each twice those of the level before.
    pub size: [[usize; 3]; 3],
    /// Signed distance at the fine points over the truncation distance of 0.12 m: 1 in observed free space, -1 behind
    /// surfaces and where nothing was observed.
    pub tsdf: Vec<f32>,
    /// Whether a surface is near, coarse, medium and fine (method 1.8).
    pub occupied: [Vec<bool>; 3],
    /// Whether the truth is known there, so that the loss counts the point (method 1.8).
    pub supervised: [Vec<bool>; 3],
}

/// A depth map with how far it may be relied on.
#[derive(Clone, Debug)]
pub struct GuideMap {
    /// The camera of the depth map and its pose, in the same world as the sites.
    pub view: View,
    /// Depth in metres, row by row; 0 where there is none.
    pub depth_m: Vec<f32>,
    /// 0 to 1.
    pub confidence: Vec<f32>,
}
