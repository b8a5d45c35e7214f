//! Eigenvectors of symmetric 3x3 matrices by Jacobi rotations (Golub and Van Loan, section 8.5).

use glam::{DMat3, DVec3};

/// The unit eigenvector of the smallest eigenvalue of a symmetric matrix.
pub(super) fn smallest(matrix: DMat3) -> DVec3 {
    let mut values = matrix;
    let mut vectors = DMat3::IDENTITY;
    for (p, q) in [(0, 1), (0, 2), (1, 2)].repeat(12) {
        let turn = rotation(values, p, q);
        values = turn.transpose() * values * turn;
        vectors *= turn;
    }
    let least = (0..3).min_by(|&i, &j| values.col(i)[i].total_cmp(&values.col(j)[j]));
    vectors.col(least.unwrap_or(0)).normalize_or(DVec3::Z)
}

/// The rotation in the plane of axes p and q that makes their mixed entry zero.
fn rotation(a: DMat3, p: usize, q: usize) -> DMat3 {
    let mut turn = DMat3::IDENTITY;
    let mixed = a.col(q)[p];
    if mixed != 0.0 {
        let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * mixed);
        let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
        let c = t.hypot(1.0).recip();
        turn.col_mut(p)[p] = c;
        turn.col_mut(p)[q] = -t * c;
        turn.col_mut(q)[p] = t * c;
        turn.col_mut(q)[q] = c;
    }
    turn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_axis_of_least_spread() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
        let matrix = turn * DMat3::from_diagonal(DVec3::new(3.0, 0.2, 1.0)) * turn.transpose();
        assert!((smallest(matrix).dot(turn.y_axis).abs() - 1.0).abs() < 1e-12);
    }
}
