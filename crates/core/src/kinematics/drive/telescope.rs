//! A telescopic leg: the coordinate is its length.

use super::swing;
use crate::kinematics::leg_state::{EndMotion, Frame, LegRotation, LegState, PointMotion, Position};
use crate::kinematics::quadratic_forms::Hessian;
use crate::model::drive::Telescope;
use crate::model::mechanism::Body;
use crate::number::real::Real;
use crate::spatial::{Mat3, Twist, Vec3, Wrench};

#[allow(clippy::unused_self, clippy::trivially_copy_pass_by_ref)] // the questions are those of all drives
impl Telescope {
    /// [Eq. 2, 3] \[T1\] `δ = r/ℓ`.
    #[inline(always)]
    pub(super) fn position<T: Real>(&self, e: Vec3<T>, r: Vec3<T>) -> Position<T> {
        let length = r.norm();
        Position { e, r, length, delta: r * (T::one() / length), coordinate: length }
    }

    #[inline(always)]
    pub(super) fn foot<T: Real>(&self, base: Vec3<T>, _: &Position<T>) -> Vec3<T> {
        base
    }

    #[inline(always)]
    pub(super) fn transmission<T: Real>(&self, _: &Position<T>) -> T {
        T::one()
    }

    #[inline(always)]
    pub(super) fn closure<T: Real>(&self, r: Vec3<T>, coordinate: T) -> (T, T) {
        let strut = r * (T::one() / coordinate);
        (strut.dot(strut) - T::one(), T::one())
    }

    /// [Eq. 6]
    #[inline(always)]
    pub(super) fn row<T: Real>(&self, p: &Position<T>) -> Wrench<T> {
        Wrench::at(p.e, p.delta)
    }

    /// \[T11\], the symmetric part of [Eq. 15].
    #[inline(always)]
    pub(super) fn hessian<T: Real>(&self, p: &Position<T>) -> Hessian<T> {
        swing(p, p.delta)
    }

    #[inline(always)]
    pub(super) fn end<T: Real>(
        &self,
        p: &Position<T>,
        f: &Frame<T>,
        v_b: Vec3<T>,
        a_b: Vec3<T>,
    ) -> EndMotion<T> {
        let inverse = T::one() / p.length;
        let (v, a) = (f.axes.transpose_mul(v_b), f.axes.transpose_mul(a_b));
        // In the leg's axes: [Eq. 6] [T3] ℓ' = δ·v_b;  δ' = (v_b - ℓ'δ)/ℓ
        let rate = [v.x * inverse, v.z * inverse];
        // [Eq. 15] [T4] ℓ'' = δ·a_b + v_b·δ';  δ'' = (a_b - ℓ''δ - 2ℓ'δ')/ℓ
        let second = v.x.mul_add(rate[0], v.z.mul_add(rate[1], a.y));
        let twice = v.y + v.y;
        let delta_acceleration = [(a.x - twice * rate[0]) * inverse, (a.z - twice * rate[1]) * inverse];
        EndMotion { v_b, a_b, rate: v.y, acceleration: second, delta_rate: rate, delta_acceleration }
    }

    #[inline(always)]
    pub(super) fn carried_along<T: Real>(&self, _: &Frame<T>, force: Vec3<T>, _: [T; 2]) -> T {
        force.y
    }

    /// The cylinder turns with the leg about B.
    #[inline(always)]
    pub(super) fn first_link<T: Real>(&self, center: Vec3<f64>, state: &LegState<T>) -> PointMotion<T> {
        state.point_motion(center, Vec3::zero(), Vec3::zero())
    }

    #[inline(always)]
    pub(super) fn first_turn<T: Real>(&self, state: &LegState<T>) -> (Mat3<T>, LegRotation<T>) {
        (state.frame.axes, state.turn)
    }

    #[inline(always)]
    pub(super) fn own_force<T: Real>(&self, _: &Body, _: Vec3<T>, _: &LegState<T>) -> T {
        T::zero()
    }

    #[inline(always)]
    pub(super) fn active<T: Real>(&self, reaction: Wrench<T>, p: &Position<T>) -> T {
        reaction.force.dot(p.delta)
    }

    #[inline(always)]
    pub(super) fn twist<T: Real>(&self, p: &Position<T>) -> Twist<T> {
        Twist::new(p.delta * p.length, Vec3::zero())
    }

    #[inline(always)]
    pub(super) fn joint<T: Real>(&self, [_, _, end]: [Vec3<T>; 3], axes: &Mat3<T>) -> (Vec3<T>, Mat3<T>) {
        (end, *axes)
    }

    pub(super) fn number(&self, coordinate: f64) -> f64 {
        coordinate * coordinate
    }

    #[inline(always)]
    pub(super) fn asked<T: Real>(&self, number: T) -> (T, T) {
        (T::zero(), number)
    }

    #[inline(always)]
    pub(super) fn vector<T: Real>(&self, r: Vec3<T>, _: T) -> Vec3<T> {
        r
    }

    #[inline(always)]
    pub(super) fn asked_rate<T: Real>(&self, _: Vec3<T>, _: T, square: T) -> T {
        square.scale(0.5)
    }

    #[inline(always)]
    pub(super) fn leans<T: Real>(&self, _: Vec3<T>) -> T {
        T::one()
    }

    pub(super) fn travel(&self) -> f64 {
        0.0
    }
}
