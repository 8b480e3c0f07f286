//! The small linear system of the kernels, solved without a branch on a value.

use crate::real::Real;

/// A solution, and what the elimination tells of the matrix.
#[derive(Clone, Copy, Debug)]
pub struct Solved<T, const N: usize> {
    pub x: [T; N],
    /// Ratio of the smallest to the largest pivot: zero (or NaN) where the matrix is singular, of the order of the
    /// reciprocal condition number elsewhere.
    pub pivots: f64,
    /// Sign of the determinant.
    pub sign: f64,
}

/// Solves `m x = rhs` by Gaussian elimination with partial pivoting, rows exchanged by [`Real::select`].
#[inline(always)]
pub fn solve<T: Real, const N: usize>(mut m: [[T; N]; N], mut rhs: [T; N]) -> Solved<T, N> {
    let mut sign = 1.0_f64;
    for k in 0..N {
        // Bubble the largest entry of column k up to the diagonal.
        for i in k + 1..N {
            let larger = m[i][k].value().abs() > m[k][k].value().abs();
            for j in k..N {
                let (a, b) = (m[k][j], m[i][j]);
                m[k][j] = T::select(larger, b, a);
                m[i][j] = T::select(larger, a, b);
            }
            sign = if larger { -sign } else { sign };
            let (a, b) = (rhs[k], rhs[i]);
            rhs[k] = T::select(larger, b, a);
            rhs[i] = T::select(larger, a, b);
        }
        let inverse = T::one() / m[k][k];
        for i in k + 1..N {
            let factor = -(m[i][k] * inverse);
            for j in k + 1..N {
                m[i][j] = factor.mul_add(m[k][j], m[i][j]);
            }
            rhs[i] = factor.mul_add(rhs[k], rhs[i]);
        }
    }
    let mut pivots = (f64::INFINITY, 0.0_f64);
    for k in (0..N).rev() {
        let mut sum = rhs[k];
        for j in k + 1..N {
            sum = (-m[k][j]).mul_add(rhs[j], sum);
        }
        rhs[k] = sum / m[k][k];
        let pivot = m[k][k].value();
        sign *= pivot.signum();
        pivots = (pivots.0.min(pivot.abs()), pivots.1.max(pivot.abs()));
    }
    Solved { x: rhs, pivots: pivots.0 / pivots.1, sign }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_with_zero_leading_pivots() {
        let m = [[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [3.0, 0.0, 1.0]];
        let x = [1.5, -2.0, 0.25];
        let rhs = m.map(|row: [f64; 3]| row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
        let found = solve(m, rhs);
        assert!(found.x.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-15) && found.pivots > 0.1);
        assert_eq!(found.sign, -1.0, "the determinant is -2");
    }

    #[test]
    fn a_singular_matrix_shows_in_the_pivots() {
        let pivots = solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0]).pivots;
        assert!(pivots < 1e-15 || pivots.is_nan());
    }
}
