//! Dynamics of many states.

use super::block::{self, Answers, At, Codes, Operation, Pieces};
use super::checks::{check_finite, limit_status, outcome, read_pose, solved, then, within_limits};
use super::{FieldId, States, Table};
use crate::dynamics;
use crate::lanes::Lanes;
use crate::leg;
use crate::mechanism::Mechanism;
use crate::mobility;
use crate::real::Dual;
use crate::spatial::{Motion, Pose, Twist, Vec3, Wrench};
use crate::spec::Axes;
use crate::status::Status;

/// The loads of the states: the mechanism's own, or six numbers for each.
#[derive(Clone, Copy, Debug)]
pub enum Loads<'a> {
    Own,
    Given(&'a [f64], Axes),
}

impl Loads<'_> {
    #[inline(always)]
    pub(super) fn of<V: Lanes>(&self, mech: &Mechanism, pose: &Pose<V>, at: At) -> Wrench<V> {
        let (wrench, axes) = self.given(mech, at);
        dynamics::load_in_base(wrench, axes, pose)
    }

    /// As they are given, with their axes.
    #[inline(always)]
    pub(super) fn given<V: Lanes>(&self, mech: &Mechanism, at: At) -> (Wrench<V>, Axes) {
        match self {
            Loads::Own => {
                let own = mech.load.wrench;
                (Wrench::new(Vec3::lift(own.force), Vec3::lift(own.torque)), mech.load.axes)
            }
            Loads::Given(values, axes) => (Wrench::from_array(at.read(values)), *axes),
        }
    }
}

/// Active forces of all legs (zero for passive ones) and multipliers of the independent constraints [Eq. 43].
#[must_use]
pub fn inverse_dynamics(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let fields = [("forces", vec![mech.legs.len()]), ("constraint", vec![mech.independent.len()])];
    block::table(&InverseDynamics { mech, states, loads }, states.len(), fields)
}

struct InverseDynamics<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
}

impl Operation<2> for InverseDynamics<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 2>) -> Codes<V> {
        let (mech, [forces, multipliers]) = (self.mech, Answers::fields());
        let (platform, load, codes) = self.states.loaded_at(mech, self.loads, at);
        let (f, pivots) = dynamics::inverse_dynamics(mech, &platform, load);
        put_forces(mech, answers, forces, &f);
        for k in 0..mech.independent.len() {
            answers.put(multipliers, k, [f[mech.dof() + k]]);
        }
        within_limits(mech, &platform.pose, solved(mech, &f, pivots, codes))
    }
}

/// Active forces of all legs, zero for passive ones.
#[inline(always)]
fn put_forces<V: Lanes, const N: usize>(
    mech: &Mechanism,
    answers: &mut Answers<'_, N>,
    field: FieldId,
    forces: &[V; 6],
) {
    let mut row = 0;
    for (k, leg) in mech.legs.iter().enumerate() {
        answers.put(field, k, [if leg.actuated { forces[row] } else { V::zero() }]);
        row += usize::from(leg.actuated);
    }
}

/// Forces on the platform at the ends of two coupled legs, and the torque on their rod, from the multiplier \[T16\].
/// None for a mechanism without such a pair.
#[must_use]
pub fn coupled_forces(
    mech: &Mechanism,
    poses: &[f64],
    multipliers: &[f64],
    as_printed: bool,
) -> Option<([usize; 2], Table)> {
    let (pair, axis, platform_axis) = mobility::coupled_pair(mech)?;
    let index = mech.independent.iter().position(|c| pair.contains(&c.leg))?;
    let (n, k) = (poses.len() / 16, mech.independent.len());
    let (fields, [forces, torque]) = ([("forces", vec![2]), ("torque", vec![])], block::fields());
    let table = block::one_by_one(n, fields, Pieces::QUICK, |rows, i| {
        let (pose, status) = read_pose(mech, poses, i);
        let f_c = multipliers[i * k + index];
        let status = then(status, || check_finite(&[f_c]));
        if status != Status::Ok {
            return status;
        }
        let c = dynamics::coupled_forces(mech, pair, axis, platform_axis, &pose, f_c, as_printed);
        if !c.forces.iter().all(|f| f.is_finite()) {
            return Status::Singular;
        }
        rows.set(forces, i, 0, &c.forces);
        rows.set(torque, i, 0, &[c.torque]);
        Status::Ok
    });
    Some((pair, table))
}

/// Energies with their exact rates along the motion, and every power of the balance \[T17\].
#[must_use]
pub fn power(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let n = states.len();
    let names = [
        "kinetic",
        "potential",
        "kinetic_rate",
        "potential_rate",
        "actuators",
        "load",
        "damping",
        "friction",
        "residual",
    ];
    let ids: [FieldId; 9] = block::fields();
    let fields = names.map(|name| (name, vec![]));
    block::one_by_one(n, fields, Pieces::QUICK, |rows, i| {
        let (platform, wrench, status) = states.one(mech, loads, i);
        let Motion { pose, twist, .. } = &platform;
        if status != Status::Ok {
            return status;
        }
        let (kinetic, potential) = energy_along(mech, &platform);
        let load = wrench.power(twist);
        let damping = -(mech.linear_damping * twist.v.dot(twist.v)
            + mech.angular_damping * twist.omega.dot(twist.omega));
        let (f, pivots) = dynamics::inverse_dynamics(mech, &platform, wrench);
        let rates = mech.actuated().map(|(_, leg)| leg::row(&leg::position(leg, pose)).power(twist));
        let status = then(outcome(mech, &f, pivots), || limit_status(mech, pose));
        let singular = status == Status::Singular;
        let actuators = if singular { f64::NAN } else { rates.zip(&f).map(|(rate, f)| rate * f).sum() };
        // What the efficiency takes: actuators serve the platform's term of [Eq. 42] 1/η times.
        let own = (wrench + dynamics::platform_wrench(mech, &platform)).power(twist);
        let friction = (1.0 / mech.efficiency - 1.0) * own;
        let residual = actuators + load + damping + friction - kinetic.d - potential.d;
        let values =
            [kinetic.x, potential.x, kinetic.d, potential.d, actuators, load, damping, friction, residual];
        for (id, value) in ids.into_iter().zip(values) {
            rows.set(id, i, 0, &[value]);
        }
        status
    })
}

/// Kinetic and potential energy as duals along the motion.
fn energy_along(mech: &Mechanism, platform: &Motion<f64>) -> (Dual<f64>, Dual<f64>) {
    let Motion { pose, twist, acceleration } = platform;
    let moving = pose.along(twist);
    let twist = Twist::new(twist.v.with_rate(acceleration.a), twist.omega.with_rate(acceleration.eps));
    dynamics::energy(mech, &moving, &twist)
}
