//! A strut whose foot slides on a rail: the coordinate is the place of its carriage \[T67\] \[T68\] \[T69\].

use super::swing;
use crate::kinematics::leg_state::{EndMotion, Frame, LegRotation, LegState, PointMotion, Position};
use crate::kinematics::quadratic_forms::Hessian;
use crate::model::drive::Slider;
use crate::model::mechanism::Body;
use crate::number::real::{Constant, Real};
use crate::spatial::{Mat3, Twist, Vec3, Wrench};

impl<S> Slider<S> {
    /// a.
    #[inline(always)]
    fn a<T: Real>(&self) -> Vec3<T>
    where
        S: Constant<T>,
    {
        Vec3::lift(self.rail)
    }

    /// \[T67\]
    #[inline(always)]
    pub(super) fn position<T: Real>(&self, e: Vec3<T>, r: Vec3<T>) -> Position<T>
    where
        S: Constant<T>,
    {
        let (a, c) = (self.a(), self.strut.lift());
        let along = a.dot(r);
        let across = r - a * along;
        let ahead = (c * c - across.dot(across)).sqrt().scale(self.branch);
        let r = across + a * ahead;
        Position { e, r, length: c, delta: r * (T::one() / c), coordinate: along - ahead }
    }

    #[inline(always)]
    pub(super) fn foot<T: Real>(&self, base: Vec3<T>, p: &Position<T>) -> Vec3<T>
    where
        S: Constant<T>,
    {
        base + self.a::<T>() * p.coordinate
    }

    /// δ·a, zero where the strut is perpendicular to its rail.
    #[inline(always)]
    pub(super) fn transmission<T: Real>(&self, p: &Position<T>) -> T
    where
        S: Constant<T>,
    {
        p.delta.dot(self.a())
    }

    /// (|r - q a|² - c²)/c² and (r - q a)·a on the side of the branch, in units of c.
    #[inline(always)]
    pub(super) fn closure<T: Real>(&self, r: Vec3<T>, coordinate: T) -> (T, T)
    where
        S: Constant<T>,
    {
        let (a, c) = (self.a::<T>(), self.strut.lift());
        let strut = (r - a * coordinate) * (T::one() / c);
        (strut.dot(strut) - T::one(), strut.dot(a).scale(self.branch))
    }

    /// \[T68\]
    #[inline(always)]
    pub(super) fn row<T: Real>(&self, p: &Position<T>) -> Wrench<T>
    where
        S: Constant<T>,
    {
        Wrench::at(p.e, p.delta * (T::one() / self.transmission(p)))
    }

    /// \[T68\]
    #[inline(always)]
    pub(super) fn hessian<T: Real>(&self, p: &Position<T>) -> Hessian<T>
    where
        S: Constant<T>,
    {
        let inverse = T::one() / self.transmission(p);
        let mut h = swing(p, self.a::<T>() * inverse);
        for row in &mut h {
            for x in row {
                *x = *x * inverse;
            }
        }
        h
    }

    #[inline(always)]
    pub(super) fn end<T: Real>(
        &self,
        p: &Position<T>,
        f: &Frame<T>,
        v_b: Vec3<T>,
        a_b: Vec3<T>,
    ) -> EndMotion<T>
    where
        S: Constant<T>,
    {
        let inverse = T::one() / p.length;
        let (v, a) = (f.axes.transpose_mul(v_b), f.axes.transpose_mul(a_b));
        // [T68] q' = δ·v_b/(δ·a);  δ' = (v_b - q'a)/c
        let d = f.axes.transpose_mul(self.a());
        let share = T::one() / d.y;
        let q = v.y * share;
        let rate = [(v.x - q * d.x) * inverse, (v.z - q * d.z) * inverse];
        // [T68] q'' = (δ·a_b + c |δ'|²)/(δ·a);  δ'' = (a_b - q''a)/c
        let square = rate[0].mul_add(rate[0], rate[1] * rate[1]);
        let second = p.length.mul_add(square, a.y) * share;
        let delta_acceleration = [(a.x - second * d.x) * inverse, (a.z - second * d.z) * inverse];
        EndMotion { v_b, a_b, rate: q, acceleration: second, delta_rate: rate, delta_acceleration }
    }

    #[inline(always)]
    pub(super) fn carried_along<T: Real>(&self, f: &Frame<T>, force: Vec3<T>, [n, m]: [T; 2]) -> T
    where
        S: Constant<T>,
    {
        // δ' = (v_b - (δ·v_b) a/(δ·a))/c: what rotates the strut along the rail is felt along δ.
        let d = f.axes.transpose_mul(self.a());
        force.y - ((n - force.x) * d.x + (m - force.z) * d.z) / d.y
    }

    /// The carriage does not rotate.
    #[inline(always)]
    pub(super) fn first_link<T: Real>(&self, center: Vec3<f64>, state: &LegState<T>) -> PointMotion<T>
    where
        S: Constant<T>,
    {
        let (a, EndMotion { rate, acceleration, .. }) = (self.a::<T>(), state.end);
        PointMotion { offset: Vec3::lift(center), velocity: a * rate, acceleration: a * acceleration }
    }

    /// Any will do: a carriage has no inertia here, as it does not rotate.
    #[allow(clippy::unused_self)] // as of all drives
    #[inline(always)]
    pub(super) fn first_turn<T: Real>(&self, state: &LegState<T>) -> (Mat3<T>, LegRotation<T>) {
        (state.frame.axes, state.turn)
    }

    /// The carriage's power is this times q'.
    #[inline(always)]
    pub(super) fn own_force<T: Real>(&self, body: &Body, gravity: Vec3<T>, state: &LegState<T>) -> T
    where
        S: Constant<T>,
    {
        (gravity.dot(self.a()) - state.end.acceleration).scale(body.mass)
    }

    #[inline(always)]
    pub(super) fn active<T: Real>(&self, reaction: Wrench<T>, _: &Position<T>) -> T
    where
        S: Constant<T>,
    {
        reaction.force.dot(self.a())
    }

    #[inline(always)]
    pub(super) fn twist<T: Real>(&self, p: &Position<T>) -> Twist<T>
    where
        S: Constant<T>,
    {
        Twist::new(self.a::<T>() * p.length, Vec3::zero())
    }
}

impl Slider {
    #[inline(always)]
    pub(super) fn joint<T: Real>(&self, [_, foot, _]: [Vec3<T>; 3], _: &Mat3<T>) -> (Vec3<T>, Mat3<T>) {
        let across = self.rail.perpendicular();
        (foot, Mat3::lift(Mat3::from_columns(across, self.rail, across.cross(self.rail))))
    }

    #[allow(clippy::unused_self)] // as of all drives
    pub(super) fn number(&self, coordinate: f64) -> f64 {
        coordinate
    }

    #[inline(always)]
    pub(super) fn asked<T: Real>(&self, number: T) -> (T, T) {
        (number, T::lit(self.strut * self.strut))
    }

    #[inline(always)]
    pub(super) fn vector<T: Real>(&self, r: Vec3<T>, place: T) -> Vec3<T> {
        r - self.a() * place
    }

    #[inline(always)]
    pub(super) fn asked_rate<T: Real>(&self, r: Vec3<T>, place: T, square: T) -> T {
        square.scale(0.5) + r.dot(self.a()) * place
    }

    #[inline(always)]
    pub(super) fn leans<T: Real>(&self, r: Vec3<T>) -> T {
        r.dot(self.a()).scale(self.branch)
    }

    pub(super) fn travel(&self) -> f64 {
        self.strut
    }
}
