//! What counts as singular: one margin for all judgements \[T77\].

use crate::kinematics::rows::constraint_row;
use crate::model::mechanism::{MAX_CONSTRAINTS, Mechanism};
use crate::number::real::Ordered;
use crate::spatial::Pose;

/// A measure up to this counts as zero: a singular value, a ratio of pivots, the sine of an angle, all pure
/// numbers. Poses may miss their constraints by as much of the characteristic length, and those that follow
/// from coordinates are off by the root of rounding where constraints depend on one another. What is smaller
/// says nothing, and a smaller margin would leave the judgement to rounding.
pub const SINGULAR: f64 = 1e-6;

/// Ratio of pivots, or of singular values, up to which a system of equations has no solution to working
/// precision. Forces and rates at a pose as it is given stand down to this: they are large near a singular
/// pose, not wrong.
pub const WORKING_PRECISION: f64 = 1e-12;

/// Whether the independent constraints do not depend on one another at a pose: of each row, in the pure
/// numbers of \[T30\], more than [`SINGULAR`] is perpendicular to those before it (Gram and Schmidt).
#[inline(always)]
pub fn are_independent<V: Ordered>(mech: &Mechanism, pose: &Pose<V>) -> V::Mask {
    let (mut rows, mut squares) = ([[V::zero(); 6]; MAX_CONSTRAINTS], [V::zero(); MAX_CONSTRAINTS]);
    // NaN after a row of zeros, which leaves nothing to divide by.
    let (mut least, mut unknown) = (V::lit(f64::INFINITY), V::zero());
    for (k, c) in mech.independent.iter().enumerate() {
        let mut row = constraint_row(c, pose, mech.characteristic_length);
        for j in 0..k {
            let share = dot(&row, &rows[j]) / squares[j];
            for i in 0..6 {
                row[i] = (-share).mul_add(rows[j][i], row[i]);
            }
        }
        (rows[k], squares[k]) = (row, dot(&row, &row));
        least = least.least(squares[k]);
        unknown = squares[k].mul_add(V::zero(), unknown);
    }
    (least + unknown).greater(V::lit(SINGULAR * SINGULAR))
}

#[inline(always)]
fn dot<V: Ordered>(a: &[V; 6], b: &[V; 6]) -> V {
    let mut sum = V::zero();
    for i in 0..6 {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}
