//! Gauss-Newton forward kinematics for over-determined mechanisms, whose lengths must be consistent \[T73\],
//! and for designs that are singular at every pose. With the rows themselves, not their products.

use nalgebra::{DMatrix, DVector};

use crate::forward_kinematics::newton::{
    FOLD_PIVOTS, FoundPose, LONGEST_STEP, LegTarget, are_coordinates, asked_of_all, error, step_of,
};
use crate::forward_kinematics::newton_lanes::{Guessed, put_numbers};
use crate::kinematics::constraint;
use crate::kinematics::leg;
use crate::kinematics::redundant_rows::RedundantRows;
use crate::kinematics::rows::{self, Row};
use crate::mobility::degrees_of_freedom::RANK_TOLERANCE;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::{self, Lanes, Task, WIDTH};
use crate::number::order::{larger, smaller};
use crate::number::slices::pairs;
use crate::numerics::svd::Svd;
use crate::spatial::motion::pure_row;
use crate::spatial::packed_poses::{Poses, load, put};
use crate::spatial::{Pose, Wrench};

/// Steps after which the iteration is given up.
const STEPS: u32 = 200;

/// Largest error of a length, relative to the characteristic length, of a pose that has the lengths: as much
/// as poses may miss their constraints by.
const AGREEMENT: f64 = 1e-6;

/// Largest residual of a constraint, as a pure number.
const KEPT: f64 = 1e-11;

/// Steps below this size are made whatever they do: the iteration contracts there, to rounding if the legs
/// agree, and if they do not to where they are missed least.
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

/// What a pose misses, in pure numbers, and the step that takes most of it off; for one state, or one in each
/// lane.
#[derive(Clone, Copy, Debug, Default)]
struct Misses<T> {
    /// The largest errors of lengths and of constraints.
    legs: T,
    others: T,
    /// What must fall: the sum of the squares of what lengths miss, and what constraints miss, not squared,
    /// so that they are kept at the cost of lengths that contradict one another.
    merit: T,
    /// (v/Λ, ω), and its size.
    step: [T; 6],
    size: T,
    /// What is left of the sum of squares, if rows stay as they are.
    left: T,
    /// Least to greatest singular value of the legs' rows on what the others allow, or a lower bound of it.
    pivots: T,
}

/// Rows of the legs from the places that are asked for (those of a slider have no branch), what lengths miss,
/// and what the other rows miss, all as pure numbers.
struct Errors<V> {
    rows: Vec<[V; 6]>,
    legs: Vec<V>,
    others: Vec<V>,
}

impl<V: Lanes> Errors<V> {
    fn new(mech: &Mechanism) -> Self {
        let (n, others) = (mech.actuated().count(), rows::others(mech).count());
        Errors { rows: vec![[V::zero(); 6]; n], legs: vec![V::zero(); n], others: vec![V::zero(); others] }
    }

    #[inline(always)]
    fn set(&mut self, mech: &Mechanism, asked: &[LegTarget<V>], pose: &Pose<V>) {
        let scale = mech.characteristic_length;
        for (k, (_, leg)) in mech.actuated().enumerate() {
            let (e, r) = leg::vectors(leg, pose);
            let r = asked[k].vector(leg, r);
            self.rows[k] = pure_row(Wrench::at(e, r.unit()), scale);
            self.legs[k] = (r.norm() - asked[k].square.sqrt()) / V::lit(scale);
        }
        for (k, row) in rows::others(mech).enumerate() {
            self.others[k] = match row {
                Row::Constraint(c) => {
                    constraint::value(c, pose).scale(constraint::length(c, scale)) / V::lit(scale)
                }
                Row::Leg(_) | Row::Idle(_) => V::zero(),
            };
        }
    }
}

impl<V: Lanes> Misses<V> {
    /// With a step that is known.
    #[inline(always)]
    fn with(errors: &Errors<V>, step: [V; 6], pivots: V) -> Self {
        let zero = V::zero();
        let mut found =
            Misses { legs: zero, others: zero, merit: zero, step, size: zero, left: zero, pivots };
        for (row, miss) in pairs(&errors.rows, &errors.legs) {
            let mut rest = *miss;
            for i in 0..6 {
                rest = row[i].mul_add(step[i], rest);
            }
            found.left = rest.mul_add(rest, found.left);
            found.merit = miss.mul_add(*miss, found.merit);
            // NaN stays: nothing is greater.
            found.legs = V::select(found.legs.greater(miss.abs()), found.legs, miss.abs());
        }
        for miss in &errors.others {
            found.merit = found.merit + miss.abs();
            found.others = V::select(found.others.greater(miss.abs()), found.others, miss.abs());
        }
        for x in step {
            found.size = x.mul_add(x, found.size);
        }
        found.size = found.size.sqrt();
        found
    }

    /// By Householder reflections, for rows that are independent.
    #[inline(always)]
    fn by_reflections(
        mech: &Mechanism,
        pose: &Pose<V>,
        errors: &Errors<V>,
        rows: &mut RedundantRows<V>,
    ) -> Self {
        rows.factor_with(mech, pose, &errors.rows);
        let step = rows.least_step(&errors.legs, &errors.others);
        Self::with(errors, step, rows.regular)
    }
}

impl Misses<f64> {
    /// By singular values, for rows of any rank.
    fn by_singular_values(mech: &Mechanism, pose: &Pose<f64>, errors: &Errors<f64>) -> Option<Self> {
        let scale = mech.characteristic_length;
        let legs = DVector::from_column_slice(&errors.legs);
        let others = DVector::from_column_slice(&errors.others);
        let of_legs = DMatrix::from_fn(legs.len(), 6, |i, j| errors.rows[i][j]);
        // First the step that the other rows require, then that of the legs within their null space; each of
        // least norm.
        let rest: Vec<[f64; 6]> = rows::others(mech).map(|row| row.pure(pose, scale)).collect();
        let held = Svd::of(&DMatrix::from_fn(others.len(), 6, |i, j| rest[i][j]))?;
        let (first, rank) = least(&held, &others);
        let allowed = held.v_t.rows(rank, 6 - rank).transpose();
        let on_allowed = Svd::of(&(&of_legs * &allowed))?;
        let (second, _) = least(&on_allowed, &(&legs + &of_legs * &first));
        let step = first + allowed * second;
        let last = on_allowed.values.len().checked_sub(1)?;
        let pivots = on_allowed.values[last] / on_allowed.values[0];
        Some(Self::with(errors, std::array::from_fn(|i| step[i]), pivots))
    }
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

/// One state on its way.
struct Search<'a> {
    mech: &'a Mechanism,
    lengths: &'a [f64],
    pose: Pose<f64>,
    at: Option<Misses<f64>>,
    share: f64,
    iterations: u32,
    /// Where it is looked at next; none once it is done.
    trial: Option<Pose<f64>>,
    /// Whether rows depend on one another on the way, so that reflections do not serve.
    dependent: bool,
}

impl<'a> Search<'a> {
    fn new(mech: &'a Mechanism, lengths: &'a [f64], guess: &Pose<f64>) -> Self {
        let trial = are_coordinates(mech, lengths).then_some(*guess);
        Search { mech, lengths, pose: *guess, at: None, share: 1.0, iterations: 0, trial, dependent: false }
    }

    /// Goes on by what is missed at the trial, if that is known.
    fn judge(&mut self, found: Option<Misses<f64>>) {
        let Some(trial) = self.trial.take() else { return };
        let found = found.filter(|found| found.size.is_finite());
        match (self.at, found) {
            (None, None) => return,
            (None, Some(found)) => self.at = Some(found),
            (Some(at), found) => {
                let near = at.size <= NEAR;
                let promised = 0.1 * self.share * larger(at.merit - at.left, 0.0);
                match found {
                    Some(found) if near || found.merit <= at.merit - promised => {
                        (self.pose, self.at) = (trial, Some(found));
                        self.share = smaller(2.0 * self.share, 1.0);
                        // Rounding shrinks no further.
                        if near && found.size >= 0.9 * at.size {
                            return;
                        }
                    }
                    _ => self.share *= 0.25,
                }
                if self.share <= SMALLEST_SHARE {
                    return;
                }
            }
        }
        let Some(at) = self.at.filter(|at| at.size > ROUNDING && self.iterations < STEPS) else { return };
        self.iterations += 1;
        self.share = smaller(self.share, LONGEST_STEP / at.size);
        self.trial = Some(self.pose.stepped(&step_of(self.mech, at.step, self.share)));
    }

    /// The result, with the largest error of a length or a constraint at its pose, m.
    fn found(&self, residual: f64) -> FoundPose {
        let (mech, pose) = (self.mech, self.pose);
        let nothing = |status| FoundPose { pose, residual: f64::NAN, iterations: 0, sign: f64::NAN, status };
        if !are_coordinates(mech, self.lengths) {
            return nothing(Status::InvalidInput);
        }
        let Some(at) = self.at else { return nothing(Status::NotConverged) };
        let met = at.legs <= AGREEMENT && at.others <= KEPT;
        let status = match (met, at.size <= NEAR) {
            (true, _) if mech.mobility.uncontrolled > 0 || !(at.pivots > FOLD_PIVOTS) => Status::Singular,
            (true, _) => Status::Ok,
            (false, true) => Status::Inconsistent,
            (false, false) => Status::NotConverged,
        };
        let sign = if mech.mobility.uncontrolled > 0 { 0.0 } else { 1.0 };
        FoundPose { pose, residual, iterations: self.iterations, sign, status }
    }
}

/// A pose near the guess with the given lengths of all actuated legs. Where the nearest one does not have
/// them, they contradict one another, and the status says so.
#[must_use]
pub fn forward_kinematics(mech: &Mechanism, lengths: &[f64], guess: &Pose<f64>) -> FoundPose {
    let state = (lengths.to_vec(), *guess);
    let [found] = &forward_kinematics_of(mech, std::slice::from_ref(&state))[..] else {
        unreachable!("one answer for one state")
    };
    *found
}

/// The same of at most [`WIDTH`] states side by side, each as if it were alone.
#[must_use]
pub fn forward_kinematics_of(mech: &Mechanism, states: &[Guessed]) -> Vec<FoundPose> {
    let mut searches: Vec<Search> =
        states.iter().map(|(lengths, guess)| Search::new(mech, lengths, guess)).collect();
    let mut numbers = vec![[1.0; WIDTH]; mech.actuated().count()];
    for (k, (lengths, _)) in states.iter().enumerate() {
        put_numbers(mech, &mut numbers, k, lengths);
    }
    // By reflections as long as rows are independent.
    if mech.mobility.uncontrolled == 0 {
        lanes::dispatch(Iteration { mech, numbers: &numbers, searches: &mut searches });
    }
    let mut poses = [[0.0; WIDTH]; 12];
    for (k, search) in searches.iter().enumerate() {
        put(&mut poses, k, &search.pose);
    }
    let mut residuals = [0.0; WIDTH];
    lanes::dispatch(Residuals { mech, poses: &poses, numbers: &numbers, result: &mut residuals });
    let alone = |((search, residual), (lengths, guess)): ((&Search, f64), &Guessed)| {
        let singular = search.dependent || mech.mobility.uncontrolled > 0;
        if singular { by_singular_values(mech, lengths, guess) } else { search.found(residual) }
    };
    searches.iter().zip(residuals).zip(states).map(alone).collect()
}

/// The same of one state for rows of any rank.
fn by_singular_values(mech: &Mechanism, lengths: &[f64], guess: &Pose<f64>) -> FoundPose {
    let asked: Vec<LegTarget<f64>> = asked_of_all(mech, lengths).collect();
    let (mut search, mut errors) = (Search::new(mech, lengths, guess), Errors::new(mech));
    while let Some(trial) = search.trial {
        errors.set(mech, &asked, &trial);
        search.judge(Misses::by_singular_values(mech, &trial, &errors));
    }
    search.found(error(mech, &asked, &search.pose))
}

/// Steps of states side by side, until all are done or their rows depend on one another.
struct Iteration<'a, 'b> {
    mech: &'a Mechanism,
    numbers: &'a [lanes::Row],
    searches: &'a mut [Search<'b>],
}

impl Task for Iteration<'_, '_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Iteration { mech, numbers, searches } = self;
        let (mut rows, mut errors) = (RedundantRows::<V>::new(mech), Errors::new(mech));
        let mut asked = vec![LegTarget::none(); numbers.len()];
        let (mut poses, mut found) = ([[0.0; WIDTH]; 12], [Misses::default(); WIDTH]);
        while searches.iter().any(|search| search.trial.is_some()) {
            for (k, search) in searches.iter().enumerate() {
                put(&mut poses, k, search.trial.as_ref().unwrap_or(&search.pose));
            }
            for k in (0..WIDTH).step_by(V::WIDTH) {
                let pose = load(&poses, k);
                set_targets(mech, numbers, k, &mut asked);
                errors.set(mech, &asked, &pose);
                put_misses(&Misses::by_reflections(mech, &pose, &errors, &mut rows), &mut found[k..]);
            }
            for (search, found) in pairs(&mut *searches, &found) {
                if search.trial.is_some() && found.pivots > RANK_TOLERANCE {
                    search.judge(Some(*found));
                } else if search.trial.is_some() {
                    (search.dependent, search.trial) = (true, None);
                }
            }
        }
    }
}

/// From numbers side by side to those of each state.
#[inline(always)]
fn put_misses<V: Lanes>(misses: &Misses<V>, found: &mut [Misses<f64>]) {
    let Misses { legs, others, merit, step, size, left, pivots } = misses;
    let numbers = [legs, others, merit, size, left, pivots];
    let mut stored = [[0.0; WIDTH]; 12];
    for i in 0..6 {
        numbers[i].store(&mut stored[i]);
        step[i].store(&mut stored[6 + i]);
    }
    for lane in 0..V::WIDTH {
        let found = &mut found[lane];
        [found.legs, found.others, found.merit] = [stored[0][lane], stored[1][lane], stored[2][lane]];
        [found.size, found.left, found.pivots] = [stored[3][lane], stored[4][lane], stored[5][lane]];
        for i in 0..6 {
            found.step[i] = stored[6 + i][lane];
        }
    }
}

/// The largest errors of poses side by side, m.
struct Residuals<'a> {
    mech: &'a Mechanism,
    poses: &'a Poses,
    numbers: &'a [lanes::Row],
    result: &'a mut lanes::Row,
}

impl Task for Residuals<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut asked = vec![LegTarget::none(); self.numbers.len()];
        for k in (0..WIDTH).step_by(V::WIDTH) {
            set_targets(self.mech, self.numbers, k, &mut asked);
            error::<V>(self.mech, &asked, &load(self.poses, k)).store(&mut self.result[k..]);
        }
    }
}

/// Targets of the legs of the states from the k-th on.
#[inline(always)]
fn set_targets<V: Lanes>(mech: &Mechanism, numbers: &[lanes::Row], k: usize, targets: &mut [LegTarget<V>]) {
    for ((target, numbers), (_, leg)) in pairs(pairs(targets, numbers), mech.actuated()) {
        *target = LegTarget::of(leg, V::load(&numbers[k..]));
    }
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

    #[test]
    fn states_side_by_side_are_those_alone() {
        for mech in [redundant(2), pentapod(6, "platform", 3)] {
            // Guesses from next to the solution to far off, lengths that no pose has, and invalid ones.
            let mut guessed: Vec<Guessed> = states(&mech, WIDTH, 4)
                .iter()
                .map(|state| {
                    let lengths = mech.actuated().map(|(_, leg)| leg::position(leg, &state.pose).length);
                    (lengths.collect(), mech.home)
                })
                .collect();
            guessed[1].0[0] *= 1.01;
            guessed[2].0[0] *= 10.0;
            guessed[3].0[0] = f64::NAN;
            guessed[4].0[0] = -1.0;
            guessed[5].1.o.x = f64::NAN;
            guessed[6].1.o.x += 0.3 * mech.characteristic_length;
            let found = forward_kinematics_of(&mech, &guessed);
            assert!(found.iter().filter(|found| found.status == Status::Ok).count() >= 2);
            for (together, (lengths, guess)) in found.iter().zip(&guessed) {
                let alone = forward_kinematics(&mech, lengths, guess);
                assert_eq!(together.pose.matrix().map(f64::to_bits), alone.pose.matrix().map(f64::to_bits));
                assert_eq!((together.status, together.iterations), (alone.status, alone.iterations));
            }
        }
    }
}
