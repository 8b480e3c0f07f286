//! Derivatives of inverse dynamics, and the regressor, of many states.

use super::block::{self, At, Pieces, Rows};
use super::checks::{limit_status, outcome, then};
use super::{FieldId, Loads, States, Table};
use crate::coordinates::{self, MAX_COORDINATES, Set};
use crate::derivatives::{self, Part};
use crate::dynamics;
use crate::geometry;
use crate::inertial::{self, Regressor};
use crate::mechanism::Mechanism;
use crate::real::Dual;
use crate::spatial::{Motion, Pose, Vec3, Wrench};
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
    let fields = [
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
    ];
    let ids: [FieldId; 17] = block::fields();
    let pair = |k: usize| [ids[2 * k], ids[2 * k + 1]];
    let lengths = ids[16];
    let varied = geometry.iter().map(|parameter| geometry::varied(mech, parameter));
    let varied: Option<Vec<_>> = varied.map(|v| Some((set.varied(&v)?, v))).collect();
    let answer = |rows: &mut Rows<'_, 17>, regressor: &mut Regressor, i: usize| {
        let (platform, _, mut status) = solvable(mech, states, loads, i);
        if status != Status::Ok {
            return status;
        }
        let (wrench, axes) = loads.given::<f64>(mech, At::one(i));
        let wrench = Wrench::new(Vec3::lift(wrench.force), Vec3::lift(wrench.torque));
        let load = |pose: &Pose<Dual<f64>>| dynamics::load_in_base(wrench, axes, pose);
        for (k, part) in Part::ALL.into_iter().enumerate() {
            put(mech, rows, pair(k), i, &derivatives::by_motion(mech, &platform, &load, part));
        }
        let columns = regressor.columns(&platform);
        put(mech, rows, pair(6), i, &regressor.by_bodies(mech, &columns));
        status = limit_status(mech, &platform.pose);
        match derivatives::by_coordinates(mech, &platform, &load, set, &given) {
            None => status = Status::Fold,
            Some(parts) => {
                for (k, columns) in parts.iter().enumerate() {
                    put(mech, rows, pair(3 + k), i, columns);
                }
            }
        }
        let q = coordinates::along(mech, set, &platform);
        let by = |(set, v): &(_, _)| derivatives::by_geometry(v, &q, &load, set, &given);
        match varied.as_ref().and_then(|all| all.iter().map(by).collect::<Option<Vec<_>>>()) {
            None => status = Status::Fold,
            Some(columns) => {
                let forces: Vec<_> = columns.iter().map(|c| c.forces).collect();
                put(mech, rows, pair(7), i, &forces);
                for leg in 0..mech.legs.len() {
                    let row: Vec<f64> = columns.iter().map(|c| c.lengths[leg]).collect();
                    rows.set(lengths, i, leg, &row);
                }
            }
        }
        status
    };
    in_pieces(mech, states.len(), fields, answer)
}

/// The same as [`block::one_by_one`] with a regressor for each piece of the states.
fn in_pieces<const N: usize>(
    mech: &Mechanism,
    states: usize,
    fields: [(&'static str, Vec<usize>); N],
    answer: impl Fn(&mut Rows<'_, N>, &mut Regressor, usize) -> Status + Sync,
) -> Table {
    block::in_pieces(states, fields, Pieces::SLOW, |rows, piece| {
        let mut regressor = Regressor::new(mech);
        for i in piece {
            let status = answer(rows, &mut regressor, i);
            rows.set_status(i, status);
        }
    })
}

/// The coefficients of the inertial parameters in active forces and multipliers, and what load and damping add
/// \[T57\].
#[must_use]
pub fn regressors(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let width = inertial::parameters(mech).len();
    let (forces, multipliers) = (mech.legs.len(), mech.independent.len());
    let fields = [
        ("forces", vec![forces, width]),
        ("constraint", vec![multipliers, width]),
        ("forces_offset", vec![forces]),
        ("constraint_offset", vec![multipliers]),
    ];
    let [y, y_constraint, offset, offset_constraint] = block::fields();
    in_pieces(mech, states.len(), fields, |rows, regressor, i| {
        let (platform, load, status) = solvable(mech, states, loads, i);
        if status != Status::Ok {
            return status;
        }
        put(mech, rows, [y, y_constraint], i, &regressor.columns(&platform));
        put(mech, rows, [offset, offset_constraint], i, &[regressor.offset(&platform, load)]);
        limit_status(mech, &platform.pose)
    })
}

/// A state, and whether inverse dynamics has an answer there.
fn solvable(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    i: usize,
) -> (Motion<f64>, Wrench<f64>, Status) {
    let (platform, load, status) = states.one(mech, loads, i);
    let status = then(status, || {
        let (forces, pivots) = dynamics::inverse_dynamics(mech, &platform, load);
        outcome(mech, &forces, pivots)
    });
    (platform, load, status)
}

/// Columns for active forces and multipliers, written as rows for all legs (zero for passive ones) and multipliers.
fn put<const N: usize>(
    mech: &Mechanism,
    rows: &mut Rows<'_, N>,
    [forces, multipliers]: Pair,
    state: usize,
    columns: &[[f64; 6]],
) {
    let row = |k: usize| -> Vec<f64> { columns.iter().map(|column| column[k]).collect() };
    for k in 0..mech.legs.len() {
        rows.set(forces, state, k, &vec![0.0; columns.len()]);
    }
    for (place, (k, _)) in mech.actuated().enumerate() {
        rows.set(forces, state, k, &row(place));
    }
    for k in 0..mech.independent.len() {
        rows.set(multipliers, state, k, &row(mech.dof() + k));
    }
}
