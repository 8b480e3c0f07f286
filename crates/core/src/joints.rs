//! Angles of the passive joints, zero at the home pose; their rates are projections of angular velocities.
//!
//! At the base they are those of the leg against the base, at the platform those of the platform against the leg, so
//! that `ω = ω_leg + φ_1' u + φ_2' n` [Eq. 29].

use crate::leg::{self, Frame, State};
use crate::mechanism::{Joint, Leg, Mechanism};
use crate::spatial::{Mat3, Motion, Pose, Vec3};
use crate::spec::JointKind;

/// Angles and rates of one joint: U has both (about the axis in the body, then about n), R the first, others none.
#[derive(Clone, Copy, Debug)]
pub struct JointAngles {
    pub angles: [f64; 2],
    pub rates: [f64; 2],
    /// Angle between the leg and the joint's cone axis.
    pub cone: f64,
}

/// A leg's normal n and direction δ at the home pose, in base axes and in platform axes: where angles are zero.
#[derive(Clone, Copy, Debug)]
pub struct Zero {
    base: (Vec3<f64>, Vec3<f64>),
    platform: (Vec3<f64>, Vec3<f64>),
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
#[must_use]
pub fn angles(leg: &Leg, zero: &Zero, platform: &Motion<f64>, state: &State<f64>) -> [JointAngles; 2] {
    let relative = state.turn.omega - platform.twist.omega;
    let base = one(&leg.base, zero.base, &Mat3::identity(), state, state.turn.omega);
    let mut above = one(&leg.platform, zero.platform, &platform.pose.rotation, state, relative);
    // Seen from the leg the platform turns the other way.
    above.angles = above.angles.map(|a| -a);
    above.rates = above.rates.map(|a| -a);
    [base, above]
}

/// The leg against a body with the given axes, turning at `omega` relative to it.
fn one(
    joint: &Joint,
    (n0, delta0): (Vec3<f64>, Vec3<f64>),
    body: &Mat3<f64>,
    state: &State<f64>,
    omega: Vec3<f64>,
) -> JointAngles {
    let (n, delta) = (body.transpose_mul(state.frame.n()), body.transpose_mul(state.position.delta));
    let omega = body.transpose_mul(omega);
    let mut result =
        JointAngles { angles: [f64::NAN; 2], rates: [f64::NAN; 2], cone: cone_angle(joint, delta) };
    match (joint.kind, joint.axis) {
        (JointKind::Universal, Some(u)) => {
            let swing = |delta: Vec3<f64>, n: Vec3<f64>| delta.dot(n.cross(u)).atan2(delta.dot(u));
            result.angles = [about(u, n0, n), wrapped(swing(delta, n) - swing(delta0, n0))];
            result.rates = [omega.dot(u), omega.dot(n)];
        }
        (JointKind::Revolute, Some(u)) => {
            result.angles[0] = about(u, delta0, delta);
            result.rates[0] = omega.dot(u);
        }
        _ => {}
    }
    result
}

/// The angle between the joint's cone axis and the leg's direction, both in the axes of the body.
#[must_use]
pub fn cone_angle(joint: &Joint, delta: Vec3<f64>) -> f64 {
    joint.cone_axis.cross(delta).norm().atan2(joint.cone_axis.dot(delta))
}

/// The turn about `axis` that takes `from` to `to`.
fn about(axis: Vec3<f64>, from: Vec3<f64>, to: Vec3<f64>) -> f64 {
    to.dot(axis.cross(from)).atan2(to.dot(from) - axis.dot(to) * axis.dot(from))
}

fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// The turn of each rod about its line since the home pose.
#[must_use]
pub fn rod_angle(mech: &Mechanism, rod: usize, zero: &Zero, frame: &Frame<f64>) -> f64 {
    about(mech.rods[rod].axis, zero.base.0, frame.n())
}
