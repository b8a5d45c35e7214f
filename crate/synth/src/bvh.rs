//! A tree of boxes over the solids, so that a ray or a point looks at a few of them and not at all.

use glam::Vec3;

use crate::solid::Solid;

const LEAF: usize = 3;
const DEPTH: usize = 64;

#[derive(Clone, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
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
        let bounds: Vec<_> = solids.iter().map(Solid::bounds).collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * solids.len()),
            order: (0..solids.len() as u32).collect(),
        };
        tree.nodes.push(Node {
            low: Vec3::ZERO,
            high: Vec3::ZERO,
            first: 0,
            count: 0,
        });
        tree.split(0, 0, solids.len(), &bounds);
        tree
    }

    /// Fills node `at` with `order[start..end]`, halving at the median of the longest side.
    fn split(&mut self, at: usize, start: usize, end: usize, bounds: &[(Vec3, Vec3)]) {
        let items = &mut self.order[start..end];
        let mut low = Vec3::INFINITY;
        let mut high = Vec3::NEG_INFINITY;
        let mut first = Vec3::INFINITY;
        let mut last = Vec3::NEG_INFINITY;
        for &item in items.iter() {
            let (a, b) = bounds[item as usize];
            low = low.min(a);
            high = high.max(b);
            first = first.min(a + b);
            last = last.max(a + b);
        }
        let leaf = items.len() <= LEAF;
        let middle = start + items.len() / 2;
        if !leaf {
            let axis = (last - first).max_position();
            let key = |item: &u32| bounds[*item as usize].0[axis] + bounds[*item as usize].1[axis];
            items.sort_by(|a, b| key(a).total_cmp(&key(b)));
        }
        let children = self.nodes.len();
        self.nodes[at] = Node {
            low,
            high,
            first: if leaf { start } else { children } as u32,
            count: if leaf { end - start } else { 0 } as u32,
        };
        if !leaf {
            let empty = self.nodes[at].clone();
            self.nodes.push(empty.clone());
            self.nodes.push(empty);
            self.split(children, start, middle, bounds);
            self.split(children + 1, middle, end, bounds);
        }
    }

    /// Walks the boxes a ray crosses, nearest first. `visit` gets a solid and the distance that still matters, and
    /// gives the new one; 0 ends the walk.
    pub fn walk_ray(&self, origin: Vec3, dir: Vec3, mut limit: f32, mut visit: impl FnMut(u32, f32) -> f32) {
        let inverse = dir.recip();
        let enter = |node: &Node| {
            let a = (node.low - origin) * inverse;
            let b = (node.high - origin) * inverse;
            let near = a.min(b).max_element().max(0.0);
            if near <= a.max(b).min_element() { near } else { f32::INFINITY }
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
            let (far, close) = if left < right { (pair[1], pair[0]) } else { (pair[0], pair[1]) };
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
        let mut best = f32::INFINITY;
        let mut stack = [0u32; DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            let away = (node.low - point).max(point - node.high).max(Vec3::ZERO).length();
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
