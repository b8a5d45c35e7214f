//! Distance from many points to the nearest of many others: the core of every 3D metric.
//!
//! A k-d tree of our own: the well-kept crates bring rayon, coroutines and CPU detection with them, which do not fit a
//! small wasm, while this needs one page.

use glam::Vec3;

/// Points below this number are compared one by one.
const LEAF: usize = 12;

/// A fixed set of points that answers "how far is the nearest one".
///
/// A balanced k-d tree without pointers: the points are sorted so that each node is a range, halved at its middle along
/// its longest side. Node i has the children 2 i + 1 and 2 i + 2.
pub struct PointIndex {
    points: Vec<Vec3>,
    splits: Vec<Split>,
}

#[derive(Clone, Copy, Default)]
struct Split {
    axis: usize,
    at: f32,
}

impl PointIndex {
    /// Sorts `points` (finite, any number of them, repetitions welcome).
    pub fn new(points: &[Vec3]) -> Self {
        let mut levels = 0;
        while points.len() >> levels > LEAF {
            levels += 1;
        }
        let mut index = Self {
            points: points.to_vec(),
            splits: vec![Split::default(); (1 << levels) - 1],
        };
        split(&mut index.points, &mut index.splits, 0);
        index
    }

    /// Distance in metres from `query` to the nearest point; infinite when there are no points.
    pub fn distance(&self, query: Vec3) -> f32 {
        let mut best = f32::INFINITY;
        self.search(query, 0, 0, self.points.len(), Vec3::ZERO, 0.0, &mut best);
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

    /// Lowers `best` (squared) to what the node's range holds. `offset` is how far the query lies outside the node's
    /// box along each axis, `gap` its squared length (Arya and Mount 1993).
    #[expect(
        clippy::too_many_arguments,
        reason = "the state of one step down the tree"
    )]
    fn search(
        &self,
        query: Vec3,
        node: usize,
        start: usize,
        end: usize,
        offset: Vec3,
        gap: f32,
        best: &mut f32,
    ) {
        let Some(&Split { axis, at }) = self.splits.get(node) else {
            for &point in &self.points[start..end] {
                *best = best.min(point.distance_squared(query));
            }
            return;
        };
        let middle = start.midpoint(end);
        let beyond = query[axis] - at;
        let low = (2 * node + 1, start, middle);
        let high = (2 * node + 2, middle, end);
        let (near, far) = if beyond < 0.0 {
            (low, high)
        } else {
            (high, low)
        };
        self.search(query, near.0, near.1, near.2, offset, gap, best);
        let mut far_offset = offset;
        far_offset[axis] = beyond;
        let far_gap = gap - offset[axis] * offset[axis] + beyond * beyond;
        if far_gap < *best {
            self.search(query, far.0, far.1, far.2, far_offset, far_gap, best);
        }
    }
}

/// Orders `points` for the subtree at `node`.
fn split(points: &mut [Vec3], splits: &mut [Split], node: usize) {
    if node >= splits.len() {
        return;
    }
    let Some(bounds) = crate::Bounds::of(points) else {
        return;
    };
    let axis = bounds.size().max_position();
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    splits[node] = Split {
        axis,
        at: points[middle][axis],
    };
    let (low, high) = points.split_at_mut(middle);
    split(low, splits, 2 * node + 1);
    split(high, splits, 2 * node + 2);
}
