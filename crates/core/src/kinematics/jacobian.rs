//! The completed Jacobian and Hessian: rows of the actuated legs over those of local degrees of freedom and
//! of the independent constraints, and the solves with them.

use crate::kinematics::quadratic_forms::{Hessian, quadratic};
use crate::kinematics::redundant_rows::RedundantRows;
use crate::kinematics::rows::{self, Matrix6, RowNumbers, for_each_row};
use crate::model::mechanism::Mechanism;
use crate::number::lanes::Lanes;
use crate::number::real::{Constant, Ordered, Real};
use crate::numerics::gauss::solve;
use crate::spatial::{Acceleration, Pose, Twist};

/// J of `J V = (ℓ', 0)`, its rows (δ, e×δ) and (c, τ) [Eq. 13].
#[inline(always)]
pub fn jacobian<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>) -> Matrix6<T> {
    let mut matrix = [[T::zero(); 6]; 6];
    for_each_row!(mech, |k, row| {
        matrix[k] = row.wrench(pose).array();
    });
    matrix
}

/// J with its torque columns divided by the characteristic length: pure numbers, so that a pivot ratio means
/// the same for every size of machine. It belongs to the twist (v, Λω).
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
    for_each_row!(mech, |k, row| {
        layers[k] = row.hessian(pose);
    });
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
    for k in 0..6 {
        if k < values.len() {
            padded[k] = values[k];
        }
    }
    padded
}

/// A motion from what the legs do.
#[derive(Clone, Copy, Debug)]
pub struct PlatformMotion<V: Ordered> {
    /// Twist, or acceleration, of o.
    pub motion: Twist<V>,
    /// Pivot ratio of J, or a lower bound of its singular values' ratio.
    pub regular: V,
    /// Whether the legs agree on it, as those of square J always do.
    pub agrees: V::Mask,
}

/// Finds motions of the platform from those of its legs: by Gaussian elimination where J is square, in the
/// sense of least squares where actuators are redundant \[T73\]. Room for one state after another.
pub struct MotionSolver<V> {
    /// Rates or accelerations of the actuated legs, then of local degrees of freedom: none of these if they
    /// do not spin.
    pub driven: Vec<V>,
    rest: Vec<V>,
    redundant: Option<RedundantRows<V>>,
}

impl<V: Lanes> MotionSolver<V> {
    #[must_use]
    pub fn new(mech: &Mechanism) -> Self {
        MotionSolver {
            driven: vec![V::zero(); mech.actuated().count()],
            rest: vec![],
            redundant: mech.is_redundant().then(|| RedundantRows::new(mech)),
        }
    }

    /// The twist that gives the legs their rates [Eq. 13].
    #[inline(always)]
    pub fn twist(&mut self, mech: &Mechanism, pose: &Pose<V>) -> PlatformMotion<V> {
        let Some(rows) = &mut self.redundant else {
            let (motion, regular) = platform_twist(mech, pose, &self.driven);
            return PlatformMotion { motion, regular, agrees: all::<V>() };
        };
        rows.factor(mech, pose);
        let (legs, idle) = self.driven.split_at(RowNumbers::of(mech).actuated().end);
        let (motion, agrees) = rows.follow(legs, idle, norm(legs));
        PlatformMotion { motion, regular: rows.regular, agrees }
    }

    /// The acceleration that gives the legs theirs [Eq. 19].
    #[inline(always)]
    pub fn acceleration(&mut self, mech: &Mechanism, pose: &Pose<V>, twist: &Twist<V>) -> PlatformMotion<V> {
        let Some(rows) = &mut self.redundant else {
            let (Acceleration { a, eps }, regular) = platform_acceleration(mech, pose, twist, &self.driven);
            return PlatformMotion { motion: Twist::new(a, eps), regular, agrees: all::<V>() };
        };
        rows.factor(mech, pose);
        let (v, n) = (twist.array(), RowNumbers::of(mech).actuated().end);
        self.rest.clear();
        for row in rows::of(mech) {
            self.rest.push(quadratic(&row.hessian(pose), &v));
        }
        let size = norm(&self.driven[..n]) + norm(&self.rest[..n]);
        for (k, rest) in self.rest.iter_mut().enumerate() {
            *rest = if k < self.driven.len() { self.driven[k] } else { V::zero() } - *rest;
        }
        let (legs, others) = self.rest.split_at(n);
        let (motion, agrees) = rows.follow(legs, others, size);
        PlatformMotion { motion, regular: rows.regular, agrees }
    }
}

/// True in all lanes.
#[inline(always)]
fn all<V: Ordered>() -> V::Mask {
    V::zero().at_most(V::zero())
}

#[inline(always)]
fn norm<V: Ordered>(values: &[V]) -> V {
    let mut square = V::zero();
    for x in values {
        square = x.mul_add(*x, square);
    }
    square.sqrt()
}
