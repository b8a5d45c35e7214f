//! What the driver asks of a network. Tests put one here that knows the truth.

use burn::Tensor;
use glam::{IVec3, Vec3};
use net::{Level, View};

/// What a level's 3D network gives for each of its sites.
pub struct Decoded {
    /// `[N, C]`, for the next level.
    pub features: Tensor<2>,
    /// `[N, 1]`: above 0 where a surface is near (coarse, medium), or the argument of the distance's tanh (fine).
    pub logit: Tensor<2>,
}

/// A network as the driver of the reconstruction sees it. Site `s` of a level lies at `s * voxel_size_m + origin_m`.
pub trait Network {
    /// What is kept of pictures at one level.
    type Plane;

    /// Feature planes of pictures `[V, 3, H, W]`, sRGB 0 to 255, from coarse to fine.
    fn planes(&self, images: Tensor<4>, views: &[View]) -> [Self::Plane; 3];

    /// Planes of several pictures as one, in that order; there is at least one.
    fn stack(&self, planes: &[&Self::Plane]) -> Self::Plane;

    /// What `views`, whose planes these are, say together of each site: `[N, C]`.
    fn fuse(
        &self,
        level: Level,
        plane: &Self::Plane,
        views: &[View],
        sites: &[IVec3],
        origin_m: Vec3,
    ) -> Tensor<2>;

    /// All sites of the scan at once. The columns of `features`: the parent's features, what views say, the parent's
    /// logit; at the coarse level what views say alone.
    fn decode(&self, level: Level, features: Tensor<2>, sites: &[IVec3], origin_m: Vec3)
    -> Decoded;
}
