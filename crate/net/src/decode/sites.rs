//! Sets of lattice sites, on the processor: the sites of the next level and of the coarser ones within a U-Net, and who
//! is whose neighbour.

use glam::{IVec3, ivec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Sites along the edge of a brick of [`SiteIndex`], as a power of two.
const BRICK_SHIFT: i32 = 2;
const BRICK_MASK: i32 = (1 << BRICK_SHIFT) - 1;
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

/// Finds the row of a site: the lattice in bricks of 4 x 4 x 4.
#[derive(Debug)]
struct SiteIndex {
    /// The number of each brick that has a site.
    bricks: HashMap<IVec3, usize>,
    /// A row for each place of each brick, -1 where there is no site.
    rows: Vec<[i32; BRICK]>,
}

impl SiteIndex {
    /// Of sites that are each there once.
    fn new(sites: &[IVec3]) -> Self {
        let mut bricks = HashMap::new();
        let mut rows: Vec<[i32; BRICK]> = Vec::new();
        for (row, site) in sites.iter().enumerate() {
            let brick = *bricks.entry(*site >> BRICK_SHIFT).or_insert_with(|| {
                rows.push([-1; BRICK]);
                rows.len() - 1
            });
            rows[brick][within(*site)] = row as i32;
        }
        Self { bricks, rows }
    }

    fn row(&self, site: IVec3) -> Option<i32> {
        let brick = *self.bricks.get(&(site >> BRICK_SHIFT))?;
        Some(self.rows[brick][within(site)]).filter(|row| *row >= 0)
    }

    /// For each brick itself and the 26 around it, in the order of [`tap_offset`].
    fn around(&self) -> Vec<[Option<usize>; 27]> {
        let mut around = vec![[None; 27]; self.rows.len()];
        for (place, brick) in &self.bricks {
            around[*brick] = std::array::from_fn(|tap| {
                let place = place.wrapping_add(tap_offset(tap));
                self.bricks.get(&place).copied()
            });
        }
        around
    }
}

/// The place of a site in its brick.
fn within(site: IVec3) -> usize {
    let site = site & BRICK_MASK;
    (site.x | site.y << BRICK_SHIFT | site.z << (2 * BRICK_SHIFT)) as usize
}

/// Tap `(dx + 1) + 3 (dy + 1) + 9 (dz + 1)` takes the site at that offset.
fn tap_offset(tap: usize) -> IVec3 {
    let tap = tap as i32;
    ivec3(tap % 3, tap / 3 % 3, tap / 9) - IVec3::ONE
}

/// The rows under the 27 taps of a submanifold convolution at each site: tap `(dx + 1) + 3 (dy + 1) + 9 (dz + 1)` is the
/// site at that offset; the number of sites where it is not in the set.
pub fn neighbours(sites: &[IVec3]) -> Vec<i32> {
    let index = SiteIndex::new(sites);
    let around = index.around();
    let absent = sites.len() as i32;
    let mut neighbours = vec![absent; 27 * sites.len()];
    let rows = neighbours.par_chunks_exact_mut(27).zip(sites);
    rows.for_each(|(neighbours, site)| {
        let around = &around[index.bricks[&(*site >> BRICK_SHIFT)]];
        let inner = *site & BRICK_MASK;
        for (tap, neighbour) in neighbours.iter_mut().enumerate() {
            let place = inner + tap_offset(tap);
            // A step back, inside or on along each axis.
            let step = (place >> BRICK_SHIFT) + IVec3::ONE;
            if let Some(brick) = around[(step.x + 3 * step.y + 9 * step.z) as usize] {
                let row = index.rows[brick][within(place)];
                if row >= 0 {
                    *neighbour = row;
                }
            }
        }
    });
    neighbours
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
