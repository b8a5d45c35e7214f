//! Where the mesh lives while it is looked at: bricks in a few large vertex buffers.
//!
//! Burn's buffers cannot be vertex buffers and are recycled, so each brick is copied on the GPU
//! into pages of our own; nothing is read back. Few large pages keep draws few and every buffer
//! far below WebGPU's default limits. What is not in use is zero, that is triangles without area
//! (fresh buffers are zero by WebGPU's rules), so a draw may run across it.

use crate::bounds;
use crate::free_list::FreeList;

use glam::{Mat4, Vec3};
use mesh::Bounds;
use mesh::soup::{VERTEX_FLOATS, VERTEX_STRIDE_BYTES};
use std::collections::BTreeMap;
use std::ops::Range;

/// Vertices are given out in blocks, so that a brick that grows a little finds room again. A
/// multiple of 3, so that a triangle's corner is `vertex_index % 3` anywhere.
const BLOCK_VERTICES: u32 = 96;
const BLOCK_BYTES: u64 = BLOCK_VERTICES as u64 * VERTEX_STRIDE_BYTES;

/// Ranges no further apart than this are drawn as one: a draw call costs more than the vertices
/// between, which are bricks out of sight or zeros.
const BRIDGE_BLOCKS: u32 = 32;

/// What the arena turns down.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArenaError {
    /// One brick needs a larger buffer than the device allows.
    #[error(
        "brick {brick:?}: expected at most {limit_bytes} bytes of vertices (the device's largest buffer), found {found_bytes}; use smaller bricks or larger voxels"
    )]
    BrickTooLarge {
        /// The brick.
        brick: [i32; 3],
        /// Bytes that its vertices take.
        found_bytes: u64,
        /// Bytes of the device's largest buffer.
        limit_bytes: u64,
    },
    /// A slice that holds no whole triangles.
    #[error(
        "brick {brick:?}: expected a multiple of {} numbers (3 vertices a triangle), found {found}",
        3 * VERTEX_FLOATS
    )]
    NotTriangles {
        /// The brick.
        brick: [i32; 3],
        /// Numbers in the slice.
        found: usize,
    },
}

struct Page {
    buffer: wgpu::Buffer,
    blocks: u32,
    free: FreeList,
}

#[derive(Clone, Debug)]
struct Slot {
    page: usize,
    blocks: Range<u32>,
    vertices: u32,
}

/// Bricks of triangle soup ([`mesh::soup`]) on the GPU, each replaceable on its own.
pub struct Arena {
    device: wgpu::Device,
    page_bytes: u64,
    brick_size_m: f32,
    pages: Vec<Page>,
    slots: BTreeMap<[i32; 3], Slot>,
}

impl Arena {
    /// An empty arena that grows in pages of `page_bytes` (8 to 16 MiB is a good size) for bricks
    /// of `brick_size_m` metres a side.
    pub fn new(device: &wgpu::Device, page_bytes: u64, brick_size_m: f32) -> Self {
        Self {
            device: device.clone(),
            page_bytes: page_bytes.min(device.limits().max_buffer_size),
            brick_size_m,
            pages: Vec::new(),
            slots: BTreeMap::new(),
        }
    }

    /// Copies `vertex_count` vertices from `source` (usage COPY_SRC, offset a multiple of 4) as
    /// the new version of `brick`; none removes it. The copy is recorded in `encoder`.
    ///
    /// # Errors
    /// [`ArenaError::BrickTooLarge`]; the old version is gone then.
    pub fn insert(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        brick: [i32; 3],
        source: &wgpu::Buffer,
        source_offset_bytes: u64,
        vertex_count: u32,
    ) -> Result<(), ArenaError> {
        self.erase(encoder, brick);
        if let Some((buffer, at)) = self.place(brick, vertex_count)? {
            let bytes = u64::from(vertex_count) * VERTEX_STRIDE_BYTES;
            encoder.copy_buffer_to_buffer(source, source_offset_bytes, buffer, at, bytes);
        }
        Ok(())
    }

    /// The same from main memory. The write is scheduled before the next submit, hence before
    /// copies that are recorded but not yet submitted: do not mix both for one brick in one
    /// submit.
    ///
    /// # Errors
    /// [`ArenaError::NotTriangles`], [`ArenaError::BrickTooLarge`].
    pub fn insert_from_slice(
        &mut self,
        queue: &wgpu::Queue,
        brick: [i32; 3],
        vertices: &[f32],
    ) -> Result<(), ArenaError> {
        if !vertices.len().is_multiple_of(3 * VERTEX_FLOATS) {
            return Err(ArenaError::NotTriangles {
                brick,
                found: vertices.len(),
            });
        }
        let vertex_count = (vertices.len() / VERTEX_FLOATS) as u32;
        if let Some((buffer, bytes)) = self.remove(brick) {
            let zeros = vec![0; (bytes.end - bytes.start) as usize];
            queue.write_buffer(&buffer, bytes.start, &zeros);
        }
        if let Some((buffer, at)) = self.place(brick, vertex_count)? {
            queue.write_buffer(buffer, at, bytemuck::cast_slice(vertices));
        }
        Ok(())
    }

    /// Removes all bricks and gives the memory back.
    pub fn clear(&mut self) {
        self.slots.clear();
        self.pages.clear();
    }

    /// Number of bricks with a surface.
    pub fn brick_count(&self) -> usize {
        self.slots.len()
    }

    /// Triangles held.
    pub fn triangle_count(&self) -> u64 {
        self.slots
            .values()
            .map(|slot| u64::from(slot.vertices / 3))
            .sum()
    }

    /// GPU memory held, free parts of pages included.
    pub fn bytes(&self) -> u64 {
        let blocks: u64 = self.pages.iter().map(|page| u64::from(page.blocks)).sum();
        blocks * BLOCK_BYTES
    }

    /// Points around the surface for [`crate::Controls::set_outline`], a scan's strays left out; empty when it is.
    pub fn outline(&self) -> Vec<Vec3> {
        bounds::outline(self.slots.keys(), self.brick_size_m)
    }

    /// The box around all bricks, exact to one brick; `None` when empty.
    pub fn bounds(&self) -> Option<Bounds> {
        bounds::of_bricks(self.slots.keys(), self.brick_size_m)
    }

    /// Vertex ranges to draw, by page, for what `clip_from_world` may see; touching ones merged.
    pub(crate) fn draws(&self, clip_from_world: &Mat4) -> Vec<(&wgpu::Buffer, Vec<Range<u32>>)> {
        let mut visible: Vec<Vec<Range<u32>>> = vec![Vec::new(); self.pages.len()];
        for (&brick, slot) in &self.slots {
            let reach = bounds::reach_of_brick(brick, self.brick_size_m);
            if bounds::may_be_seen(&reach, clip_from_world) {
                visible[slot.page].push(slot.blocks.clone());
            }
        }
        let pages = self.pages.iter().zip(visible);
        pages
            .filter_map(|(page, ranges)| {
                let merged = merge(ranges);
                (!merged.is_empty()).then_some((&page.buffer, merged))
            })
            .collect()
    }

    /// Takes a brick away.
    pub fn erase(&mut self, encoder: &mut wgpu::CommandEncoder, brick: [i32; 3]) {
        if let Some((buffer, bytes)) = self.remove(brick) {
            encoder.clear_buffer(&buffer, bytes.start, Some(bytes.end - bytes.start));
        }
    }

    /// Frees a brick's room: the buffer and bytes to zero.
    fn remove(&mut self, brick: [i32; 3]) -> Option<(wgpu::Buffer, Range<u64>)> {
        let slot = self.slots.remove(&brick)?;
        let page = self.pages.get_mut(slot.page)?;
        page.free.give_back(slot.blocks.clone());
        let bytes =
            u64::from(slot.blocks.start) * BLOCK_BYTES..u64::from(slot.blocks.end) * BLOCK_BYTES;
        Some((page.buffer.clone(), bytes))
    }

    /// Finds room for a brick that has none: the buffer and the byte to write from, or `None`
    /// when there is nothing to write.
    fn place(
        &mut self,
        brick: [i32; 3],
        vertices: u32,
    ) -> Result<Option<(&wgpu::Buffer, u64)>, ArenaError> {
        if vertices == 0 {
            return Ok(None);
        }
        let (page, blocks) = self.take(brick, vertices.div_ceil(BLOCK_VERTICES))?;
        let at = u64::from(blocks.start) * BLOCK_BYTES;
        let slot = Slot {
            page,
            blocks,
            vertices,
        };
        self.slots.insert(brick, slot);
        Ok(Some((&self.pages[page].buffer, at)))
    }

    fn take(&mut self, brick: [i32; 3], blocks: u32) -> Result<(usize, Range<u32>), ArenaError> {
        for (index, page) in self.pages.iter_mut().enumerate() {
            if let Some(range) = page.free.take(blocks) {
                return Ok((index, range));
            }
        }
        let limit_bytes = self.device.limits().max_buffer_size;
        let found_bytes = u64::from(blocks) * BLOCK_BYTES;
        if found_bytes > limit_bytes {
            return Err(ArenaError::BrickTooLarge {
                brick,
                found_bytes,
                limit_bytes,
            });
        }
        let page_blocks = blocks.max((self.page_bytes / BLOCK_BYTES) as u32);
        self.pages.push(Page {
            buffer: self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("mesh page"),
                size: u64::from(page_blocks) * BLOCK_BYTES,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            blocks: page_blocks,
            free: FreeList::new(blocks..page_blocks),
        });
        Ok((self.pages.len() - 1, 0..blocks))
    }
}

/// Blocks to vertices, sorted, near ranges joined.
fn merge(mut blocks: Vec<Range<u32>>) -> Vec<Range<u32>> {
    blocks.sort_by_key(|range| range.start);
    let mut merged: Vec<Range<u32>> = Vec::new();
    for range in blocks {
        let range = range.start * BLOCK_VERTICES..range.end * BLOCK_VERTICES;
        match merged.last_mut() {
            Some(last) if range.start - last.end <= BRIDGE_BLOCKS * BLOCK_VERTICES => {
                last.end = range.end;
            }
            _ => merged.push(range),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_ranges_are_drawn_as_one() {
        let merged = merge(vec![40..41, 0..1, 1..3, 4..6, 73..80]);
        assert_eq!(merged, vec![0..6 * 96, 40 * 96..80 * 96]);
    }
}
