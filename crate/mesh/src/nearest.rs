//! Distance from many points to the nearest of many others: the core of every 3D metric.
//!
//! A k-d tree of our own: the well-kept crates bring rayon, coroutines and CPU detection with them, which do not fit a
//! small wasm, while this needs one page.

use glam::{Vec3, Vec3A};

/// Points up to this number are compared one by one.
const LEAF: usize = 8;

/// A fixed set of points that answers "how far is the nearest one".
///
/// A balanced k-d tree without pointers: the points are sorted so that each node is a range of them, halved at its
/// middle along its longest side. Node i has the children 2 i + 1 and 2 i + 2. Each node keeps the tight box around its
/// points, so that also a query far away from a thin surface discards most of it.
pub struct PointIndex {
    points: Vec<Vec3A>,
    boxes: Vec<[Vec3A; 2]>,
}

impl PointIndex {
    /// Sorts `points` (finite, any number of them, repetitions welcome).
    pub fn new(points: &[Vec3]) -> Self {
        let mut levels = 0;
        while points.len() >> levels > LEAF {
            levels += 1;
        }
        let mut index = Self {
            points: points.iter().map(|&point| point.into()).collect(),
            boxes: vec![[Vec3A::ZERO; 2]; (2 << levels) - 1],
        };
        arrange(&mut index.points, &mut index.boxes, 0);
        index
    }

    /// Distance in metres from `query` to the nearest point; infinite when there are no points.
    pub fn distance(&self, query: Vec3) -> f32 {
        let mut best = f32::INFINITY;
        self.search(query.into(), 0, &self.points, &mut best);
        best.sqrt()
    }

    /// [`Self::distance`] for each of `queries`, in their order; on all cores where there are threads.
    pub fn distances(&self, queries: &[Vec3]) -> Vec<f32> {
        #[cfg(target_family = "wasm")]
        return queries.iter().map(|&query| self.distance(query)).collect();
        #[cfg(not(target_family = "wasm"))]
        {
            let threads = std::thread::available_parallelism().map_or(1, usize::from);
            let share = queries.len().div_ceil(threads).max(1024);
            let mut distances = vec![0.0; queries.len()];
            std::thread::scope(|scope| {
                for (queries, out) in queries.chunks(share).zip(distances.chunks_mut(share)) {
                    scope.spawn(move || {
                        for (&query, out) in queries.iter().zip(out) {
                            *out = self.distance(query);
                        }
                    });
                }
            });
            distances
        }
    }

    /// Lowers `best`, a squared distance, to the nearest of `points`, which are those of `node`.
    fn search(&self, query: Vec3A, node: usize, points: &[Vec3A], best: &mut f32) {
        let (low, high) = (2 * node + 1, 2 * node + 2);
        if high >= self.boxes.len() {
            for &point in points {
                *best = best.min(point.distance_squared(query));
            }
            return;
        }
        let (low_points, high_points) = points.split_at(points.len() / 2);
        let mut near = (self.gap(query, low), low, low_points);
        let mut far = (self.gap(query, high), high, high_points);
        if far.0 < near.0 {
            (near, far) = (far, near);
        }
        for (gap, node, points) in [near, far] {
            if gap < *best {
                self.search(query, node, points, best);
            }
        }
    }

    /// Squared distance from `query` to the box of `node`.
    fn gap(&self, query: Vec3A, node: usize) -> f32 {
        let [min, max] = self.boxes[node];
        query.distance_squared(query.clamp(min, max))
    }
}

/// Orders the points of `node` and of all below it, and fills in their boxes.
fn arrange(points: &mut [Vec3A], boxes: &mut [[Vec3A; 2]], node: usize) {
    if node >= boxes.len() || points.is_empty() {
        return;
    }
    let min = points.iter().copied().fold(points[0], Vec3A::min);
    let max = points.iter().copied().fold(points[0], Vec3A::max);
    boxes[node] = [min, max];
    let axis = (max - min).max_position();
    let middle = points.len() / 2;
    if 2 * node + 1 < boxes.len() {
        points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    }
    let (low, high) = points.split_at_mut(middle);
    arrange(low, boxes, 2 * node + 1);
    arrange(high, boxes, 2 * node + 2);
}
