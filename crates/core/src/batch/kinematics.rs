//! Kinematics of many states.

use super::block::{self, Answers, At, Codes, Operation, Working};
use super::checks::{
    any_pose, finite, kept, pose_at, read_actuated, solved, with_leg, with_motion, with_twist,
    within_limits_of,
};
use super::{States, Table};
use crate::kinematics::jacobian::MotionSolver;
use crate::kinematics::leg;
use crate::kinematics::passive_joints;
use crate::kinematics::rows::for_each_row;
use crate::limits::margins::LegCache;
use crate::model::limit::Zero;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::number::slices::pairs;
use crate::spatial::{Twist, Vec3};

/// Lengths, vectors r and directions δ of all legs [Eq. 3].
#[must_use]
pub fn inverse_kinematics(mech: &Mechanism, poses: &[f64]) -> Table {
    let legs = mech.legs.len();
    let fields = [("lengths", vec![legs]), ("vectors", vec![legs, 3]), ("directions", vec![legs, 3])];
    block::table(&InverseKinematics { mech, poses }, poses.len() / 16, fields)
}

struct InverseKinematics<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
}

impl Operation<3> for InverseKinematics<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 3>) -> Codes<V> {
        let (mech, [lengths, vectors, directions]) = (self.mech, Answers::fields());
        let (pose, mut codes) = any_pose(self.poses, at);
        let mut seen = LegCache::default();
        for (k, leg) in mech.legs.iter().enumerate() {
            let p = leg::position(leg, &pose);
            let normal = leg::normal(leg, &pose, &p);
            codes = with_leg(mech, leg, &p, normal.dot(normal), codes);
            seen.next(&p);
            answers.put(lengths, k, [p.coordinate]);
            answers.put(vectors, k, p.r.array());
            answers.put(directions, k, p.delta.array());
        }
        within_limits_of(mech, &pose, &mut seen, kept(mech, &pose, codes))
    }
}

/// J for each pose, constraint satisfied or not [Eq. 13].
#[must_use]
pub fn jacobians(mech: &Mechanism, poses: &[f64]) -> Table {
    block::table(&Jacobians { mech, poses }, poses.len() / 16, [("jacobian", vec![mech.rows(), 6])])
}

struct Jacobians<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
}

impl Operation<1> for Jacobians<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 1>) -> Codes<V> {
        let (pose, codes) = any_pose(self.poses, at);
        let [matrix] = Answers::fields();
        for_each_row!(self.mech, |k, row| {
            answers.put(matrix, k, row.wrench(&pose).array());
        });
        codes
    }
}

/// H for each pose, constraint satisfied or not [Eq. 19].
#[must_use]
pub fn hessians(mech: &Mechanism, poses: &[f64]) -> Table {
    block::table(&Hessians { mech, poses }, poses.len() / 16, [("hessian", vec![mech.rows(), 6, 6])])
}

struct Hessians<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
}

impl Operation<1> for Hessians<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 1>) -> Codes<V> {
        let (pose, codes) = any_pose(self.poses, at);
        let [layers] = Answers::fields();
        for_each_row!(self.mech, |k, row| {
            let layer = row.hessian(&pose);
            for i in 0..6 {
                answers.put(layers, 6 * k + i, layer[i]);
            }
        });
        codes
    }
}

/// Every quantity of legs, rods, cylinders, pistons and joints [Eq. 2-39].
#[must_use]
pub fn kinematics(mech: &Mechanism, states: &States) -> Table {
    let (legs, rods) = (mech.legs.len(), mech.rods.len());
    let (scalar, vector, pair) = (|| vec![legs], || vec![legs, 3], || vec![legs, 2]);
    let fields = [
        ("lengths", scalar()),
        ("rates", scalar()),
        ("accelerations", scalar()),
        ("directions", vector()),
        ("leg_omega", vector()),
        ("leg_eps", vector()),
        ("leg_spin", scalar()),
        ("leg_spin_rate", scalar()),
        ("piston_velocity", vector()),
        ("piston_acceleration", vector()),
        ("cylinder_velocity", vector()),
        ("cylinder_acceleration", vector()),
        ("base_joint_angles", pair()),
        ("base_joint_rates", pair()),
        ("platform_joint_angles", pair()),
        ("platform_joint_rates", pair()),
        ("base_cone_angle", scalar()),
        ("platform_cone_angle", scalar()),
        ("rod_angle", vec![rods]),
        ("rod_omega", vec![rods, 3]),
        ("rod_eps", vec![rods, 3]),
    ];
    let zeros: Vec<Zero> = mech.legs.iter().map(|leg| Zero::of(leg, &mech.home)).collect();
    block::table(&Kinematics { mech, states, zeros: &zeros }, states.len(), fields)
}

struct Kinematics<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    zeros: &'a [Zero],
}

impl Operation<21> for Kinematics<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 21>) -> Codes<V> {
        let mech = self.mech;
        let (platform, codes) = self.states.platform(at);
        let (mut legs, mut seen) = (Codes::ok(), LegCache::default());
        for (k, (leg, zero)) in pairs(&mech.legs, self.zeros).enumerate() {
            let state = leg::state(leg, &platform);
            let leg::LegState { position: p, end, turn, frame } = &state;
            legs = with_leg(mech, leg, p, frame.sine * frame.sine, legs);
            seen.next(p);
            let (piston, cylinder) = (leg::piston(leg, &state), leg::cylinder(leg, &state));
            let [below, above] = passive_joints::angles(leg, zero, &platform, &state);
            let [
                lengths,
                rates,
                accelerations,
                directions,
                leg_omega,
                leg_eps,
                leg_spin,
                leg_spin_rate,
                piston_velocity,
                piston_acceleration,
                cylinder_velocity,
                cylinder_acceleration,
                base_joint_angles,
                base_joint_rates,
                platform_joint_angles,
                platform_joint_rates,
                base_cone_angle,
                platform_cone_angle,
                rod_angle,
                rod_omega,
                rod_eps,
            ] = Answers::fields();
            answers.put(lengths, k, [p.coordinate]);
            answers.put(rates, k, [end.rate]);
            answers.put(accelerations, k, [end.acceleration]);
            answers.put(directions, k, p.delta.array());
            answers.put(leg_omega, k, state.omega().array());
            answers.put(leg_eps, k, state.eps().array());
            answers.put(leg_spin, k, [turn.spin]);
            answers.put(leg_spin_rate, k, [turn.spin_rate]);
            answers.put(piston_velocity, k, piston.velocity.array());
            answers.put(piston_acceleration, k, piston.acceleration.array());
            answers.put(cylinder_velocity, k, cylinder.velocity.array());
            answers.put(cylinder_acceleration, k, cylinder.acceleration.array());
            answers.put(base_joint_angles, k, below.angles);
            answers.put(base_joint_rates, k, below.rates);
            answers.put(platform_joint_angles, k, above.angles);
            answers.put(platform_joint_rates, k, above.rates);
            answers.put(base_cone_angle, k, [below.cone]);
            answers.put(platform_cone_angle, k, [above.cone]);
            for (r, rod) in mech.rods.iter().enumerate().filter(|(_, rod)| rod.leader == k) {
                let (axis, turn) = (Vec3::lift(rod.axis), leg::rod_turn(Vec3::lift(rod.axis), &state));
                answers.put(rod_angle, r, [passive_joints::rod_angle(mech, r, zero, frame.n())]);
                answers.put(rod_omega, r, (axis * turn.rate).array());
                answers.put(rod_eps, r, (axis * turn.acceleration).array());
            }
        }
        let codes = codes.then(with_motion(mech, &platform, legs));
        within_limits_of(mech, &platform.pose, &mut seen, codes)
    }
}

/// The platform's twist from the rates of all legs; those of passive legs are not read [Eq. 13]. Where
/// actuators are redundant the legs must agree \[T73\].
#[must_use]
pub fn platform_twist(mech: &Mechanism, poses: &[f64], rates: &[f64]) -> Table {
    block::table(&PlatformTwist { mech, poses, rates }, poses.len() / 16, [("twist", vec![6])])
}

struct PlatformTwist<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
    rates: &'a [f64],
}

impl Working<1> for PlatformTwist<'_> {
    type Room<V: Lanes> = MotionSolver<V>;

    fn room<V: Lanes>(&self) -> MotionSolver<V> {
        MotionSolver::new(self.mech)
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut MotionSolver<V>, at: At, answers: &mut Answers<'_, 1>) -> Codes<V> {
        let (mech, [field]) = (self.mech, Answers::fields());
        let (pose, codes) = pose_at(mech, self.poses, at);
        read_actuated(mech, self.rates, at, &mut room.driven);
        let codes = codes.unless(finite(&room.driven), Status::InvalidInput);
        let found = room.twist(mech, &pose);
        answers.put(field, 0, found.motion.array());
        solved(mech, &pose, &found.motion.array(), found.regular, codes)
            .unless(found.agrees, Status::Inconsistent)
    }
}

/// The platform's acceleration from its twist and the accelerations of all legs [Eq. 19].
#[must_use]
pub fn platform_acceleration(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    accelerations: &[f64],
) -> Table {
    let operation = PlatformAcceleration { mech, poses, twists, accelerations };
    block::table(&operation, poses.len() / 16, [("acceleration", vec![6])])
}

struct PlatformAcceleration<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
    twists: &'a [f64],
    accelerations: &'a [f64],
}

impl Working<1> for PlatformAcceleration<'_> {
    type Room<V: Lanes> = MotionSolver<V>;

    fn room<V: Lanes>(&self) -> MotionSolver<V> {
        MotionSolver::new(self.mech)
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut MotionSolver<V>, at: At, answers: &mut Answers<'_, 1>) -> Codes<V> {
        let (mech, [field]) = (self.mech, Answers::fields());
        let (pose, codes) = pose_at(mech, self.poses, at);
        let twist = Twist::from_array(at.read(self.twists));
        read_actuated(mech, self.accelerations, at, &mut room.driven);
        let codes = with_twist(mech, &pose, &twist, codes).unless(finite(&room.driven), Status::InvalidInput);
        let found = room.acceleration(mech, &pose, &twist);
        answers.put(field, 0, found.motion.array());
        solved(mech, &pose, &found.motion.array(), found.regular, codes)
            .unless(found.agrees, Status::Inconsistent)
    }
}
