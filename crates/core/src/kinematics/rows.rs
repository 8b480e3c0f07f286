//! Rows of the Jacobian in their order: actuated legs, local degrees of freedom, independent constraints.
//!
//! The order is written here alone: [`of`] goes through the rows, [`RowNumbers`] tells where those of each
//! sort are.

use std::ops::Range;

use crate::kinematics::constraint;
use crate::kinematics::idle;
use crate::kinematics::leg;
use crate::kinematics::quadratic_forms::Hessian;
use crate::model::mechanism::{Constraint, Idle, Leg, Mechanism};
use crate::number::real::{Constant, Real};
use crate::spatial::motion::pure_row;
use crate::spatial::{Pose, Wrench};

pub type Matrix6<T> = [[T; 6]; 6];

/// Origin of a row of the Jacobian: a leg, a local degree of freedom, or a constraint.
#[derive(Clone, Copy, Debug)]
pub enum Row<'a, S = f64> {
    Leg(&'a Leg<S>),
    Idle(&'a Idle<S>),
    Constraint(&'a Constraint<S>),
}

/// All rows in order.
#[inline(always)]
pub fn of<S>(mech: &Mechanism<S>) -> impl Iterator<Item = Row<'_, S>> {
    mech.actuated().map(|(_, leg)| Row::Leg(leg)).chain(others(mech))
}

/// Those after the rows of the legs.
#[inline(always)]
pub fn others<S>(mech: &Mechanism<S>) -> impl Iterator<Item = Row<'_, S>> {
    mech.idle.iter().map(Row::Idle).chain(mech.independent.iter().map(Row::Constraint))
}

/// The same for kernels: a body for each row and its number, or for the rows after those of the legs,
/// numbered from a given one on. A loop for each sort of row, inside which the compiler knows the sort; with
/// the iterators it asks for it at each row.
macro_rules! for_each_row {
    ($mech:expr, |$k:ident, $row:ident| $body:block) => {{
        let mut count = 0;
        for (_, leg) in $mech.actuated() {
            let ($k, $row) = (count, $crate::kinematics::rows::Row::Leg(leg));
            $body
            count += 1;
        }
        $crate::kinematics::rows::for_each_row!(others of $mech, count, |$k, $row| $body);
    }};
    (others of $mech:expr, $first:expr, |$k:ident, $row:ident| $body:block) => {{
        let mut count = $first;
        for idle in &$mech.idle {
            let ($k, $row) = (count, $crate::kinematics::rows::Row::Idle(idle));
            $body
            count += 1;
        }
        for c in &$mech.independent {
            let ($k, $row) = (count, $crate::kinematics::rows::Row::Constraint(c));
            $body
            count += 1;
        }
        let _ = count;
    }};
}
pub(crate) use for_each_row;

/// Numbers of the rows of each sort.
#[derive(Clone, Copy, Debug)]
pub struct RowNumbers {
    actuated: usize,
    idle: usize,
    constraints: usize,
}

impl RowNumbers {
    #[inline(always)]
    pub fn of<S>(mech: &Mechanism<S>) -> Self {
        let actuated = mech.actuated().count();
        RowNumbers { actuated, idle: mech.idle.len(), constraints: mech.independent.len() }
    }

    /// Of actuated legs.
    #[must_use]
    #[inline(always)]
    pub fn actuated(self) -> Range<usize> {
        0..self.actuated
    }

    /// Of local degrees of freedom.
    #[must_use]
    #[inline(always)]
    pub fn idle(self) -> Range<usize> {
        self.actuated..self.actuated + self.idle
    }

    /// Of independent constraints.
    #[must_use]
    #[inline(always)]
    pub fn constraints(self) -> Range<usize> {
        let first = self.actuated + self.idle;
        first..first + self.constraints
    }

    /// Of all but the legs.
    #[must_use]
    #[inline(always)]
    pub fn others(self) -> Range<usize> {
        self.actuated..self.actuated + self.idle + self.constraints
    }
}

impl<S> Row<'_, S> {
    /// The row itself [Eq. 13].
    #[inline(always)]
    pub fn wrench<T: Real>(self, pose: &Pose<T>) -> Wrench<T>
    where
        S: Constant<T>,
    {
        match self {
            Row::Leg(leg) => leg::row(leg, &leg::position(leg, pose)),
            Row::Idle(idle) => idle::row(idle, pose),
            Row::Constraint(c) => constraint::row(c, pose),
        }
    }

    /// Its layer of the Hessian [Eq. 19]; that of a local degree of freedom is zero.
    #[inline(always)]
    pub fn hessian<T: Real>(self, pose: &Pose<T>) -> Hessian<T>
    where
        S: Constant<T>,
    {
        match self {
            Row::Leg(leg) => leg::hessian(leg, &leg::position(leg, pose)),
            Row::Idle(_) => [[T::zero(); 6]; 6],
            Row::Constraint(c) => constraint::hessian(c, pose),
        }
    }
}

impl Row<'_> {
    /// The row in pure numbers for the length `scale` \[T30\].
    #[inline(always)]
    pub(crate) fn pure<T: Real>(self, pose: &Pose<T>, scale: f64) -> [T; 6] {
        match self {
            Row::Leg(leg) => pure_row(leg::row(leg, &leg::position(leg, pose)), scale),
            Row::Idle(idle) => idle_row(idle, pose, scale),
            Row::Constraint(c) => constraint_row(c, pose, scale),
        }
    }
}

/// J, row by row [Eq. 13].
#[must_use]
pub fn all_rows(mech: &Mechanism, pose: &Pose<f64>) -> Vec<[f64; 6]> {
    of(mech).map(|row| row.wrench(pose).array()).collect()
}

/// H, layer by layer [Eq. 19].
#[must_use]
pub fn all_hessians(mech: &Mechanism, pose: &Pose<f64>) -> Vec<Hessian<f64>> {
    of(mech).map(|row| row.hessian(pose)).collect()
}

/// J in pure numbers \[T30\].
#[must_use]
pub fn pure_rows(mech: &Mechanism, pose: &Pose<f64>, scale: f64) -> Vec<[f64; 6]> {
    of(mech).map(|row| row.pure(pose, scale)).collect()
}

/// A constraint's row for the twist (v, Λω), of a constraint counted as a length, in pure numbers:
/// `(c, τ/Λ)`, and `(0, τ)` for kind D \[T30\].
#[inline(always)]
pub(crate) fn constraint_row<T: Real>(c: &Constraint, pose: &Pose<T>, scale: f64) -> [T; 6] {
    pure_row(constraint::row(c, pose) * T::lit(constraint::length(c, scale)), scale)
}

/// J in pure numbers for the length `scale`: its determinant says on which side of the singular poses a pose
/// is \[T30\].
#[inline(always)]
pub fn pure_jacobian<T: Real>(mech: &Mechanism, pose: &Pose<T>, scale: f64) -> Matrix6<T> {
    let mut rows = [[T::zero(); 6]; 6];
    for_each_row!(mech, |k, row| {
        rows[k] = row.pure(pose, scale);
    });
    rows
}

/// A local degree of freedom's row, counted as a constraint on a rotation is: `(0, u)`.
#[inline(always)]
fn idle_row<T: Real>(idle: &Idle, pose: &Pose<T>, scale: f64) -> [T; 6] {
    pure_row(idle::row(idle, pose) * T::lit(scale), scale)
}

/// JᵀJ in pure numbers, of any number of rows \[T72\].
#[inline(always)]
pub(crate) fn gram<T: Real>(mech: &Mechanism, pose: &Pose<T>, scale: f64) -> Matrix6<T> {
    let mut sum = [[T::zero(); 6]; 6];
    for_each_row!(mech, |_k, row| {
        add_square(&mut sum, &row.pure(pose, scale));
    });
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
