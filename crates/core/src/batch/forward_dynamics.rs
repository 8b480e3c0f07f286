//! Forward dynamics of many states.

use super::checks::{
    SINGULAR_PIVOTS, actuated_values, check_finite, check_twist, limit_status, read_pose, six, then,
};
use super::dynamics::Loads;
use super::{FieldId, Table};
use crate::coordinates::Set;
use crate::forward_dynamics::{self, Equations};
use crate::leg;
use crate::mechanism::Mechanism;
use crate::nearest::{self, Search};
use crate::spatial::{Pose, Twist};
use crate::status::Status;

/// Pose and twist of a state, and whether it is one that the mechanism can be in.
fn read(mech: &Mechanism, poses: &[f64], twists: &[f64], i: usize) -> (Pose<f64>, Twist<f64>, Status) {
    let (pose, status) = read_pose(mech, poses, i);
    let twist = Twist::from_array(six(twists, i));
    (pose, twist, then(status, || check_twist(mech, &pose, &twist)))
}

/// Accelerations of the platform and multipliers of the independent constraints from the forces of all legs; those of
/// passive legs are not read \[T49\].
#[must_use]
pub fn forward_dynamics(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    forces: &[f64],
    loads: &Loads,
) -> Table {
    let n = poses.len() / 16;
    let (mut table, [acceleration, multipliers]) =
        Table::new(n, [("acceleration", vec![6]), ("constraint", vec![mech.independent.len()])]);
    for i in 0..n {
        let (pose, twist, status) = read(mech, poses, twists, i);
        let (load, push) = (loads.at(mech, &pose, i), actuated_values(mech, forces, i));
        let mut status = then(status, || check_finite(&load.array()));
        status = then(status, || check_finite(&push));
        if status == Status::Ok {
            let driven = forward_dynamics::forward_dynamics(mech, &pose, &twist, &push, load);
            let a = driven.acceleration.array();
            status = Status::Singular;
            if driven.pivots > SINGULAR_PIVOTS && a.iter().all(|x| x.is_finite()) {
                status = limit_status(mech, &pose);
                table.set(acceleration, i, 0, &a);
                table.set(multipliers, i, 0, &driven.multipliers[..mech.independent.len()]);
            }
        }
        table.status[i] = status;
    }
    table
}

/// What the equations of motion are written in: twists, or given coordinates of a set.
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

/// Mass, Coriolis and damping matrix, gravity, and the Jacobians of platform and legs \[T49\]-\[T52\].
#[must_use]
pub fn equations_of_motion(mech: &Mechanism, poses: &[f64], twists: &[f64], space: &Space) -> Table {
    let (n, d) = (poses.len() / 16, space.size());
    let (mut table, ids) = Table::new(
        n,
        [
            ("mass", vec![d, d]),
            ("coriolis", vec![d, d]),
            ("damping", vec![d, d]),
            ("gravity", vec![d]),
            ("twist_jacobian", vec![6, d]),
            ("leg_jacobian", vec![mech.legs.len(), d]),
            ("rates", vec![d]),
        ],
    );
    for i in 0..n {
        let (pose, twist, status) = read(mech, poses, twists, i);
        let found = if status == Status::Ok { equations(mech, &pose, &twist, space) } else { Err(status) };
        table.status[i] = match found {
            Ok((e, rates)) => {
                put(mech, &mut table, ids, i, (&e, &rates), &pose);
                limit_status(mech, &pose)
            }
            Err(status) => status,
        };
    }
    table
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
            let search =
                Search { set: **set, given: given.clone(), reach: 0.0, scale: mech.characteristic_length };
            let (q, branch) = nearest::start(mech, &search, pose)?;
            forward_dynamics::coordinate_equations(mech, set, given, (&q, branch), pose, twist)
        }
    }
}

fn put(
    mech: &Mechanism,
    table: &mut Table,
    ids: [FieldId; 7],
    i: usize,
    (e, rates): (&Equations<f64>, &[f64; 6]),
    pose: &Pose<f64>,
) {
    let d = e.count;
    for (id, matrix) in ids.into_iter().zip([&e.mass, &e.coriolis, &e.damping]) {
        for (k, row) in matrix[..d].iter().enumerate() {
            table.set(id, i, k, &row[..d]);
        }
    }
    table.set(ids[3], i, 0, &e.gravity[..d]);
    for (j, twist) in e.twists[..d].iter().enumerate() {
        for (k, x) in twist.array().into_iter().enumerate() {
            table.set(ids[4], i, k * d + j, &[x]);
        }
    }
    for (k, leg) in mech.legs.iter().enumerate() {
        let row = leg::row(&leg::position(leg, pose));
        for (j, twist) in e.twists[..d].iter().enumerate() {
            table.set(ids[5], i, k * d + j, &[row.power(twist)]);
        }
    }
    table.set(ids[6], i, 0, &rates[..d]);
}
