//! Marching cubes in tensor operations: the definition that the kernels are checked against, and what CPU devices run.
//!
//! Each brick is gathered with one lattice point around it (11 along an edge: its own 8, the first of the next brick for
//! the cells' upper corners, and one on either side for the slopes).

use super::{
    BRICK_RECORD, KEYS, LEVELS, MOST_VIEWS, SurfaceRule, VERTEX,
    table::{CASE_STRIDE, MAX_TRIANGLES, Table},
};
use crate::{
    VolumeError,
    evidence::FRAME,
    field::{COLOR, Field, SAMPLE},
    lattice::BRICK_VOXELS,
};
use burn::{
    Tensor,
    tensor::{DType, Device, Int, TensorData},
};

/// Bricks handled at a time: bounds the memory of the gathered blocks to some 10 MB.
const BRICKS_A_BATCH: usize = 256;
const BLOCK_EDGE: i32 = 11;
const BLOCK: usize = 11 * 11 * 11;
/// From a block's point to the next one along x, y and z.
const STEPS: [i32; 3] = [1, BLOCK_EDGE, BLOCK_EDGE * BLOCK_EDGE];

/// The vertices, and the triangles of each brick.
pub(super) async fn extract(
    field: &Field,
    table: &Table,
    rule: SurfaceRule,
    records: &[i32],
    voxel_size_m: f32,
) -> Result<(Tensor<2>, Vec<i32>), VolumeError> {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for batch in records.chunks(BRICKS_A_BATCH * BRICK_RECORD) {
        let block = Block::gather(field, batch);
        let (soup, counts) = block.triangles(table, rule, batch, voxel_size_m).await?;
        vertices.push(soup);
        triangles.extend(counts);
    }
    Ok((Tensor::cat(vertices, 0), triangles))
}

/// The field around some bricks, point by point: `[bricks * 1331]` each.
struct Block {
    distance: Tensor<1>,
    weight: Tensor<1>,
    evidence: Tensor<1>,
    colors: Option<Tensor<2>>,
    device: Device,
}

impl Block {
    fn gather(field: &Field, records: &[i32]) -> Self {
        let bricks = records.len() / BRICK_RECORD;
        let mut voxels = Vec::with_capacity(bricks * BLOCK);
        for record in records.chunks_exact(BRICK_RECORD) {
            for point in 0..BLOCK as i32 {
                // 0 to 10 along an axis stands for -1 to 9; + 7 makes it 8 for the brick's own first point.
                let place = STEPS.map(|step| point / step % BLOCK_EDGE + 7);
                let [nx, ny, nz] = place.map(|p| p / 8);
                let [x, y, z] = place.map(|p| p % 8);
                let slot = record[(4 + nx + 3 * (ny + 3 * nz)) as usize];
                voxels.push(slot * BRICK_VOXELS as i32 + x + 8 * (y + 8 * z));
            }
        }
        let device = field.device().clone();
        let voxels = ints(voxels, &device);
        let rows = field.capacity() * BRICK_VOXELS;
        let samples = field.samples.clone().reshape([rows, SAMPLE]);
        let samples = samples.select(0, voxels.clone());
        let colors = field.has_color().then(|| {
            let colors = field.colors.clone().reshape([rows, COLOR]);
            colors.select(0, voxels)
        });
        Self {
            distance: samples.clone().narrow(1, 0, 1).squeeze_dim(1),
            weight: samples.clone().narrow(1, 1, 1).squeeze_dim(1),
            evidence: samples.narrow(1, 2, 1).squeeze_dim(1),
            colors,
            device,
        }
    }

    async fn triangles(
        &self,
        table: &Table,
        rule: SurfaceRule,
        records: &[i32],
        voxel_size_m: f32,
    ) -> Result<(Tensor<2>, Vec<i32>), VolumeError> {
        let bricks = records.len() / BRICK_RECORD;
        let cases = self.cases(bricks, rule);
        let counts = cases.clone().map_table(&table.counts, &self.device);
        let per_brick = counts.clone().reshape([bricks, BRICK_VOXELS]).sum_dim(1);
        let per_brick = per_brick.into_data_async().await;
        let per_brick = per_brick.map_err(|error| VolumeError::Device(error.to_string()))?;
        let per_brick: Vec<i32> = per_brick.iter::<i32>().collect();

        // A row for each triangle: its cell and which one of the cell's it is.
        let numbers = ints((0..MAX_TRIANGLES as i32).collect(), &self.device);
        let wanted = numbers
            .unsqueeze_dim::<2>(0)
            .lower(counts.unsqueeze_dim::<2>(1));
        let found = wanted.argwhere_async().await;
        let count = found.dims()[0];
        if count == 0 {
            let none = Tensor::zeros([0, VERTEX], (&self.device, DType::F32));
            return Ok((none, per_brick));
        }
        let cell: Tensor<1, Int> = found.clone().narrow(1, 0, 1).squeeze_dim(1);
        let number: Tensor<1, Int> = found.narrow(1, 1, 1).squeeze_dim(1);

        // A row for each vertex.
        let corner = ints(vec![0, 1, 2], &self.device).unsqueeze_dim::<2>(0);
        let entry = cases.select(0, cell.clone()) * CASE_STRIDE as i32 + number * 3;
        let entry = (entry.unsqueeze_dim::<2>(1) + corner).reshape([count * 3]);
        let edge = entry.map_table(&table.edges, &self.device);
        let cell = cell.unsqueeze_dim::<2>(1).repeat_dim(1, 3);
        let cell = cell.reshape([count * 3]);
        Ok((self.vertices(records, cell, edge, voxel_size_m), per_brick))
    }

    /// The case of each cell, `[bricks * 512]`; 0 where the rule allows no surface.
    fn cases(&self, bricks: usize, rule: SurfaceRule) -> Tensor<1, Int> {
        let cells = cell_points(bricks, &self.device);
        let mut case = Tensor::<1, Int>::zeros([bricks * BRICK_VOXELS], (&self.device, DType::I32));
        let mut observed = case.clone();
        let mut highest = case.clone().float() - 1.0;
        let mut lowest = case.clone().float() + 1.0;
        for corner in 0..8 {
            let offset: i32 = (0..3).map(|axis| (corner >> axis & 1) * STEPS[axis]).sum();
            let point = cells.clone() + offset;
            let distance = self.distance.clone().select(0, point.clone());
            let weight = self.weight.clone().select(0, point);
            case = case + distance.clone().lower_elem(0.0).int().cast(DType::I32) * (1 << corner);
            observed = observed
                + weight
                    .greater_elem(rule.least_weight)
                    .int()
                    .cast(DType::I32);
            highest = highest.max_pair(distance.clone());
            lowest = lowest.min_pair(distance);
        }
        let smooth = (highest - lowest).lower_elem(rule.largest_jump);
        case * observed
            .equal_elem(8)
            .bool_and(smooth)
            .int()
            .cast(DType::I32)
    }

    /// `[vertices, 6]` on the `edge`s of the `cell`s.
    fn vertices(
        &self,
        records: &[i32],
        cell: Tensor<1, Int>,
        edge: Tensor<1, Int>,
        voxel_size_m: f32,
    ) -> Tensor<2> {
        let axis = edge.clone() / 4;
        let low = edge.clone() % 2;
        let high = edge / 2 % 2;
        let along = [0, 1, 2].map(|a| axis.clone().equal_elem(a).int().cast(DType::I32));
        let across = |axis: usize| along[axis].clone() * -1 + 1;
        // On the two other axes, in order, the offsets are `low` and `high`.
        let offset = [
            low.clone() * across(0),
            low * along[0].clone() + high.clone() * along[2].clone(),
            high * across(2),
        ];
        let brick = cell.clone() / BRICK_VOXELS as i32;
        let place: [Tensor<1, Int>; 3] = std::array::from_fn(|axis| {
            let shift = 8i32.pow(axis as u32);
            cell.clone() / shift % 8 + offset[axis].clone()
        });
        let mut a = brick.clone() * BLOCK as i32;
        let mut b = a.clone();
        for axis in 0..3 {
            a = a + (place[axis].clone() + 1) * STEPS[axis];
            b = b + (place[axis].clone() + 1 + along[axis].clone()) * STEPS[axis];
        }
        let da = self.distance.clone().select(0, a.clone());
        let db = self.distance.clone().select(0, b.clone());
        let t = da.clone() / (da - db);

        let mut columns = Vec::with_capacity(VERTEX);
        for axis in 0..3 {
            let bricks = records.chunks_exact(BRICK_RECORD);
            let start = ints(
                bricks.map(|record| record[axis] * 8).collect(),
                &self.device,
            );
            let whole = start.select(0, brick.clone()) + place[axis].clone();
            let part = t.clone() * along[axis].clone().float();
            columns.push((whole.float() + part) * voxel_size_m);
        }
        let normal = STEPS.map(|step| {
            let at_a = self.slope(a.clone(), step);
            let at_b = self.slope(b.clone(), step);
            mix(at_a, at_b, &t)
        });
        columns.push(pack_normal(normal));
        let evidence = self.packed_evidence(a.clone(), b.clone());
        columns.push(self.packed_colors(a, b, &t));
        let [x, y, z] = place;
        let key = (((z * 9 + y) * 9 + x) * 3 + axis).float();
        columns.push(evidence * KEYS + key);
        let columns = columns.into_iter().map(|c| c.unsqueeze_dim(1)).collect();
        Tensor::cat(columns, 1)
    }

    /// Derivative of the field along an axis: central where both neighbours were observed.
    fn slope(&self, at: Tensor<1, Int>, step: i32) -> Tensor<1> {
        let here = self.distance.clone().select(0, at.clone());
        let mut slope = here.zeros_like();
        let mut steps = here.zeros_like();
        for sign in [1, -1] {
            let beside = at.clone() + sign * step;
            let seen = self.weight.clone().select(0, beside.clone());
            let seen = seen.greater_elem(0.0).float();
            let there = self.distance.clone().select(0, beside);
            slope = slope + (there - here.clone()) * seen.clone() * sign;
            steps = steps + seen;
        }
        slope / steps.clamp_min(1.0)
    }

    /// Of the end of the edge that more frames measured.
    fn packed_evidence(&self, a: Tensor<1, Int>, b: Tensor<1, Int>) -> Tensor<1> {
        let a = self.evidence.clone().select(0, a);
        let most = a.max_pair(self.evidence.clone().select(0, b));
        let frames = (most.clone() / FRAME).floor();
        let sum = most - frames.clone() * FRAME;
        let unsure = sum.clone().lower_equal_elem(0.0);
        let level = (sum / frames.clone().clamp_min(1.0) * LEVELS + 1.5).floor();
        frames.clamp_max(MOST_VIEWS) * 64.0 + level.mask_fill(unsure, 0.0)
    }

    fn packed_colors(&self, a: Tensor<1, Int>, b: Tensor<1, Int>, t: &Tensor<1>) -> Tensor<1> {
        let Some(colors) = &self.colors else {
            return t.full_like(mesh::soup::NO_COLOR);
        };
        let a = colors.clone().select(0, a);
        let b = colors.clone().select(0, b);
        let column = |rows: &Tensor<2>, channel| -> Tensor<1> {
            rows.clone().narrow(1, channel, 1).squeeze_dim(1)
        };
        let seen_a = column(&a, 3).greater_elem(0.0);
        let seen_b = column(&b, 3).greater_elem(0.0);
        // A colour that was never seen gives way to the other one.
        let share = t.clone().mask_fill(seen_a.clone().bool_not(), 1.0);
        let share = share.mask_fill(seen_b.clone().bool_not(), 0.0);
        let channel = |channel| {
            let mixed = mix(column(&a, channel), column(&b, channel), &share);
            (mixed + 0.5).floor()
        };
        let packed = channel(0) * 65536.0 + channel(1) * 256.0 + channel(2);
        let unseen = seen_a.bool_or(seen_b).bool_not();
        packed.mask_fill(unseen, mesh::soup::NO_COLOR)
    }
}

/// Index in the block of each cell's lowest corner, `[bricks * 512]`.
fn cell_points(bricks: usize, device: &Device) -> Tensor<1, Int> {
    let points = (0..(bricks * BRICK_VOXELS) as i32).map(|cell| {
        let within: i32 = (0..3)
            .map(|axis| (cell >> (3 * axis) & 7) + 1)
            .zip(STEPS)
            .map(|(place, step)| place * step)
            .sum();
        cell / BRICK_VOXELS as i32 * BLOCK as i32 + within
    });
    ints(points.collect(), device)
}

fn ints(values: Vec<i32>, device: &Device) -> Tensor<1, Int> {
    let count = values.len();
    Tensor::from_data(TensorData::new(values, [count]), (device, DType::I32))
}

fn mix(a: Tensor<1>, b: Tensor<1>, t: &Tensor<1>) -> Tensor<1> {
    a.clone() + (b - a) * t.clone()
}

/// Octahedral map of a direction to two integers of 12 bits, in one float; as in [`mesh::soup::encode`].
fn pack_normal([x, y, z]: [Tensor<1>; 3]) -> Tensor<1> {
    let sum = x.clone().abs() + y.clone().abs() + z.clone().abs();
    let sum = sum.clone().mask_fill(sum.equal_elem(0.0), 1.0);
    let (u, v) = (x / sum.clone(), y / sum);
    let below = z.lower_elem(0.0);
    let sign = |values: &Tensor<1>| values.clone().lower_elem(0.0).float() * -2.0 + 1.0;
    let folded_u = (v.clone().abs() * -1.0 + 1.0) * sign(&u);
    let folded_v = (u.clone().abs() * -1.0 + 1.0) * sign(&v);
    let step = |values: Tensor<1>| ((values * 0.5 + 0.5) * 4095.0 + 0.5).floor();
    let u = step(u.mask_where(below.clone(), folded_u));
    let v = step(v.mask_where(below, folded_v));
    u * 4096.0 + v
}

/// Looks each number up in a table.
trait MapTable {
    fn map_table(self, table: &[i32], device: &Device) -> Self;
}

impl MapTable for Tensor<1, Int> {
    fn map_table(self, table: &[i32], device: &Device) -> Self {
        ints(table.to_vec(), device).select(0, self)
    }
}
