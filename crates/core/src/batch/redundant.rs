//! Mechanisms with redundant actuators at many states, one after the other \[T72\]-\[T74\].

use super::block::{self, At, Pieces, Rows};
use super::checks::{actuated_values, any_pose, finite, limit_status, pose_at, then, with_twist};
use super::{FieldId, Loads, States, Table};
use crate::assembly::geometric_parameters;
use crate::dynamics::derivatives::{Coordinates, Varied};
use crate::dynamics::forward_dynamics;
use crate::dynamics::inverse_dynamics::{self, resultant};
use crate::dynamics::redundant_actuation::{self, Column, Followed, Parted, Solved};
use crate::dynamics::regressor::Regressor;
use crate::kinematics::coordinate_sets::{DEPENDENT_PIVOTS, MAX_COORDINATES, Set};
use crate::kinematics::leg;
use crate::kinematics::rows::{RowNumbers, all_hessians, all_rows};
use crate::limits::margins::{Binding, Seen};
use crate::model::limit::Measure;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::real::Dual;
use crate::spatial::{Motion, Twist, Wrench};

/// J for each pose, constraint satisfied or not [Eq. 13].
pub(super) fn jacobians(mech: &Mechanism, poses: &[f64]) -> Table {
    let fields = [("jacobian", vec![mech.rows(), 6])];
    block::one_by_one(poses.len() / 16, fields, Pieces::QUICK, |rows, i| {
        let (pose, codes) = any_pose::<f64>(poses, At::one(i));
        if codes.status() == Status::Ok {
            let [field] = block::fields();
            for (k, row) in all_rows(mech, &pose).iter().enumerate() {
                rows.set(field, i, k, row);
            }
        }
        codes.status()
    })
}

/// H for each pose, constraint satisfied or not [Eq. 19].
pub(super) fn hessians(mech: &Mechanism, poses: &[f64]) -> Table {
    let fields = [("hessian", vec![mech.rows(), 6, 6])];
    block::one_by_one(poses.len() / 16, fields, Pieces::QUICK, |rows, i| {
        let (pose, codes) = any_pose::<f64>(poses, At::one(i));
        if codes.status() == Status::Ok {
            let [field] = block::fields();
            for (k, layer) in all_hessians(mech, &pose).iter().enumerate() {
                rows.set(field, i, k, &layer.concat());
            }
        }
        codes.status()
    })
}

/// The platform's twist from the rates of all legs, as far as they agree \[T73\].
pub(super) fn platform_twist(mech: &Mechanism, poses: &[f64], rates: &[f64]) -> Table {
    block::one_by_one(poses.len() / 16, [("twist", vec![6])], Pieces::QUICK, |rows, i| {
        let (pose, codes) = pose_at::<f64>(mech, poses, At::one(i));
        let legs = actuated_values(mech, rates, i);
        let status = codes.unless(finite(&legs), Status::InvalidInput).status();
        then(status, || put_followed(rows, i, &redundant_actuation::platform_twist(mech, &pose, &legs)))
    })
}

/// The same of accelerations.
pub(super) fn platform_acceleration(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    accelerations: &[f64],
) -> Table {
    block::one_by_one(poses.len() / 16, [("acceleration", vec![6])], Pieces::QUICK, |rows, i| {
        let (pose, codes) = pose_at::<f64>(mech, poses, At::one(i));
        let twist = Twist::from_array(At::one(i).read(twists));
        let legs = actuated_values(mech, accelerations, i);
        let codes = with_twist(mech, &pose, &twist, codes).unless(finite(&legs), Status::InvalidInput);
        then(codes.status(), || {
            put_followed(rows, i, &redundant_actuation::platform_acceleration(mech, &pose, &twist, &legs))
        })
    })
}

fn put_followed(rows: &mut Rows<'_, 1>, i: usize, found: &Followed) -> Status {
    let [field] = block::fields();
    match (found.regular, found.agrees) {
        (false, _) => Status::Singular,
        (true, false) => Status::Inconsistent,
        (true, true) => {
            rows.set(field, i, 0, &found.motion.array());
            Status::Ok
        }
    }
}

/// Active forces of all legs (zero for passive ones), those nearest to the preferred ones, torques of idle freedoms and
/// multipliers [Eq. 43] \[T72\].
pub(super) fn inverse_dynamics(
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
    block::one_by_one(states.len(), fields, Pieces::QUICK, |rows, i| {
        let [forces, multipliers, torques] = block::fields();
        let (platform, load, mut status) = read(mech, states, loads, i);
        let near = preferred.map_or_else(Vec::new, |values| actuated_values(mech, values, i));
        if status == Status::Ok && !near.iter().all(|x| x.is_finite()) {
            status = Status::InvalidInput;
        }
        if status != Status::Ok {
            return status;
        }
        let found = redundant_actuation::inverse_dynamics(mech, &platform, load, &near);
        if !found.regular {
            return Status::Singular;
        }
        let (idle, constraints) = found.multipliers.split_at(mech.idle.len());
        rows.set(forces, i, 0, &of_all_legs(mech, &found.forces));
        rows.set(multipliers, i, 0, constraints);
        rows.set(torques, i, 0, idle);
        limit_status(mech, &platform.pose)
    })
}

/// A motion under load, and whether it is one that the mechanism can be in.
fn read(mech: &Mechanism, states: &States, loads: &Loads, i: usize) -> (Motion<f64>, Wrench<f64>, Status) {
    let (platform, load, codes) = states.loaded_at::<f64>(mech, loads, At::one(i));
    (platform, load, codes.status())
}

/// Zero for passive legs.
fn of_all_legs(mech: &Mechanism, actuated: &[f64]) -> Vec<f64> {
    let mut values = actuated.iter();
    let value = |actuated: bool| if actuated { values.next().copied().unwrap_or(f64::NAN) } else { 0.0 };
    mech.legs.iter().map(|leg| leg.actuated).map(value).collect()
}

/// Energies and the powers of their balance \[T17\], with the forces of least size.
pub(super) fn power<const N: usize>(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    names: [&'static str; N],
    energy: impl Fn(&Motion<f64>) -> (Dual<f64>, Dual<f64>) + Sync,
) -> Table {
    block::one_by_one(states.len(), names.map(|name| (name, vec![])), Pieces::QUICK, |rows, i| {
        let (platform, wrench, status) = read(mech, states, loads, i);
        if status != Status::Ok {
            return status;
        }
        let Motion { pose, twist, .. } = &platform;
        let (kinetic, potential) = energy(&platform);
        let load = wrench.power(twist);
        let damping = inverse_dynamics::damping_wrench(mech, twist).power(twist);
        let found = redundant_actuation::inverse_dynamics(mech, &platform, wrench, &[]);
        let rates = all_rows(mech, pose);
        let rates = rates.iter().map(|row| Wrench::from_array(*row).power(twist));
        let driven = RowNumbers::of(mech).idle().end;
        let forces = found.forces.iter().chain(&found.multipliers).take(driven);
        let actuators: f64 = rates.zip(forces).map(|(rate, force)| rate * force).sum();
        let own = (wrench + inverse_dynamics::platform_wrench(mech, &platform)).power(twist);
        let friction = own * (1.0 / mech.efficiency - 1.0);
        let residual = actuators + load + damping + friction - kinetic.d - potential.d;
        let values =
            [kinetic.x, potential.x, kinetic.d, potential.d, actuators, load, damping, friction, residual];
        for (id, value) in block::fields::<N>().into_iter().zip(values) {
            rows.set(id, i, 0, &[value]);
        }
        then(if found.regular { Status::Ok } else { Status::Singular }, || limit_status(mech, pose))
    })
}

/// Slack of all limits, forces being those of least size \[T35\] \[T38\].
pub(super) fn limits(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    fields: [(&'static str, Vec<usize>); 4],
) -> Table {
    let asked = mech.limits.iter().any(|limit| matches!(limit.measure, Measure::Force { .. }));
    block::one_by_one(states.len(), fields, Pieces::QUICK, |rows, i| {
        let [margins, relatives, binding, within] = block::fields();
        let (platform, load, mut status) = read(mech, states, loads, i);
        if status != Status::Ok {
            return status;
        }
        let mut forces = vec![];
        if asked {
            let found = redundant_actuation::inverse_dynamics(mech, &platform, load, &[]);
            forces = found.forces;
            status = if found.regular { status } else { Status::Singular };
        }
        let (mut seen, mut binds, mut kept) = (Seen::default(), Binding::default(), true);
        for (k, limit) in mech.limits.iter().enumerate() {
            let margin: f64 = limit.margin_at(mech, &platform.pose, &forces, &mut seen);
            let relative = margin / limit.scale;
            rows.set(margins, i, k, &[margin]);
            rows.set(relatives, i, k, &[relative]);
            binds = binds.or(k, relative);
            kept &= margin >= 0.0;
            if limit.status() != Status::Ok && !(margin >= 0.0) && status == Status::Ok {
                status = limit.status();
            }
        }
        rows.set(binding, i, 0, &[binds.limit]);
        rows.set(within, i, 0, &[f64::from(u8::from(kept))]);
        status
    })
}

/// Accelerations of the platform and multipliers of the constraints from the forces of all legs \[T49\].
pub(super) fn forward_dynamics(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    forces: &[f64],
    loads: &Loads,
    fields: [(&'static str, Vec<usize>); 2],
) -> Table {
    block::one_by_one(poses.len() / 16, fields, Pieces::QUICK, |rows, i| {
        let [acceleration, multipliers] = block::fields();
        let (pose, codes) = pose_at::<f64>(mech, poses, At::one(i));
        let twist = Twist::from_array(At::one(i).read(twists));
        let (load, push) = (loads.of(mech, &pose, At::one(i)), actuated_values(mech, forces, i));
        let status = with_twist(mech, &pose, &twist, codes)
            .unless(finite(&load.array()), Status::InvalidInput)
            .unless(finite(&push), Status::InvalidInput)
            .status();
        then(status, || {
            let driven = forward_dynamics::forward_dynamics::<f64>(mech, &pose, &twist, &push, load);
            let a = driven.acceleration.array();
            if !(driven.pivots > super::SINGULAR_PIVOTS && a.iter().all(|x| x.is_finite())) {
                return Status::Singular;
            }
            rows.set(acceleration, i, 0, &a);
            rows.set(multipliers, i, 0, &driven.multipliers[..mech.independent.len()]);
            limit_status(mech, &pose)
        })
    })
}

/// Inverse dynamics at a state, solved, or why it is not.
fn solve(mech: &Mechanism, states: &States, loads: &Loads, i: usize) -> Result<Solved, Status> {
    let (platform, load, status) = read(mech, states, loads, i);
    if status != Status::Ok {
        return Err(status);
    }
    let parted = Parted::at(mech, &platform.pose).filter(|parted| parted.regular).ok_or(Status::Singular)?;
    let balanced = parted.solve(&[], resultant(mech, &platform, load) * -1.0, &[]);
    Ok(Solved { platform, load: loads.given(mech, At::one(i)), parted, balanced })
}

/// Derivatives of the least active forces \[T74\]; fields as of [`super::inverse_dynamics_derivatives`].
pub(super) fn inverse_dynamics_derivatives(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    set: &Set,
    given: [bool; MAX_COORDINATES],
    fields: [(&'static str, Vec<usize>); 17],
) -> Table {
    let numbers: Vec<usize> = (0..set.names().len()).filter(|&k| given[k]).collect();
    let (still, regressor) = (Varied::none(mech, set), Regressor::new(mech));
    let varied = geometric_parameters::parameters(mech);
    let varied: Option<Vec<Varied>> = varied.iter().map(|p| Varied::new(mech, p, set)).collect();
    block::one_by_one(states.len(), fields, Pieces::SLOW, |rows, i| {
        let ids: [FieldId; 17] = block::fields();
        let pair = |k: usize| [ids[2 * k], ids[2 * k + 1]];
        let at = match solve(mech, states, loads, i) {
            Ok(at) => at,
            Err(status) => return status,
        };
        let by_motion = redundant_actuation::by_motion(mech, &still, &at);
        for order in 0..3 {
            put(mech, rows, i, pair(order), &by_motion[6 * order..6 * order + 6]);
        }
        let columns = columns(mech, &regressor, &at);
        let by_bodies: Vec<Column> =
            (0..columns.len()).map(|k| regressor.by_bodies_of(&columns, k)).collect();
        put(mech, rows, i, pair(6), &by_bodies);

        let by = Coordinates::at(mech, set, &still, &given, &at.platform);
        let determined = by.following.pivots > DEPENDENT_PIVOTS;
        let known = |columns: &[Column]| determined && columns.iter().flatten().all(|x| x.is_finite());
        let mut status = Status::Ok;
        for order in 0..3 {
            let step = |&number: &usize| by.step(&by.varied(&still, number), order);
            let columns: Vec<Column> =
                numbers.iter().map(|k| redundant_actuation::combined(&by_motion, &step(k))).collect();
            if known(&columns) {
                put(mech, rows, i, pair(3 + order), &columns);
            } else {
                status = Status::Fold;
            }
        }
        let mut lengths = vec![vec![0.0; mech.legs.len()]; varied.as_ref().map_or(0, Vec::len)];
        let by_geometry = varied.as_ref().map(|varied| {
            let of = |(v, lengths): (&Varied, &mut Vec<f64>)| {
                redundant_actuation::by_geometry(v, &at, &by_motion, &by, lengths)
            };
            varied.iter().zip(&mut lengths).map(of).collect::<Vec<Column>>()
        });
        match by_geometry.filter(|columns| known(columns)) {
            Some(columns) => {
                put(mech, rows, i, pair(7), &columns);
                for (k, lengths) in lengths.iter().enumerate() {
                    for (leg, length) in lengths.iter().enumerate() {
                        rows.set(ids[16], i, leg * columns.len() + k, &[*length]);
                    }
                }
            }
            None => status = Status::Fold,
        }
        then(status, || limit_status(mech, &at.platform.pose))
    })
}

/// The columns of Y.
fn columns(mech: &Mechanism, regressor: &Regressor, at: &Solved) -> Vec<Column> {
    let legs: Vec<_> = mech.legs.iter().map(|leg| leg::state(leg, &at.platform)).collect();
    let answer = |k: usize| at.parted.answer(regressor.wrench(mech, &at.platform, &legs, k));
    (0..regressor.parameters.len()).map(answer).collect()
}

/// The regressor of the least active forces \[T57\] \[T72\]; fields as of [`super::regressors`].
pub(super) fn regressors(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    fields: [(&'static str, Vec<usize>); 4],
) -> Table {
    let regressor = Regressor::new(mech);
    block::one_by_one(states.len(), fields, Pieces::SLOW, |rows, i| {
        let [y, y_constraint, offset, offset_constraint] = block::fields();
        let at = match solve(mech, states, loads, i) {
            Ok(at) => at,
            Err(status) => return status,
        };
        put(mech, rows, i, [y, y_constraint], &columns(mech, &regressor, &at));
        let load = loads.of(mech, &at.platform.pose, At::one(i));
        let rest = at.parted.answer(Regressor::rest(mech, &at.platform.twist, load));
        put(mech, rows, i, [offset, offset_constraint], &[rest]);
        limit_status(mech, &at.platform.pose)
    })
}

/// Columns for active forces and multipliers, of rows for all legs (zero for passive ones) and constraints.
fn put<const N: usize>(
    mech: &Mechanism,
    rows: &mut Rows<'_, N>,
    i: usize,
    [forces, multipliers]: [FieldId; 2],
    columns: &[Column],
) {
    let numbers = RowNumbers::of(mech);
    for (k, column) in columns.iter().enumerate() {
        for (leg, force) in of_all_legs(mech, &column[numbers.actuated()]).into_iter().enumerate() {
            rows.set(forces, i, leg * columns.len() + k, &[force]);
        }
        for (c, multiplier) in column[numbers.constraints()].iter().enumerate() {
            rows.set(multipliers, i, c * columns.len() + k, &[*multiplier]);
        }
    }
}
