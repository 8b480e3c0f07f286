//! The singular value decomposition, by rotations of pairs of columns until all are orthogonal (one-sided
//! Jacobi; Golub and Van Loan, Matrix Computations, section 8.6.3). Slower on large matrices than a reduction
//! to two diagonals, but every step is a rotation, so that nothing can go wrong unseen: whatever is left
//! shows as an angle between columns.
//!
//! Why not nalgebra's: version 0.35.0 gives wrong values for some matrices without full rank, which are those
//! that matter here, and does not say so (`findings/nalgebra-svd.sh`: one random 7×6 matrix of rank 2 in
//! twenty).

use crate::number::order::{by_size, smaller};
use nalgebra::{DMatrix, DVector};

/// Cosine of the angle between two columns that counts as square.
const SQUARE: f64 = 1e-15;

/// Far more than any matrix needs: six to ten are usual.
const SWEEPS: usize = 60;

/// `m = u · diag(values) · v_t` with as many values as columns.
#[derive(Clone, Debug)]
pub struct Svd {
    /// Largest first.
    pub values: DVector<f64>,
    /// One column for each value, orthonormal but for those of values that are nothing beside the largest.
    pub u: DMatrix<f64>,
    /// Square: one orthonormal row for each value, also for those that are zero.
    pub v_t: DMatrix<f64>,
}

impl Svd {
    /// None for entries that are not finite.
    #[must_use]
    pub fn of(m: &DMatrix<f64>) -> Option<Self> {
        let n = m.ncols();
        let (mut u, mut v) = (m.clone(), DMatrix::identity(n, n));
        // A column of this size is rounding of the others.
        let nothing = m.norm_squared() * f64::EPSILON * f64::EPSILON;
        if !nothing.is_finite() {
            return None;
        }
        (0..SWEEPS).find(|_| !sweep(&mut u, &mut v, nothing))?;
        let sizes = DVector::from_fn(n, |k, _| u.column(k).norm());
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| by_size(sizes[b], sizes[a]));
        // A matrix has no higher rank than rows.
        let values = DVector::from_fn(n, |k, _| if k < m.nrows() { sizes[order[k]] } else { 0.0 });
        let part = |entry: f64, of: f64| if of > 0.0 { entry / of } else { 0.0 };
        let u = DMatrix::from_fn(m.nrows(), n, |i, k| part(u[(i, order[k])], values[k]));
        let v_t = DMatrix::from_fn(n, n, |k, j| v[(j, order[k])]);
        Some(Svd { values, u, v_t })
    }

    /// Number of values above this part of the largest.
    #[must_use]
    pub fn rank(&self, tolerance: f64) -> usize {
        self.values.iter().filter(|&&s| s > tolerance * self.values[0]).count()
    }
}

/// Makes every pair of columns of u square once, v following; whether any had to rotate.
fn sweep(u: &mut DMatrix<f64>, v: &mut DMatrix<f64>, nothing: f64) -> bool {
    let mut turned = false;
    for j in 1..u.ncols() {
        for i in 0..j {
            let (p, q) = (u.column(i), u.column(j));
            let (a, b, product) = (p.norm_squared(), q.norm_squared(), p.dot(&q));
            if smaller(a, b) <= nothing || product.abs() <= SQUARE * (a * b).sqrt() {
                continue;
            }
            // The smaller rotation that makes them orthogonal: t = tan of its angle, t² + 2 ζ t = 1. What was
            // passed over above keeps ζ below 1e31, so that its square is finite.
            let zeta = (b - a) / (2.0 * product);
            let t = zeta.signum() / (zeta.abs() + (zeta * zeta + 1.0).sqrt());
            let cos = 1.0 / (t * t + 1.0).sqrt();
            rotate(u, i, j, cos, cos * t);
            rotate(v, i, j, cos, cos * t);
            turned = true;
        }
    }
    turned
}

fn rotate(m: &mut DMatrix<f64>, i: usize, j: usize, cos: f64, sin: f64) {
    let (height, entries) = (m.nrows(), m.as_mut_slice());
    let (left, right) = entries.split_at_mut(j * height);
    for (p, q) in left[i * height..][..height].iter_mut().zip(&mut right[..height]) {
        (*p, *q) = (cos * *p - sin * *q, sin * *p + cos * *q);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::Random;

    fn check(m: &DMatrix<f64>) -> Svd {
        let svd = Svd::of(m).unwrap();
        let back = &svd.u * DMatrix::from_diagonal(&svd.values) * &svd.v_t;
        assert!((back - m).amax() < 1e-14 * m.norm(), "{m}");
        assert!(
            (&svd.v_t * svd.v_t.transpose() - DMatrix::identity(m.ncols(), m.ncols())).amax() < 1e-14,
            "{m}"
        );
        assert!(svd.values.as_slice().is_sorted_by(|a, b| a >= b), "{}", svd.values);
        svd
    }

    fn random(rows: usize, columns: usize, draw: &mut Random) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| draw.number())
    }

    #[test]
    fn values_are_those_that_the_matrix_was_made_of() {
        let mut draw = Random(7);
        for (rows, columns) in [(6, 6), (9, 4), (24, 24), (3, 6)] {
            let least = rows.min(columns);
            let (left, right) =
                (random(rows, rows, &mut draw).qr().q(), random(columns, columns, &mut draw).qr().q());
            for smallest in [1e-3, 1e-9, 0.0] {
                let known = |k: usize| if k + 1 == least { smallest } else { 3.0 / (k + 1) as f64 };
                let sigma = DMatrix::from_fn(rows, columns, |i, k| if i == k { known(k) } else { 0.0 });
                let svd = check(&(&left * sigma * &right));
                for (k, value) in svd.values.iter().enumerate() {
                    let error = value - if k < least { known(k) } else { 0.0 };
                    assert!(error.abs() < 1e-14, "{rows}x{columns}, value {k}: off by {error}");
                }
                let square = svd.u.columns(0, least - 1).into_owned();
                let square = square.transpose() * &square - DMatrix::identity(least - 1, least - 1);
                assert!(square.amax() < 1e-14);
            }
        }
    }

    #[test]
    fn equal_values_zeros_and_nothing_at_all() {
        let mut draw = Random(8);
        assert_eq!(check(&DMatrix::identity(6, 6)).values, DVector::from_element(6, 1.0));
        assert_eq!(check_of_zero(&DMatrix::zeros(6, 6)), DVector::zeros(6));
        let twice = random(6, 3, &mut draw);
        let svd = check(&DMatrix::from_fn(6, 6, |i, k| twice[(i, k % 3)]));
        assert!(svd.values[2] > 0.1 && svd.values[3] < 1e-15, "{}", svd.values);
        let mut m = random(6, 6, &mut draw);
        m[(2, 3)] = f64::NAN;
        assert!(Svd::of(&m).is_none());
    }

    fn check_of_zero(m: &DMatrix<f64>) -> DVector<f64> {
        let svd = Svd::of(m).unwrap();
        assert_eq!(svd.v_t, DMatrix::identity(m.ncols(), m.ncols()));
        svd.values
    }

    /// Balances of a mechanism's legs. Of this matrix nalgebra 0.35 gives factors that miss it by 1.8e-3.
    #[test]
    fn a_matrix_that_another_method_gets_wrong() {
        let mut m = DMatrix::zeros(24, 24);
        for &(i, k, entry) in BALANCES {
            m[(i, k)] = entry;
        }
        let theirs = m.clone().svd(true, true);
        let back = theirs.u.unwrap() * DMatrix::from_diagonal(&theirs.singular_values) * theirs.v_t.unwrap();
        assert!((back - &m).amax() > 1e-3, "mended: then nalgebra's would do instead of this module");
        let svd = check(&m);
        assert!((&svd.u.transpose() * &svd.u - DMatrix::identity(24, 24)).amax() < 1e-14);
        let by_values: f64 = svd.values.iter().map(|s| s * s).sum();
        assert!((by_values - m.norm_squared()).abs() < 1e-13 * by_values);
    }

    #[rustfmt::skip]
    #[allow(clippy::unreadable_literal)]
    const BALANCES: &[(usize, usize, f64)] = &[
        (0, 0, 1.734), (1, 0, 4.096), (18, 0, 1.0), (22, 0, -0.153), (23, 0, 0.7263), (0, 1, 3.928),
        (1, 1, -2.053), (19, 1, 1.0), (21, 1, 0.153), (23, 1, -1.001), (0, 2, -1.416), (1, 2, -0.6788),
        (20, 2, 1.0), (21, 2, -0.7263), (22, 2, 1.001), (0, 3, -0.921), (1, 3, 0.3836), (2, 3, 0.3836),
        (21, 3, 1.0), (0, 4, 0.3847), (1, 4, 0.8688), (2, 4, 0.8688), (22, 4, 1.0), (0, 5, -0.06089),
        (1, 5, -0.3131), (2, 5, -0.3131), (23, 5, 1.0), (3, 6, 1.72), (4, 6, -1.513), (18, 6, 1.0),
        (22, 6, -0.5117), (23, 6, 0.3274), (3, 7, -1.124), (4, 7, -1.679), (19, 7, 1.0), (21, 7, 0.5117),
        (23, 7, -0.4382), (3, 8, 0.997), (4, 8, 0.717), (20, 8, 1.0), (21, 8, -0.3274), (22, 8, 0.4382),
        (3, 9, 0.6577), (4, 9, 0.7531), (5, 9, 0.7531), (6, 9, -0.1603), (7, 9, -0.6381), (21, 9, 1.0),
        (3, 10, 0.5463), (4, 10, -0.4922), (5, 10, -0.4922), (6, 10, 0.5063), (7, 10, -0.7081),
        (22, 10, 1.0), (3, 11, -0.5187), (4, 11, 0.4366), (5, 11, 0.4366), (6, 11, 0.8473),
        (7, 11, 0.3024), (23, 11, 1.0), (8, 12, 1.676), (9, 12, -3.579), (18, 12, 1.0), (22, 12, -0.7583),
        (23, 12, 0.2438), (8, 13, -3.898), (9, 13, -2.278), (19, 13, 1.0), (21, 13, 0.7583),
        (23, 13, 0.86), (8, 14, -1.452), (9, 14, 1.984), (20, 14, 1.0), (21, 14, -0.2438), (22, 14, -0.86),
        (8, 15, 0.8834), (9, 15, 0.3737), (10, 15, 0.3737), (11, 15, 0.5256), (12, 15, -0.7643),
        (21, 15, 1.0), (8, 16, 0.4399), (9, 16, -0.8692), (10, 16, -0.8692), (11, 16, -0.0892),
        (12, 16, -0.4863), (22, 16, 1.0), (8, 17, -0.1615), (9, 17, -0.3238), (10, 17, -0.3238),
        (11, 17, 0.846), (12, 17, 0.4236), (23, 17, 1.0), (13, 18, -1.277), (14, 18, -1.51), (18, 18, 1.0),
        (22, 18, -0.6928), (23, 18, 0.1653), (13, 19, -1.461), (14, 19, 1.346), (19, 19, 1.0),
        (21, 19, 0.6928), (23, 19, -0.0619), (13, 20, 0.573), (14, 20, 0.06716), (20, 20, 1.0),
        (21, 20, -0.1653), (22, 20, 0.0619), (13, 21, 0.7528), (14, 21, -0.6311), (15, 21, -0.6311),
        (16, 21, 0.2123), (17, 21, -0.7461), (21, 21, 1.0), (13, 22, -0.6582), (14, 22, -0.7221),
        (15, 22, -0.7221), (16, 22, 0.1904), (17, 22, 0.665), (22, 22, 1.0), (13, 23, -0.0008306),
        (14, 23, 0.2832), (15, 23, 0.2832), (16, 23, 0.9585), (17, 23, 0.03318), (23, 23, 1.0),
    ];
}
