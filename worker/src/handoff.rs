//! From burn's tensors to the picture: on the GPU by a copy from burn's buffer into the arena's, never through the heap.

use crate::messages::BrickMessage;
use burn_cubecl::CubeBackend;
use cubecl::wgpu::{AutoCompiler, WgpuServer};
use mesh::soup::{VERTEX_FLOATS, VERTEX_STRIDE_BYTES};
use std::ops::Range;
use view::Arena;
use volume::{Brick, BrickMeshes, VolumeError};

fn lost(error: impl std::fmt::Debug) -> VolumeError {
    VolumeError::Device(format!("{error:?}"))
}

/// Copies bricks into the arena on the device that both share.
pub fn to_arena(
    meshes: BrickMeshes,
    arena: &mut Arena,
    device: &wgpu::Device,
    queue: &wgpu::Queue,
) -> Result<(), VolumeError> {
    let BrickMeshes { vertices, ranges } = meshes;
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("bricks to arena"),
    });
    if vertices.dims()[0] == 0 {
        for (brick, _) in ranges {
            arena.erase(&mut encoder, brick.to_array());
        }
        queue.submit([encoder.finish()]);
        return Ok(());
    }
    let cube = vertices.try_into_primitive::<CubeBackend>().map_err(lost)?;
    let resource = cube
        .client
        .get_resource::<WgpuServer<AutoCompiler>>(cube.handle.clone())
        .map_err(lost)?;
    // What burn has queued must run first; from here on the shared queue keeps the order.
    cube.client.flush().map_err(lost)?;
    let source = resource.resource();
    for (brick, rows) in ranges {
        let offset = source.offset + rows.start as u64 * VERTEX_STRIDE_BYTES;
        let count = rows.len() as u32;
        let inserted = arena.insert(
            &mut encoder,
            brick.to_array(),
            &source.buffer,
            offset,
            count,
        );
        inserted.map_err(|error| VolumeError::Device(error.to_string()))?;
    }
    queue.submit([encoder.finish()]);
    Ok(())
}

/// Reads bricks, for a view that does not share their device.
pub async fn read(meshes: BrickMeshes) -> Result<Soup, VolumeError> {
    let BrickMeshes { vertices, ranges } = meshes;
    let data = vertices.into_data_async().await.map_err(lost)?;
    let numbers = data.try_to_vec().map_err(lost)?;
    Ok(Soup { numbers, ranges })
}

/// Bricks and their vertices in main memory.
pub struct Soup {
    /// Of all bricks.
    pub numbers: Vec<f32>,
    ranges: Vec<(Brick, Range<usize>)>,
}

impl Soup {
    /// Of bricks that follow each other in `numbers`, as another worker sends them. Those that have no room there stay out.
    pub fn received(bricks: &[BrickMessage], numbers: Vec<f32>) -> Self {
        let (mut ranges, mut start) = (Vec::with_capacity(bricks.len()), 0);
        for &BrickMessage(brick, vertices) in bricks {
            let end = start + vertices as usize;
            if end * VERTEX_FLOATS > numbers.len() {
                break;
            }
            ranges.push((Brick::from_array(brick), start..end));
            start = end;
        }
        Self { numbers, ranges }
    }

    /// Each brick with its part of the numbers.
    pub fn bricks(&self) -> impl Iterator<Item = ([i32; 3], &[f32])> {
        self.ranges.iter().map(|(brick, rows)| {
            let part = rows.start * VERTEX_FLOATS..rows.end * VERTEX_FLOATS;
            (brick.to_array(), &self.numbers[part])
        })
    }
}
