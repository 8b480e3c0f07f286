//! Poses, twists, accelerations and wrenches.
//!
//! Six-vectors have their linear part first and are taken at the platform's point o, in base axes.
//! An acceleration is the classical one: its linear part is the acceleration of the point o.

use std::ops::{Add, Mul, Neg, Sub};

use crate::number::real::{Dual, Jet, Real};
use crate::spatial::vector::{Mat3, Vec3};

/// The platform's place: platform axes to base axes, and the point o.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T> {
    pub rotation: Mat3<T>,
    pub o: Vec3<T>,
}

impl<T: Real> Pose<T> {
    /// The pose after the finite step `(v, w)`: o moves by v and the axes rotate by the Cayley map of w,
    /// which agrees with the rotation by the vector w to second order and needs no trigonometry \[T26\].
    #[must_use]
    #[inline(always)]
    pub fn stepped(&self, step: &Twist<T>) -> Self {
        Pose { rotation: Mat3::cayley(step.omega) * self.rotation, o: self.o + step.v }
    }

    #[inline(always)]
    pub fn lift(p: &Pose<f64>) -> Self {
        Pose { rotation: Mat3::lift(p.rotation), o: Vec3::lift(p.o) }
    }
}

impl<T: Real> Pose<T> {
    /// The pose with its rate along a twist.
    #[must_use]
    #[inline(always)]
    pub fn along(&self, twist: &Twist<T>) -> Pose<Dual<T>> {
        let (omega, [x, y, z]) = (twist.omega, self.rotation.0);
        let columns = [x.with_rate(omega.cross(x)), y.with_rate(omega.cross(y)), z.with_rate(omega.cross(z))];
        Pose { rotation: Mat3(columns), o: self.o.with_rate(twist.v) }
    }
}

impl Pose<f64> {
    /// The homogeneous matrix, row by row.
    #[must_use]
    pub fn matrix(&self) -> [f64; 16] {
        let ([x, y, z], o) = (self.rotation.0, self.o);
        [x.x, y.x, z.x, o.x, x.y, y.y, z.y, o.y, x.z, y.z, z.z, o.z, 0.0, 0.0, 0.0, 1.0]
    }
}

/// (v, ω) of the platform at o.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist<T> {
    pub v: Vec3<T>,
    pub omega: Vec3<T>,
}

/// (a, ε) of the platform at o.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acceleration<T> {
    pub a: Vec3<T>,
    pub eps: Vec3<T>,
}

/// (F, T) on the platform at o; also a row of the Jacobian, whose product with the twist is a power or a
/// rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<T> {
    pub force: Vec3<T>,
    pub torque: Vec3<T>,
}

/// How the platform moves at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<T> {
    pub pose: Pose<T>,
    pub twist: Twist<T>,
    pub acceleration: Acceleration<T>,
}

impl<T: Real> Motion<T> {
    /// The pose with its rate and second rate.
    #[must_use]
    #[inline(always)]
    pub fn jets(&self) -> Pose<Jet<T>> {
        let Motion { pose, twist, acceleration } = self;
        let (omega, eps) = (twist.omega, acceleration.eps);
        let [x, y, z] = pose.rotation.0;
        // [T2] with the columns of R for e: x' = ω × x, x'' = ε × x + ω × (ω × x)
        let [x1, y1, z1] = [omega.cross(x), omega.cross(y), omega.cross(z)];
        let x2 = eps.cross(x) + omega.cross(x1);
        let y2 = eps.cross(y) + omega.cross(y1);
        let z2 = eps.cross(z) + omega.cross(z1);
        Pose {
            rotation: Mat3([x.with_rates(x1, x2), y.with_rates(y1, y2), z.with_rates(z1, z2)]),
            o: pose.o.with_rates(twist.v, acceleration.a),
        }
    }
}

macro_rules! six_vector {
    ($name:ident, $linear:ident, $angular:ident) => {
        impl<T: Real> $name<T> {
            #[inline(always)]
            pub fn new($linear: Vec3<T>, $angular: Vec3<T>) -> Self {
                $name { $linear, $angular }
            }
            #[must_use]
            #[inline(always)]
            pub fn zero() -> Self {
                $name::new(Vec3::zero(), Vec3::zero())
            }
            #[inline(always)]
            pub fn from_array([a, b, c, d, e, f]: [T; 6]) -> Self {
                $name::new(Vec3::new(a, b, c), Vec3::new(d, e, f))
            }
            #[inline(always)]
            pub fn array(self) -> [T; 6] {
                let ([a, b, c], [d, e, f]) = (self.$linear.array(), self.$angular.array());
                [a, b, c, d, e, f]
            }
        }
    };
}
six_vector!(Twist, v, omega);
six_vector!(Acceleration, a, eps);
six_vector!(Wrench, force, torque);

impl<T: Real> Wrench<T> {
    /// A force at the point o + e.
    #[inline(always)]
    pub fn at(e: Vec3<T>, force: Vec3<T>) -> Self {
        Wrench::new(force, e.cross(force))
    }

    /// Wrench with its torque about the point that lies `back` behind the given one.
    #[must_use]
    #[inline(always)]
    pub fn moved(self, back: Vec3<T>) -> Self {
        Wrench::new(self.force, self.torque + back.cross(self.force))
    }

    #[inline(always)]
    pub fn power(self, twist: &Twist<T>) -> T {
        self.force.dot(twist.v) + self.torque.dot(twist.omega)
    }
}

/// A row for the twist (v, Λω), Λ being `scale`.
#[inline(always)]
pub(crate) fn pure_row<T: Real>(row: Wrench<T>, scale: f64) -> [T; 6] {
    Wrench::new(row.force, row.torque * T::lit(1.0 / scale)).array()
}

impl<T: Real> Add for Wrench<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Wrench::new(self.force + b.force, self.torque + b.torque)
    }
}

impl<T: Real> Sub for Wrench<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Wrench::new(self.force - b.force, self.torque - b.torque)
    }
}

impl<T: Real> Neg for Wrench<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Wrench::new(-self.force, -self.torque)
    }
}

impl<T: Real> Mul<T> for Wrench<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: T) -> Self {
        Wrench::new(self.force * k, self.torque * k)
    }
}
