//! The triangles of a marching-cubes cell, made by rule instead of copied from a list.
//!
//! Corner `c` of a cell lies at offset `(c & 1, c >> 1 & 1, c >> 2 & 1)`; bit `c` of a case says that corner `c` is
//! inside (negative). Edge `e` runs along axis `e / 4` from the `(e % 4)`-th of the corners whose bit of that axis is 0.
//!
//! On each face of the cell, every run of neighbouring inside corners is cut off by one segment; two inside corners that
//! face each other diagonally stay apart. The rule reads nothing but the face's own corners, so the two cells that share
//! a face draw the same segments on it, and the surface has no holes. The segments of the six faces join to loops, each
//! loop becomes a fan. (Lorensen and Cline 1987, with the ambiguous faces settled as in Nielson and Hamann 1991.)

/// Most triangles of a cell.
pub(crate) const MAX_TRIANGLES: usize = 5;
/// Entries of a case in [`Table::edges`]: 5 triangles of 3 edges, and one to fill up.
pub(crate) const CASE_STRIDE: usize = 16;

/// The triangles of every case.
pub(crate) struct Table {
    /// `[256 * 16]`: edges of the case's triangles, three by three.
    pub edges: Vec<i32>,
    /// `[256]`: triangles of the case.
    pub counts: Vec<i32>,
}

/// Corners of each face, counter-clockwise seen from outside the cell.
const FACES: [[usize; 4]; 6] = [
    [0, 2, 3, 1],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
];

impl Table {
    pub fn new() -> Self {
        let mut edges = vec![0; 256 * CASE_STRIDE];
        let mut counts = vec![0; 256];
        for case in 0..256 {
            let triangles = triangles(case);
            counts[case] = triangles.len() as i32;
            for (slot, edge) in edges[case * CASE_STRIDE..]
                .iter_mut()
                .zip(triangles.into_iter().flatten())
            {
                *slot = edge as i32;
            }
        }
        Self { edges, counts }
    }
}

/// The edge between two corners that differ in one axis.
fn edge(a: usize, b: usize) -> usize {
    let base = a & b;
    match a ^ b {
        1 => base >> 1,
        2 => 4 + (base & 1) + (base >> 2 << 1),
        _ => 8 + base,
    }
}

fn triangles(case: usize) -> Vec<[usize; 3]> {
    let inside = |corner: usize| case >> corner & 1 == 1;
    // Where the surface goes on from each edge that it crosses.
    let mut next = [None; 12];
    for face in FACES {
        for start in 0..4 {
            let before = face[(start + 3) % 4];
            if !inside(face[start]) || inside(before) {
                continue;
            }
            let length = (1..4)
                .find(|&step| !inside(face[(start + step) % 4]))
                .unwrap_or(4);
            let last = face[(start + length - 1) % 4];
            let after = face[(start + length) % 4];
            next[edge(before, face[start])] = Some(edge(last, after));
        }
    }
    let mut triangles = Vec::new();
    for first in 0..12 {
        let mut corner = next[first].take();
        while let Some(second) = corner.filter(|&edge| edge != first) {
            let third = next[second].take();
            if let Some(third) = third.filter(|&edge| edge != first) {
                triangles.push([first, second, third]);
            }
            corner = third;
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn every_case_fits_and_uses_exactly_the_crossed_edges() {
        let table = Table::new();
        for case in 0..256usize {
            let count = table.counts[case] as usize;
            assert!(count <= MAX_TRIANGLES, "case {case}: {count} triangles");
            let mut used = [false; 12];
            for &edge in &table.edges[case * CASE_STRIDE..][..count * 3] {
                used[edge as usize] = true;
            }
            for a in 0..8usize {
                for b in [a | 1, a | 2, a | 4] {
                    if a != b {
                        let crossed = (case >> a & 1) != (case >> b & 1);
                        assert_eq!(used[edge(a, b)], crossed, "case {case}, corners {a} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn inner_sides_of_triangles_cancel_and_the_rest_lies_on_faces() {
        for case in 0..256 {
            let mut sides: HashMap<(usize, usize), i32> = HashMap::new();
            for [a, b, c] in triangles(case) {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *sides.entry((from.min(to), from.max(to))).or_default() +=
                        if from < to { 1 } else { -1 };
                }
            }
            // What does not cancel is drawn on a face, where the neighbouring cell draws its opposite.
            for ((a, b), count) in sides {
                assert!(
                    count.abs() <= 1,
                    "case {case}: side {a}-{b} used {count} times"
                );
                if count != 0 {
                    let on = |face: &[usize; 4], e: usize| {
                        (0..4).any(|i| edge(face[i], face[(i + 1) % 4]) == e)
                    };
                    assert!(
                        FACES.iter().any(|face| on(face, a) && on(face, b)),
                        "case {case}"
                    );
                }
            }
        }
    }
}
