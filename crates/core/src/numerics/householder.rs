//! Householder factorisation of a matrix with no more rows than columns: solutions of least norm, least
//! squares with its transpose, and its null space (Golub and Van Loan, Matrix Computations, sections 5.2 and
//! 5.5). No branch on a value, and no allocation once it is made.

use crate::number::real::Ordered;
use crate::number::slices;

/// `m = L Qᵀ` of a matrix with no more rows than columns: L lower triangular, Q a product of Householder
/// reflections.
#[derive(Clone, Debug)]
pub struct Householder<V> {
    rows: usize,
    columns: usize,
    /// Row by row: the matrix; once factored, L below the diagonal and each reflection's vector from there
    /// on.
    entries: Vec<V>,
    /// Reciprocals of L's diagonal.
    inverses: Vec<V>,
    /// `2/|v|²` of each reflection's vector v.
    shares: Vec<V>,
    /// Sum of the squares of L's entries.
    square: V,
    column: Vec<V>,
}

impl<V: Ordered> Householder<V> {
    /// Room for a matrix.
    #[must_use]
    pub fn new(rows: usize, columns: usize) -> Self {
        let zeros = |count: usize| vec![V::zero(); count];
        Householder {
            rows,
            columns,
            entries: zeros(rows * columns),
            inverses: zeros(rows),
            shares: zeros(rows),
            square: V::zero(),
            column: zeros(rows),
        }
    }

    /// Sets an entry of the matrix; all must be set anew before it is factored again.
    #[inline(always)]
    pub fn set(&mut self, row: usize, column: usize, x: V) {
        self.entries[row * self.columns + column] = x;
    }

    /// Sets a row of the matrix.
    #[inline(always)]
    pub fn set_row(&mut self, row: usize, entries: &[V]) {
        let start = row * self.columns;
        slices::copy(entries, &mut self.entries[start..start + self.columns]);
    }

    #[inline(always)]
    pub fn factor(&mut self) {
        let (rows, columns) = (self.rows, self.columns);
        self.square = V::zero();
        for k in 0..rows {
            let (above, below) = self.entries.split_at_mut((k + 1) * columns);
            let v = &mut above[k * columns..];
            for j in 0..k {
                self.square = v[j].mul_add(v[j], self.square);
            }
            let mut square = V::zero();
            for j in k..columns {
                square = v[j].mul_add(v[j], square);
            }
            // The reflection that turns the row into (.., -sign(v_k) |v|, 0, ..): no difference of nearly
            // equal numbers.
            let (norm, first) = (square.sqrt(), v[k]);
            let sign = first.signum();
            self.square = self.square + square;
            self.inverses[k] = -(sign / norm);
            self.shares[k] = V::one() / first.abs().mul_add(norm, square);
            v[k] = sign.mul_add(norm, first);
            for i in 0..rows - k - 1 {
                reflect(&v[k..], self.shares[k], &mut below[i * columns + k..(i + 1) * columns]);
            }
        }
    }

    /// The x of least norm with `m x = b`, in place of b, which is followed by zeros.
    #[inline(always)]
    pub fn solve(&self, x: &mut [V]) {
        self.solve_lower(x);
        self.rotate(x);
    }

    /// The y that makes `|mᵀ y - b|` least, in place of the beginning of b.
    #[inline(always)]
    pub fn solve_transposed(&self, y: &mut [V]) {
        self.rotate_back(y);
        self.solve_upper(y);
    }

    /// The k-th of the orthonormal vectors that span the null space of m.
    #[inline(always)]
    pub fn null_vector(&self, k: usize, x: &mut [V]) {
        self.orthonormal_vector(self.rows + k, x);
    }

    /// The k-th column of Q: perpendicular to the first k rows of m.
    #[inline(always)]
    pub fn orthonormal_vector(&self, k: usize, x: &mut [V]) {
        for j in 0..self.columns {
            x[j] = V::lit(f64::from(u8::from(j == k)));
        }
        self.rotate(x);
    }

    /// `L⁻¹ x`.
    #[inline(always)]
    pub fn solve_lower(&self, x: &mut [V]) {
        for k in 0..self.rows {
            let mut sum = x[k];
            for j in 0..k {
                sum = (-self.entries[k * self.columns + j]).mul_add(x[j], sum);
            }
            x[k] = sum * self.inverses[k];
        }
    }

    /// `L⁻ᵀ x`.
    #[inline(always)]
    pub fn solve_upper(&self, x: &mut [V]) {
        for k in (0..self.rows).rev() {
            let mut sum = x[k];
            for j in k + 1..self.rows {
                sum = (-self.entries[j * self.columns + k]).mul_add(x[j], sum);
            }
            x[k] = sum * self.inverses[k];
        }
    }

    /// `Q x`.
    #[inline(always)]
    pub fn rotate(&self, x: &mut [V]) {
        for k in (0..self.rows).rev() {
            let v = &self.entries[k * self.columns..(k + 1) * self.columns];
            reflect(&v[k..], self.shares[k], &mut x[k..]);
        }
    }

    /// `Qᵀ x`.
    #[inline(always)]
    pub fn rotate_back(&self, x: &mut [V]) {
        for k in 0..self.rows {
            let v = &self.entries[k * self.columns..(k + 1) * self.columns];
            reflect(&v[k..], self.shares[k], &mut x[k..]);
        }
    }

    /// `1/(|L| |L⁻¹|)` with the root of the sum of squares for a size: at most the smallest singular value by
    /// the largest, and no less than that by the number of rows. Zero or NaN where rows depend on one
    /// another.
    #[inline(always)]
    pub fn reciprocal_condition(&mut self) -> V {
        let mut inverse = V::zero();
        for c in 0..self.rows {
            for k in c..self.rows {
                let mut sum = V::lit(f64::from(u8::from(k == c)));
                for j in c..k {
                    sum = (-self.entries[k * self.columns + j]).mul_add(self.column[j], sum);
                }
                self.column[k] = sum * self.inverses[k];
                inverse = self.column[k].mul_add(self.column[k], inverse);
            }
        }
        V::one() / (self.square * inverse).sqrt()
    }
}

/// `x - v (v·x) share`.
#[inline(always)]
fn reflect<V: Ordered>(v: &[V], share: V, x: &mut [V]) {
    let mut product = V::zero();
    for j in 0..v.len() {
        product = v[j].mul_add(x[j], product);
    }
    let product = -(product * share);
    for j in 0..v.len() {
        x[j] = v[j].mul_add(product, x[j]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::Random;
    use crate::numerics::svd::Svd;
    use nalgebra::{DMatrix, DVector};

    fn factored(m: &DMatrix<f64>) -> Householder<f64> {
        let mut all = Householder::new(m.nrows(), m.ncols());
        for i in 0..m.nrows() {
            for j in 0..m.ncols() {
                all.set(i, j, m[(i, j)]);
            }
        }
        all.factor();
        all
    }

    #[test]
    fn solutions_are_least_and_the_rest_is_open() {
        let mut draw = Random(11);
        for (rows, columns) in [(1, 1), (5, 6), (7, 9), (6, 6), (3, 8), (0, 2)] {
            let m = DMatrix::from_fn(rows, columns, |_, _| draw.number());
            let b = DVector::from_fn(rows, |_, _| draw.number());
            let mut found = factored(&m);
            let mut x = vec![0.0; columns];
            x[..rows].copy_from_slice(b.as_slice());
            found.solve(&mut x);
            let x = DVector::from_vec(x);
            assert!((&m * &x - &b).norm() < 1e-13 * (1.0 + x.norm()));
            let open: Vec<_> = (0..columns - rows)
                .map(|k| {
                    let mut y = vec![0.0; columns];
                    found.null_vector(k, &mut y);
                    DVector::from_vec(y)
                })
                .collect();
            for (k, y) in open.iter().enumerate() {
                assert!((&m * y).norm() < 1e-14 && y.dot(&x).abs() < 1e-13 * (1.0 + x.norm()));
                for (j, other) in open.iter().enumerate() {
                    assert!((y.dot(other) - f64::from(u8::from(j == k))).abs() < 1e-14);
                }
            }
            // Least squares with the transpose: what is missed is perpendicular to its columns.
            let c = DVector::from_fn(columns, |_, _| draw.number());
            let mut y = c.as_slice().to_vec();
            found.solve_transposed(&mut y);
            let missed = m.transpose() * DVector::from_column_slice(&y[..rows]) - c;
            assert!((&m * &missed).norm() < 1e-13 * (1.0 + missed.norm()));
            if rows > 0 {
                let sigma = Svd::of(&m.transpose()).unwrap().values;
                let (ratio, told) = (sigma[rows - 1] / sigma[0], found.reciprocal_condition());
                let least = ratio / rows as f64 * (1.0 - 1e-12);
                assert!(told <= ratio * (1.0 + 1e-12) && told >= least, "{rows}x{columns}: {told} {ratio}");
            }
        }
    }

    #[test]
    fn rows_that_depend_on_one_another_show() {
        let m = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 3.0, 2.0, 4.0, 6.0]);
        let told = factored(&m).reciprocal_condition();
        assert!(!(told > 1e-15), "{told}");
        let told = factored(&DMatrix::zeros(2, 3)).reciprocal_condition();
        assert!(!(told > 1e-15), "{told}");
    }
}
