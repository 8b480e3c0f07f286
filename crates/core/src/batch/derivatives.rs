//! Derivatives of inverse dynamics, and the regressor, of many states.

use super::checks::{check_finite, limit_status, outcome, then};
use super::{FieldId, Loads, States, Table};
use crate::coordinates::{self, MAX_COORDINATES, Set};
use crate::derivatives::{self, Part};
use crate::dynamics;
use crate::geometry;
use crate::inertial::{self, Regressor};
use crate::mechanism::Mechanism;
use crate::real::Dual;
use crate::spatial::{Motion, Pose};
use crate::status::Status;

/// A field for the forces of all legs and one for the multipliers.
type Pair = [FieldId; 2];

/// Derivatives of active forces and multipliers by pose, twist and acceleration, by the `given` coordinates of a set
/// with their rates and second rates, by the numbers of the bodies and by those of the geometry, this for lengths too
/// \[T56\] \[T57\].
#[must_use]
pub fn inverse_dynamics_derivatives(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    set: &Set,
    given: &[bool],
) -> Table {
    let given: [bool; MAX_COORDINATES] =
        std::array::from_fn(|k| k >= set.names().len() || given.get(k).copied().unwrap_or(false));
    let chosen = (0..set.names().len()).filter(|&k| given[k]).count();
    let (forces, multipliers) = (mech.legs.len(), mech.independent.len());
    let bodies = inertial::parameters(mech).len();
    let geometry = geometry::parameters(mech);
    let (mut table, ids) = Table::new(
        states.len(),
        [
            ("forces_by_pose", vec![forces, 6]),
            ("constraint_by_pose", vec![multipliers, 6]),
            ("forces_by_twist", vec![forces, 6]),
            ("constraint_by_twist", vec![multipliers, 6]),
            ("forces_by_acceleration", vec![forces, 6]),
            ("constraint_by_acceleration", vec![multipliers, 6]),
            ("forces_by_coordinates", vec![forces, chosen]),
            ("constraint_by_coordinates", vec![multipliers, chosen]),
            ("forces_by_rates", vec![forces, chosen]),
            ("constraint_by_rates", vec![multipliers, chosen]),
            ("forces_by_second_rates", vec![forces, chosen]),
            ("constraint_by_second_rates", vec![multipliers, chosen]),
            ("forces_by_bodies", vec![forces, bodies]),
            ("constraint_by_bodies", vec![multipliers, bodies]),
            ("forces_by_geometry", vec![forces, geometry.len()]),
            ("constraint_by_geometry", vec![multipliers, geometry.len()]),
            ("lengths_by_geometry", vec![forces, geometry.len()]),
        ],
    );
    let pair = |k: usize| [ids[2 * k], ids[2 * k + 1]];
    let lengths = ids[16];
    let mut regressor = Regressor::new(mech);
    let varied = geometry.iter().map(|parameter| geometry::varied(mech, parameter));
    let varied: Option<Vec<_>> = varied.map(|v| Some((set.varied(&v)?, v))).collect();
    for i in 0..states.len() {
        let (platform, status) = solvable(mech, states, loads, i);
        table.status[i] = status;
        if status != Status::Ok {
            continue;
        }
        let load = |pose: &Pose<Dual<f64>>| loads.at(mech, pose, i);
        for (k, part) in Part::ALL.into_iter().enumerate() {
            put(mech, &mut table, pair(k), i, &derivatives::by_motion(mech, &platform, &load, part));
        }
        let columns = regressor.columns(&platform);
        put(mech, &mut table, pair(6), i, &regressor.by_bodies(mech, &columns));
        table.status[i] = limit_status(mech, &platform.pose);
        match derivatives::by_coordinates(mech, &platform, &load, set, &given) {
            None => table.status[i] = Status::Fold,
            Some(parts) => {
                for (k, columns) in parts.iter().enumerate() {
                    put(mech, &mut table, pair(3 + k), i, columns);
                }
            }
        }
        let q = coordinates::along(mech, set, &platform);
        let by = |(set, v): &(_, _)| derivatives::by_geometry(v, &q, &load, set, &given);
        match varied.as_ref().and_then(|all| all.iter().map(by).collect::<Option<Vec<_>>>()) {
            None => table.status[i] = Status::Fold,
            Some(columns) => {
                let forces: Vec<_> = columns.iter().map(|c| c.forces).collect();
                put(mech, &mut table, pair(7), i, &forces);
                for leg in 0..mech.legs.len() {
                    let row: Vec<f64> = columns.iter().map(|c| c.lengths[leg]).collect();
                    table.set(lengths, i, leg, &row);
                }
            }
        }
    }
    table
}

/// The coefficients of the inertial parameters in active forces and multipliers, and what load and damping add
/// \[T57\].
#[must_use]
pub fn regressors(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let mut regressor = Regressor::new(mech);
    let width = regressor.parameters.len();
    let (forces, multipliers) = (mech.legs.len(), mech.independent.len());
    let (mut table, [y, y_constraint, offset, offset_constraint]) = Table::new(
        states.len(),
        [
            ("forces", vec![forces, width]),
            ("constraint", vec![multipliers, width]),
            ("forces_offset", vec![forces]),
            ("constraint_offset", vec![multipliers]),
        ],
    );
    for i in 0..states.len() {
        let (platform, status) = solvable(mech, states, loads, i);
        table.status[i] = status;
        if status == Status::Ok {
            put(mech, &mut table, [y, y_constraint], i, &regressor.columns(&platform));
            let load = loads.at(mech, &platform.pose, i);
            let column = regressor.offset(&platform, load);
            put(mech, &mut table, [offset, offset_constraint], i, &[column]);
            table.status[i] = limit_status(mech, &platform.pose);
        }
    }
    table
}

/// A state, and whether inverse dynamics has an answer there.
fn solvable(mech: &Mechanism, states: &States, loads: &Loads, i: usize) -> (Motion<f64>, Status) {
    let (platform, status) = states.read(mech, i);
    let load = loads.at(mech, &platform.pose, i);
    let status = then(status, || check_finite(&load.array()));
    let status = then(status, || {
        let (forces, pivots) = dynamics::inverse_dynamics(mech, &platform, load);
        outcome(mech, &forces, pivots)
    });
    (platform, status)
}

/// Columns for active forces and multipliers, written as rows for all legs (zero for passive ones) and multipliers.
fn put(mech: &Mechanism, table: &mut Table, [forces, multipliers]: Pair, state: usize, columns: &[[f64; 6]]) {
    let row = |k: usize| -> Vec<f64> { columns.iter().map(|column| column[k]).collect() };
    for k in 0..mech.legs.len() {
        table.set(forces, state, k, &vec![0.0; columns.len()]);
    }
    for (place, (k, _)) in mech.actuated().enumerate() {
        table.set(forces, state, k, &row(place));
    }
    for k in 0..mech.independent.len() {
        table.set(multipliers, state, k, &row(mech.dof() + k));
    }
}
