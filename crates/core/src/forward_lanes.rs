//! Forward kinematics of several states side by side, one in each lane: what [`forward`](crate::forward) does with one,
//! where it gets by with one piece of the path. The other states are told apart by masks and left to it.

use crate::forward::{
    CONTRACTION, FOLD_PIVOTS, Found, LONGEST_STEP, PIECE_STEPS, ROUNDING, SMALL_STEP, System, error,
    forward_kinematics, polish, squares, step_of, system,
};
use crate::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::linear::{Solved, solve};
use crate::mechanism::Mechanism;
use crate::spatial::{Mat3, Pose, Vec3};
use crate::status::Status;

/// The columns of R and o of each.
type Poses = [Row; 12];

/// [`forward_kinematics`](crate::forward::forward_kinematics) of at most [`WIDTH`] states, each as if it were alone.
///
/// # Panics
/// If there are more.
#[must_use]
pub fn forward_kinematics_of(mech: &Mechanism, states: &[(Vec<f64>, Pose<f64>)]) -> Vec<Found> {
    let (mut poses, mut to) = ([[0.0; WIDTH]; 12], [[0.0; WIDTH]; 6]);
    for (k, (lengths, guess)) in states.iter().enumerate() {
        put(&mut poses, k, guess);
        for (row, square) in to.iter_mut().zip(squares(lengths)) {
            row[k] = square;
        }
    }
    let mut lanes: Vec<Lane> = states.iter().map(|(lengths, _)| Lane::new(lengths)).collect();
    let mut at = Newtons::default();
    while lanes.iter().any(Lane::is_under_way) {
        lanes::dispatch(Evaluation { mech, poses: &poses, squares: &to, result: &mut at });
        for (k, lane) in lanes.iter_mut().enumerate().filter(|(_, lane)| lane.is_under_way()) {
            if lane.judge(&at, k) {
                for (row, next) in poses.iter_mut().zip(&at.next) {
                    row[k] = next[k];
                }
            }
        }
    }
    let solved = lanes.iter().zip(states).enumerate();
    solved.map(|(k, (lane, (lengths, guess)))| lane.found(mech, lengths, guess, &get(&poses, k))).collect()
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

#[derive(Clone, Copy, Debug)]
struct Lane {
    stage: Stage,
    steps: u32,
    /// Size of the last step.
    last: f64,
    sign: f64,
}

impl Lane {
    fn new(lengths: &[f64]) -> Self {
        let valid = lengths.iter().all(|l| *l >= 0.0 && l.is_finite());
        Lane {
            stage: if valid { Stage::Going } else { Stage::Left },
            steps: 0,
            last: f64::INFINITY,
            sign: f64::NAN,
        }
    }

    fn is_under_way(&self) -> bool {
        matches!(self.stage, Stage::Going | Stage::Arrived)
    }

    /// Sets the stage by a Newton step at the present pose; whether the step is to be made. In the order of
    /// [`continuation`](crate::forward::continuation) and [`polish`].
    fn judge(&mut self, at: &Newtons, k: usize) -> bool {
        let (size, sign) = (at.size[k], at.sign[k]);
        if self.stage == Stage::Arrived {
            self.sign = sign;
            self.stage = match (at.residual[k] <= ROUNDING, at.pivots[k] > FOLD_PIVOTS) {
                (false, _) => Stage::Rounding,
                (true, true) => Stage::Solved(Status::Ok),
                (true, false) => Stage::Solved(Status::Singular),
            };
            return false;
        }
        if self.steps == 0 {
            self.sign = sign;
        }
        self.steps += 1;
        let contracts = sign == self.sign && size <= LONGEST_STEP && size <= CONTRACTION * self.last;
        self.last = size;
        if size <= SMALL_STEP && sign == self.sign {
            self.stage = Stage::Arrived;
        } else if !contracts || self.steps == PIECE_STEPS {
            self.stage = Stage::Left;
        }
        contracts
    }

    /// What it has come to, by way of one state alone where it has left the others.
    fn found(&self, mech: &Mechanism, lengths: &[f64], guess: &Pose<f64>, pose: &Pose<f64>) -> Found {
        let squares = squares(lengths);
        match self.stage {
            Stage::Solved(status) => {
                let residual = error(mech, &squares, pose);
                Found { pose: *pose, residual, iterations: self.steps, sign: self.sign, status }
            }
            Stage::Rounding => {
                let found = polish(mech, &squares, pose);
                Found { iterations: self.steps + found.iterations, ..found }
            }
            Stage::Going | Stage::Arrived | Stage::Left => forward_kinematics(mech, lengths, guess),
        }
    }
}

/// Newton steps towards `F = 0` and what they are judged by.
#[derive(Clone, Copy, Debug, Default)]
struct Newtons {
    /// The poses after the steps.
    next: Poses,
    size: Row,
    residual: Row,
    pivots: Row,
    sign: Row,
}

struct Evaluation<'a> {
    mech: &'a Mechanism,
    poses: &'a Poses,
    squares: &'a [Row; 6],
    result: &'a mut Newtons,
}

impl Task for Evaluation<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut k = 0;
        while k < WIDTH {
            let pose: Pose<V> = load(self.poses, k);
            let mut squares = [V::zero(); 6];
            for i in 0..6 {
                squares[i] = V::load(&self.squares[i][k..]);
            }
            let System { residual, matrix } = system(self.mech, &pose, &squares);
            let (mut rhs, mut largest, mut sum) = (residual, V::zero(), V::zero());
            for f in &mut rhs {
                largest = largest.most(f.abs());
                *f = -*f;
            }
            let Solved { x, pivots, sign } = solve(matrix, rhs);
            for e in x {
                sum = sum + e * e;
            }
            store(&pose.stepped(&step_of(self.mech, x, V::one())), &mut self.result.next, k);
            sum.sqrt().store(&mut self.result.size[k..]);
            largest.store(&mut self.result.residual[k..]);
            pivots.store(&mut self.result.pivots[k..]);
            sign.store(&mut self.result.sign[k..]);
            k += V::WIDTH;
        }
    }
}

#[inline(always)]
fn load<V: Lanes>(poses: &Poses, k: usize) -> Pose<V> {
    let mut columns = [Vec3::<V>::zero(); 4];
    for i in 0..4 {
        let [x, y, z] = [&poses[3 * i], &poses[3 * i + 1], &poses[3 * i + 2]];
        columns[i] = Vec3::new(V::load(&x[k..]), V::load(&y[k..]), V::load(&z[k..]));
    }
    let [x, y, z, o] = columns;
    Pose { rotation: Mat3::from_columns(x, y, z), o }
}

#[inline(always)]
fn store<V: Lanes>(pose: &Pose<V>, poses: &mut Poses, k: usize) {
    let [x, y, z] = pose.rotation.0;
    let columns = [x, y, z, pose.o];
    for i in 0..4 {
        columns[i].x.store(&mut poses[3 * i][k..]);
        columns[i].y.store(&mut poses[3 * i + 1][k..]);
        columns[i].z.store(&mut poses[3 * i + 2][k..]);
    }
}

fn get(poses: &Poses, k: usize) -> Pose<f64> {
    let column = |i: usize| Vec3::new(poses[3 * i][k], poses[3 * i + 1][k], poses[3 * i + 2][k]);
    Pose { rotation: Mat3::from_columns(column(0), column(1), column(2)), o: column(3) }
}

fn put(poses: &mut Poses, k: usize, pose: &Pose<f64>) {
    let columns = pose.rotation.0.into_iter().chain([pose.o]);
    for (row, x) in poses.iter_mut().zip(columns.flat_map(Vec3::array)) {
        row[k] = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common;
    use crate::draw::Draw;
    use crate::leg;

    #[test]
    fn states_side_by_side_are_those_alone() {
        let mut draw = Draw(9);
        for mech in common::mechanisms().iter().filter(|m| m.actuated().count() == m.dof()) {
            let lengths = |pose: &Pose<f64>| -> Vec<f64> {
                mech.actuated().map(|(_, leg)| leg::position(leg, pose).length).collect()
            };
            // Guesses from next to the solution to far off, lengths that no pose has, and invalid ones.
            let mut states: Vec<(Vec<f64>, Pose<f64>)> = common::states(mech, 25, 4)
                .iter()
                .enumerate()
                .map(|(i, state)| {
                    let off = 10.0_f64.powi(i as i32 % 5 - 5);
                    let turned =
                        Mat3::from_rotation_vector(draw.vector(Draw::number) * off) * state.pose.rotation;
                    (lengths(&state.pose), Pose { rotation: turned, o: state.pose.o + Vec3::X * off })
                })
                .collect();
            states[3].0[0] *= 10.0;
            states[5].0[0] = f64::NAN;
            states[6].0[0] = -1.0;
            states[7].1.o.x = f64::NAN;
            let bits =
                |f: &Found| (f.pose.matrix().map(f64::to_bits), f.residual.to_bits(), f.sign.to_bits());
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
