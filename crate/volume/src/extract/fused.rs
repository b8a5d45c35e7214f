//! Marching cubes as three kernels: the case of every cell, the place of every cell's triangles within its brick, and
//! the triangles. Between them only the bricks' triangle counts are read back, four bytes a brick.

use super::{
    BRICK_RECORD, KEYS, LEVELS, MOST_VIEWS, SurfaceRule, VERTEX,
    table::{CASE_STRIDE, Table},
};
use crate::{
    VolumeError,
    compute::{float_buffer, float_tensor, int_buffer},
    evidence::FRAME,
    field::{COLOR, Field, SAMPLE},
    lattice::BRICK_VOXELS,
};
use burn::{
    Tensor,
    tensor::{DType, Device, Int, TensorData},
};
use burn_cubecl::tensor::CubeTensor;
use cubecl::prelude::*;

const THREADS: u32 = 256;

/// The vertices, and the triangles of each brick.
pub(super) async fn extract(
    field: &Field,
    table: &Table,
    rule: SurfaceRule,
    mut records: Vec<i32>,
    voxel_size_m: f32,
) -> Result<(Tensor<2>, Vec<i32>), VolumeError> {
    let device = field.device();
    let bricks = records.len() / BRICK_RECORD;
    let cells = bricks * BRICK_VOXELS;
    let samples = float_buffer(field.samples.clone())?;
    let colors = float_buffer(field.colors.clone())?;
    let counts = ints(&table.counts, device)?;
    let edges = ints(&table.edges, device)?;
    let codes = int_buffer(Tensor::<1, Int>::empty([cells], (device, DType::I32)))?;
    let totals = int_buffer(Tensor::<1, Int>::empty([bricks], (device, DType::I32)))?;
    let client = samples.client.clone();
    let cell_cubes = CubeCount::new_1d((cells as u32).div_ceil(THREADS));
    let brick_cubes = CubeCount::new_1d((bricks as u32).div_ceil(THREADS));
    let cube = CubeDim::new_1d(THREADS);

    let shape = ints(&records, device)?;
    // SAFETY (all three): indices are derived from slots that the field has rows for and from counts checked below.
    unsafe {
        classify_kernel::launch_unchecked(
            &client,
            cell_cubes.clone(),
            cube,
            samples.clone().into_buffer_arg(),
            shape.into_buffer_arg(),
            counts.into_buffer_arg(),
            codes.clone().into_buffer_arg(),
            cells as u32,
            rule.least_weight,
            rule.largest_jump,
        );
        place_kernel::launch_unchecked(
            &client,
            brick_cubes,
            cube,
            codes.clone().into_buffer_arg(),
            totals.clone().into_buffer_arg(),
            bricks as u32,
        );
    }
    let totals = Tensor::<1, Int>::from_primitive::<burn_cubecl::CubeBackend>(totals);
    let totals = totals.into_data_async().await;
    let totals = totals.map_err(|error| VolumeError::Device(error.to_string()))?;
    let totals: Vec<i32> = totals
        .try_to_vec()
        .map_err(|error| VolumeError::Device(format!("{error:?}")))?;

    let mut triangles = 0;
    for (record, total) in records.chunks_exact_mut(BRICK_RECORD).zip(&totals) {
        record[3] = triangles;
        triangles += total;
    }
    let rows = triangles as usize * 3;
    if rows == 0 {
        return Ok((Tensor::zeros([0, VERTEX], (device, DType::F32)), totals));
    }
    let vertices = float_buffer(Tensor::<1>::empty([rows * VERTEX], (device, DType::F32)))?;
    let shape = ints(&records, device)?;
    unsafe {
        emit_kernel::launch_unchecked(
            &client,
            cell_cubes,
            cube,
            samples.into_buffer_arg(),
            colors.into_buffer_arg(),
            shape.into_buffer_arg(),
            edges.into_buffer_arg(),
            codes.into_buffer_arg(),
            vertices.clone().into_buffer_arg(),
            cells as u32,
            voxel_size_m,
            field.has_color(),
        );
    }
    let vertices: Tensor<1> = float_tensor(vertices);
    Ok((vertices.reshape([rows, VERTEX]), totals))
}

fn ints(values: &[i32], device: &Device) -> Result<CubeTensor, VolumeError> {
    let data = TensorData::new(values.to_vec(), [values.len()]);
    int_buffer(Tensor::<1, Int>::from_data(data, (device, DType::I32)))
}

/// Index of the voxel at `x, y, z` of a brick, each from -1 to 9: it may lie in a brick beside it.
#[cube]
fn voxel_at(records: &[i32], brick: usize, x: i32, y: i32, z: i32) -> usize {
    let nx = (x + 8) / 8;
    let ny = (y + 8) / 8;
    let nz = (z + 8) / 8;
    let neighbour = nx + 3 * (ny + 3 * nz);
    let slot = records[brick * BRICK_RECORD + 4 + neighbour as usize];
    let local = (x + 8) % 8 + 8 * ((y + 8) % 8 + 8 * ((z + 8) % 8));
    slot as usize * BRICK_VOXELS + local as usize
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn classify_kernel(
    samples: &[f32],
    records: &[i32],
    counts: &[i32],
    codes: &mut [i32],
    cells: u32,
    least_weight: f32,
    largest_jump: f32,
) {
    let thread = ABSOLUTE_POS;
    if thread >= cells as usize {
        terminate!();
    }
    let brick = thread / BRICK_VOXELS;
    let x = (thread % 8) as i32;
    let y = (thread / 8 % 8) as i32;
    let z = (thread / 64 % 8) as i32;
    let mut case = 0i32;
    let mut observed = 0i32;
    let mut highest = f32::new(-1.0);
    let mut lowest = f32::new(1.0);
    for corner in 0..8 {
        let voxel = voxel_at(
            records,
            brick,
            x + corner % 2,
            y + corner / 2 % 2,
            z + corner / 4,
        );
        let distance = samples[voxel * SAMPLE];
        if samples[voxel * SAMPLE + 1] > least_weight {
            observed += 1;
        }
        if distance > highest {
            highest = distance;
        }
        if distance < lowest {
            lowest = distance;
        }
        if distance < 0.0 {
            case += 1 << corner;
        }
    }
    let mut code = 0i32;
    if observed == 8 && highest - lowest < largest_jump {
        code = case + counts[case as usize] * 256;
    }
    codes[thread] = code;
}

/// Bits 0 to 7 of a code are the cell's case, 8 to 11 its triangles, from 12 on its first triangle within the brick.
#[cube(launch_unchecked)]
fn place_kernel(codes: &mut [i32], totals: &mut [i32], bricks: u32) {
    let brick = ABSOLUTE_POS;
    if brick >= bricks as usize {
        terminate!();
    }
    let mut triangles = 0i32;
    for cell in 0..BRICK_VOXELS {
        let at = brick * BRICK_VOXELS + cell;
        let code = codes[at];
        codes[at] = code + triangles * 4096;
        triangles += code / 256;
    }
    totals[brick] = triangles;
}

/// Derivative of the field along an axis at a voxel of a brick: central where both neighbours were observed.
#[cube]
#[allow(clippy::too_many_arguments)]
fn slope(
    samples: &[f32],
    records: &[i32],
    brick: usize,
    x: i32,
    y: i32,
    z: i32,
    #[comptime] axis: u32,
) -> f32 {
    let dx = comptime!(if axis == 0 { 1i32 } else { 0i32 });
    let dy = comptime!(if axis == 1 { 1i32 } else { 0i32 });
    let dz = comptime!(if axis == 2 { 1i32 } else { 0i32 });
    let here = samples[voxel_at(records, brick, x, y, z) * SAMPLE];
    let above = voxel_at(records, brick, x + dx, y + dy, z + dz) * SAMPLE;
    let below = voxel_at(records, brick, x - dx, y - dy, z - dz) * SAMPLE;
    let mut slope = 0.0f32;
    let mut steps = 0.0f32;
    if samples[above + 1] > 0.0 {
        slope += samples[above] - here;
        steps += 1.0;
    }
    if samples[below + 1] > 0.0 {
        slope += here - samples[below];
        steps += 1.0;
    }
    slope / steps.max(1.0)
}

#[cube]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// The evidence of the end of an edge that more frames measured, as [`mesh::soup::Evidence`] packs it.
#[cube]
fn evidence(a: f32, b: f32) -> f32 {
    let most = a.max(b);
    let frames = (most / FRAME).floor();
    let sum = most - frames * FRAME;
    let mut level = 0.0f32;
    if sum > 0.0 {
        level = (sum / frames * LEVELS + 1.5).floor();
    }
    frames.min(MOST_VIEWS) * 64.0 + level
}

/// Octahedral map of a direction to two integers of 12 bits, in one float.
#[cube]
fn pack_normal(x: f32, y: f32, z: f32) -> f32 {
    let sum = x.abs() + y.abs() + z.abs();
    let mut u = 0.0f32;
    let mut v = 0.0f32;
    if sum > 0.0 {
        u = x / sum;
        v = y / sum;
        if z < 0.0 {
            let mut su = 1.0f32;
            let mut sv = 1.0f32;
            if u < 0.0 {
                su = -1.0f32;
            }
            if v < 0.0 {
                sv = -1.0f32;
            }
            let folded = (1.0f32 - v.abs()) * su;
            v = (1.0f32 - u.abs()) * sv;
            u = folded;
        }
    }
    let u = ((u * 0.5 + 0.5) * 4095.0 + 0.5).floor();
    let v = ((v * 0.5 + 0.5) * 4095.0 + 0.5).floor();
    u * 4096.0 + v
}

#[cube]
fn channel(colors: &[f32], a: usize, b: usize, t: f32) -> f32 {
    (mix(colors[a], colors[b], t) + 0.5).floor()
}

#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
fn emit_kernel(
    samples: &[f32],
    colors: &[f32],
    records: &[i32],
    edges: &[i32],
    codes: &[i32],
    vertices: &mut [f32],
    cells: u32,
    voxel_size_m: f32,
    #[comptime] has_color: bool,
) {
    let thread = ABSOLUTE_POS;
    if thread >= cells as usize {
        terminate!();
    }
    let code = codes[thread];
    let corners = (code / 256 % 16) * 3;
    let brick = thread / BRICK_VOXELS;
    let record = brick * BRICK_RECORD;
    let first = (records[record + 3] + code / 4096) * 3;
    let case = (code % 256) as usize;
    for corner in 0..corners {
        let edge = edges[case * CASE_STRIDE + corner as usize];
        let axis = edge / 4;
        let low = edge % 2;
        let high = edge / 2 % 2;
        // Point A of the edge, in voxels of the brick; the cell's own corner plus the edge's offset on the other two axes.
        let mut x = (thread % 8) as i32;
        let mut y = (thread / 8 % 8) as i32;
        let mut z = (thread / 64 % 8) as i32;
        let mut ex = 0i32;
        let mut ey = 0i32;
        let mut ez = 0i32;
        if axis == 0 {
            y += low;
            z += high;
            ex = 1;
        } else if axis == 1 {
            x += low;
            z += high;
            ey = 1;
        } else {
            x += low;
            y += high;
            ez = 1;
        }
        let a = voxel_at(records, brick, x, y, z);
        let b = voxel_at(records, brick, x + ex, y + ey, z + ez);
        let da = samples[a * SAMPLE];
        let db = samples[b * SAMPLE];
        let t = da / (da - db);

        let nx = mix(
            slope(samples, records, brick, x, y, z, 0u32),
            slope(samples, records, brick, x + ex, y + ey, z + ez, 0u32),
            t,
        );
        let ny = mix(
            slope(samples, records, brick, x, y, z, 1u32),
            slope(samples, records, brick, x + ex, y + ey, z + ez, 1u32),
            t,
        );
        let nz = mix(
            slope(samples, records, brick, x, y, z, 2u32),
            slope(samples, records, brick, x + ex, y + ey, z + ez, 2u32),
            t,
        );

        let mut packed = f32::new(mesh::soup::NO_COLOR);
        if comptime!(has_color) {
            let ca = a * COLOR;
            let cb = b * COLOR;
            let seen_a = colors[ca + 3] > 0.0;
            let seen_b = colors[cb + 3] > 0.0;
            if seen_a || seen_b {
                // A colour that was never seen gives way to the other one.
                let mut share = t;
                if !seen_b {
                    share = 0.0;
                } else if !seen_a {
                    share = 1.0;
                }
                packed = channel(colors, ca, cb, share) * 65536.0
                    + channel(colors, ca + 1, cb + 1, share) * 256.0
                    + channel(colors, ca + 2, cb + 2, share);
            }
        }

        let to = (first + corner) as usize * VERTEX;
        vertices[to] = ((records[record] * 8 + x) as f32 + t * ex as f32) * voxel_size_m;
        vertices[to + 1] = ((records[record + 1] * 8 + y) as f32 + t * ey as f32) * voxel_size_m;
        vertices[to + 2] = ((records[record + 2] * 8 + z) as f32 + t * ez as f32) * voxel_size_m;
        vertices[to + 3] = pack_normal(nx, ny, nz);
        vertices[to + 4] = packed;
        let evidence = evidence(samples[a * SAMPLE + 2], samples[b * SAMPLE + 2]);
        vertices[to + 5] = evidence * KEYS + ((x + 9 * (y + 9 * z)) * 3 + axis) as f32;
    }
}
