//! Forward kinematics of many states.

use super::Table;
use super::block::{self, Pieces, Rows};
use super::checks::{actuated_values, check_legs, is_rotation, joint_limits, raw_pose, then};
use crate::forward::{self, Found};
use crate::forward_lanes::forward_kinematics_of;
use crate::lanes::WIDTH;
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
    let guess = |i: usize| match guesses {
        None => Some(mech.home),
        Some(guesses) => {
            let k = if guesses.len() == 16 { 0 } else { i };
            is_rotation(guesses, k).then(|| raw_pose(guesses, k))
        }
    };
    let fields = [("pose", vec![4, 4]), ("residual", vec![]), ("iterations", vec![])];
    let asked = |i: usize| actuated_values(mech, lengths, i);
    if !continued {
        return block::in_pieces(n, fields, IN_LANES, |rows, piece| {
            let (mut states, mut numbers) = (Vec::with_capacity(WIDTH), Vec::with_capacity(WIDTH));
            let last = piece.end;
            for i in piece {
                match guess(i) {
                    None => rows.set_status(i, Status::InvalidInput),
                    Some(guess) => {
                        states.push((asked(i), guess));
                        numbers.push(i);
                    }
                }
                if states.len() == WIDTH || i + 1 == last {
                    for (i, found) in numbers.drain(..).zip(forward_kinematics_of(mech, &states)) {
                        put_found(mech, rows, i, &found);
                    }
                    states.clear();
                }
            }
        });
    }
    block::in_pieces(n, fields, Pieces::WHOLE, |rows, states| {
        // The last pose that was solved, and the one of the state before it.
        let (mut last, mut before, mut solved) = (None, None, false);
        for i in states {
            let Some(guess) = last.or_else(|| guess(i)) else {
                rows.set_status(i, Status::InvalidInput);
                continue;
            };
            let values = asked(i);
            let mut found = forward::forward_kinematics(mech, &values, &guess);
            if let (Some(last), Some(before), Status::Ok) = (last, before, found.status) {
                found = forward::passed(mech, &values, &before, &last, &found).unwrap_or(found);
            }
            let status = put_found(mech, rows, i, &found);
            let unsolved = [Status::NotConverged, Status::InvalidInput, Status::Singular, Status::ModeJump]
                .contains(&status);
            (last, before) =
                if unsolved { (last, None) } else { (Some(found.pose), last.filter(|_| solved)) };
            solved = !unsolved;
        }
    })
}

/// So many lengths at least are worth a thread of their own.
const IN_LANES: Pieces = Pieces { least: 32, unit: WIDTH };

/// Writes down what was found, with its status.
fn put_found(mech: &Mechanism, rows: &mut Rows<'_, 3>, i: usize, found: &Found) -> Status {
    let Found { pose, residual, iterations, .. } = *found;
    let status = then(found.status, || check_found(mech, &pose, residual));
    let [poses, residuals, counts] = block::fields();
    rows.set_status(i, status);
    if !matches!(status, Status::NotConverged | Status::InvalidInput) {
        rows.set(poses, i, 0, &pose.matrix());
        rows.set(residuals, i, 0, &[residual]);
    }
    rows.set(counts, i, 0, &[f64::from(iterations)]);
    status
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
    let found = block::each(n, |i| modes::assembly_modes(mech, start, &actuated_values(mech, lengths, i)));
    let all: Vec<&modes::Mode> = found.iter().flat_map(|f| &f.modes).collect();
    let [sign, above, multiplicity, residual] =
        ["determinant_sign", "above", "multiplicity", "residual"].map(|name| (name, vec![]));
    let fields = [("pose", vec![4, 4]), sign, above, multiplicity, residual];
    let [poses, sign, above, multiplicity, residual] = block::fields();
    let table = block::one_by_one(all.len(), fields, Pieces::QUICK, |rows, i| {
        let mode = all[i];
        rows.set(poses, i, 0, &mode.pose.matrix());
        rows.set(sign, i, 0, &[if mode.singular { 0.0 } else { mode.sign }]);
        rows.set(above, i, 0, &[f64::from(u8::from(mode.above))]);
        rows.set(multiplicity, i, 0, &[f64::from(mode.multiplicity)]);
        rows.set(residual, i, 0, &[mode.residual]);
        let status = if mode.singular { Status::Singular } else { Status::Ok };
        then(status, || check_found(mech, &mode.pose, mode.residual))
    });
    let counts = found.iter().map(|f| f.modes.len()).collect();
    AllModes { modes: table, counts, status: found.iter().map(|f| f.status).collect() }
}
