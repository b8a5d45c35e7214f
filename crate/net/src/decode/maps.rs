//! The kernel maps of a U-Net.

use super::sites;
use crate::ops::sparse_conv::KernelMap;
use burn::tensor::Device;
use glam::IVec3;
use rayon::prelude::*;

/// The maps of a [`UNet`](super::UNet)'s three resolutions over a set of sites, made once and shared by its convolutions.
#[derive(Clone, Debug)]
pub struct UNetMaps {
    /// Rows at each resolution, from the sites given to their quarter resolution.
    pub rows: [usize; 3],
    /// Submanifold convolution at each resolution, 27 taps.
    pub same: [KernelMap; 3],
    /// Stride 2 from a resolution to the next coarser one, eight taps.
    pub down: [KernelMap; 2],
    /// Back: the transposed maps.
    pub up: [KernelMap; 2],
}

impl UNetMaps {
    /// Of `sites`, each there once, in the order of the features' rows. On the device 4 * 2 * (27 + 8) bytes a site: the
    /// largest tensor stays within WebGPU's guaranteed 128 MiB up to 1.2 million sites.
    pub fn new(sites: &[IVec3], device: &Device) -> Self {
        let half = sites::halved(sites);
        let quarter = sites::halved(&half);
        let down = [
            pooling(sites, &half, device),
            pooling(&half, &quarter, device),
        ];
        Self {
            rows: [sites.len(), half.len(), quarter.len()],
            same: [sites, &half, &quarter].map(|sites| submanifold(sites, device)),
            up: [down[0].transposed(), down[1].transposed()],
            down,
        }
    }

    /// Whether there is no site at all.
    pub fn is_empty(&self) -> bool {
        self.rows[0] == 0
    }
}

/// The map of a submanifold convolution with 27 taps over `sites`.
pub fn submanifold(sites: &[IVec3], device: &Device) -> KernelMap {
    let gather = sites::neighbours(sites);
    // Site m meets site n under tap k as n meets m under the opposite tap.
    let scatter = gather
        .par_chunks_exact(27)
        .flat_map_iter(|taps| taps.iter().rev().copied())
        .collect();
    KernelMap::new(gather, scatter, 27, device)
}

/// The map of a convolution with stride 2 and eight taps from `sites` to `halves`, their [`sites::halved`].
pub fn pooling(sites: &[IVec3], halves: &[IVec3], device: &Device) -> KernelMap {
    let (gather, scatter) = sites::pooling(sites, halves);
    KernelMap::new(gather, scatter, 8, device)
}
