//! Rows of the Jacobian in their order: actuated legs, idle freedoms, independent constraints.

use crate::kinematics::constraint;
use crate::kinematics::idle;
use crate::kinematics::leg;
use crate::kinematics::quadratic_forms::Hessian;
use crate::model::mechanism::{Constraint, Idle, Mechanism};
use crate::number::real::{Constant, Real};
use crate::spatial::motion::pure_row;
use crate::spatial::{Pose, Wrench};

pub type Matrix6<T> = [[T; 6]; 6];

/// Rows of idle freedoms, then those of constraints.
#[inline(always)]
pub(crate) fn other_rows<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>, rows: &mut [[T; 6]]) {
    let idle = mech.idle.len();
    for k in 0..idle {
        rows[k] = idle::row(&mech.idle[k], pose).array();
    }
    for k in 0..mech.independent.len() {
        rows[idle + k] = constraint::row(&mech.independent[k], pose).array();
    }
}

/// J, row by row [Eq. 13].
#[must_use]
pub fn all_rows(mech: &Mechanism, pose: &Pose<f64>) -> Vec<[f64; 6]> {
    let legs = mech.actuated().map(|(_, leg)| leg::row(leg, &leg::position(leg, pose)));
    let idle = mech.idle.iter().map(|idle| idle::row(idle, pose));
    let constraints = mech.independent.iter().map(|c| constraint::row(c, pose));
    legs.chain(idle).chain(constraints).map(Wrench::array).collect()
}

/// H, layer by layer [Eq. 19].
#[must_use]
pub fn all_hessians(mech: &Mechanism, pose: &Pose<f64>) -> Vec<Hessian<f64>> {
    let legs = mech.actuated().map(|(_, leg)| leg::hessian(leg, &leg::position(leg, pose)));
    let idle = mech.idle.iter().map(|_| [[0.0; 6]; 6]);
    legs.chain(idle).chain(mech.independent.iter().map(|c| constraint::hessian(c, pose))).collect()
}

/// J in pure numbers \[T30\].
#[must_use]
pub fn pure_rows(mech: &Mechanism, pose: &Pose<f64>, scale: f64) -> Vec<[f64; 6]> {
    let legs = mech.actuated().map(|(_, leg)| pure_row(leg::row(leg, &leg::position(leg, pose)), scale));
    let idle = mech.idle.iter().map(|idle| idle_row(idle, pose, scale));
    legs.chain(idle).chain(mech.independent.iter().map(|c| constraint_row(c, pose, scale))).collect()
}

/// A constraint's row for the twist (v, Λω), of a constraint counted as a length, in pure numbers: `(c, τ/Λ)`, and
/// `(0, τ)` for kind D \[T30\].
#[inline(always)]
pub(crate) fn constraint_row<T: Real>(c: &Constraint, pose: &Pose<T>, scale: f64) -> [T; 6] {
    pure_row(constraint::row(c, pose) * T::lit(constraint::length(c, scale)), scale)
}

/// J in pure numbers for the length `scale`: its determinant says on which side of the singular poses a pose is \[T30\].
#[inline(always)]
pub fn pure_jacobian<T: Real>(mech: &Mechanism, pose: &Pose<T>, scale: f64) -> Matrix6<T> {
    let (mut rows, mut count) = ([[T::zero(); 6]; 6], 0);
    for leg in &mech.legs {
        if leg.actuated {
            rows[count] = pure_row(leg::row(leg, &leg::position(leg, pose)), scale);
            count += 1;
        }
    }
    for idle in &mech.idle {
        rows[count] = idle_row(idle, pose, scale);
        count += 1;
    }
    for c in &mech.independent {
        rows[count] = constraint_row(c, pose, scale);
        count += 1;
    }
    rows
}

/// An idle freedom's row, counted as a constraint on a turn is: `(0, u)`.
#[inline(always)]
pub(crate) fn idle_row<T: Real>(idle: &Idle, pose: &Pose<T>, scale: f64) -> [T; 6] {
    pure_row(idle::row(idle, pose) * T::lit(scale), scale)
}

/// JᵀJ in pure numbers, of any number of rows \[T72\].
#[inline(always)]
pub(crate) fn gram<T: Real>(mech: &Mechanism, pose: &Pose<T>, scale: f64) -> Matrix6<T> {
    let mut sum = [[T::zero(); 6]; 6];
    for leg in &mech.legs {
        if leg.actuated {
            add_square(&mut sum, &pure_row(leg::row(leg, &leg::position(leg, pose)), scale));
        }
    }
    for idle in &mech.idle {
        add_square(&mut sum, &idle_row(idle, pose, scale));
    }
    for c in &mech.independent {
        add_square(&mut sum, &constraint_row(c, pose, scale));
    }
    sum
}

#[inline(always)]
fn add_square<T: Real>(sum: &mut Matrix6<T>, row: &[T; 6]) {
    for i in 0..6 {
        for j in 0..6 {
            sum[i][j] = row[i].mul_add(row[j], sum[i][j]);
        }
    }
}
