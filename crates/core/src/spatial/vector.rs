//! Three-vectors, and 3×3 matrices as rotations.

use std::ops::{Add, Mul, Neg, Sub};

use serde::{Deserialize, Serialize};

use crate::number::real::{Constant, Dual, Jet, Real, Scalar, Trig};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[T; 3]", into = "[T; 3]")]
#[serde(bound(serialize = "T: Copy + Serialize", deserialize = "T: Deserialize<'de>"))]
pub struct Vec3<T> {
    pub x: T,
    pub y: T,
    pub z: T,
}

impl<T> From<[T; 3]> for Vec3<T> {
    fn from([x, y, z]: [T; 3]) -> Self {
        Vec3 { x, y, z }
    }
}

impl<T> From<Vec3<T>> for [T; 3] {
    fn from(a: Vec3<T>) -> Self {
        [a.x, a.y, a.z]
    }
}

impl<T: Real> Vec3<T> {
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        Vec3 { x, y, z }
    }

    #[must_use]
    #[inline(always)]
    pub fn zero() -> Self {
        Vec3::new(T::zero(), T::zero(), T::zero())
    }

    /// A constant of the mechanism as a vector of the kernel's number.
    #[inline(always)]
    pub fn lift(a: Vec3<impl Constant<T>>) -> Self {
        Vec3 { x: a.x.lift(), y: a.y.lift(), z: a.z.lift() }
    }

    #[inline(always)]
    pub fn dot(self, b: Self) -> T {
        self.x.mul_add(b.x, self.y.mul_add(b.y, self.z * b.z))
    }

    #[must_use]
    #[inline(always)]
    pub fn cross(self, b: Self) -> Self {
        Vec3::new(
            self.y.mul_add(b.z, -(self.z * b.y)),
            self.z.mul_add(b.x, -(self.x * b.z)),
            self.x.mul_add(b.y, -(self.y * b.x)),
        )
    }

    #[inline(always)]
    pub fn norm(self) -> T {
        self.dot(self).sqrt()
    }

    #[must_use]
    #[inline(always)]
    pub fn unit(self) -> Self {
        self * (T::one() / self.norm())
    }

    /// The vector times a constant.
    #[must_use]
    #[inline(always)]
    pub fn scale(self, k: impl Constant<T>) -> Self {
        Vec3::new(k.times(self.x), k.times(self.y), k.times(self.z))
    }

    #[inline(always)]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Vec3<U> {
        Vec3 { x: f(self.x), y: f(self.y), z: f(self.z) }
    }

    #[inline(always)]
    pub fn array(self) -> [T; 3] {
        self.into()
    }

    /// The vector with its rate.
    #[must_use]
    #[inline(always)]
    pub fn with_rate(self, d: Self) -> Vec3<Dual<T>> {
        Vec3 { x: Dual::new(self.x, d.x), y: Dual::new(self.y, d.y), z: Dual::new(self.z, d.z) }
    }

    /// The vector with its rate and second rate.
    #[must_use]
    #[inline(always)]
    pub fn with_rates(self, d: Self, dd: Self) -> Vec3<Jet<T>> {
        let (x, y) = (Jet::new(self.x, d.x, dd.x), Jet::new(self.y, d.y, dd.y));
        Vec3 { x, y, z: Jet::new(self.z, d.z, dd.z) }
    }
}

impl Vec3<f64> {
    pub const X: Self = Vec3 { x: 1.0, y: 0.0, z: 0.0 };
    pub const Y: Self = Vec3 { x: 0.0, y: 1.0, z: 0.0 };
    pub const Z: Self = Vec3 { x: 0.0, y: 0.0, z: 1.0 };
}

impl<T: Scalar> Vec3<T> {
    /// A unit vector perpendicular to this one, on the side of the base axis that this one leans on least.
    #[must_use]
    #[inline]
    pub fn perpendicular(self) -> Self {
        let [x, y, z] = self.map(|c| c.value().abs()).array();
        let axis = if z <= x && z <= y {
            Vec3::Z
        } else if y <= x {
            Vec3::Y
        } else {
            Vec3::X
        };
        self.cross(Vec3::lift(axis)).cross(self).unit()
    }
}

impl<T: Real> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Vec3::new(self.x + b.x, self.y + b.y, self.z + b.z)
    }
}

impl<T: Real> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Vec3::new(self.x - b.x, self.y - b.y, self.z - b.z)
    }
}

impl<T: Real> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3::new(-self.x, -self.y, -self.z)
    }
}

impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: T) -> Self {
        Vec3::new(self.x * k, self.y * k, self.z * k)
    }
}

/// A matrix by its columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<T>(pub [Vec3<T>; 3]);

impl<T: Real> Mat3<T> {
    #[inline(always)]
    pub fn from_columns(a: Vec3<T>, b: Vec3<T>, c: Vec3<T>) -> Self {
        Mat3([a, b, c])
    }

    #[inline(always)]
    pub fn from_rows(m: [[T; 3]; 3]) -> Self {
        let [x, y, z] = m;
        Mat3([Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]), Vec3::new(x[2], y[2], z[2])])
    }

    #[inline(always)]
    pub fn rows(self) -> [[T; 3]; 3] {
        let [x, y, z] = self.transpose().0;
        [x.array(), y.array(), z.array()]
    }

    #[must_use]
    #[inline(always)]
    pub fn identity() -> Self {
        Mat3::lift(Mat3([Vec3::X, Vec3::Y, Vec3::Z]))
    }

    #[inline(always)]
    pub fn lift(m: Mat3<impl Constant<T>>) -> Self {
        let [x, y, z] = m.0;
        Mat3([Vec3::lift(x), Vec3::lift(y), Vec3::lift(z)])
    }

    #[must_use]
    #[inline(always)]
    pub fn transpose(self) -> Self {
        let [a, b, c] = self.0;
        Mat3([Vec3::new(a.x, b.x, c.x), Vec3::new(a.y, b.y, c.y), Vec3::new(a.z, b.z, c.z)])
    }

    /// `Mᵀ a`.
    #[inline(always)]
    pub fn transpose_mul(self, a: Vec3<T>) -> Vec3<T> {
        let [x, y, z] = self.0;
        Vec3::new(x.dot(a), y.dot(a), z.dot(a))
    }

    /// Rotation by `angle`, given as its sine and cosine, about x.
    #[inline(always)]
    pub fn rotation_x((s, c): (T, T)) -> Self {
        let (i, o) = (T::one(), T::zero());
        Mat3::from_rows([[i, o, o], [o, c, -s], [o, s, c]])
    }

    /// Rotation about y.
    #[inline(always)]
    pub fn rotation_y((s, c): (T, T)) -> Self {
        let (i, o) = (T::one(), T::zero());
        Mat3::from_rows([[c, o, s], [o, i, o], [-s, o, c]])
    }

    /// Rotation about z.
    #[inline(always)]
    pub fn rotation_z((s, c): (T, T)) -> Self {
        let (i, o) = (T::one(), T::zero());
        Mat3::from_rows([[c, -s, o], [s, c, o], [o, o, i]])
    }

    /// The shortest rotation that takes the unit vector `a` to the unit vector `b`; undefined for `b = -a`.
    #[inline(always)]
    pub fn shortest_turn(a: Vec3<T>, b: Vec3<T>) -> Self {
        let w = a.cross(b);
        let k = T::one() / (T::one() + a.dot(b));
        // 1 + [w] + [w]² / (1 + a·b)
        let mut columns = Mat3::identity().0;
        for e in &mut columns {
            let we = w.cross(*e);
            *e = *e + we + w.cross(we) * k;
        }
        Mat3(columns)
    }
}

impl<T: Real> Mat3<T> {
    /// `M a` for a constant vector.
    #[must_use]
    #[inline(always)]
    pub fn of(self, a: Vec3<impl Constant<T>>) -> Vec3<T> {
        let [x, y, z] = self.0;
        x.scale(a.x) + y.scale(a.y) + z.scale(a.z)
    }

    /// The Cayley map `(1 - ŵ/2)⁻¹ (1 + ŵ/2)`, a rotation by 2 atan(|w|/2) about w \[T26\].
    #[must_use]
    #[inline(always)]
    pub fn cayley(w: Vec3<T>) -> Self {
        let half = w * T::lit(0.5);
        let share = T::lit(2.0) / (T::one() + half.dot(half));
        let mut columns = Mat3::identity().0;
        for e in &mut columns {
            let across = half.cross(*e);
            *e = *e + (across + half.cross(across)) * share;
        }
        Mat3(columns)
    }

    /// The matrix with the rounding of many products taken off: one Newton step of `MᵀM = 1` \[T29\].
    #[must_use]
    #[inline(always)]
    pub fn orthonormalised(self) -> Self {
        let half = T::lit(0.5);
        let products = self.transpose() * self;
        let identity = Mat3::identity();
        let mut columns = self.0;
        for j in 0..3 {
            let excess = (products.0[j] - identity.0[j]) * half;
            columns[j] = columns[j] - self * excess;
        }
        Mat3(columns)
    }
}

impl<T: Trig + Scalar> Mat3<T> {
    /// Rodrigues' formula for the rotation by |w| about w.
    #[must_use]
    pub fn from_rotation_vector(w: Vec3<T>) -> Self {
        let angle = w.norm();
        if angle.value() == 0.0 {
            return Mat3(Mat3::identity().0.map(|e: Vec3<T>| e + w.cross(e)));
        }
        let axis = w * (T::one() / angle);
        let (s, c) = angle.sin_cos();
        Mat3(
            Mat3::identity()
                .0
                .map(|e: Vec3<T>| e * c + axis.cross(e) * s + axis * (axis.dot(e) * (T::one() - c))),
        )
    }
}

impl Mat3<f64> {
    /// The inverse of [`Mat3::from_rotation_vector`] for rotations below a half turn.
    #[must_use]
    pub fn rotation_vector(self) -> Vec3<f64> {
        let [a, b, c] = self.0;
        let w = Vec3::new(b.z - c.y, c.x - a.z, a.y - b.x) * 0.5;
        let (s, c) = (w.norm(), (a.x + b.y + c.z - 1.0) * 0.5);
        if s == 0.0 { w } else { w * (s.atan2(c) / s) }
    }
}

impl<T: Real> Mat3<T> {
    /// The entries of `MᵀM - 1`, all zero for a rotation or a mirror image.
    #[inline(always)]
    pub fn departures(self) -> [T; 6] {
        let ([a, b, c], one) = (self.0, T::one());
        [a.dot(a) - one, b.dot(b) - one, c.dot(c) - one, a.dot(b), b.dot(c), c.dot(a)]
    }

    #[inline(always)]
    pub fn determinant(self) -> T {
        let [a, b, c] = self.0;
        a.cross(b).dot(c)
    }
}

impl<T: Real> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, a: Vec3<T>) -> Vec3<T> {
        let [x, y, z] = self.0;
        Vec3::new(
            x.x.mul_add(a.x, y.x.mul_add(a.y, z.x * a.z)),
            x.y.mul_add(a.x, y.y.mul_add(a.y, z.y * a.z)),
            x.z.mul_add(a.x, y.z.mul_add(a.y, z.z * a.z)),
        )
    }
}

impl<T: Real> Add for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, b.0);
        Mat3([a + x, b + y, c + z])
    }
}

impl<T: Real> Mul for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        let [x, y, z] = b.0;
        Mat3([self * x, self * y, self * z])
    }
}
