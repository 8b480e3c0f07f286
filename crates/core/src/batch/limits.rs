//! Limits of many states.

use super::checks::outcome;
use super::dynamics::Loads;
use super::{States, Table};
use crate::dynamics;
use crate::limits::{self, Measure};
use crate::mechanism::Mechanism;
use crate::spatial::{Motion, Wrench};
use crate::status::Status;

/// Signed slack of every limit, the same relative to the limit's scale, and the number of the limit that binds \[T35\].
/// Forces are those of the motion; where they are not determined their margins are NaN and no limit binds.
#[must_use]
pub fn limits(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let (n, m) = (states.len(), mech.limits.len());
    let (mut table, [margins, relative, binding]) =
        Table::new(n, [("margins", vec![m]), ("relative", vec![m]), ("binding", vec![])]);
    let needs_forces = mech.limits.iter().any(|limit| matches!(limit.measure, Measure::Force { .. }));
    let mut found = vec![0.0; m];
    for i in 0..n {
        let (platform, load, status) = states.read_loaded(mech, loads, i);
        table.status[i] = status;
        if status != Status::Ok {
            continue;
        }
        let forces = if needs_forces { forces(mech, &platform, load) } else { None };
        limits::margins(mech, &platform.pose, forces.as_ref(), &mut found);
        table.status[i] = if needs_forces && forces.is_none() {
            Status::Singular
        } else {
            limits::status(mech.limits.iter().zip(found.iter().copied()))
        };
        table.set(margins, i, 0, &found);
        if let Some(k) = limits::binding(mech, &found) {
            table.set(binding, i, 0, &[k as f64]);
        }
        for (margin, limit) in found.iter_mut().zip(&mech.limits) {
            *margin /= limit.scale;
        }
        table.set(relative, i, 0, &found);
    }
    table
}

/// Active forces, where they are determined.
fn forces(mech: &Mechanism, platform: &Motion<f64>, load: Wrench<f64>) -> Option<[f64; 6]> {
    let (f, pivots) = dynamics::inverse_dynamics(mech, platform, load);
    (outcome(mech, &f, pivots) == Status::Ok).then_some(f)
}
