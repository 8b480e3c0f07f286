//! The completed Jacobian and Hessian: rows of the actuated legs over rows of the independent constraints, and the
//! solves with them.

use crate::constraint;
use crate::leg;
use crate::linear::solve;
use crate::mechanism::Mechanism;
use crate::quadratic::{Hessian, quadratic};
use crate::real::{Constant, Real};
use crate::spatial::{Acceleration, Pose, Twist, Wrench};

pub type Matrix6<T> = [[T; 6]; 6];

/// J of `J V = (ℓ', 0)`, its rows (δ, e×δ) and (c, τ) [Eq. 13].
#[inline(always)]
pub fn jacobian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> Matrix6<T> {
    let mut rows = [Wrench::zero(); 6];
    let legs = mech.actuated().map(|(_, leg)| leg::row(&leg::position(leg, pose)));
    let constraints = mech.independent.iter().map(|c| constraint::row(c, pose));
    for (row, wrench) in rows.iter_mut().zip(legs.chain(constraints)) {
        *row = wrench;
    }
    rows.map(Wrench::array)
}

/// J with its torque columns divided by the characteristic length: pure numbers, so that a pivot ratio means the
/// same for every size of machine. It belongs to the twist (v, Λω).
#[inline(always)]
pub fn scaled_jacobian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> Matrix6<T> {
    let inverse = T::lit(1.0 / mech.characteristic_length);
    jacobian(mech, pose).map(|row| std::array::from_fn(|j| if j < 3 { row[j] } else { row[j] * inverse }))
}

/// A solution (v, Λω) as (v, ω).
#[inline(always)]
fn unscaled<T: Real>(mech: &Mechanism<impl Constant<T>>, x: [T; 6]) -> [T; 6] {
    let inverse = T::lit(1.0 / mech.characteristic_length);
    std::array::from_fn(|j| if j < 3 { x[j] } else { x[j] * inverse })
}

/// H of `J A + Vᵀ H V = (ℓ'', 0)`, one symmetric 6×6 layer for each row of J [Eq. 19].
#[inline(always)]
pub fn hessian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> [Hessian<T>; 6] {
    let mut layers = [[[T::zero(); 6]; 6]; 6];
    let legs = mech.actuated().map(|(_, leg)| leg::hessian(&leg::position(leg, pose)));
    let constraints = mech.independent.iter().map(|c| constraint::hessian(c, pose));
    for (layer, h) in layers.iter_mut().zip(legs.chain(constraints)) {
        *layer = h;
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
    for (entry, h) in rhs.iter_mut().zip(hessian(mech, pose)) {
        *entry = *entry - quadratic(&h, &v);
    }
    let solved = solve(scaled_jacobian(mech, pose), rhs);
    (Acceleration::from_array(unscaled(mech, solved.x)), solved.pivots)
}

#[inline(always)]
fn padded<T: Real>(values: &[T]) -> [T; 6] {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or_else(T::zero))
}
