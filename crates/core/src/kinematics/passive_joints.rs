//! Angles of the passive joints, zero at the home pose; their rates are projections of angular velocities.
//!
//! At the base they are those of the leg against the base, at the platform those of the platform against the
//! leg, so that `ω = ω_leg + φ_1' u + φ_2' n` [Eq. 29].

use crate::kinematics::leg::{self, LegState};
use crate::model::joint::Joint;
use crate::model::limit::Zero;
use crate::model::mechanism::{Leg, Mechanism};
use crate::model::spec::Axes;
use crate::number::real::{Real, Trig};
use crate::spatial::{Mat3, Motion, Pose, Vec3};

/// Angles and rates of one joint: U has both (about the axis in the body, then about n), R the first, others
/// none.
#[derive(Clone, Copy, Debug)]
pub struct JointAngles<T> {
    pub angles: [T; 2],
    pub rates: [T; 2],
    /// Angle between the leg and the joint's cone axis.
    pub cone: T,
}

impl Zero {
    #[must_use]
    pub fn of(leg: &Leg, home: &Pose<f64>) -> Self {
        let p = leg::position(leg, home);
        let n = leg::frame(leg, home, &p).n();
        let seen = |a: Vec3<f64>| home.rotation.transpose_mul(a);
        Zero { base: (n, p.delta), platform: (seen(n), seen(p.delta)) }
    }
}

/// Base joint and platform joint of a leg.
#[inline(always)]
pub fn angles<T: Trig>(
    leg: &Leg,
    zero: &Zero,
    platform: &Motion<T>,
    state: &LegState<T>,
) -> [JointAngles<T>; 2] {
    let (n, delta, omega) = (state.frame.n(), state.position.delta, state.omega());
    let rotation = &platform.pose.rotation;
    // Seen from the leg the platform rotates the other way.
    let outer = platform.twist.omega - omega;
    [
        JointAngles {
            angles: angles_at(leg, Axes::Base, zero, rotation, n, delta),
            rates: rates(&leg.base, &Mat3::identity(), n, omega),
            cone: cone_angle(&leg.base, delta),
        },
        JointAngles {
            angles: angles_at(leg, Axes::Platform, zero, rotation, n, delta),
            rates: rates(&leg.platform, rotation, n, outer),
            cone: cone_angle(&leg.platform, rotation.transpose_mul(delta)),
        },
    ]
}

/// Angles of one joint of a leg with the normal `n` and the direction `delta`, given in base axes; `rotation`
/// is the platform's. NaN where the joint has none.
#[inline(always)]
pub fn angles_at<T: Trig>(
    leg: &Leg,
    side: Axes,
    zero: &Zero,
    rotation: &Mat3<T>,
    n: Vec3<T>,
    delta: Vec3<T>,
) -> [T; 2] {
    let (joint, (n0, delta0), n, delta) = match side {
        Axes::Base => (&leg.base, zero.base, n, delta),
        Axes::Platform => {
            (&leg.platform, zero.platform, rotation.transpose_mul(n), rotation.transpose_mul(delta))
        }
    };
    let none = T::lit(f64::NAN);
    let angles = match (joint.kind.angles(), joint.axis) {
        (2, Some(u)) => [about(u, n0, n), swing(u, (delta0, n0), delta, n)],
        (1, Some(u)) => [about(u, delta0, delta), none],
        _ => [none, none],
    };
    match side {
        Axes::Base => angles,
        // Seen from the leg the platform rotates the other way.
        Axes::Platform => [-angles[0], -angles[1]],
    }
}

/// Rates of the angles of a joint whose outer link rotates at `omega` against the inner one; `body` are the
/// axes that the joint's own axis is given in.
#[inline(always)]
fn rates<T: Real>(joint: &Joint, body: &Mat3<T>, n: Vec3<T>, omega: Vec3<T>) -> [T; 2] {
    let none = T::lit(f64::NAN);
    match (joint.kind.angles(), joint.axis) {
        (2, Some(u)) => [omega.dot(body.of(u)), omega.dot(n)],
        (1, Some(u)) => [omega.dot(body.of(u)), none],
        _ => [none; 2],
    }
}

/// The angle between the joint's cone axis and the leg's direction, both in the axes of the body.
#[must_use]
#[inline(always)]
pub fn cone_angle<T: Trig>(joint: &Joint, delta: Vec3<T>) -> T {
    let axis = Vec3::lift(joint.cone_axis);
    axis.cross(delta).norm().atan2(axis.dot(delta))
}

/// The rotation about `axis` that takes `from` to `to`.
#[inline(always)]
fn about<T: Trig>(axis: Vec3<f64>, from: Vec3<f64>, to: Vec3<T>) -> T {
    let side = Vec3::lift(axis.cross(from));
    let along = to.dot(Vec3::lift(from)) - Vec3::lift(axis).dot(to) * T::lit(axis.dot(from));
    to.dot(side).atan2(along)
}

/// The rotation of a leg about its normal since it had the given direction and normal, from where it is to
/// the axis of its universal joint then and now.
#[inline(always)]
fn swing<T: Trig>(axis: Vec3<f64>, zero: (Vec3<f64>, Vec3<f64>), delta: Vec3<T>, n: Vec3<T>) -> T {
    let (y0, x0) = across(axis, zero.0, zero.1);
    let (y, x) = across(Vec3::lift(axis), delta, n);
    let (y0, x0) = (T::lit(y0), T::lit(x0));
    (y * x0 - x * y0).atan2(x * x0 + y * y0)
}

/// The leg's direction across the axis and along it, in the plane perpendicular to the normal.
#[inline(always)]
fn across<T: Real>(axis: Vec3<T>, delta: Vec3<T>, n: Vec3<T>) -> (T, T) {
    (delta.dot(n.cross(axis)), delta.dot(axis))
}

/// The angle of the same direction within a half turn of zero.
#[inline(always)]
pub(crate) fn wrapped<T: Trig>(angle: T) -> T {
    let (s, c) = angle.sin_cos();
    s.atan2(c)
}

/// The rotation of each rod about its line since the home pose; `n` is the normal of the leg that leads it.
#[must_use]
#[inline(always)]
pub fn rod_angle<T: Trig>(mech: &Mechanism, rod: usize, zero: &Zero, n: Vec3<T>) -> T {
    about(mech.rods[rod].axis, zero.base.0, n)
}
