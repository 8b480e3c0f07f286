//! Complex poses with a quaternion of any size, on which the paths of a homotopy are followed.

use crate::model::mechanism::Mechanism;
use crate::model::spec::Axes;
use crate::number::complex::Complex;
use crate::number::lanes::{Lanes, Row};
use crate::number::order::larger;
use crate::number::real::Real;
use crate::spatial::{Mat3, Pose, Vec3};

pub type C = Complex<f64>;

/// A complex pose with its rotation as a quaternion of any size but zero, so that steps are sums \[T29\].
#[derive(Clone, Copy, Debug)]
pub struct PathPoint<T> {
    pub q: [T; 4],
    pub o: Vec3<T>,
}

impl<T: Real> PathPoint<T> {
    #[must_use]
    #[inline(always)]
    pub fn pose(&self) -> Pose<T> {
        let [w, x, y, z] = self.q;
        let share = T::lit(2.0) / (w * w + x * x + y * y + z * z);
        let (sx, sy, sz) = (x * share, y * share, z * share);
        let (wx, wy, wz) = (w * sx, w * sy, w * sz);
        let (xx, xy, xz) = (x * sx, x * sy, x * sz);
        let (yy, yz, zz) = (y * sy, y * sz, z * sz);
        let one = T::one();
        let rotation = Mat3::from_columns(
            Vec3::new(one - (yy + zz), xy + wz, xz - wy),
            Vec3::new(xy - wz, one - (xx + zz), yz + wx),
            Vec3::new(xz + wy, yz - wx, one - (xx + yy)),
        );
        Pose { rotation, o: self.o }
    }

    /// The change of the point along (v/Λ, ω): `q' = ω q/2`.
    #[inline(always)]
    pub(crate) fn along(&self, mech: &Mechanism, x: &[T; 6]) -> Self {
        let [w, i, j, k] = self.q;
        let (omega, vector) = (Vec3::new(x[3], x[4], x[5]).scale(0.5), Vec3::new(i, j, k));
        let turned = omega * w + omega.cross(vector);
        let o = Vec3::new(x[0], x[1], x[2]).scale(mech.characteristic_length);
        PathPoint { q: [-omega.dot(vector), turned.x, turned.y, turned.z], o }
    }
}

impl<T: Real> std::ops::Add for PathPoint<T> {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        PathPoint { q: std::array::from_fn(|i| self.q[i] + b.q[i]), o: self.o + b.o }
    }
}

impl PathPoint<C> {
    /// From the largest of four products of the quaternion with each of its parts.
    pub(crate) fn of(pose: &Pose<C>) -> Self {
        let m = pose.rotation.rows();
        let one = C::one();
        let (w, x) = (one + m[0][0] + m[1][1] + m[2][2], one + m[0][0] - m[1][1] - m[2][2]);
        let (y, z) = (one - m[0][0] + m[1][1] - m[2][2], one - m[0][0] - m[1][1] + m[2][2]);
        let (wx, wy, wz) = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]);
        let (xy, xz, yz) = (m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]);
        let products = [[w, wx, wy, wz], [wx, x, xy, xz], [wy, xy, y, yz], [wz, xz, yz, z]];
        let largest =
            (0..4).fold(0, |a, b| if products[b][b].norm() > products[a][a].norm() { b } else { a });
        let share = one / products[largest][largest].sqrt();
        PathPoint { q: products[largest].map(|p| p * share), o: pose.o }
    }

    /// The point after that imaginary idle spin which makes the quaternion least: spins are no part of a
    /// solution, and imaginary ones let it grow without bounds \[T71\].
    pub(super) fn unspun(self, mech: &Mechanism) -> Self {
        let [idle] = &mech.idle[..] else { return self };
        let [w, x, y, z] = self.q;
        let (u, v) = (Vec3::lift(idle.axis), Vec3::new(x, y, z));
        // q u or u q: multiplied twice it is -q, so that q has two parts that it makes ±i times as large.
        let across = if idle.side == Axes::Platform { v.cross(u) } else { u.cross(v) };
        let Vec3 { x, y, z } = u * w + across;
        let (i, turned) = (C::new(0.0, 1.0), [-u.dot(v), x, y, z]);
        let parts =
            [-i, i].map(|i| std::array::from_fn::<C, 4, _>(|k| (self.q[k] + i * turned[k]).scale(0.5)));
        let [a, b] = parts.map(|part| part.iter().map(|e| e.norm_sqr()).sum::<f64>().sqrt());
        let share = (b / a).sqrt();
        if !(share > 0.0 && share.is_finite()) {
            return self;
        }
        let [first, second] = parts;
        let q = std::array::from_fn(|k| first[k].scale(share) + second[k].scale(1.0 / share));
        // The line stays where it is: o rotates about it.
        let (before, after) = (self.pose(), PathPoint { q, ..self }.pose());
        let point = Vec3::lift(idle.point);
        let o = match idle.side {
            Axes::Platform => self.o + before.rotation * point - after.rotation * point,
            Axes::Base => point - after.rotation * before.rotation.transpose_mul(point - self.o),
        };
        PathPoint { q, o }
    }

    /// How large its coordinates are, as a pure number: of o, and of the rotation, by |q|²/|q·q|.
    pub(super) fn size(&self, mech: &Mechanism) -> f64 {
        let q = self.q.iter().fold(C::zero(), |sum, &e| sum + e * e).norm();
        let turned = self.q.iter().map(|e| e.norm_sqr()).sum::<f64>() / q;
        larger(modulus(self.o) / mech.characteristic_length, turned)
    }

    pub(super) fn get(block: &Block, k: usize) -> Self {
        let [w, x, y, z, a, b, c] = std::array::from_fn(|i| C::new(block[2 * i][k], block[2 * i + 1][k]));
        PathPoint { q: [w, x, y, z], o: Vec3::new(a, b, c) }
    }

    pub(super) fn put(&self, block: &mut Block, k: usize) {
        let numbers = self.q.into_iter().chain(self.o.array()).flat_map(|z| [z.re, z.im]);
        for (row, number) in block.iter_mut().zip(numbers) {
            row[k] = number;
        }
    }
}

/// The length of the real and imaginary parts together.
#[must_use]
pub fn modulus(v: Vec3<C>) -> f64 {
    (v.x.norm_sqr() + v.y.norm_sqr() + v.z.norm_sqr()).sqrt()
}

/// Real and imaginary parts of the q and o of each: places, steps of them, or rates.
pub(super) type Block = [Row; 14];

#[inline(always)]
pub(super) fn load<V: Lanes>(block: &Block, k: usize) -> PathPoint<Complex<V>> {
    let mut parts = [Complex::<V>::zero(); 7];
    for i in 0..7 {
        parts[i] = Complex::new(V::load(&block[2 * i][k..]), V::load(&block[2 * i + 1][k..]));
    }
    let [w, x, y, z, a, b, c] = parts;
    PathPoint { q: [w, x, y, z], o: Vec3::new(a, b, c) }
}

#[inline(always)]
pub(super) fn store<V: Lanes>(place: &PathPoint<Complex<V>>, block: &mut Block, k: usize) {
    let ([w, x, y, z], [a, b, c]) = (place.q, place.o.array());
    let parts = [w, x, y, z, a, b, c];
    for i in 0..7 {
        parts[i].re.store(&mut block[2 * i][k..]);
        parts[i].im.store(&mut block[2 * i + 1][k..]);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::common;
    use crate::number::lanes::WIDTH;
    use crate::numerics::random::Random;

    pub(in crate::forward_kinematics) fn complex_places(draw: &mut Random) -> [PathPoint<C>; WIDTH] {
        let mut place =
            || PathPoint { q: std::array::from_fn(|_| draw.complex()), o: draw.vector(Random::complex) };
        std::array::from_fn(|_| place())
    }

    #[test]
    fn a_quaternion_of_any_size_is_its_rotation() {
        for place in complex_places(&mut Random(11)) {
            let pose = place.pose();
            let again = PathPoint::of(&pose).pose();
            for (a, b) in pose.rotation.0.into_iter().zip(again.rotation.0) {
                assert!(modulus(a - b) < 1e-12 * (1.0 + modulus(a)));
            }
            let products = pose.rotation.transpose() * pose.rotation;
            assert!(modulus(products.0[1] - Vec3::lift(Vec3::Y)) < 1e-11);
        }
        // Unit quaternion of a rotation by 0.6 about z, twice as large.
        let (s, c) = 0.3_f64.sin_cos();
        let place = PathPoint { q: [2.0 * c, 0.0, 0.0, 2.0 * s].map(C::lit), o: Vec3::zero() };
        let turned = Mat3::from_rotation_vector(Vec3::Z * 0.6);
        for (a, b) in place.pose().rotation.0.into_iter().zip(turned.0) {
            assert!(modulus(a - Vec3::lift(b)) < 1e-15);
        }
    }

    #[test]
    fn the_rate_of_a_place_is_that_of_its_pose() {
        let mech = common::published();
        let mut draw = Random(3);
        let [place, ..] = complex_places(&mut draw);
        let twist: [C; 6] = std::array::from_fn(|_| draw.complex());
        let rate = place.along(&mech, &twist);
        let h = 1e-6;
        let moved = |h: f64| {
            let step = PathPoint { q: rate.q.map(|q| q.scale(h)), o: rate.o.scale(h) };
            (place + step).pose()
        };
        let omega = Vec3::new(twist[3], twist[4], twist[5]);
        let (after, before) = (moved(h), moved(-h));
        for k in 0..3 {
            let difference = (after.rotation.0[k] - before.rotation.0[k]).scale(0.5 / h);
            let expected = omega.cross(place.pose().rotation.0[k]);
            assert!(modulus(difference - expected) < 1e-6 * (1.0 + modulus(expected)));
        }
        let speed = (after.o - before.o).scale(0.5 / h);
        assert!(
            modulus(speed - Vec3::new(twist[0], twist[1], twist[2]).scale(mech.characteristic_length)) < 1e-8
        );
    }
}
