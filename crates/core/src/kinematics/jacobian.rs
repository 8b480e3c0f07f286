//! The completed Jacobian and Hessian: rows of the actuated legs over those of idle freedoms and of the independent
//! constraints, and the solves with them. Of mechanisms with six rows; [`redundant`](crate::dynamics::redundant_actuation) has those with more.

use crate::kinematics::quadratic_forms::{Hessian, quadratic};
use crate::kinematics::rows::{self, Matrix6};
use crate::model::mechanism::Mechanism;
use crate::number::real::{Constant, Real};
use crate::numerics::gauss::solve;
use crate::spatial::{Acceleration, Pose, Twist};

/// J of `J V = (ℓ', 0)`, its rows (δ, e×δ) and (c, τ) [Eq. 13].
#[inline(always)]
pub fn jacobian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> Matrix6<T> {
    let mut matrix = [[T::zero(); 6]; 6];
    for (k, row) in rows::of(mech).enumerate() {
        matrix[k] = row.wrench(pose).array();
    }
    matrix
}

/// J with its torque columns divided by the characteristic length: pure numbers, so that a pivot ratio means the
/// same for every size of machine. It belongs to the twist (v, Λω).
#[inline(always)]
pub fn scaled_jacobian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> Matrix6<T> {
    scaled(mech, jacobian(mech, pose))
}

#[inline(always)]
pub(crate) fn scaled<T: Real>(mech: &Mechanism<impl Constant<T>>, mut rows: Matrix6<T>) -> Matrix6<T> {
    let inverse = T::lit(1.0 / mech.characteristic_length);
    for i in 0..6 {
        for j in 3..6 {
            rows[i][j] = rows[i][j] * inverse;
        }
    }
    rows
}

/// A solution (v, Λω) as (v, ω).
#[inline(always)]
fn unscaled<T: Real>(mech: &Mechanism<impl Constant<T>>, mut x: [T; 6]) -> [T; 6] {
    let inverse = T::lit(1.0 / mech.characteristic_length);
    for i in 3..6 {
        x[i] = x[i] * inverse;
    }
    x
}

/// H of `J A + Vᵀ H V = (ℓ'', 0)`, one symmetric 6×6 layer for each row of J [Eq. 19].
#[inline(always)]
pub fn hessian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> [Hessian<T>; 6] {
    let mut layers = [[[T::zero(); 6]; 6]; 6];
    for (k, row) in rows::of(mech).enumerate() {
        layers[k] = row.hessian(pose);
    }
    layers
}

/// The platform's twist from the rates of the actuated legs, and the pivot ratio of J [Eq. 13].
#[inline(always)]
pub fn platform_twist<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    pose: &Pose<T>,
    rates: &[T],
) -> (Twist<T>, T::Value) {
    let solved = solve(scaled_jacobian(mech, pose), padded(rates));
    (Twist::from_array(unscaled(mech, solved.x)), solved.pivots)
}

/// The platform's acceleration from those of the actuated legs: `A = J⁻¹ (ℓ'' - Vᵀ H V)` [Eq. 19].
#[inline(always)]
pub fn platform_acceleration<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    pose: &Pose<T>,
    twist: &Twist<T>,
    accelerations: &[T],
) -> (Acceleration<T>, T::Value) {
    let mut rhs = padded(accelerations);
    let v = twist.array();
    let layers = hessian(mech, pose);
    for i in 0..6 {
        rhs[i] = rhs[i] - quadratic(&layers[i], &v);
    }
    let solved = solve(scaled_jacobian(mech, pose), rhs);
    (Acceleration::from_array(unscaled(mech, solved.x)), solved.pivots)
}

#[inline(always)]
fn padded<T: Real>(values: &[T]) -> [T; 6] {
    let mut padded = [T::zero(); 6];
    padded[..values.len()].copy_from_slice(values);
    padded
}
