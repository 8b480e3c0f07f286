//! Forward kinematics where lengths are not six equations with one solution nearby: legs that contradict one another unless
//! they agree \[T73\], and designs that are singular at every pose. By Gauss and Newton's method, with the rows themselves.

use nalgebra::{DMatrix, DVector};

use crate::forward_kinematics::newton::{
    Asked, FOLD_PIVOTS, Found, LONGEST_STEP, are_coordinates, asked_of_all, error, step_of,
};
use crate::kinematics::constraint;
use crate::kinematics::leg;
use crate::kinematics::redundant_rows::RedundantRows;
use crate::kinematics::rows::{self, Row};
use crate::mobility::degrees_of_freedom::RANK_TOLERANCE;
use crate::model::mechanism::{Leg, Mechanism};
use crate::model::status::Status;
use crate::numerics::svd::Svd;
use crate::spatial::motion::pure_row;
use crate::spatial::{Pose, Wrench};

/// Steps after which the iteration is given up.
const STEPS: u32 = 200;

/// Largest error of a length, relative to the characteristic length, of a pose that has the lengths: as much as poses may miss
/// their constraints by.
const AGREEMENT: f64 = 1e-6;

/// The same of a constraint.
const KEPT: f64 = 1e-11;

/// Steps below this size are made whatever they do: the iteration contracts there, to rounding if the legs agree, and if they
/// do not to where they are missed least.
const NEAR: f64 = 1e-6;

/// Size of a step that is rounding.
const ROUNDING: f64 = 1e-14;

/// Share of a step below which there is no way nearer.
const SMALLEST_SHARE: f64 = 1e-7;

/// Whether forward kinematics is sought here.
#[must_use]
pub fn serves(mech: &Mechanism) -> bool {
    mech.is_redundant() || mech.mobility.uncontrolled > 0
}

/// What a pose misses, in pure numbers, and the step that takes most of it off.
struct Misses {
    legs: Vec<f64>,
    others: Vec<f64>,
    /// (v/Λ, ω), and its size.
    step: [f64; 6],
    size: f64,
    /// What is left of the square of what lengths miss, if rows stay as they are.
    left: f64,
    /// Least to greatest singular value of the legs' rows on what the others allow, or a lower bound of it.
    pivots: f64,
}

impl Misses {
    fn at(
        mech: &Mechanism,
        asked: &[Asked<f64>],
        pose: &Pose<f64>,
        room: Option<&mut RedundantRows<f64>>,
    ) -> Option<Self> {
        let scale = mech.characteristic_length;
        // Rows and errors of the lengths from the places that are asked for: those of a slider have no branch.
        let of_leg = |((_, leg), asked): ((usize, &Leg), &Asked<f64>)| {
            let (e, r) = leg::vectors(leg, pose);
            let r = asked.vector(leg, r);
            (pure_row(Wrench::at(e, r.unit()), scale), (r.norm() - asked.square.sqrt()) / scale)
        };
        let (rows, legs): (Vec<[f64; 6]>, Vec<f64>) = mech.actuated().zip(asked).map(of_leg).unzip();
        let off = |row| match row {
            Row::Constraint(c) => constraint::value(c, pose) * constraint::length(c, scale) / scale,
            Row::Leg(_) | Row::Idle(_) => 0.0,
        };
        let others: Vec<f64> = rows::others(mech).map(off).collect();
        let regular = room.and_then(|room| by_reflections(mech, pose, &rows, [&legs, &others], room));
        let (step, pivots) = match regular {
            Some(found) => found,
            None => by_singular_values(mech, pose, &rows, [&legs, &others])?,
        };
        let missed =
            |(row, miss): (&[f64; 6], &f64)| miss + row.iter().zip(&step).map(|(a, b)| a * b).sum::<f64>();
        let left = rows.iter().zip(&legs).map(missed).map(|x| x * x).sum();
        let size = step.iter().map(|x| x * x).sum::<f64>().sqrt();
        size.is_finite().then_some(Misses { legs, others, step, size, left, pivots })
    }

    /// What must fall: the square of what lengths miss, and what constraints miss, not squared, so that they are kept at the
    /// cost of lengths that contradict one another.
    fn merit(&self) -> f64 {
        self.legs.iter().map(|x| x * x).sum::<f64>() + self.others.iter().map(|x| x.abs()).sum::<f64>()
    }
}

/// The step and the legs' regularity by Householder reflections; none where rows are as good as dependent.
fn by_reflections(
    mech: &Mechanism,
    pose: &Pose<f64>,
    rows: &[[f64; 6]],
    [legs, others]: [&[f64]; 2],
    room: &mut RedundantRows<f64>,
) -> Option<([f64; 6], f64)> {
    room.factor_with(mech, pose, rows);
    let step = room.least_step(legs, others);
    (room.regular > RANK_TOLERANCE).then_some((step, room.regular))
}

/// The same by singular values, for rows of any rank.
fn by_singular_values(
    mech: &Mechanism,
    pose: &Pose<f64>,
    rows: &[[f64; 6]],
    [legs, others]: [&[f64]; 2],
) -> Option<([f64; 6], f64)> {
    let scale = mech.characteristic_length;
    let (legs, others) = (DVector::from_column_slice(legs), DVector::from_column_slice(others));
    let of_legs = DMatrix::from_fn(rows.len(), 6, |i, j| rows[i][j]);
    // First what the others ask for, then what the legs ask for within that; each of least size.
    let rest: Vec<[f64; 6]> = rows::others(mech).map(|row| row.pure(pose, scale)).collect();
    let held = Svd::of(&DMatrix::from_fn(others.len(), 6, |i, j| rest[i][j]))?;
    let (first, rank) = least(&held, &others);
    let allowed = held.v_t.rows(rank, 6 - rank).transpose();
    let on_allowed = Svd::of(&(&of_legs * &allowed))?;
    let (second, _) = least(&on_allowed, &(&legs + &of_legs * &first));
    let step = first + allowed * second;
    let last = on_allowed.values.len().checked_sub(1)?;
    Some((std::array::from_fn(|i| step[i]), on_allowed.values[last] / on_allowed.values[0]))
}

/// The least x for which `m x = -b` in the sense of least squares, and the rank of m.
fn least(m: &Svd, b: &DVector<f64>) -> (DVector<f64>, usize) {
    let rank = m.rank(RANK_TOLERANCE);
    let mut x = DVector::zeros(m.v_t.ncols());
    for k in 0..rank {
        x -= m.v_t.row(k).transpose() * (m.u.column(k).dot(b) / m.values[k]);
    }
    (x, rank)
}

/// A pose near the guess with the given lengths of all actuated legs. Where the nearest one does not have them, they contradict
/// one another, and the status says so.
#[must_use]
pub fn forward_kinematics(mech: &Mechanism, lengths: &[f64], guess: &Pose<f64>) -> Found {
    let nothing = Found {
        pose: *guess,
        residual: f64::NAN,
        iterations: 0,
        sign: f64::NAN,
        status: Status::InvalidInput,
    };
    if !are_coordinates(mech, lengths) {
        return nothing;
    }
    let lost = Found { status: Status::NotConverged, ..nothing };
    let asked: Vec<Asked<f64>> = asked_of_all(mech, lengths).collect();
    let mut room = (mech.mobility.uncontrolled == 0).then(|| RedundantRows::new(mech));
    let Some(mut at) = Misses::at(mech, &asked, guess, room.as_mut()) else { return lost };
    let (mut pose, mut share, mut iterations) = (*guess, 1.0_f64, 0);
    while at.size > ROUNDING && iterations < STEPS {
        iterations += 1;
        share = share.min(LONGEST_STEP / at.size);
        let next = pose.stepped(&step_of(mech, at.step, share));
        let trial = Misses::at(mech, &asked, &next, room.as_mut());
        let near = at.size <= NEAR;
        let promised = 0.1 * share * (at.merit() - at.left).max(0.0);
        match trial {
            Some(trial) if near || trial.merit() <= at.merit() - promised => {
                // Rounding shrinks no further.
                let done = near && trial.size >= 0.9 * at.size;
                (pose, at, share) = (next, trial, (2.0 * share).min(1.0));
                if done {
                    break;
                }
            }
            _ => share *= 0.25,
        }
        if share <= SMALLEST_SHARE {
            break;
        }
    }
    let met = at.legs.iter().all(|x| x.abs() <= AGREEMENT) && at.others.iter().all(|x| x.abs() <= KEPT);
    let status = match (met, at.size <= NEAR) {
        (true, _) if mech.mobility.uncontrolled > 0 || !(at.pivots > FOLD_PIVOTS) => Status::Singular,
        (true, _) => Status::Ok,
        (false, true) => Status::Inconsistent,
        (false, false) => Status::NotConverged,
    };
    let sign = if mech.mobility.uncontrolled > 0 { 0.0 } else { 1.0 };
    let residual = error(mech, &asked, &pose);
    Found { pose, residual, iterations, sign, status }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{pentapod, redundant, states};

    #[test]
    fn a_pose_has_all_lengths_or_none_is_told() {
        for mech in [redundant(1), redundant(2), pentapod(6, "platform", 3)] {
            for state in states(&mech, 5, 4) {
                let mut lengths: Vec<f64> =
                    mech.actuated().map(|(_, leg)| leg::position(leg, &state.pose).length).collect();
                let found = forward_kinematics(&mech, &lengths, &mech.home);
                assert_eq!(found.status, Status::Ok, "{}", mech.name);
                assert!(found.residual < 1e-12);
                lengths[0] += 0.02 * mech.characteristic_length;
                let found = forward_kinematics(&mech, &lengths, &state.pose);
                assert_eq!(found.status, Status::Inconsistent, "{}", mech.name);
                // Constraints are kept whatever the lengths say.
                assert!(constraint::largest_distance(&mech, &found.pose) < 1e-9);
                lengths[1] = f64::NAN;
                assert_eq!(forward_kinematics(&mech, &lengths, &mech.home).status, Status::InvalidInput);
            }
        }
    }
}
