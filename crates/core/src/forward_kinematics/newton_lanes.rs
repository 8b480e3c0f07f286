//! Forward kinematics of several states side by side, one in each lane:
//! [`forward`](crate::forward_kinematics::newton) as far as one piece of the path is enough. The other states
//! are masked out and left to it.

use crate::forward_kinematics::newton::{
    CONTRACTION, FOLD_PIVOTS, FoundPose, LONGEST_STEP, LegTarget, PIECE_STEPS, ROUNDING, SMALL_STEP, System,
    are_coordinates, asked, error, forward_kinematics, polish, step_of, system,
};
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::number::slices::pairs;
use crate::numerics::gauss::{Solved, solve};
use crate::spatial::Pose;
use crate::spatial::packed_poses::{Poses, get, load, put, store};

/// Coordinates of the actuated legs, and a guess.
pub type Guessed = (Vec<f64>, Pose<f64>);

/// [`forward_kinematics`](crate::forward_kinematics::newton::forward_kinematics) of at most [`WIDTH`] states,
/// each as if it were alone.
///
/// # Panics
/// If there are more.
#[must_use]
pub fn forward_kinematics_of(mech: &Mechanism, states: &[Guessed]) -> Vec<FoundPose> {
    let (mut poses, mut to) = ([[0.0; WIDTH]; 12], [[0.0; WIDTH]; 6]);
    for (k, (lengths, guess)) in states.iter().enumerate() {
        put(&mut poses, k, guess);
        put_numbers(mech, &mut to, k, lengths);
    }
    let mut lanes: Vec<Lane> = states.iter().map(|(lengths, _)| Lane::new(mech, lengths)).collect();
    let mut at = Newtons::default();
    while lanes.iter().any(Lane::is_under_way) {
        lanes::dispatch(Evaluation { mech, poses: &poses, numbers: &to, result: &mut at });
        for (k, lane) in lanes.iter_mut().enumerate().filter(|(_, lane)| lane.is_under_way()) {
            if lane.judge(&at, k) {
                for (row, next) in pairs(&mut poses, &at.next) {
                    row[k] = next[k];
                }
            }
        }
    }
    let mut errors = [0.0; WIDTH];
    lanes::dispatch(Errors { mech, poses: &poses, numbers: &to, result: &mut errors });
    let lanes = lanes.iter().zip(states).enumerate();
    let found = |(k, (lane, (lengths, guess))): (usize, (&Lane, &Guessed))| {
        lane.found(mech, lengths, guess, &get(&poses, k), errors[k])
    };
    lanes.map(found).collect()
}

/// The errors of poses side by side.
struct Errors<'a> {
    mech: &'a Mechanism,
    poses: &'a Poses,
    numbers: &'a [Row; 6],
    result: &'a mut Row,
}

impl Task for Errors<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut k = 0;
        while k < WIDTH {
            let asked = load_asked(self.mech, self.numbers, k);
            error::<V>(self.mech, &asked, &load(self.poses, k)).store(&mut self.result[k..]);
            k += V::WIDTH;
        }
    }
}

/// How far one state has come.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// On its way along the one piece.
    Going,
    /// At its end: what is left must be rounding.
    Arrived,
    Solved(Status),
    /// At its end, but for rounding.
    Rounding,
    /// One piece is not enough.
    Left,
}

/// A piece of a path, or one in each lane, made in Newton steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<V> {
    steps: V,
    /// Size of the last step.
    last: V,
    /// Sign of the determinant at its beginning.
    sign: V,
}

/// State of a piece of the path, as numbers: going on, arrived, or left as too long, because it contracts too
/// little or changes the sign of the determinant.
pub(crate) const GOING: f64 = 0.0;
pub(crate) const ARRIVED: f64 = 1.0;
pub(crate) const LEFT: f64 = 2.0;

/// Numbers of a piece in each lane.
pub(crate) type Pieces = [Row; 3];

/// Those of one that has not begun.
pub(crate) const BEGINNING: [f64; 3] = [0.0, f64::INFINITY, 0.0];

impl<V: Lanes> Piece<V> {
    #[inline(always)]
    pub(crate) fn load(pieces: &Pieces, k: usize) -> Self {
        let [steps, last, sign] = pieces;
        Piece { steps: V::load(&steps[k..]), last: V::load(&last[k..]), sign: V::load(&sign[k..]) }
    }

    #[inline(always)]
    pub(crate) fn store(self, pieces: &mut Pieces, k: usize) {
        let [steps, last, sign] = pieces;
        self.steps.store(&mut steps[k..]);
        self.last.store(&mut last[k..]);
        self.sign.store(&mut sign[k..]);
    }

    /// State of the piece after a Newton step, judged by its size and by the sign of the determinant before
    /// it, and the lanes in which the step is to be made; as
    /// [`continuation`](crate::forward_kinematics::newton::continuation) does.
    #[inline(always)]
    pub(crate) fn judge(&mut self, size: V, sign: V) -> (V, V::Mask) {
        let (no, yes) = (V::zero(), V::one());
        self.sign = V::select(self.steps.greater(no), self.sign, sign);
        self.steps = self.steps + yes;
        let same = V::select((sign * self.sign).greater(no), yes, no);
        let longest = self.last.scale(CONTRACTION).least(V::lit(LONGEST_STEP));
        let contracts = V::select(size.at_most(longest), same, no);
        let small = V::select(size.at_most(V::lit(SMALL_STEP)), same, no);
        let goes_on = V::select(V::lit(f64::from(PIECE_STEPS)).greater(self.steps), contracts, no);
        self.last = size;
        let course = V::select(goes_on.greater(no), V::lit(GOING), V::lit(LEFT));
        (V::select(small.greater(no), V::lit(ARRIVED), course), contracts.greater(no))
    }
}

#[derive(Clone, Copy, Debug)]
struct Lane {
    stage: Stage,
    piece: Piece<f64>,
}

impl Lane {
    fn new(mech: &Mechanism, lengths: &[f64]) -> Self {
        let valid = are_coordinates(mech, lengths);
        let [steps, last, sign] = BEGINNING;
        Lane { stage: if valid { Stage::Going } else { Stage::Left }, piece: Piece { steps, last, sign } }
    }

    fn is_under_way(&self) -> bool {
        matches!(self.stage, Stage::Going | Stage::Arrived)
    }

    /// Sets the stage by a Newton step at the present pose; whether the step is to be made. In the order of
    /// [`continuation`](crate::forward_kinematics::newton::continuation) and [`polish`].
    fn judge(&mut self, at: &Newtons, k: usize) -> bool {
        if self.stage == Stage::Arrived {
            self.piece.sign = at.sign[k];
            self.stage = match (at.residual[k] <= ROUNDING, at.pivots[k] > FOLD_PIVOTS) {
                (false, _) => Stage::Rounding,
                (true, true) => Stage::Solved(Status::Ok),
                (true, false) => Stage::Solved(Status::Singular),
            };
            return false;
        }
        let (course, made) = self.piece.judge(at.size[k], at.sign[k]);
        self.stage = if course == ARRIVED {
            Stage::Arrived
        } else if course == LEFT {
            Stage::Left
        } else {
            Stage::Going
        };
        made
    }

    /// Result of a state, computed alone where it has left the others.
    fn found(
        &self,
        mech: &Mechanism,
        lengths: &[f64],
        guess: &Pose<f64>,
        pose: &Pose<f64>,
        residual: f64,
    ) -> FoundPose {
        match self.stage {
            Stage::Solved(status) => {
                let (iterations, sign) = (self.piece.steps as u32, self.piece.sign);
                FoundPose { pose: *pose, residual, iterations, sign, status }
            }
            Stage::Rounding => {
                let found = polish(mech, &asked(mech, lengths), pose);
                FoundPose { iterations: self.piece.steps as u32 + found.iterations, ..found }
            }
            Stage::Going | Stage::Arrived | Stage::Left => forward_kinematics(mech, lengths, guess),
        }
    }
}

/// A Newton step towards `F = 0`, or one in each lane, and what it is judged by.
pub(crate) struct NewtonStep<V> {
    /// The pose after it.
    pub(crate) next: Pose<V>,
    pub(crate) size: V,
    residual: V,
    pivots: V,
    pub(crate) sign: V,
}

#[inline(always)]
pub(crate) fn newton<V: Lanes>(
    mech: &Mechanism,
    pose: &Pose<V>,
    numbers: &[Row; 6],
    k: usize,
) -> NewtonStep<V> {
    let System { residual, matrix } = system(mech, pose, &load_asked(mech, numbers, k));
    let (mut rhs, mut largest, mut sum) = (residual, V::zero(), V::zero());
    // NaN if an equation's value is not finite, else zero.
    let mut unknown = V::zero();
    for f in &mut rhs {
        largest = largest.most(f.abs());
        unknown = f.mul_add(V::zero(), unknown);
        *f = -*f;
    }
    let Solved { x, pivots, sign } = solve(matrix, rhs);
    for e in x {
        sum = sum + e * e;
    }
    let next = pose.stepped(&step_of(mech, x, V::one()));
    NewtonStep { next, size: sum.sqrt(), residual: largest + unknown, pivots, sign }
}

/// What varies of the legs of a state: see [`numbers`](crate::forward_kinematics::newton::numbers).
pub(crate) fn put_numbers(mech: &Mechanism, rows: &mut [Row], k: usize, coordinates: &[f64]) {
    for ((row, (_, leg)), &q) in pairs(pairs(rows, mech.actuated()), coordinates) {
        row[k] = leg.drive.number(q);
    }
}

#[inline(always)]
pub(crate) fn load_asked<V: Lanes>(mech: &Mechanism, numbers: &[Row; 6], k: usize) -> [LegTarget<V>; 6] {
    let (mut asked, mut count) = ([LegTarget::none(); 6], 0);
    for leg in &mech.legs {
        if leg.actuated {
            asked[count] = LegTarget::of(leg, V::load(&numbers[count][k..]));
            count += 1;
        }
    }
    asked
}

/// Newton steps side by side.
#[derive(Clone, Copy, Debug, Default)]
struct Newtons {
    next: Poses,
    size: Row,
    residual: Row,
    pivots: Row,
    sign: Row,
}

struct Evaluation<'a> {
    mech: &'a Mechanism,
    poses: &'a Poses,
    numbers: &'a [Row; 6],
    result: &'a mut Newtons,
}

impl Task for Evaluation<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut k = 0;
        while k < WIDTH {
            let at = newton::<V>(self.mech, &load(self.poses, k), self.numbers, k);
            store(&at.next, &mut self.result.next, k);
            at.size.store(&mut self.result.size[k..]);
            at.residual.store(&mut self.result.residual[k..]);
            at.pivots.store(&mut self.result.pivots[k..]);
            at.sign.store(&mut self.result.sign[k..]);
            k += V::WIDTH;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common;
    use crate::kinematics::leg;
    use crate::numerics::random::Random;
    use crate::spatial::{Mat3, Vec3};

    #[test]
    fn states_side_by_side_are_those_alone() {
        let mut draw = Random(9);
        for mech in common::mechanisms().iter().filter(|m| m.actuated().count() == m.dof()) {
            let lengths = |pose: &Pose<f64>| -> Vec<f64> {
                mech.actuated().map(|(_, leg)| leg::position(leg, pose).coordinate).collect()
            };
            // Guesses from next to the solution to far off, lengths that no pose has, and invalid ones.
            let mut states: Vec<(Vec<f64>, Pose<f64>)> = common::states(mech, 25, 4)
                .iter()
                .enumerate()
                .map(|(i, state)| {
                    let off = 10.0_f64.powi(i as i32 % 5 - 5);
                    let turned =
                        Mat3::from_rotation_vector(draw.vector(Random::number) * off) * state.pose.rotation;
                    (lengths(&state.pose), Pose { rotation: turned, o: state.pose.o + Vec3::X * off })
                })
                .collect();
            states[3].0[0] *= 10.0;
            states[5].0[0] = f64::NAN;
            states[6].0[0] = -1.0;
            states[7].1.o.x = f64::NAN;
            let bits =
                |f: &FoundPose| (f.pose.matrix().map(f64::to_bits), f.residual.to_bits(), f.sign.to_bits());
            for states in states.chunks(WIDTH) {
                for (found, state) in forward_kinematics_of(mech, states).iter().zip(states) {
                    let [alone] = &forward_kinematics_of(mech, std::slice::from_ref(state))[..] else {
                        panic!("one answer")
                    };
                    assert_eq!(bits(found), bits(alone), "{}", mech.name);
                    assert_eq!((found.status, found.iterations), (alone.status, alone.iterations));
                    // Registers that fuse round otherwise than the numbers of a single state.
                    let single = forward_kinematics(mech, &state.0, &state.1);
                    assert_eq!(found.status, single.status, "{}", mech.name);
                    if found.status == Status::Ok {
                        for (a, b) in found.pose.matrix().into_iter().zip(single.pose.matrix()) {
                            assert!((a - b).abs() < 1e-9, "{}: {a} {b}", mech.name);
                        }
                    }
                }
            }
        }
    }
}
