//! A tree of boxes over the solids, so that a ray or a point looks at a few of them and not at all.

use glam::{Vec3, Vec3A};

use crate::solid::Solid;

const DEPTH: usize = 64;

/// Opposite corners of a box.
type Bounds = (Vec3A, Vec3A);

const EMPTY: Bounds = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);

fn union(boxes: impl IntoIterator<Item = Bounds>) -> Bounds {
    boxes
        .into_iter()
        .fold(EMPTY, |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Half of a box's surface.
fn area((low, high): Bounds) -> f32 {
    let size = high - low;
    size.x * size.y + size.y * size.z + size.z * size.x
}

#[derive(Clone, Debug)]
struct Node {
    low: Vec3A,
    high: Vec3A,
    /// First entry of `order` in a leaf; first of two child nodes otherwise.
    first: u32,
    /// 0 in an inner node.
    count: u32,
}

/// The tree; solids are named by their index in the list it was built from.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Bvh {
    pub fn new(solids: &[Solid]) -> Self {
        let bounds: Vec<_> = solids
            .iter()
            .map(Solid::bounds)
            .map(|(low, high)| (low.into(), high.into()))
            .collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * solids.len()),
            order: (0..solids.len() as u32).collect(),
        };
        tree.nodes.push(Node {
            low: Vec3A::ZERO,
            high: Vec3A::ZERO,
            first: 0,
            count: 0,
        });
        tree.split(0, 0, solids.len(), &bounds);
        tree
    }

    /// Fills node `at` with `order[start..end]`, cut where the surface area heuristic (MacDonald and Booth 1990) says.
    fn split(&mut self, at: usize, start: usize, end: usize, bounds: &[Bounds]) {
        let all = union(
            self.order[start..end]
                .iter()
                .map(|&item| bounds[item as usize]),
        );
        let cut = self.cheapest_cut(start, end, bounds, area(all) * (end - start) as f32);
        let children = self.nodes.len() as u32;
        self.nodes[at] = Node {
            low: all.0,
            high: all.1,
            first: if cut.is_some() {
                children
            } else {
                start as u32
            },
            count: if cut.is_some() {
                0
            } else {
                (end - start) as u32
            },
        };
        if let Some(middle) = cut {
            let empty = self.nodes[at].clone();
            self.nodes.extend([empty.clone(), empty]);
            self.split(children as usize, start, middle, bounds);
            self.split(children as usize + 1, middle, end, bounds);
        }
    }

    /// Sorts `order[start..end]` along the best axis and gives where to cut; `None` if a leaf is no dearer.
    fn cheapest_cut(
        &mut self,
        start: usize,
        end: usize,
        bounds: &[Bounds],
        leaf_cost: f32,
    ) -> Option<usize> {
        let count = end - start;
        let mut best = (leaf_cost, None);
        for axis in 0..3 {
            self.sort(start, end, bounds, axis);
            let items = &self.order[start..end];
            let mut right = vec![0.0; count];
            let mut grown = EMPTY;
            for i in (1..count).rev() {
                grown = union([grown, bounds[items[i] as usize]]);
                right[i] = area(grown) * (count - i) as f32;
            }
            let mut grown = EMPTY;
            for i in 1..count {
                grown = union([grown, bounds[items[i - 1] as usize]]);
                // Two boxes must be looked at before their content: the price of one solid for both.
                let cost = area(grown) * i as f32 + right[i] + leaf_cost / count as f32;
                if cost < best.0 {
                    best = (cost, Some((axis, start + i)));
                }
            }
        }
        let (axis, middle) = best.1?;
        self.sort(start, end, bounds, axis);
        Some(middle)
    }

    fn sort(&mut self, start: usize, end: usize, bounds: &[Bounds], axis: usize) {
        let key = |item: &u32| bounds[*item as usize].0[axis] + bounds[*item as usize].1[axis];
        self.order[start..end].sort_by(|a, b| key(a).total_cmp(&key(b)));
    }

    /// Corners, first and count of every node; a node without a count has the two children `first` and `first + 1`.
    #[cfg(feature = "gpu")]
    pub fn nodes(&self) -> impl Iterator<Item = (Vec3, Vec3, u32, u32)> {
        let node = |node: &Node| (node.low.into(), node.high.into(), node.first, node.count);
        self.nodes.iter().map(node)
    }

    /// The solids in the order in which leaves name them.
    #[cfg(feature = "gpu")]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Walks the boxes a ray crosses, nearest first. `visit` gets a solid and the distance that still matters, and
    /// gives the new one; 0 ends the walk.
    pub fn walk_ray(
        &self,
        origin: Vec3,
        dir: Vec3,
        mut limit: f32,
        mut visit: impl FnMut(u32, f32) -> f32,
    ) {
        let origin = Vec3A::from(origin);
        let inverse = Vec3A::from(nowhere_level(dir)).recip();
        let enter = |node: &Node| {
            let a = (node.low - origin) * inverse;
            let b = (node.high - origin) * inverse;
            let near = a.min(b).max_element().max(0.0);
            if near <= a.max(b).min_element() {
                near
            } else {
                f32::INFINITY
            }
        };
        let mut stack = [(0u32, 0.0f32); DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (at, near) = stack[height];
            if near >= limit {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                let range = node.first as usize..(node.first + node.count) as usize;
                for &item in &self.order[range] {
                    limit = visit(item, limit);
                }
                continue;
            }
            let left = enter(&self.nodes[node.first as usize]);
            let right = enter(&self.nodes[node.first as usize + 1]);
            let pair = [(node.first, left), (node.first + 1, right)];
            let (far, close) = if left < right {
                (pair[1], pair[0])
            } else {
                (pair[0], pair[1])
            };
            for next in [far, close] {
                if next.1 < limit {
                    stack[height] = next;
                    height += 1;
                }
            }
        }
    }

    /// The smallest value `distance` has over all solids, asking only those whose box may hold a smaller one.
    pub fn nearest(&self, point: Vec3, distance: impl Fn(u32) -> f32) -> f32 {
        let point = Vec3A::from(point);
        let mut best = f32::INFINITY;
        let mut stack = [0u32; DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            let away = (node.low - point)
                .max(point - node.high)
                .max(Vec3A::ZERO)
                .length();
            // Inside a box (distance 0) a solid may lie at any depth.
            if away > 0.0 && away >= best {
                continue;
            }
            if node.count > 0 {
                let range = node.first as usize..(node.first + node.count) as usize;
                for &item in &self.order[range] {
                    best = best.min(distance(item));
                }
            } else {
                stack[height] = node.first;
                stack[height + 1] = node.first + 1;
                height += 2;
            }
        }
        best
    }
}

/// `dir` without zeros: infinite reciprocals times zero would be NaN, which machines compare differently.
fn nowhere_level(dir: Vec3) -> Vec3 {
    let nudge = |v: f32| if v.abs() < 1e-12 { 1e-12 } else { v };
    Vec3::new(nudge(dir.x), nudge(dir.y), nudge(dir.z))
}
