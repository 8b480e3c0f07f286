//! Number types: the traits and types over which every equation is generic.
//!
//! [`Real`] is what a kernel may use: field operations, a square root, and [`Real::select`] in place of a
//! branch. `f64` and [`F`] are numbers; [`Dual`] carries one derivative along, [`Jet`] a rate and a second
//! rate, so that the same source gives values, exact derivatives and exact time histories. [`Trig`] adds what
//! only coordinate sets and joint angles need, [`Scalar`] names the numbers of a single state, which may be
//! branched on. Complex numbers and lanes of numbers are in [`complex`](crate::number::complex) and
//! [`lanes`](crate::number::lanes).

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::number::work::Work;

/// A number for the kernels: no trigonometry, no branching on values.
pub trait Real:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// Type in which numbers are compared.
    type Value: Ordered;

    /// The constant `x`.
    fn lit(x: f64) -> Self;

    /// The value without derivatives: for pivoting and for status, never for an answer.
    fn value(self) -> Self::Value;

    #[must_use]
    fn sqrt(self) -> Self;

    /// `self * x` for a constant, which needs fewer operations where the number has parts.
    #[must_use]
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        self * Self::lit(x)
    }

    /// `self * a + b`, fused where the number says so.
    #[must_use]
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }

    /// Does a part of a long computation: in a function of its own where the number is a register.
    #[inline(always)]
    fn apart<W: Work<Self>>(work: W) -> W::Result {
        work.run()
    }

    /// `a` where `choose`, else `b`: the kernels' only choice.
    fn select(choose: Mask<Self>, a: Self, b: Self) -> Self;

    #[must_use]
    #[inline(always)]
    fn zero() -> Self {
        Self::lit(0.0)
    }

    #[must_use]
    #[inline(always)]
    fn one() -> Self {
        Self::lit(1.0)
    }
}

/// Numbers in an order: one, or one in each lane.
pub trait Ordered: Real<Value = Self> + Trig {
    /// Yes or no, for each lane.
    type Mask: Copy;

    fn greater(self, than: Self) -> Self::Mask;
    /// No where they cannot be compared.
    fn at_most(self, other: Self) -> Self::Mask;
    #[must_use]
    fn abs(self) -> Self;
    /// 1 or -1.
    #[must_use]
    fn signum(self) -> Self;

    /// The lesser one; this one if they cannot be compared.
    #[must_use]
    #[inline(always)]
    fn least(self, other: Self) -> Self {
        Self::select(self.greater(other), other, self)
    }

    /// The greater one; this one if they cannot be compared.
    #[must_use]
    #[inline(always)]
    fn most(self, other: Self) -> Self {
        Self::select(other.greater(self), other, self)
    }
}

/// Where one of two numbers is chosen.
pub type Mask<T> = <<T as Real>::Value as Ordered>::Mask;

/// A number of a single state: its value is one double.
pub trait Scalar: Real<Value = f64> {}
impl<T: Real<Value = f64>> Scalar for T {}

/// Trigonometry, for coordinate sets and angles of joints; of plain numbers by [`trig`](crate::number::trig).
pub trait Trig: Real {
    fn sin_cos(self) -> (Self, Self);
    #[must_use]
    fn acos(self) -> Self;
    /// The angle of the point `(x, self)`.
    #[must_use]
    fn atan2(self, x: Self) -> Self;
}

/// A small count as a number: exact.
#[must_use]
pub fn count(n: usize) -> f64 {
    u32::try_from(n).map_or(f64::INFINITY, f64::from)
}

/// A number of the mechanism, a constant to the kernels' number `T`: a double, or one that carries its
/// derivative by a number of the geometry, for kernels whose numbers carry that as well \[T56\].
pub trait Constant<T: Real>: Scalar {
    fn lift(self) -> T;

    /// `x` times the constant.
    #[must_use]
    #[inline(always)]
    fn times(self, x: T) -> T {
        x * self.lift()
    }
}

impl<T: Real> Constant<T> for f64 {
    #[inline(always)]
    fn lift(self) -> T {
        T::lit(self)
    }
    #[inline(always)]
    fn times(self, x: T) -> T {
        x.scale(self)
    }
}

/// For one number or one in each lane.
impl<V: Ordered> Constant<Dual<V>> for Dual<f64> {
    #[inline(always)]
    fn lift(self) -> Dual<V> {
        Dual::new(V::lit(self.x), V::lit(self.d))
    }
}

/// At rest along a motion.
impl<V: Ordered> Constant<Jet<Dual<V>>> for Dual<f64> {
    #[inline(always)]
    fn lift(self) -> Jet<Dual<V>> {
        Jet::new(self.lift(), Dual::zero(), Dual::zero())
    }
}

impl Real for f64 {
    type Value = Self;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn value(self) -> Self {
        self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn select(choose: bool, a: Self, b: Self) -> Self {
        if choose { a } else { b }
    }
}

impl Ordered for f64 {
    type Mask = bool;
    #[inline(always)]
    fn greater(self, than: Self) -> bool {
        self > than
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn signum(self) -> Self {
        f64::signum(self)
    }
}

/// A double whose `mul_add` is one fused instruction when `FMA` (for code compiled with that feature), else
/// two.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct F<const FMA: bool>(pub f64);

macro_rules! forward {
    ($($op:ident $method:ident),*) => {$(
        impl<const FMA: bool> $op for F<FMA> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                F(self.0.$method(other.0))
            }
        }
    )*};
}
forward!(Add add, Sub sub, Mul mul, Div div);

impl<const FMA: bool> Neg for F<FMA> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        F(-self.0)
    }
}

impl<const FMA: bool> Real for F<FMA> {
    type Value = f64;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        F(x)
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.0
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        F(self.0.sqrt())
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        if FMA { F(self.0.mul_add(a.0, b.0)) } else { F(self.0 * a.0 + b.0) }
    }
    #[inline(always)]
    fn select(choose: bool, a: Self, b: Self) -> Self {
        if choose { a } else { b }
    }
}

/// A value and its derivative in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T> {
    pub x: T,
    pub d: T,
}

impl<T: Real> Dual<T> {
    #[inline(always)]
    pub fn new(x: T, d: T) -> Self {
        Dual { x, d }
    }
}

impl<T: Real> Add for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Dual::new(self.x + b.x, self.d + b.d)
    }
}

impl<T: Real> Sub for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Dual::new(self.x - b.x, self.d - b.d)
    }
}

impl<T: Real> Mul for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Dual::new(self.x * b.x, self.d.mul_add(b.x, self.x * b.d))
    }
}

impl<T: Real> Div for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let x = self.x / b.x;
        Dual::new(x, (self.d - x * b.d) / b.x)
    }
}

impl<T: Real> Neg for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual::new(-self.x, -self.d)
    }
}

impl<T: Real> Real for Dual<T> {
    type Value = T::Value;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Dual::new(T::lit(x), T::zero())
    }
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        Dual::new(self.x.scale(x), self.d.scale(x))
    }
    #[inline(always)]
    fn value(self) -> T::Value {
        self.x.value()
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let x = self.x.sqrt();
        Dual::new(x, self.d / (x + x))
    }
    #[inline(always)]
    fn select(choose: Mask<T>, a: Self, b: Self) -> Self {
        Dual::new(T::select(choose, a.x, b.x), T::select(choose, a.d, b.d))
    }
}

impl<T: Trig> Trig for Dual<T> {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.x.sin_cos();
        (Dual::new(s, c * self.d), Dual::new(c, -(s * self.d)))
    }
    #[inline(always)]
    fn acos(self) -> Self {
        Dual::new(self.x.acos(), -self.d / (T::one() - self.x * self.x).sqrt())
    }
    #[inline(always)]
    fn atan2(self, b: Self) -> Self {
        let square = self.x * self.x + b.x * b.x;
        Dual::new(self.x.atan2(b.x), (self.d * b.x - self.x * b.d) / square)
    }
}

/// A quantity along a motion: its value, rate and second rate. The chain rule is exact, nothing is truncated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<T> {
    pub x: T,
    pub d: T,
    pub dd: T,
}

impl<T: Real> Jet<T> {
    #[inline(always)]
    pub fn new(x: T, d: T, dd: T) -> Self {
        Jet { x, d, dd }
    }

    /// `f(self)` from the value of `f` and its first two derivatives at `self.x`.
    #[inline(always)]
    fn chain(self, f: T, f1: T, f2: T) -> Self {
        Jet::new(f, f1 * self.d, (f2 * self.d).mul_add(self.d, f1 * self.dd))
    }
}

impl<T: Real> Add for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Jet::new(self.x + b.x, self.d + b.d, self.dd + b.dd)
    }
}

impl<T: Real> Sub for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Jet::new(self.x - b.x, self.d - b.d, self.dd - b.dd)
    }
}

impl<T: Real> Mul for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        let cross = self.d * b.d;
        Jet::new(
            self.x * b.x,
            self.d.mul_add(b.x, self.x * b.d),
            self.dd.mul_add(b.x, self.x * b.dd) + (cross + cross),
        )
    }
}

impl<T: Real> Div for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let x = self.x / b.x;
        let d = (self.d - x * b.d) / b.x;
        let cross = d * b.d;
        Jet::new(x, d, (self.dd - (cross + cross) - x * b.dd) / b.x)
    }
}

impl<T: Real> Neg for Jet<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Jet::new(-self.x, -self.d, -self.dd)
    }
}

impl<T: Real> Real for Jet<T> {
    type Value = T::Value;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Jet::new(T::lit(x), T::zero(), T::zero())
    }
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        Jet::new(self.x.scale(x), self.d.scale(x), self.dd.scale(x))
    }
    #[inline(always)]
    fn value(self) -> T::Value {
        self.x.value()
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let x = self.x.sqrt();
        let f1 = T::lit(0.5) / x;
        self.chain(x, f1, -f1 * T::lit(0.5) / self.x)
    }
    #[inline(always)]
    fn select(choose: Mask<T>, a: Self, b: Self) -> Self {
        Jet::new(T::select(choose, a.x, b.x), T::select(choose, a.d, b.d), T::select(choose, a.dd, b.dd))
    }
}

impl<T: Trig> Trig for Jet<T> {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.x.sin_cos();
        (self.chain(s, c, -s), self.chain(c, -s, -c))
    }
    #[inline(always)]
    fn acos(self) -> Self {
        let square = T::one() - self.x * self.x;
        let f1 = -T::one() / square.sqrt();
        self.chain(self.x.acos(), f1, f1 * self.x / square)
    }
    #[inline(always)]
    fn atan2(self, b: Self) -> Self {
        // The rate of the angle of (b, self) is (self' b - self b') / (self² + b²): one quotient,
        // differentiated once.
        let square = self * self + b * b;
        let area = self.d * b.x - self.x * b.d;
        let area_rate = self.dd * b.x - self.x * b.dd;
        let d = area / square.x;
        Jet::new(self.x.atan2(b.x), d, (area_rate - d * square.d) / square.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function that meets every operation.
    fn sample<T: Trig>(t: T) -> T {
        let (s, c) = (t * t).sin_cos();
        let q = (T::lit(2.0) + s) / (T::lit(3.0) - c * t);
        (q * T::lit(0.3)).acos() + q.sqrt() - s.atan2(q + t).mul_add(t, -c)
    }

    #[test]
    fn dual_and_jet_agree_with_central_differences_of_order_two() {
        for t in [-1.3, -0.4, 0.0, 0.7, 2.1] {
            let jet = sample(Jet::new(t, 1.0, 0.0));
            let dual = sample(Dual::new(Dual::new(t, 1.0), Dual::new(1.0, 0.0)));
            assert!((jet.x - sample(t)).abs() < 1e-15);
            assert!((jet.d - dual.d.x).abs() < 1e-13 && (jet.dd - dual.d.d).abs() < 1e-12);
            let error = |h: f64| {
                let (f1, f0, f2) = (sample(t - h), sample(t), sample(t + h));
                (((f2 - f1) / (2.0 * h) - jet.d).abs(), ((f2 - 2.0 * f0 + f1) / (h * h) - jet.dd).abs())
            };
            let (coarse, fine) = (error(2e-3), error(1e-3));
            assert!((coarse.0 / fine.0 - 4.0).abs() < 0.1, "rate at {t}: {coarse:?} {fine:?}");
            assert!((coarse.1 / fine.1 - 4.0).abs() < 0.1, "second rate at {t}: {coarse:?} {fine:?}");
        }
    }

    #[test]
    fn jet_follows_a_moving_argument() {
        // sample(t²): the second rate must hold the argument's own second rate.
        let t = 0.6;
        let composed = sample(Jet::new(t * t, 2.0 * t, 2.0));
        let inside = Jet::new(t, 1.0, 0.0);
        let direct = sample(inside * inside);
        assert!((composed.d - direct.d).abs() < 1e-14 && (composed.dd - direct.dd).abs() < 1e-13);
    }
}
