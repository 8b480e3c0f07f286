//! Forward dynamics of many states.

use super::block::{self, Answers, At, Codes, Pieces, Rows, Working};
use super::checks::{finite, limit_status, pose_at, read_actuated, with_twist, within_limits};
use super::dynamics::Loads;
use super::{FieldId, Table};
use crate::dynamics::forward_dynamics::{self, Equations, SINGULAR_BALANCE};
use crate::kinematics::coordinate_sets::Set;
use crate::kinematics::leg;
use crate::mobility::singularity_distance::{self, SingularitySearch};
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::spatial::{Pose, Twist};

/// Pose and twist of a state, and whether it is one that the mechanism can be in.
fn read(mech: &Mechanism, poses: &[f64], twists: &[f64], i: usize) -> (Pose<f64>, Twist<f64>, Status) {
    let (pose, codes) = pose_at::<f64>(mech, poses, At::one(i));
    let twist = Twist::from_array(At::one(i).read(twists));
    (pose, twist, with_twist(mech, &pose, &twist, codes).status())
}

/// Accelerations of the platform and multipliers of the independent constraints from the forces of all legs;
/// those of passive legs are not read \[T49\].
#[must_use]
pub fn forward_dynamics(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    forces: &[f64],
    loads: &Loads,
) -> Table {
    let fields = [("acceleration", vec![6]), ("constraint", vec![mech.independent.len()])];
    let operation = ForwardDynamics { mech, poses, twists, forces, loads };
    block::table(&operation, poses.len() / 16, fields)
}

struct ForwardDynamics<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
    twists: &'a [f64],
    forces: &'a [f64],
    loads: &'a Loads<'a>,
}

impl Working<2> for ForwardDynamics<'_> {
    /// Forces of the actuated legs.
    type Room<V: Lanes> = Vec<V>;

    fn room<V: Lanes>(&self) -> Vec<V> {
        vec![V::zero(); self.mech.actuated().count()]
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, push: &mut Vec<V>, at: At, answers: &mut Answers<'_, 2>) -> Codes<V> {
        let (mech, [acceleration, multipliers]) = (self.mech, Answers::fields());
        let (pose, codes) = pose_at(mech, self.poses, at);
        let twist = Twist::from_array(at.read(self.twists));
        let load = self.loads.of(mech, &pose, at);
        read_actuated(mech, self.forces, at, push);
        let codes = with_twist(mech, &pose, &twist, codes)
            .unless(finite(&load.array()), Status::InvalidInput)
            .unless(finite(push), Status::InvalidInput);
        let driven = forward_dynamics::forward_dynamics::<V>(mech, &pose, &twist, push, load);
        let a = driven.acceleration.array();
        answers.put(acceleration, 0, a);
        for k in 0..mech.independent.len() {
            answers.put(multipliers, k, [driven.multipliers[k]]);
        }
        let codes = codes
            .unless(driven.pivots.greater(V::lit(SINGULAR_BALANCE)), Status::Singular)
            .unless(finite(&a), Status::Singular);
        within_limits(mech, &pose, codes)
    }
}

/// Velocities of the equations of motion: twists, or rates of given coordinates of a set.
#[derive(Clone, Debug)]
pub enum Space {
    Platform,
    Coordinates(Box<Set>, Vec<bool>),
}

impl Space {
    fn size(&self) -> usize {
        match self {
            Space::Platform => 6,
            Space::Coordinates(_, given) => given.iter().filter(|&&g| g).count(),
        }
    }
}

/// Mass, Coriolis and damping matrix, gravity, and the Jacobians of platform and legs \[T49\] \[T50\] \[T51\]
/// \[T52\].
#[must_use]
pub fn equations_of_motion(mech: &Mechanism, poses: &[f64], twists: &[f64], space: &Space) -> Table {
    let (n, d) = (poses.len() / 16, space.size());
    let fields = [
        ("mass", vec![d, d]),
        ("coriolis", vec![d, d]),
        ("damping", vec![d, d]),
        ("gravity", vec![d]),
        ("twist_jacobian", vec![6, d]),
        ("leg_jacobian", vec![mech.legs.len(), d]),
        ("rates", vec![d]),
    ];
    block::one_by_one(n, fields, Pieces::SLOW, |rows, i| {
        let (pose, twist, status) = read(mech, poses, twists, i);
        let found = if status == Status::Ok { equations(mech, &pose, &twist, space) } else { Err(status) };
        match found {
            Ok((e, rates)) => {
                put(mech, rows, i, (&e, &rates), &pose);
                limit_status(mech, &pose)
            }
            Err(status) => status,
        }
    })
}

fn equations(
    mech: &Mechanism,
    pose: &Pose<f64>,
    twist: &Twist<f64>,
    space: &Space,
) -> Result<(Equations<f64>, [f64; 6]), Status> {
    match space {
        Space::Platform => Ok((forward_dynamics::platform_equations(mech, pose, twist), twist.array())),
        Space::Coordinates(set, given) => {
            let search = SingularitySearch {
                set: **set,
                given: given.clone(),
                reach: 0.0,
                scale: mech.characteristic_length,
            };
            let (q, branch) = singularity_distance::start(mech, &search, pose)?;
            forward_dynamics::coordinate_equations(mech, set, given, (&q, branch), pose, twist)
        }
    }
}

fn put(
    mech: &Mechanism,
    rows: &mut Rows<'_, 7>,
    i: usize,
    (e, rates): (&Equations<f64>, &[f64; 6]),
    pose: &Pose<f64>,
) {
    let (d, ids): (_, [FieldId; 7]) = (e.count, block::fields());
    for (id, matrix) in ids.into_iter().zip([&e.mass, &e.coriolis, &e.damping]) {
        for (k, row) in matrix[..d].iter().enumerate() {
            rows.set(id, i, k, &row[..d]);
        }
    }
    rows.set(ids[3], i, 0, &e.gravity[..d]);
    for (j, twist) in e.twists[..d].iter().enumerate() {
        for (k, x) in twist.array().into_iter().enumerate() {
            rows.set(ids[4], i, k * d + j, &[x]);
        }
    }
    for (k, leg) in mech.legs.iter().enumerate() {
        let row = leg::row(leg, &leg::position(leg, pose));
        for (j, twist) in e.twists[..d].iter().enumerate() {
            rows.set(ids[5], i, k * d + j, &[row.power(twist)]);
        }
    }
    rows.set(ids[6], i, 0, &rates[..d]);
}
