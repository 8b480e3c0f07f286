//! A leg at an instant: its place, its motion, its rotation, as what [`leg`](crate::kinematics::leg) and the
//! drives find of them.

use crate::number::real::Real;
use crate::spatial::{Mat3, Vec3};

/// Where the leg is, base axes \[T1\] \[T67\].
#[derive(Clone, Copy, Debug)]
pub struct Position<T> {
    /// From o to b.
    pub e: Vec3<T>,
    /// From the strut's foot to b: from B, or from the carriage of a slider.
    pub r: Vec3<T>,
    /// Of the strut.
    pub length: T,
    /// Unit vector of r.
    pub delta: Vec3<T>,
    /// Of the prismatic joint: the length ℓ, or the place q of the carriage.
    pub coordinate: T,
}

/// The leg's frame at a pose, and what the spin needs of it \[T5\].
#[derive(Clone, Copy, Debug)]
pub struct Frame<T> {
    /// Columns n, δ, m = n×δ.
    pub axes: Mat3<T>,
    /// |u×δ|: zero where a U joint's axis lies along the leg, one for an R or F joint.
    pub sine: T,
    /// κ = u·δ/|u×δ| of a U joint: how much the leg spins as it swings; zero for other joints.
    pub slope: T,
}

impl<T: Real> Frame<T> {
    #[inline(always)]
    pub fn n(&self) -> Vec3<T> {
        self.axes.0[0]
    }
}

/// How the platform end moves, and with it the leg's coordinate and direction \[T2\] \[T3\] \[T4\] \[T68\].
#[derive(Clone, Copy, Debug)]
pub struct EndMotion<T> {
    /// Base axes.
    pub v_b: Vec3<T>,
    pub a_b: Vec3<T>,
    /// Of the coordinate: ℓ' and ℓ'', or q' and q''.
    pub rate: T,
    pub acceleration: T,
    /// δ' along n and m.
    pub delta_rate: [T; 2],
    /// δ'' along n and m; along δ it is -|δ'|².
    pub delta_acceleration: [T; 2],
}

/// Rotation of the leg: spin, angular velocity and acceleration \[T6\].
#[derive(Clone, Copy, Debug)]
pub struct LegRotation<T> {
    pub spin: T,
    pub spin_rate: T,
    /// Angular velocity and acceleration along n, δ, m.
    pub omega: Vec3<T>,
    pub eps: Vec3<T>,
}

/// All of a leg at an instant.
#[derive(Clone, Copy, Debug)]
pub struct LegState<T> {
    pub position: Position<T>,
    pub end: EndMotion<T>,
    pub frame: Frame<T>,
    pub turn: LegRotation<T>,
}

impl<T: Real> LegState<T> {
    /// Angular velocity, base axes.
    #[inline(always)]
    pub fn omega(&self) -> Vec3<T> {
        self.frame.axes * self.turn.omega
    }

    /// Angular acceleration, base axes.
    #[inline(always)]
    pub fn eps(&self) -> Vec3<T> {
        self.frame.axes * self.turn.eps
    }

    /// The motion of a point fixed in a link that rotates with the leg, from that of the link's reference
    /// point.
    #[inline(always)]
    pub(crate) fn point_motion(
        &self,
        center: Vec3<f64>,
        velocity: Vec3<T>,
        acceleration: Vec3<T>,
    ) -> PointMotion<T> {
        let (axes, LegRotation { omega, eps, .. }, center) = (self.frame.axes, self.turn, Vec3::lift(center));
        let spin = omega.cross(center);
        PointMotion {
            offset: axes * center,
            velocity: velocity + axes * spin,
            acceleration: acceleration + axes * (eps.cross(center) + omega.cross(spin)),
        }
    }
}

/// A point fixed in a link that rotates with the leg: offset from the link's reference point, velocity,
/// acceleration.
#[derive(Clone, Copy, Debug)]
pub struct PointMotion<T> {
    pub offset: Vec3<T>,
    pub velocity: Vec3<T>,
    pub acceleration: Vec3<T>,
}
