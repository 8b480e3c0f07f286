//! Gaussian elimination for the small linear systems of the kernels, without a branch on a value.

use crate::number::real::{Ordered, Real};

/// Solutions, and pivots of the elimination.
#[derive(Clone, Copy, Debug)]
pub struct Solved<T: Real, X> {
    pub x: X,
    /// Ratio of the smallest to the largest pivot: zero (or NaN) where the matrix is singular, of the order
    /// of the reciprocal condition number elsewhere.
    pub pivots: T::Value,
    /// Sign of the determinant.
    pub sign: T::Value,
}

/// Solves `m x = rhs`.
#[inline(always)]
pub fn solve<T: Real, const N: usize>(m: [[T; N]; N], rhs: [T; N]) -> Solved<T, [T; N]> {
    let Solved { x: [x], pivots, sign } = solve_all(m, [rhs]);
    Solved { x, pivots, sign }
}

/// Solves `m x = rhs` for several right-hand sides.
#[inline(always)]
pub fn solve_all<T: Real, const N: usize, const M: usize>(
    m: [[T; N]; N],
    rhs: [[T; N]; M],
) -> Solved<T, [[T; N]; M]> {
    solve_first(m, rhs, N)
}

macro_rules! for_six {
    ($k:ident => $body:expr) => {{
        for_six!($k 0 $body);
        for_six!($k 1 $body);
        for_six!($k 2 $body);
        for_six!($k 3 $body);
        for_six!($k 4 $body);
        for_six!($k 5 $body);
    }};
    ($k:ident $at:literal $body:expr) => {{
        let $k = $at;
        $body;
    }};
}

/// Solves the first `size` equations in as many unknowns for several right-hand sides by Gaussian elimination
/// with partial pivoting, rows exchanged by [`Real::select`]; the rest is not read.
#[inline(always)]
pub fn solve_first<T: Real, const N: usize, const M: usize>(
    mut m: [[T; N]; N],
    mut rhs: [[T; N]; M],
    size: usize,
) -> Solved<T, [[T; N]; M]> {
    let mut sign = T::Value::one();
    let mut inverses = [T::zero(); N];
    if N == 6 && size == 6 && size_of::<T>() == size_of::<T::Value>() {
        // Unrolled, the rows stay in registers.
        for_six!(k => eliminate(&mut m, &mut rhs, &mut inverses, &mut sign, k, 6));
    } else {
        for k in 0..size {
            eliminate(&mut m, &mut rhs, &mut inverses, &mut sign, k, size);
        }
    }
    let (mut least, mut most) = (T::Value::lit(f64::INFINITY), T::Value::zero());
    // NaN if a pivot is not finite, else zero.
    let mut unknown = T::Value::zero();
    for k in (0..size).rev() {
        for x in &mut rhs {
            let mut sum = x[k];
            for j in k + 1..size {
                sum = (-m[k][j]).mul_add(x[j], sum);
            }
            x[k] = sum * inverses[k];
        }
        let pivot = m[k][k].value();
        sign = sign * pivot.signum();
        (least, most) = (least.least(pivot.abs()), most.most(pivot.abs()));
        unknown = pivot.mul_add(T::Value::zero(), unknown);
    }
    Solved { x: rhs, pivots: least / most + unknown, sign }
}

/// Column k of the elimination.
#[inline(always)]
fn eliminate<T: Real, const N: usize, const M: usize>(
    m: &mut [[T; N]; N],
    rhs: &mut [[T; N]; M],
    inverses: &mut [T; N],
    sign: &mut T::Value,
    k: usize,
    size: usize,
) {
    // Bubble the largest entry of column k up to the diagonal.
    for i in k + 1..size {
        let larger = m[i][k].value().abs().greater(m[k][k].value().abs());
        for j in k..size {
            let (a, b) = (m[k][j], m[i][j]);
            m[k][j] = T::select(larger, b, a);
            m[i][j] = T::select(larger, a, b);
        }
        *sign = T::Value::select(larger, -*sign, *sign);
        for x in &mut *rhs {
            let (a, b) = (x[k], x[i]);
            x[k] = T::select(larger, b, a);
            x[i] = T::select(larger, a, b);
        }
    }
    inverses[k] = T::one() / m[k][k];
    for i in k + 1..size {
        let factor = -(m[i][k] * inverses[k]);
        for j in k + 1..size {
            m[i][j] = factor.mul_add(m[k][j], m[i][j]);
        }
        for x in &mut *rhs {
            x[i] = factor.mul_add(x[k], x[i]);
        }
    }
}

/// The determinant by expansion along the rows, each minor once: `d[S]` is that of the first |S| rows and the
/// columns in the bit set S. No division, so that with duals the rate is exact at singular matrices of any
/// rank too.
#[inline(always)]
pub fn determinant<T: Real>(m: &[[T; 6]; 6]) -> T {
    let mut d = [T::zero(); 64];
    d[0] = T::one();
    for set in 1..64_usize {
        let row = set.count_ones() as usize - 1;
        let mut sum = T::zero();
        for column in 0..6 {
            if set >> column & 1 == 0 {
                continue;
            }
            // The entry's sign is that of the number of columns in the set to the right of its own.
            let term = m[row][column] * d[set & !(1 << column)];
            sum = if (set >> (column + 1)).count_ones() % 2 == 0 { sum + term } else { sum - term };
        }
        d[set] = sum;
    }
    d[63]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::real::Dual;

    #[test]
    fn determinants_multiply_and_change_sign_with_their_rows() {
        let entry = |i: usize, j: usize| ((7 * i + 3 * j * j + i * j) % 11) as f64 - 4.5;
        let m: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        let known = nalgebra::Matrix6::from_fn(entry).determinant();
        assert!((determinant(&m) - known).abs() < 1e-11 * known.abs());
        let mut swapped = m;
        swapped.swap(1, 4);
        assert!((determinant(&swapped) + known).abs() < 1e-11 * known.abs());
    }

    #[test]
    fn the_rate_of_a_determinant_is_exact_where_it_vanishes() {
        // diag(t, 1, 1, 1, 1, 1) has the rate 1 at t = 0, diag(t, t, 1, 1, 1, 1) the rate 0.
        let at_zero = |moving: usize| {
            let entry = |i: usize, j: usize| match (i == j, i < moving) {
                (true, true) => Dual::new(0.0, 1.0),
                (same, _) => Dual::new(f64::from(u8::from(same)), 0.0),
            };
            determinant(&std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))))
        };
        assert_eq!(at_zero(1), Dual::new(0.0, 1.0));
        assert_eq!(at_zero(2), Dual::new(0.0, 0.0));
    }

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
