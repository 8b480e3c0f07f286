//! Whether a state is one that the mechanism can be in: the checks that every operation makes of its input.

use crate::constraint;
use crate::leg;
use crate::limits::{self, Limit};
use crate::mechanism::Mechanism;
use crate::quadratic::quadratic;
use crate::spatial::{Acceleration, Mat3, Pose, Twist, Vec3};
use crate::status::Status;

/// Largest entry of `RᵀR - 1` for a rotation.
pub(super) const ROTATION_TOLERANCE: f64 = 1e-6;

/// How far a pose may miss a constraint, relative to the characteristic length; for twists and accelerations
/// relative to their own size.
pub const CONSTRAINT_TOLERANCE: f64 = 1e-6;

/// Pivot ratio of the scaled Jacobian below which it is singular to working precision.
pub const SINGULAR_PIVOTS: f64 = 1e-12;

/// Sine of the angle between a leg and the axis of its universal joint, and length of a leg relative to the
/// characteristic length, below which the leg has no frame.
pub(super) const LEG_TOLERANCE: f64 = 1e-6;

pub(super) fn six(values: &[f64], i: usize) -> [f64; 6] {
    std::array::from_fn(|k| values[6 * i + k])
}

pub(super) fn raw_pose(poses: &[f64], i: usize) -> Pose<f64> {
    let m = &poses[16 * i..16 * i + 16];
    Pose {
        rotation: Mat3::from_rows([[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]]),
        o: Vec3::new(m[3], m[7], m[11]),
    }
}

/// Whether sixteen numbers are a homogeneous matrix.
pub(super) fn is_rotation(poses: &[f64], i: usize) -> bool {
    let m = &poses[16 * i..16 * i + 16];
    m.iter().all(|x| x.is_finite())
        && m[12..] == [0.0, 0.0, 0.0, 1.0]
        && raw_pose(poses, i).rotation.rotation_error() <= ROTATION_TOLERANCE
}

pub(super) fn read_pose(mech: &Mechanism, poses: &[f64], i: usize) -> (Pose<f64>, Status) {
    let pose = raw_pose(poses, i);
    let valid = is_rotation(poses, i);
    let status = if valid { Status::Ok } else { Status::InvalidInput };
    let status = then(status, || check_legs(mech, &pose));
    (pose, then(status, || check_pose(mech, &pose)))
}

/// Whether every leg has a direction and a frame: no length of zero, no axis of a universal joint (or rod) along it.
pub(super) fn check_legs(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    let regular = mech.legs.iter().all(|leg| {
        let p = leg::position(leg, pose);
        let sine = leg::frame(leg, pose, &p).sine;
        p.length > LEG_TOLERANCE * mech.characteristic_length && sine > LEG_TOLERANCE
    });
    if regular { Status::Ok } else { Status::Singular }
}

/// Whether a pose satisfies the constraints.
pub(super) fn check_pose(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    let kept = constraint::largest_distance(mech, pose) <= CONSTRAINT_TOLERANCE * mech.characteristic_length;
    if kept { Status::Ok } else { Status::OffConstraint }
}

/// Whether a twist keeps the constraints: `(c, τ)·V = 0`.
pub(super) fn check_twist(mech: &Mechanism, pose: &Pose<f64>, twist: &Twist<f64>) -> Status {
    let speed = speed(mech, twist);
    let kept = mech.independent.iter().all(|c| {
        let row = constraint::row(c, pose);
        let size = constraint::row_size(&row, mech.characteristic_length);
        row.power(twist).abs() <= CONSTRAINT_TOLERANCE * speed * size
    });
    match (speed.is_finite(), kept) {
        (false, _) => Status::InvalidInput,
        (true, false) => Status::OffConstraint,
        (true, true) => Status::Ok,
    }
}

/// Whether an acceleration keeps the constraints with that twist: `(c, τ)·A + Vᵀ h V = 0`.
pub(super) fn check_acceleration(
    mech: &Mechanism,
    pose: &Pose<f64>,
    twist: &Twist<f64>,
    a: &Acceleration<f64>,
) -> Status {
    let as_twist = Twist::new(a.a, a.eps);
    let scale = mech.characteristic_length;
    let (speed, second) = (speed(mech, twist), self::speed(mech, &as_twist));
    let kept = mech.independent.iter().all(|c| {
        let row = constraint::row(c, pose);
        let size = constraint::row_size(&row, scale);
        let g = row.power(&as_twist) + quadratic(&constraint::hessian(c, pose), &twist.array());
        g.abs() <= CONSTRAINT_TOLERANCE * (second + speed * speed / scale) * size
    });
    match (second.is_finite(), kept) {
        (false, _) => Status::InvalidInput,
        (true, false) => Status::OffConstraint,
        (true, true) => Status::Ok,
    }
}

/// Size of a twist, turns counted as arcs at the characteristic length.
pub(super) fn speed(mech: &Mechanism, twist: &Twist<f64>) -> f64 {
    twist.v.norm() + twist.omega.norm() * mech.characteristic_length
}

/// The first of two outcomes that is not ok; the second is looked at only if the first is.
pub(super) fn then(first: Status, second: impl FnOnce() -> Status) -> Status {
    if first == Status::Ok { second() } else { first }
}

pub(super) fn check_finite(values: &[f64]) -> Status {
    if values.iter().all(|x| x.is_finite()) { Status::Ok } else { Status::InvalidInput }
}

/// The first limit of a joint that a pose breaks.
pub(super) fn limit_status(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    limits::status(joint_limits(mech).map(|limit| (limit, limit.margin(mech, pose, None))))
}

/// The limits of joints, which come first in the list.
pub(super) fn joint_limits(mech: &Mechanism) -> impl Iterator<Item = &Limit> {
    mech.limits.iter().take_while(|limit| limit.status() != Status::Ok)
}

pub(super) fn outcome(mech: &Mechanism, solution: &[f64; 6], pivots: f64) -> Status {
    let controlled = mech.mobility.uncontrolled == 0;
    if controlled && pivots > SINGULAR_PIVOTS && solution.iter().all(|x| x.is_finite()) {
        Status::Ok
    } else {
        Status::Singular
    }
}

pub(super) fn actuated_values(mech: &Mechanism, values: &[f64], i: usize) -> Vec<f64> {
    mech.actuated().map(|(k, _)| values[i * mech.legs.len() + k]).collect()
}
