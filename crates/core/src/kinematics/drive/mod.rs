//! Drives at a pose and in motion: how each kind places the strut, moves its end, and carries forces.
//!
//! The one place where kinds are told apart. A new kind is a file beside those here, with its data and facts
//! in [`model::drive`](crate::model::drive) and its part of a description in `model/spec.rs`,
//! `model/spec_checks.rs` and `assembly/drives.rs`.

mod slider;
mod telescope;

use crate::kinematics::leg_state::{EndMotion, Frame, LegRotation, LegState, PointMotion, Position};
use crate::kinematics::quadratic_forms::{Hessian, add_centripetal, point_columns};
use crate::model::drive::Drive;
use crate::model::mechanism::Body;
use crate::number::real::{Constant, Real};
use crate::spatial::{Mat3, Twist, Vec3, Wrench};

/// The answer of the kind that a drive is of.
macro_rules! ask {
    ($drive:expr, $question:ident($($given:expr),*)) => {
        match $drive {
            Drive::Telescope(kind) => kind.$question($($given),*),
            Drive::Slider(kind) => kind.$question($($given),*),
        }
    };
}

impl<S> Drive<S> {
    /// Where the leg is, from e and the r from B to b [Eq. 2, 3] \[T1\] \[T67\]. The coordinate is not a
    /// number where the strut is too short.
    #[inline(always)]
    pub fn position<T: Real>(&self, e: Vec3<T>, r: Vec3<T>) -> Position<T>
    where
        S: Constant<T>,
    {
        ask!(self, position(e, r))
    }

    /// Where the strut begins, base axes, given B.
    #[inline(always)]
    pub fn foot<T: Real>(&self, base: Vec3<T>, p: &Position<T>) -> Vec3<T>
    where
        S: Constant<T>,
    {
        ask!(self, foot(base, p))
    }

    /// δ·d, d being the direction in which it moves the strut's end or foot: one of a telescopic leg, zero in
    /// a dead position.
    #[inline(always)]
    pub fn transmission<T: Real>(&self, p: &Position<T>) -> T
    where
        S: Constant<T>,
    {
        ask!(self, transmission(p))
    }

    /// What r from B to b and the coordinate must keep, as smooth functions of both: the first is zero where the
    /// strut has its length; the second, above zero on the leg's branch, is the size of δ·d there.
    #[inline(always)]
    pub fn closure<T: Real>(&self, r: Vec3<T>, coordinate: T) -> (T, T)
    where
        S: Constant<T>,
    {
        ask!(self, closure(r, coordinate))
    }

    /// The wrench of a unit force of the actuator, a row of the Jacobian [Eq. 6] \[T68\].
    #[inline(always)]
    pub fn row<T: Real>(&self, p: &Position<T>) -> Wrench<T>
    where
        S: Constant<T>,
    {
        ask!(self, row(p))
    }

    /// The symmetric h with `q'' = row·A + Vᵀ h V` \[T11\] \[T68\].
    #[inline(always)]
    pub fn hessian<T: Real>(&self, p: &Position<T>) -> Hessian<T>
    where
        S: Constant<T>,
    {
        ask!(self, hessian(p))
    }

    /// How the coordinate and δ move with the platform end, whose velocity and acceleration are given in base
    /// axes \[T3\] \[T4\] \[T68\].
    #[inline(always)]
    pub fn end<T: Real>(&self, p: &Position<T>, f: &Frame<T>, v_b: Vec3<T>, a_b: Vec3<T>) -> EndMotion<T>
    where
        S: Constant<T>,
    {
        ask!(self, end(p, f, v_b, a_b))
    }

    /// The part along δ of what a force at b and torques, both along n, δ, m, do to b: `across` are the parts
    /// along n and m \[T14\] \[T69\].
    #[inline(always)]
    pub fn carried_along<T: Real>(&self, f: &Frame<T>, force: Vec3<T>, across: [T; 2]) -> T
    where
        S: Constant<T>,
    {
        ask!(self, carried_along(f, force, across))
    }

    /// The motion of the first link's mass centre, from B or from the strut's foot [Eq. 38, 39] \[T8\].
    #[inline(always)]
    pub fn first_link<T: Real>(&self, center: Vec3<f64>, state: &LegState<T>) -> PointMotion<T>
    where
        S: Constant<T>,
    {
        ask!(self, first_link(center, state))
    }

    /// The first link's axes, and how it rotates along them; of a carriage, which has no inertia, those of
    /// the leg.
    #[inline(always)]
    pub fn first_turn<T: Real>(&self, state: &LegState<T>) -> (Mat3<T>, LegRotation<T>)
    where
        S: Constant<T>,
    {
        ask!(self, first_turn(state))
    }

    /// Generalised force of the first link's weight and inertia along the coordinate, if the link does not
    /// rotate with the leg \[T69\]; zero if it does.
    #[inline(always)]
    pub fn own_force<T: Real>(&self, body: &Body, gravity: Vec3<T>, state: &LegState<T>) -> T
    where
        S: Constant<T>,
    {
        ask!(self, own_force(body, gravity, state))
    }

    /// The active force in the reaction of its joint \[T48\].
    #[inline(always)]
    pub fn active<T: Real>(&self, reaction: Wrench<T>, p: &Position<T>) -> T
    where
        S: Constant<T>,
    {
        ask!(self, active(reaction, p))
    }

    /// Twist of the leg at o by its prismatic joint alone, of a size comparable with the strut's length and a
    /// unit rotation.
    #[inline(always)]
    pub fn twist<T: Real>(&self, p: &Position<T>) -> Twist<T>
    where
        S: Constant<T>,
    {
        ask!(self, twist(p))
    }
}

/// The questions of joint reactions and of forward kinematics, of a mechanism that does not vary.
impl Drive {
    /// Point and axes of its joint in base axes, with d second: given B, the strut's foot and b, and the
    /// leg's axes \[T44\].
    #[inline(always)]
    pub fn joint<T: Real>(&self, points: [Vec3<T>; 3], axes: &Mat3<T>) -> (Vec3<T>, Mat3<T>) {
        ask!(self, joint(points, axes))
    }

    /// The number that the equations of forward kinematics vary with: the squared length, or the place of a
    /// carriage \[T25\].
    #[must_use]
    pub fn number(&self, coordinate: f64) -> f64 {
        ask!(self, number(coordinate))
    }

    /// From that number: where the foot is, zero where it does not move, and the square of the distance from
    /// there to b \[T25\] \[T69\].
    #[inline(always)]
    pub fn asked<T: Real>(&self, number: T) -> (T, T) {
        ask!(self, asked(number))
    }

    /// r from the foot in a place, given that from B.
    #[inline(always)]
    pub fn vector<T: Real>(&self, r: Vec3<T>, place: T) -> Vec3<T> {
        ask!(self, vector(r, place))
    }

    /// The rate of `(ℓ² - r·r)/2` with those of place and square; r from the foot.
    #[inline(always)]
    pub fn asked_rate<T: Real>(&self, r: Vec3<T>, place: T, square: T) -> T {
        ask!(self, asked_rate(r, place, square))
    }

    /// Above zero where r from the foot leans to the side that belongs to the coordinate; one where there is
    /// but one side.
    #[inline(always)]
    pub fn leans<T: Real>(&self, r: Vec3<T>) -> T {
        ask!(self, leans(r))
    }

    /// How far, to the order of magnitude, the foot may move; zero where it does not.
    #[must_use]
    pub fn travel(&self) -> f64 {
        ask!(self, travel())
    }
}

/// The symmetric h with `(δ·d) q'' = δ·a_b + Vᵀ h V`, `Vᵀ h V = |P v_b|²/ℓ` and more with `P = 1 - along δᵀ`,
/// where `along` is d/(δ·d).
#[inline(always)]
fn swing<T: Real>(p: &Position<T>, along: Vec3<T>) -> Hessian<T> {
    let mut h = [[T::zero(); 6]; 6];
    add_centripetal(&mut h, p.e, p.delta);
    let inverse = T::one() / p.length;
    let mut columns = point_columns(p.e);
    for v in &mut columns {
        *v = *v - along * p.delta.dot(*v);
    }
    for i in 0..6 {
        for j in 0..6 {
            h[i][j] = columns[i].dot(columns[j]).mul_add(inverse, h[i][j]);
        }
    }
    h
}
