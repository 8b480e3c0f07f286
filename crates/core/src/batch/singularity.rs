//! Singularities at many states.

use super::checks::{check_pose, is_rotation, raw_pose, read_pose, six, then};
use super::{FieldId, Table};
use crate::coordinates::{self, Set};
use crate::mechanism::Mechanism;
use crate::nearest::{self, Search};
use crate::singularity;
use crate::spatial::{Pose, Twist};
use crate::status::Status;

/// A pose that keeps the constraints, whether or not its legs have frames: a singular pose is one too.
fn read(mech: &Mechanism, poses: &[f64], i: usize) -> (Pose<f64>, Status) {
    let pose = raw_pose(poses, i);
    let status = if is_rotation(poses, i) { Status::Ok } else { Status::InvalidInput };
    (pose, then(status, || check_pose(mech, &pose)))
}

/// Singular values of the leg Jacobian on the twists that the constraints allow, for the length `scale` \[T24\].
#[must_use]
pub fn conditioning(mech: &Mechanism, poses: &[f64], scale: f64) -> Table {
    let n = poses.len() / 16;
    let (mut table, ids) = Table::new(n, ["sigma_min", "sigma_max", "condition"].map(|name| (name, vec![])));
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        table.status[i] = status;
        if status == Status::Ok {
            let c = singularity::conditioning(mech, &pose, scale);
            for (id, value) in ids.iter().zip([c.sigma_min, c.sigma_max, c.condition]) {
                table.set(*id, i, 0, &[value]);
            }
        }
    }
    table
}

/// det J in pure numbers and its exact rate along the twist \[T30\]. The rate is NaN where the twist has NaN.
#[must_use]
pub fn determinants(mech: &Mechanism, poses: &[f64], twists: &[f64], scale: f64) -> Table {
    let n = poses.len() / 16;
    let (mut table, [value, rate]) = Table::new(n, [("determinant", vec![]), ("rate", vec![])]);
    for i in 0..n {
        let (pose, status) = read(mech, poses, i);
        table.status[i] = status;
        if status == Status::Ok {
            let det = singularity::determinant(mech, &pose, &Twist::from_array(six(twists, i)), scale);
            table.status[i] = put_known(&mut table, value, i, det.x);
            table.set(rate, i, 0, &[det.d]);
        }
    }
    table
}

fn put_known(table: &mut Table, field: FieldId, i: usize, value: f64) -> Status {
    table.set(field, i, 0, &[value]);
    if value.is_finite() { Status::Ok } else { Status::Singular }
}

/// Determinant, singular values, kind and uncontrolled twist at each pose \[T30\]-\[T33\]. At a pose where a leg has no
/// direction the status is singular, and only the kind and the measures of legs and constraints stand.
#[must_use]
pub fn singularities(mech: &Mechanism, poses: &[f64], scale: f64, tolerance: f64) -> Table {
    let (n, legs) = (poses.len() / 16, mech.legs.len());
    let (mut table, ids) = Table::new(
        n,
        [
            ("determinant", vec![]),
            ("sigma_min", vec![]),
            ("sigma_max", vec![]),
            ("condition", vec![]),
            ("constraint_sigma", vec![]),
            ("leg_length", vec![legs]),
            ("leg_sine", vec![legs]),
            ("kind", vec![]),
            ("leg", vec![]),
            ("uncontrolled", vec![]),
            ("twist", vec![6]),
            ("axis", vec![3]),
            ("pitch", vec![]),
            ("point", vec![3]),
        ],
    );
    for i in 0..n {
        let (pose, status) = read(mech, poses, i);
        table.status[i] = status;
        if status != Status::Ok {
            continue;
        }
        let s = singularity::singularity(mech, &pose, scale, tolerance);
        table.status[i] = put_known(&mut table, ids[0], i, s.determinant);
        let known = table.status[i] == Status::Ok;
        let c = s.conditioning;
        let values: [&[f64]; 13] = [
            &[c.sigma_min],
            &[c.sigma_max],
            &[c.condition],
            &[s.constraint_sigma],
            &s.leg_length,
            &s.leg_sine,
            &[f64::from(s.kind as u8)],
            &[s.leg.map_or(-1.0, |leg| leg as f64)],
            &[if known { s.uncontrolled as f64 } else { f64::NAN }],
            &s.twist.array(),
            &s.screw.axis.array(),
            &[s.screw.pitch],
            &s.screw.point.array(),
        ];
        for (id, value) in ids[1..].iter().zip(values) {
            table.set(*id, i, 0, value);
        }
    }
    table
}

/// Coordinates to search along from each pose: those of a set that are given, by name.
#[must_use]
pub fn searched_coordinates(mech: &Mechanism, set: &Set, names: Option<&[String]>) -> Vec<bool> {
    names.map_or_else(
        || coordinates::best_given(mech, set),
        |names| set.names().iter().map(|name| names.iter().any(|n| n == name)).collect(),
    )
}

/// For each given coordinate its value at the nearest singular poses below and above, their kinds, and how far
/// poses were looked at \[T34\].
#[must_use]
pub fn nearest_singular(mech: &Mechanism, poses: &[f64], search: &Search) -> Table {
    let n = poses.len() / 16;
    let given: Vec<usize> = (0..search.set.names().len()).filter(|&i| search.given[i]).collect();
    let pair = || vec![given.len(), 2];
    let (mut table, [value, singular, kind, searched]) = Table::new(
        n,
        [("value", vec![given.len()]), ("singular", pair()), ("kind", pair()), ("searched", pair())],
    );
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        let found = if status == Status::Ok { nearest::start(mech, search, &pose) } else { Err(status) };
        let (q, branch) = match found {
            Ok(start) => start,
            Err(status) => {
                table.status[i] = status;
                continue;
            }
        };
        for (k, &index) in given.iter().enumerate() {
            table.set(value, i, k, &[q[index]]);
            let both = [-1.0, 1.0].map(|d| nearest::along(mech, search, &pose, (&q, branch), index, d));
            table.set(singular, i, k, &both.map(|b| b.value));
            table.set(kind, i, k, &both.map(|b| b.kind.map_or(f64::NAN, |kind| f64::from(kind as u8))));
            table.set(searched, i, k, &both.map(|b| b.searched));
        }
    }
    table
}
