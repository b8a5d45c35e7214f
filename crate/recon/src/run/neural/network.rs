//! What the driver asks of a network: [`Ipdrecon`] is one. Tests put another here that knows the truth.

use super::evidence::Seen;
use burn::{
    Tensor,
    module::Module,
    tensor::{Device, Int},
};
use glam::{IVec3, Vec3};
use net::{
    Ipdrecon, Level, View,
    fusion::{Pairs, Pooling},
    model::Decoded,
    planes::{Plane, plane_size},
};

/// A network as the driver of the reconstruction sees it. Site `s` of a level lies at `s * voxel_size_m + origin_m`.
pub trait Network {
    /// What is kept of pictures at one level.
    type Plane;

    /// Where its tensors are, and where its guide is made. It may be another device than the volume's: a processor that plays GPU
    /// is no match for itself.
    fn device(&self) -> Device;

    /// Whether it wants stereo's depth as a guide.
    fn guided(&self) -> bool;

    /// Bytes of a voxel in the widest tensor at a level.
    fn row_bytes(&self, level: Level) -> usize;

    /// Feature planes of pictures `[V, 3, H, W]`, sRGB 0 to 255, from coarse to fine.
    fn planes(&self, images: Tensor<4>, views: &[View]) -> [Self::Plane; 3];

    /// Planes of several pictures as one, in that order; there is at least one.
    fn stack(&self, planes: &[&Self::Plane]) -> Self::Plane;

    /// What `views`, whose planes these are, say together of each site: `[N, C]`; at the fine level also what that rests on, if
    /// the network can tell.
    fn fuse(
        &self,
        level: Level,
        plane: &Self::Plane,
        views: &[View],
        sites: &[IVec3],
        origin_m: Vec3,
    ) -> (Tensor<2>, Option<Seen>);

    /// The 3D network, over all sites of the scan at once.
    fn decode(&self, level: Level, input: Input<'_>) -> Decoded;
}

/// What a level's 3D network works on.
pub struct Input<'a> {
    /// The sites.
    pub sites: &'a [IVec3],
    /// Where site 0 lies.
    pub origin_m: Vec3,
    /// What the views say of each: `[N, C]`.
    pub fused: Tensor<2>,
    /// The level above and each site's row in it.
    pub above: Option<(&'a Decoded, Tensor<1, Int>)>,
    /// The guide at each site `[N, 2]`, for a network that wants one.
    pub guide: Option<Tensor<2>>,
}

impl Network for Ipdrecon {
    type Plane = Plane;

    fn device(&self) -> Device {
        let first = self.devices().into_iter().next();
        first.unwrap_or_else(Device::flex)
    }

    fn guided(&self) -> bool {
        self.config().guide
    }

    fn row_bytes(&self, level: Level) -> usize {
        self.config().row_bytes(level)
    }

    fn planes(&self, images: Tensor<4>, views: &[View]) -> [Plane; 3] {
        Self::planes(self, images, views)
    }

    fn stack(&self, planes: &[&Plane]) -> Plane {
        let all = |part: fn(&Plane) -> Option<Tensor<4>>| {
            let parts: Option<Vec<_>> = planes.iter().map(|plane| part(plane)).collect();
            parts.map(|parts| Tensor::cat(parts, 0))
        };
        let base = planes.iter().map(|plane| plane.base.clone());
        Plane {
            base: Tensor::cat(base.collect(), 0),
            hidden: all(|plane| plane.hidden.clone()),
            confidence: all(|plane| plane.confidence.clone()),
        }
    }

    fn fuse(
        &self,
        level: Level,
        plane: &Plane,
        views: &[View],
        sites: &[IVec3],
        origin_m: Vec3,
    ) -> (Tensor<2>, Option<Seen>) {
        let size = views.first().map(|view| view.camera);
        let size = size.map_or([0, 0], |camera| {
            plane_size(camera.width as usize, camera.height as usize, level)
        });
        let (voxel_m, stride) = (level.voxel_size_m(), level.stride());
        let pairs = Pairs::find(sites, voxel_m, origin_m, views, size, stride);
        let tensors = pairs.on(&plane.base.device());
        let seen = (level == Level::Fine).then(|| Seen::new(plane, &pairs, &tensors));
        let fused = Self::fuse(self, level, plane, &tensors, Pooling::Softmax);
        (fused.features, seen)
    }

    fn decode(&self, level: Level, input: Input<'_>) -> Decoded {
        let features = self.input(input.fused, input.above, input.guide);
        Self::decode(self, level, features, input.sites)
    }
}

/// Whole numbers as a tensor of row numbers.
pub(super) fn rows(rows: Vec<i32>, device: &Device) -> Tensor<1, Int> {
    use burn::tensor::{DType, TensorData};
    let count = rows.len();
    Tensor::from_data(TensorData::new(rows, [count]), (device, DType::I32))
}
