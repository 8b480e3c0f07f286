//! Forward kinematics of many states.

use super::Table;
use super::block::{self, Codes, Pieces, Rows};
use super::checks::{actuated_values, forwards, is_rotation, joint_limits, raw_pose, then, with_legs};
use crate::forward_kinematics::assembly_modes::{self, Start};
use crate::forward_kinematics::gauss_newton;
use crate::forward_kinematics::newton::{self, FoundPose, LegTarget};
use crate::forward_kinematics::newton_lanes::{self, put_numbers};
use crate::kinematics::leg;
use crate::limits::margins::LegCache;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::number::slices::pairs;
use crate::spatial::Pose;
use crate::spatial::packed_poses::{Poses, load, put};

/// The pose for each set of lengths of all legs (those of passive legs are not read), in the assembly mode of
/// its guess: one for each state or one for all. `continued` starts each state from the last one that was
/// solved, and tells where a motion through the states has passed a singularity \[T27\].
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
        let of_lanes = if gauss_newton::serves(mech) {
            gauss_newton::forward_kinematics_of
        } else {
            newton_lanes::forward_kinematics_of
        };
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
                    let found = of_lanes(mech, &states);
                    let asked = states.iter().map(|(asked, _)| &asked[..]);
                    let checked = checks(mech, asked.zip(found.iter().map(|f| &f.pose)));
                    for ((i, found), check) in numbers.drain(..).zip(&found).zip(checked) {
                        put_found(rows, i, found, then(found.status, || block::read(check).0));
                    }
                    states.clear();
                }
            }
        });
    }
    let pieces = if continued { Pieces::WHOLE } else { Pieces::SLOW };
    block::in_pieces(n, fields, pieces, |rows, states| {
        // The last pose that was solved, and the one of the state before it.
        let (mut last, mut before, mut solved) = (None, None, false);
        for i in states {
            let Some(guess) = last.filter(|_| continued).or_else(|| guess(i)) else {
                rows.set_status(i, Status::InvalidInput);
                continue;
            };
            let values = asked(i);
            let mut found = found_near(mech, &values, &guess);
            if let (Some(last), Some(before), Status::Ok, false) =
                (last, before, found.status, gauss_newton::serves(mech))
            {
                found = newton::passed(mech, &values, &before, &last, &found).unwrap_or(found);
            }
            let status = then(found.status, || check_found(mech, &values, &found.pose));
            put_found(rows, i, &found, status);
            let unsolved = [
                Status::NotConverged,
                Status::InvalidInput,
                Status::Singular,
                Status::ModeJump,
                Status::Inconsistent,
                Status::Backwards,
            ]
            .contains(&status);
            (last, before) =
                if unsolved { (last, None) } else { (Some(found.pose), last.filter(|_| solved)) };
            solved = !unsolved;
        }
    })
}

/// The pose with these lengths that belongs to a guess.
fn found_near(mech: &Mechanism, lengths: &[f64], guess: &Pose<f64>) -> FoundPose {
    if gauss_newton::serves(mech) {
        gauss_newton::forward_kinematics(mech, lengths, guess)
    } else {
        newton::forward_kinematics(mech, lengths, guess)
    }
}

/// So many lengths at least are worth a thread of their own.
const IN_LANES: Pieces = Pieces { least: 32, unit: WIDTH };

/// Writes down what was found, with its status.
fn put_found(rows: &mut Rows<'_, 3>, i: usize, found: &FoundPose, status: Status) {
    let FoundPose { pose, residual, iterations, .. } = *found;
    let [poses, residuals, counts] = block::fields();
    rows.set_status(i, status);
    let known = !matches!(status, Status::NotConverged | Status::InvalidInput);
    if known && status != Status::Inconsistent {
        rows.set(poses, i, 0, &pose.matrix());
    }
    if known {
        rows.set(residuals, i, 0, &[residual]);
    }
    rows.set(counts, i, 0, &[f64::from(iterations)]);
}

/// Whether a pose that was found for lengths is one that the mechanism can be in, and within its limits.
fn check_found(mech: &Mechanism, asked: &[f64], pose: &Pose<f64>) -> Status {
    block::read(checks(mech, [(asked, pose)])[0]).0
}

/// Status codes of at most [`WIDTH`] lengths and poses that were found for them.
fn checks<'a>(mech: &Mechanism, found: impl IntoIterator<Item = (&'a [f64], &'a Pose<f64>)>) -> Row {
    let (mut poses, mut codes) = ([[0.0; WIDTH]; 12], [0.0; WIDTH]);
    let mut numbers = vec![[0.0; WIDTH]; mech.actuated().count()];
    for (k, (asked, pose)) in found.into_iter().enumerate() {
        put(&mut poses, k, pose);
        put_numbers(mech, &mut numbers, k, asked);
    }
    lanes::dispatch(Checks { mech, poses: &poses, numbers: &numbers, codes: &mut codes });
    codes
}

struct Checks<'a> {
    mech: &'a Mechanism,
    poses: &'a Poses,
    numbers: &'a [Row],
    codes: &'a mut Row,
}

impl Task for Checks<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let (mech, mut k) = (self.mech, 0);
        while k < WIDTH {
            let pose = load::<V>(self.poses, k);
            // At most six targets have their room here.
            let (mut few, mut many) = ([LegTarget::none(); 6], vec![]);
            let asked = if self.numbers.len() <= 6 {
                &mut few[..self.numbers.len()]
            } else {
                many.resize(self.numbers.len(), LegTarget::none());
                &mut many[..]
            };
            for ((target, row), (_, leg)) in pairs(pairs(&mut *asked, self.numbers), mech.actuated()) {
                *target = LegTarget::of(leg, V::load(&row[k..]));
            }
            check(mech, asked, &pose).store(&mut self.codes[k..]);
            k += V::WIDTH;
        }
    }
}

/// A root that a constraint has only because a leg has no frame there is none. Strokes are judged by the
/// lengths that were asked for, which the pose's own miss by its error: lengths at the very end of a stroke
/// are within it.
#[inline(always)]
fn check<V: Lanes>(mech: &Mechanism, asked: &[LegTarget<V>], pose: &Pose<V>) -> Codes<V> {
    let missed = newton::error(mech, asked, pose);
    let codes = forwards(mech, pose, with_legs(mech, pose, Codes::ok()));
    within_limits_missed(mech, pose, missed, on_branch(mech, asked, pose, codes))
}

/// The first limit of a joint that a pose breaks which may miss lengths by so much.
#[inline(always)]
fn within_limits_missed<V: Lanes>(
    mech: &Mechanism,
    pose: &Pose<V>,
    missed: V,
    mut codes: Codes<V>,
) -> Codes<V> {
    let mut seen = LegCache::default();
    for limit in joint_limits(mech) {
        let mut margin = limit.bound.margin(limit.of_joint(mech, pose, &mut seen));
        if limit.status() == Status::OutOfStroke {
            margin = margin + missed;
        }
        codes = codes.unless(V::zero().at_most(margin), limit.status());
    }
    codes
}

/// Whether the struts of all actuated sliders lean to the sides that their branches say: only then are the
/// coordinates that were asked for those of the pose \[T69\].
#[inline(always)]
fn on_branch<V: Lanes>(
    mech: &Mechanism,
    asked: &[LegTarget<V>],
    pose: &Pose<V>,
    mut codes: Codes<V>,
) -> Codes<V> {
    let mut count = 0;
    for leg in &mech.legs {
        if leg.actuated && leg.drive.moves_foot() {
            let r = asked[count].vector(leg, leg::vectors(leg, pose).1);
            let leans = leg.drive.leans(r);
            codes = codes.unless(leans.greater(V::zero()), Status::OtherBranch);
        }
        count += usize::from(leg.actuated);
    }
    codes
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

/// The lengths of all legs of a state.
fn lengths_of<'a>(mech: &Mechanism, lengths: &'a [f64], i: usize) -> &'a [f64] {
    &lengths[i * mech.legs.len()..][..mech.legs.len()]
}

#[must_use]
pub fn assembly_modes(mech: &Mechanism, start: &Start, lengths: &[f64]) -> AllModes {
    let n = lengths.len() / mech.legs.len();
    let asked = |i: usize| actuated_values(mech, lengths, i);
    let found =
        block::each(n, |i| assembly_modes::assembly_modes_of_all(mech, start, lengths_of(mech, lengths, i)));
    let all: Vec<(usize, &assembly_modes::Mode)> =
        found.iter().enumerate().flat_map(|(i, f)| f.modes.iter().map(move |mode| (i, mode))).collect();
    let [sign, above, multiplicity, residual] =
        ["determinant_sign", "above", "multiplicity", "residual"].map(|name| (name, vec![]));
    let fields = [("pose", vec![4, 4]), sign, above, multiplicity, residual];
    let [poses, sign, above, multiplicity, residual] = block::fields();
    let table = block::one_by_one(all.len(), fields, Pieces::QUICK, |rows, i| {
        let (set, mode) = all[i];
        rows.set(poses, i, 0, &mode.pose.matrix());
        rows.set(sign, i, 0, &[if mode.singular { 0.0 } else { mode.sign }]);
        rows.set(above, i, 0, &[f64::from(u8::from(mode.above))]);
        rows.set(multiplicity, i, 0, &[f64::from(mode.multiplicity)]);
        rows.set(residual, i, 0, &[mode.residual]);
        let status = if mode.singular { Status::Singular } else { Status::Ok };
        then(status, || check_found(mech, &asked(set), &mode.pose))
    });
    let counts = found.iter().map(|f| f.modes.len()).collect();
    AllModes { modes: table, counts, status: found.iter().map(|f| f.status).collect() }
}
