//! Solids that can be asked: what a ray meets, what stands in its way, how far the next surface is.

use glam::Vec3;

use crate::bvh::Bvh;
use crate::solid::{Solid, Touch};

/// Solids and the tree over them.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub solids: Vec<Solid>,
    pub bvh: Bvh,
}

/// Where a ray meets a scene.
pub(crate) struct Hit {
    pub solid: u32,
    pub t: f32,
    pub normal: Vec3,
}

impl Scene {
    pub fn new(solids: Vec<Solid>) -> Self {
        let bvh = Bvh::new(&solids);
        Self { solids, bvh }
    }

    /// Signed distance in metres from `point` to the nearest surface: positive in free space, where it is exact.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.bvh
            .nearest(point, |solid| self.solids[solid as usize].distance(point))
    }

    /// The first surface that the ray meets within `limit` metres; `dir` has unit length.
    pub fn cast(&self, origin: Vec3, dir: Vec3, limit: f32) -> Option<Hit> {
        let mut found = None;
        self.bvh.walk_ray(origin, dir, limit, |solid, limit| {
            match self.solids[solid as usize].cast(origin, dir, limit) {
                Some(Touch { t, normal }) => {
                    found = Some(Hit { solid, t, normal });
                    t
                }
                None => limit,
            }
        });
        found
    }

    /// Whether something that casts a shadow stands within `limit` metres of `origin` along `dir`.
    pub fn blocked(&self, origin: Vec3, dir: Vec3, limit: f32) -> bool {
        let mut blocked = false;
        self.bvh.walk_ray(origin, dir, limit, |solid, limit| {
            let solid = &self.solids[solid as usize];
            if solid.casts_shadow && solid.cast(origin, dir, limit).is_some() {
                blocked = true;
                return 0.0;
            }
            limit
        });
        blocked
    }
}
