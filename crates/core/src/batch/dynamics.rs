//! Dynamics of many states.

use super::block::{self, Answers, At, Codes, Operation, Working};
use super::checks::{
    finite, pose_at, read_actuated, solved, with_leg, with_motion, within_limits, within_limits_of,
};
use super::{FieldId, States, Table};
use crate::dynamics::force_balance::ForceSolver;
use crate::dynamics::inverse_dynamics::{self, Balance};
use crate::kinematics::leg;
use crate::kinematics::rows;
use crate::limits::margins::LegCache;
use crate::mobility::degrees_of_freedom;
use crate::model::mechanism::Mechanism;
use crate::model::spec::Axes;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::number::real::Dual;
use crate::number::work::work;
use crate::spatial::{Motion, Pose, Twist, Vec3, Wrench};

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
        inverse_dynamics::load_in_base(wrench, axes, pose)
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

/// Active forces of all legs (zero for passive ones), multipliers of the independent constraints and torques
/// of local degrees of freedom [Eq. 43] \[T70\]. Where actuators are redundant, the forces nearest to the
/// preferred ones of all legs, zero for none \[T72\].
#[must_use]
pub fn inverse_dynamics(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    preferred: Option<&[f64]>,
) -> Table {
    let fields = [
        ("forces", vec![mech.legs.len()]),
        ("constraint", vec![mech.independent.len()]),
        ("idle_torques", vec![mech.idle.len()]),
    ];
    let preferred = preferred.filter(|_| mech.is_redundant());
    block::table(&InverseDynamics { mech, states, loads, preferred }, states.len(), fields)
}

struct InverseDynamics<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
    preferred: Option<&'a [f64]>,
}

impl Working<3> for InverseDynamics<'_> {
    type Room<V: Lanes> = ForceSolver<V>;

    fn room<V: Lanes>(&self) -> ForceSolver<V> {
        let mut room = ForceSolver::new(self.mech);
        if self.preferred.is_some() {
            room.preferred = vec![V::zero(); self.mech.actuated().count()];
        }
        room
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut ForceSolver<V>, at: At, answers: &mut Answers<'_, 3>) -> Codes<V> {
        let (mech, [forces, multipliers, torques]) = (self.mech, Answers::fields());
        let (platform, codes) = self.states.platform(at);
        let (pose, load) = (&platform.pose, self.loads.of(mech, &platform.pose, at));
        let mut balance = Balance::new(mech, &platform, load);
        let (mut legs, mut seen) = (Codes::ok(), LegCache::default());
        for (k, leg) in mech.legs.iter().enumerate() {
            let place = leg::place(leg, pose);
            let (p, f) = &place;
            legs = with_leg(mech, leg, p, f.sine * f.sine, legs);
            seen.next(p);
            balance.add(mech, k, leg, &place, &platform);
        }
        let mut codes = codes
            .then(with_motion(mech, &platform, legs))
            .unless(finite(&load.array()), Status::InvalidInput);
        if let Some(preferred) = self.preferred {
            read_actuated(mech, preferred, at, &mut room.preferred);
            codes = codes.unless(finite(&room.preferred), Status::InvalidInput);
        }
        let regular = room.solve(mech, pose, balance);
        let (f, numbers) = (&room.forces, room.numbers);
        put_of_legs(mech, answers, forces, &f[numbers.actuated()]);
        for (k, multiplier) in f[numbers.constraints()].iter().enumerate() {
            answers.put(multipliers, k, [*multiplier]);
        }
        for (k, torque) in f[numbers.idle()].iter().enumerate() {
            answers.put(torques, k, [*torque]);
        }
        within_limits_of(mech, pose, &mut seen, solved(mech, pose, f, regular, codes))
    }
}

/// Active forces of all legs, zero for passive ones.
#[inline(always)]
fn put_of_legs<V: Lanes, const N: usize>(
    mech: &Mechanism,
    answers: &mut Answers<'_, N>,
    field: FieldId,
    forces: &[V],
) {
    let mut row = 0;
    for (k, leg) in mech.legs.iter().enumerate() {
        answers.put(field, k, [if leg.actuated { forces[row] } else { V::zero() }]);
        row += usize::from(leg.actuated);
    }
}

/// Forces on the platform at the ends of two coupled legs, and the torque on their rod, from the multiplier
/// \[T16\]. None for a mechanism without such a pair.
#[must_use]
pub fn coupled_forces(
    mech: &Mechanism,
    poses: &[f64],
    multipliers: &[f64],
    as_printed: bool,
) -> Option<([usize; 2], Table)> {
    let (pair, axis, platform_axis) = degrees_of_freedom::coupled_pair(mech)?;
    let index = mech.independent.iter().position(|c| pair.contains(&c.leg))?;
    let operation = CoupledForces { mech, pair, axis, platform_axis, index, poses, multipliers, as_printed };
    let fields = [("forces", vec![2]), ("torque", vec![])];
    Some((pair, block::table(&operation, poses.len() / 16, fields)))
}

struct CoupledForces<'a> {
    mech: &'a Mechanism,
    pair: [usize; 2],
    axis: Vec3<f64>,
    platform_axis: Vec3<f64>,
    /// Which of the multipliers is theirs.
    index: usize,
    poses: &'a [f64],
    multipliers: &'a [f64],
    as_printed: bool,
}

impl Operation<2> for CoupledForces<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 2>) -> Codes<V> {
        let (mech, [forces, torque]) = (self.mech, Answers::fields());
        let (pose, codes) = pose_at(mech, self.poses, at);
        let f_c: V = at.read_one(self.multipliers, mech.independent.len(), self.index);
        let (axis, platform_axis) = (self.axis, self.platform_axis);
        let c = inverse_dynamics::coupled_forces(
            mech,
            self.pair,
            axis,
            platform_axis,
            &pose,
            f_c,
            self.as_printed,
        );
        answers.put(forces, 0, c.forces);
        answers.put(torque, 0, [c.torque]);
        codes.unless(finite(&[f_c]), Status::InvalidInput).unless(finite(&c.forces), Status::Singular)
    }
}

/// Energies with their exact rates along the motion, and every power of the balance \[T17\].
#[must_use]
pub fn power(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
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
    block::table(&Power { mech, states, loads }, states.len(), names.map(|name| (name, vec![])))
}

struct Power<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
}

impl Working<9> for Power<'_> {
    type Room<V: Lanes> = ForceSolver<V>;

    fn room<V: Lanes>(&self) -> ForceSolver<V> {
        ForceSolver::new(self.mech)
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut ForceSolver<V>, at: At, answers: &mut Answers<'_, 9>) -> Codes<V> {
        let (mech, ids) = (self.mech, Answers::<9>::fields());
        let (platform, wrench, codes) = self.states.loaded_at::<V>(mech, self.loads, at);
        let Motion { pose, twist, .. } = &platform;
        let (kinetic, potential) = V::apart(EnergyAlong { mech, platform: &platform });
        let load = wrench.power(twist);
        let damping = inverse_dynamics::damping_wrench(mech, twist).power(twist);
        let regular = room.solve_motion(mech, &platform, wrench);
        let f = &room.forces;
        let regular = solved(mech, pose, f, regular, Codes::ok()).are(Status::Ok);
        let mut actuators = V::zero();
        for (k, row) in rows::of(mech).take(room.numbers.idle().end).enumerate() {
            actuators = actuators + row.wrench(pose).power(twist) * f[k];
        }
        actuators = V::select(regular, actuators, V::lit(f64::NAN));
        // What the efficiency takes: actuators serve the platform's term of [Eq. 42] 1/η times.
        let own = (wrench + inverse_dynamics::platform_wrench(mech, &platform)).power(twist);
        let friction = own.scale(1.0 / mech.efficiency - 1.0);
        let residual = actuators + load + damping + friction - kinetic.d - potential.d;
        let values =
            [kinetic.x, potential.x, kinetic.d, potential.d, actuators, load, damping, friction, residual];
        for k in 0..9 {
            answers.put(ids[k], 0, [values[k]]);
        }
        // At a singular pose all but the actuators' power stands.
        within_limits(mech, pose, codes.but(regular, Status::Singular))
    }
}

work! {
    /// Kinetic and potential energy as duals along the motion.
    EnergyAlong<'a, V: Lanes> { mech: &'a Mechanism, platform: &'a Motion<V> } -> (Dual<V>, Dual<V>) {
        let Motion { pose, twist, acceleration } = platform;
        let moving = pose.along(twist);
        let twist = Twist::new(twist.v.with_rate(acceleration.a), twist.omega.with_rate(acceleration.eps));
        inverse_dynamics::energy(mech, &moving, &twist)
    }
}
