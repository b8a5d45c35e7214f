//! Sets of lattice sites, on the processor: the sites of the next level and of the coarser ones within a U-Net, and who
//! is whose neighbour.

use glam::{IVec3, ivec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Sites along the edge of a brick of [`SiteIndex`], as a power of two.
const BRICK_SHIFT: i32 = 2;
const BRICK: usize = 1 << (3 * BRICK_SHIFT);

/// The eight sites of the next finer level that each site becomes: `2 * site + (dx, dy, dz)` with offsets of 0 or 1, parent
/// after parent, child `dx + 2 dy + 4 dz` of each (method 1.4).
pub fn children(sites: &[IVec3]) -> Vec<IVec3> {
    sites
        .par_iter()
        .flat_map_iter(|site| (0..8).map(move |child| 2 * *site + corner(child)))
        .collect()
}

/// The sites of the next coarser resolution: `floor(site / 2)`, each once, sorted by z, y, x (method 1.7).
pub fn halved(sites: &[IVec3]) -> Vec<IVec3> {
    let mut halves: Vec<_> = sites.par_iter().map(|site| parent(*site)).collect();
    halves.par_sort_unstable_by_key(|site| (site.z, site.y, site.x));
    halves.dedup();
    halves
}

fn corner(index: i32) -> IVec3 {
    ivec3(index & 1, index >> 1 & 1, index >> 2 & 1)
}

/// `floor(site / 2)`: an arithmetic shift.
fn parent(site: IVec3) -> IVec3 {
    site >> 1
}

/// Finds the row of a site.
#[derive(Debug)]
pub struct SiteIndex {
    /// Where a brick's rows start.
    bricks: HashMap<IVec3, usize>,
    /// A row for each site of a brick, -1 where there is none.
    rows: Vec<i32>,
}

impl SiteIndex {
    /// Of sites that are each there once.
    pub fn new(sites: &[IVec3]) -> Self {
        let mut bricks = HashMap::new();
        let mut rows = Vec::new();
        for (row, site) in sites.iter().enumerate() {
            let start = *bricks.entry(*site >> BRICK_SHIFT).or_insert_with(|| {
                rows.resize(rows.len() + BRICK, -1);
                rows.len() - BRICK
            });
            rows[start + within(*site)] = row as i32;
        }
        Self { bricks, rows }
    }

    /// The row of `site`, if it is in the set.
    pub fn row(&self, site: IVec3) -> Option<i32> {
        let start = self.bricks.get(&(site >> BRICK_SHIFT))?;
        Some(self.rows[start + within(site)]).filter(|row| *row >= 0)
    }
}

/// The place of a site in its brick.
fn within(site: IVec3) -> usize {
    let mask = (1 << BRICK_SHIFT) - 1;
    let site = site & mask;
    (site.x | site.y << BRICK_SHIFT | site.z << (2 * BRICK_SHIFT)) as usize
}

/// The rows under the 27 taps of a submanifold convolution at each site: tap `(dx + 1) + 3 (dy + 1) + 9 (dz + 1)` is the
/// site at that offset; the number of sites where it is not in the set.
pub fn neighbours(sites: &[IVec3]) -> Vec<i32> {
    let index = SiteIndex::new(sites);
    let absent = sites.len() as i32;
    sites
        .par_iter()
        .flat_map_iter(|site| {
            let index = &index;
            (0..27).map(move |tap| {
                let offset = ivec3(tap % 3, tap / 3 % 3, tap / 9) - IVec3::ONE;
                index.row(site.wrapping_add(offset)).unwrap_or(absent)
            })
        })
        .collect()
}

/// The rows under the eight taps of a convolution of stride 2 and kernel 2, both ways: for each of `halves` its children
/// among `sites` in the order of [`children`], and for each of `sites` its half under the tap that it is.
pub fn pooling(sites: &[IVec3], halves: &[IVec3]) -> (Vec<i32>, Vec<i32>) {
    let index = SiteIndex::new(halves);
    let (inputs, outputs) = (sites.len() as i32, halves.len() as i32);
    let mut gather = vec![inputs; 8 * halves.len()];
    let mut scatter = vec![outputs; 8 * sites.len()];
    for (row, site) in sites.iter().enumerate() {
        let child = *site & 1;
        let tap = (child.x | child.y << 1 | child.z << 2) as usize;
        if let Some(half) = index.row(parent(*site)) {
            gather[8 * half as usize + tap] = row as i32;
            scatter[8 * row + tap] = half;
        }
    }
    (gather, scatter)
}
