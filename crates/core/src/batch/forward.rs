//! Forward kinematics of many states.

use super::Table;
use super::checks::{actuated_values, check_legs, is_rotation, joint_limits, raw_pose, then};
use crate::forward::{Found, forward_kinematics as find, passed};
use crate::limits;
use crate::mechanism::Mechanism;
use crate::modes::{self, Start};
use crate::spatial::Pose;
use crate::status::Status;

/// The pose for each set of lengths of all legs (those of passive legs are not read), in the assembly mode of its
/// guess: one for each state or one for all. `continued` starts each state from the last one that was solved, and tells
/// where a motion through the states has passed a singularity \[T27\].
#[must_use]
pub fn forward_kinematics(
    mech: &Mechanism,
    lengths: &[f64],
    guesses: Option<&[f64]>,
    continued: bool,
) -> Table {
    let n = lengths.len() / mech.legs.len();
    let (mut table, [poses, residuals, iterations]) =
        Table::new(n, [("pose", vec![4, 4]), ("residual", vec![]), ("iterations", vec![])]);
    // The last pose that was solved, and the one of the state before it.
    let (mut last, mut before, mut solved) = (None, None, false);
    for i in 0..n {
        let guess = match (last, guesses) {
            (Some(pose), _) if continued => pose,
            (_, None) => mech.home,
            (_, Some(guesses)) => {
                let k = if guesses.len() == 16 { 0 } else { i };
                if !is_rotation(guesses, k) {
                    table.status[i] = Status::InvalidInput;
                    continue;
                }
                raw_pose(guesses, k)
            }
        };
        let values = actuated_values(mech, lengths, i);
        let mut found = find(mech, &values, &guess);
        if let (true, Some(last), Some(before), Status::Ok) = (continued, last, before, found.status) {
            found = passed(mech, &values, &before, &last, &found).unwrap_or(found);
        }
        let Found { pose, residual, iterations: steps, status, .. } = found;
        let status = then(status, || check_found(mech, &pose, residual));
        table.status[i] = status;
        if !matches!(status, Status::NotConverged | Status::InvalidInput) {
            table.set(poses, i, 0, &pose.matrix());
            table.set(residuals, i, 0, &[residual]);
        }
        table.set(iterations, i, 0, &[f64::from(steps)]);
        let unsolved = [Status::NotConverged, Status::InvalidInput, Status::Singular, Status::ModeJump]
            .contains(&status);
        (last, before) = if unsolved { (last, None) } else { (Some(pose), last.filter(|_| solved)) };
        solved = !unsolved;
    }
    table
}

/// Whether a pose that was found is one that the mechanism can be in, and within its limits. A root that a constraint
/// has only because a leg has no frame there is none. Strokes are judged by the lengths that were asked for, which the
/// pose's own miss by the residual: lengths at the very end of a stroke are within it.
fn check_found(mech: &Mechanism, pose: &Pose<f64>, residual: f64) -> Status {
    then(check_legs(mech, pose), || {
        limits::status(joint_limits(mech).map(|limit| {
            let missed = if limit.status() == Status::OutOfStroke { residual } else { 0.0 };
            (limit, limit.margin(mech, pose, None) + missed)
        }))
    })
}

/// All assembly modes of each set of lengths, one after the other, and how many belong to each set \[T28\].
#[derive(Clone, Debug)]
pub struct AllModes {
    /// One row for each mode.
    pub modes: Table,
    pub counts: Vec<usize>,
    /// One for each set of lengths.
    pub status: Vec<Status>,
}

#[must_use]
pub fn assembly_modes(mech: &Mechanism, start: &Start, lengths: &[f64]) -> AllModes {
    let n = lengths.len() / mech.legs.len();
    let found: Vec<modes::Modes> =
        (0..n).map(|i| modes::assembly_modes(mech, start, &actuated_values(mech, lengths, i))).collect();
    let all: Vec<&modes::Mode> = found.iter().flat_map(|f| &f.modes).collect();
    let names = ["determinant_sign", "above", "multiplicity", "residual"].map(|name| (name, vec![]));
    let [sign, above, multiplicity, residual] = names;
    let (mut table, [poses, sign, above, multiplicity, residual]) =
        Table::new(all.len(), [("pose", vec![4, 4]), sign, above, multiplicity, residual]);
    for (i, mode) in all.iter().enumerate() {
        table.set(poses, i, 0, &mode.pose.matrix());
        table.set(sign, i, 0, &[if mode.singular { 0.0 } else { mode.sign }]);
        table.set(above, i, 0, &[f64::from(u8::from(mode.above))]);
        table.set(multiplicity, i, 0, &[f64::from(mode.multiplicity)]);
        table.set(residual, i, 0, &[mode.residual]);
        let status = if mode.singular { Status::Singular } else { Status::Ok };
        table.status[i] = then(status, || check_found(mech, &mode.pose, mode.residual));
    }
    let counts = found.iter().map(|f| f.modes.len()).collect();
    AllModes { modes: table, counts, status: found.iter().map(|f| f.status).collect() }
}
