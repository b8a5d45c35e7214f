//! Where voxels are: bricks, their slots in memory and their neighbours.

use glam::IVec3;
use std::collections::HashMap;

/// Lattice points along the edge of a brick.
pub const BRICK_EDGE: i32 = 8;
/// Lattice points in a brick.
pub const BRICK_VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;

/// Position of a brick, in bricks: it holds the lattice points `8 * brick .. 8 * brick + 8` on each axis.
pub type Brick = IVec3;

/// Slot that stands for every brick that was never allocated: its weights stay 0.
pub(crate) const EMPTY_SLOT: i32 = 0;

/// Bricks that have been allocated, and where they lie in the field's tensors.
#[derive(Default)]
pub(crate) struct Lattice {
    slots: HashMap<Brick, i32>,
    bricks: Vec<Brick>,
}

impl Lattice {
    /// Slots in use, the empty one included.
    pub fn slot_count(&self) -> usize {
        self.bricks.len() + 1
    }

    /// Bricks in order of allocation.
    pub fn bricks(&self) -> &[Brick] {
        &self.bricks
    }

    /// The slot of a brick, or the empty slot.
    pub fn slot(&self, brick: Brick) -> i32 {
        self.slots.get(&brick).copied().unwrap_or(EMPTY_SLOT)
    }

    /// Gives a brick its slot unless it has one.
    pub fn allocate(&mut self, brick: Brick) -> i32 {
        let next = self.slot_count() as i32;
        *self.slots.entry(brick).or_insert_with(|| {
            self.bricks.push(brick);
            next
        })
    }

    /// Slots of the 27 bricks around `brick`, itself included, x fastest.
    pub fn neighbourhood(&self, brick: Brick) -> impl Iterator<Item = i32> + '_ {
        (0..27).map(move |n| self.slot(brick + IVec3::new(n % 3, n / 3 % 3, n / 9) - 1))
    }
}
