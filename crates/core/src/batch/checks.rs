//! Checks that every operation makes of its input: pose, legs, limits, constraints, motion.

use super::block::{self, At, Codes};
use crate::dynamics::forward_dynamics::square;
use crate::kinematics::constraint;
use crate::kinematics::leg::{self, Position};
use crate::kinematics::singular::{self, WORKING_PRECISION};
use crate::limits::margins::LegCache;
use crate::model::limit::Limit;
use crate::model::mechanism::{Constraint, Leg, Mechanism, Turning};
use crate::model::status::Status;
use crate::number::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::number::real::{Ordered, Real};
use crate::spatial::{Mat3, Motion, Pose, Twist, Vec3};

/// Largest entry of `RᵀR - 1` for a rotation.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// How far a pose may miss a constraint, relative to the characteristic length; for twists and accelerations
/// relative to their own size. Poses are judged to be singular with the same margin, [`singular::SINGULAR`].
pub const CONSTRAINT_TOLERANCE: f64 = 1e-6;

/// Sine of the angle between a leg and the axis of its universal joint, and length of a leg relative to the
/// characteristic length, below which the leg has no frame.
const LEG_TOLERANCE: f64 = 1e-6;

pub(super) fn raw_pose(poses: &[f64], i: usize) -> Pose<f64> {
    pose_of(At::one(i).read(poses))
}

/// The pose of a homogeneous matrix, row by row.
#[inline(always)]
fn pose_of<V: Real>(m: [V; 16]) -> Pose<V> {
    Pose {
        rotation: Mat3::from_rows([[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]]),
        o: Vec3::new(m[3], m[7], m[11]),
    }
}

/// Where all are finite: nothing times them is nothing.
#[inline(always)]
pub(super) fn finite<V: Ordered>(values: &[V]) -> V::Mask {
    let mut sum = V::zero();
    for x in values {
        sum = sum + *x * V::zero();
    }
    sum.at_most(V::zero())
}

/// The pose of sixteen numbers, whether or not the mechanism can be in it.
#[inline(always)]
pub(super) fn any_pose<V: Lanes>(poses: &[f64], at: At) -> (Pose<V>, Codes<V>) {
    let m: [V; 16] = at.read(poses);
    let pose = pose_of(m);
    let [x, y, z, one] = [m[12], m[13], m[14], m[15] - V::one()];
    let last_row = x.abs() + y.abs() + z.abs() + one.abs();
    let mut codes = Codes::ok()
        .unless(finite(&m), Status::InvalidInput)
        .unless(last_row.at_most(V::zero()), Status::InvalidInput)
        .unless(pose.rotation.determinant().greater(V::zero()), Status::InvalidInput);
    for e in pose.rotation.departures() {
        codes = codes.unless(e.abs().at_most(V::lit(ROTATION_TOLERANCE)), Status::InvalidInput);
    }
    (pose, codes)
}

/// Whether sixteen numbers are a homogeneous matrix.
pub(super) fn is_rotation(poses: &[f64], i: usize) -> bool {
    any_pose::<f64>(poses, At::one(i)).1.status() == Status::Ok
}

#[inline(always)]
pub(super) fn pose_at<V: Lanes>(mech: &Mechanism, poses: &[f64], at: At) -> (Pose<V>, Codes<V>) {
    let (pose, codes) = any_pose(poses, at);
    (pose, kept(mech, &pose, with_legs(mech, &pose, codes)))
}

pub(super) fn read_pose(mech: &Mechanism, poses: &[f64], i: usize) -> (Pose<f64>, Status) {
    let (pose, codes) = pose_at::<f64>(mech, poses, At::one(i));
    (pose, codes.status())
}

/// Whether every leg has a direction and a frame: no length of zero, no axis of a universal joint (or rod)
/// along it.
#[inline(always)]
pub(super) fn with_legs<V: Lanes>(mech: &Mechanism, pose: &Pose<V>, mut codes: Codes<V>) -> Codes<V> {
    for leg in &mech.legs {
        let p = leg::position(leg, pose);
        let normal = leg::normal(leg, pose, &p);
        codes = with_leg(mech, leg, &p, normal.dot(normal), codes);
    }
    codes
}

/// Whether one leg has a direction and a frame, from |N|² \[T5\], and the strut of a slider reaches its rail,
/// not perpendicular to it \[T67\].
#[inline(always)]
pub(super) fn with_leg<V: Lanes>(
    mech: &Mechanism,
    leg: &Leg,
    p: &Position<V>,
    normal: V,
    codes: Codes<V>,
) -> Codes<V> {
    let codes = if leg.drive.moves_foot() {
        let leans = leg::transmission(leg, p).abs();
        codes
            .unless(finite(&[p.coordinate]), Status::OutOfReach)
            .unless(leans.greater(V::lit(LEG_TOLERANCE)), Status::Singular)
    } else {
        let least = V::lit(LEG_TOLERANCE * mech.characteristic_length);
        codes.unless(p.length.greater(least), Status::Singular)
    };
    match leg.turning {
        Turning::Across(..) => {
            codes.unless(normal.greater(V::lit(LEG_TOLERANCE * LEG_TOLERANCE)), Status::Singular)
        }
        Turning::Along(..) | Turning::Free(_) => codes,
    }
}

/// Whether the struts of all sliders reach their rails.
#[inline(always)]
pub(super) fn reached<V: Lanes>(mech: &Mechanism, pose: &Pose<V>, mut codes: Codes<V>) -> Codes<V> {
    for leg in &mech.legs {
        if leg.drive.moves_foot() {
            codes = codes.unless(finite(&[leg::position(leg, pose).coordinate]), Status::OutOfReach);
        }
    }
    codes
}

pub(super) fn check_legs(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    with_legs(mech, pose, Codes::ok()).status()
}

/// The square of what a constraint's value may be, of its rate beside a squared speed of one, and so on: as
/// large as the tolerance makes a step along its row.
#[inline(always)]
fn square_tolerance<V: Lanes>(mech: &Mechanism, c: &Constraint, pose: &Pose<V>) -> V {
    let square = constraint::square(&constraint::row(c, pose), mech.characteristic_length);
    square.scale(CONSTRAINT_TOLERANCE * CONSTRAINT_TOLERANCE)
}

/// Whether a pose satisfies the constraints, with no leg backwards.
#[inline(always)]
pub(super) fn kept<V: Lanes>(mech: &Mechanism, pose: &Pose<V>, mut codes: Codes<V>) -> Codes<V> {
    for c in &mech.independent {
        let (value, square) = (constraint::value(c, pose), square_tolerance(mech, c, pose));
        codes = codes.unless((value * value).at_most(nearness(mech, square)), Status::OffConstraint);
    }
    forwards(mech, pose, codes)
}

/// Whether all legs point the way in which fixed joints hold them.
#[inline(always)]
pub(super) fn forwards<V: Lanes>(mech: &Mechanism, pose: &Pose<V>, codes: Codes<V>) -> Codes<V> {
    codes.unless(leg::all_ahead(mech, pose), Status::Backwards)
}

/// Square of the tolerance for constraint values, which are lengths; a row that vanishes gives no distance.
#[inline(always)]
fn nearness<V: Lanes>(mech: &Mechanism, square: V) -> V {
    let least = constraint::VANISHING_ROW * CONSTRAINT_TOLERANCE;
    square.most(V::lit(least * least)).scale(mech.characteristic_length * mech.characteristic_length)
}

/// Whether a twist keeps the constraints: `ġ = (c, τ)·V = 0`.
#[inline(always)]
pub(super) fn with_twist<V: Lanes>(
    mech: &Mechanism,
    pose: &Pose<V>,
    twist: &Twist<V>,
    codes: Codes<V>,
) -> Codes<V> {
    let speed = square(mech, twist);
    let mut codes = codes.unless(finite(&[speed]), Status::InvalidInput);
    for c in &mech.independent {
        let rate = constraint::row(c, pose).power(twist);
        let most = speed * square_tolerance(mech, c, pose);
        codes = codes.unless((rate * rate).at_most(most), Status::OffConstraint);
    }
    codes
}

/// Whether pose, twist and acceleration keep the constraints, `g = ġ = g̈ = 0` \[T65\], with no leg
/// backwards.
#[inline(always)]
pub(super) fn with_motion<V: Lanes>(mech: &Mechanism, platform: &Motion<V>, codes: Codes<V>) -> Codes<V> {
    let Motion { pose, twist, acceleration } = platform;
    let second = Twist::new(acceleration.a, acceleration.eps);
    let (scale, speed) = (mech.characteristic_length, square(mech, twist));
    let sum = square(mech, &second) + (speed * speed).scale(1.0 / (scale * scale));
    let mut codes = codes.unless(finite(&[sum]), Status::InvalidInput);
    let moving = platform.jets();
    for c in &mech.independent {
        let (g, square) = (constraint::value(c, &moving), square_tolerance(mech, c, pose));
        codes = codes
            .unless((g.x * g.x).at_most(nearness(mech, square)), Status::OffConstraint)
            .unless((g.d * g.d).at_most(speed * square), Status::OffConstraint)
            .unless((g.dd * g.dd).at_most(sum * square), Status::OffConstraint);
    }
    forwards(mech, pose, codes)
}

/// The first of two outcomes that is not ok; the second is looked at only if the first is.
pub(super) fn then(first: Status, second: impl FnOnce() -> Status) -> Status {
    if first == Status::Ok { second() } else { first }
}

/// The first limit of a joint that a pose breaks.
#[inline(always)]
pub(super) fn within_limits<V: Lanes>(mech: &Mechanism, pose: &Pose<V>, codes: Codes<V>) -> Codes<V> {
    within_limits_of(mech, pose, &mut LegCache::default(), codes)
}

/// First limit of a joint that a pose breaks, from the cached legs.
#[inline(always)]
pub(super) fn within_limits_of<V: Lanes>(
    mech: &Mechanism,
    pose: &Pose<V>,
    seen: &mut LegCache<V>,
    mut codes: Codes<V>,
) -> Codes<V> {
    for limit in joint_limits(mech) {
        let margin = limit.bound.margin(limit.of_joint(mech, pose, seen));
        codes = codes.unless(V::zero().at_most(margin), limit.status());
    }
    codes
}

/// Status of one pose by the limits of joints, in the registers of batches: lengths at the very end of a
/// stroke are judged alike everywhere.
pub(super) fn limit_status(mech: &Mechanism, pose: &Pose<f64>) -> Status {
    let mut codes = [0.0; WIDTH];
    lanes::dispatch(LimitsOfOne { mech, pose, codes: &mut codes });
    block::read(codes[0]).0
}

struct LimitsOfOne<'a> {
    mech: &'a Mechanism,
    pose: &'a Pose<f64>,
    codes: &'a mut Row,
}

impl Task for LimitsOfOne<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        within_limits::<V>(self.mech, &Pose::lift(self.pose), Codes::ok()).store(self.codes);
    }
}

/// The limits of joints, which come first in the list.
pub(super) fn joint_limits(mech: &Mechanism) -> impl Iterator<Item = &Limit> {
    mech.limits.iter().take_while(|limit| limit.status() != Status::Ok)
}

/// Whether a system at a pose was solved: the mechanism is controlled, no constraint is lost, the pivots tell
/// a regular matrix, all is finite \[T77\].
#[inline(always)]
pub(super) fn solved<V: Lanes>(
    mech: &Mechanism,
    pose: &Pose<V>,
    solution: &[V],
    pivots: V,
    codes: Codes<V>,
) -> Codes<V> {
    let least = if mech.mobility.uncontrolled == 0 { WORKING_PRECISION } else { f64::INFINITY };
    codes
        .unless(singular::are_independent(mech, pose), Status::Singular)
        .unless(pivots.greater(V::lit(least)), Status::Singular)
        .unless(finite(solution), Status::Singular)
}

/// One number of each actuated leg, of as many as there are legs.
#[inline(always)]
pub(super) fn read_actuated<V: Lanes>(mech: &Mechanism, values: &[f64], at: At, read: &mut [V]) {
    let mut count = 0;
    for k in 0..mech.legs.len() {
        if mech.legs[k].actuated {
            read[count] = at.read_one(values, mech.legs.len(), k);
            count += 1;
        }
    }
}

pub(super) fn actuated_values(mech: &Mechanism, values: &[f64], i: usize) -> Vec<f64> {
    mech.actuated().map(|(k, _)| values[i * mech.legs.len() + k]).collect()
}
