//! Forward kinematics: from leg lengths to the pose, by Newton's method on SE(3) \[T25\] \[T26\] \[T27\].
//!
//! The equations are polynomials in the pose, for any number: doubles here, complex numbers in
//! [`modes`](crate::forward_kinematics::assembly_modes), where all of their solutions are followed.

use crate::kinematics::constraint;
use crate::kinematics::idle;
use crate::kinematics::leg;
use crate::kinematics::rows::{Row, for_each_row};
use crate::model::mechanism::{Leg, Mechanism};
use crate::model::status::Status;
use crate::number::order::smaller;
use crate::number::real::{Ordered, Real};
use crate::number::slices::pairs;
use crate::numerics::gauss::solve;
use crate::spatial::{Pose, Twist, Vec3, Wrench};

/// Steps after which the iteration is given up.
const NEWTON_STEPS: u32 = 200;

/// Step, relative to the characteristic length, from which the next one is rounding: Newton's method is
/// quadratic.
pub(crate) const SMALL_STEP: f64 = 1e-9;

/// Residual, as a pure number, that is rounding of zero.
pub(crate) const ROUNDING: f64 = 2e-14;

/// How much each Newton step must be smaller than the one before. A quarter is what the theorem of Newton and
/// Kantorovich asks for: the solution is then the only one around, and the one that belongs to the guess.
pub(crate) const CONTRACTION: f64 = 0.25;

/// Newton steps for one piece of the path: with that contraction no more are needed from half a radian to
/// rounding.
pub(crate) const PIECE_STEPS: u32 = 12;

/// Shortest piece of the path: where shorter ones would be needed, its assembly mode ends.
const SHORTEST_PIECE: f64 = 1e-6;

/// Largest residual, as a pure number, that still counts as rounding after convergence.
const MOST_ROUNDING: f64 = 2e-12;

/// Longest Newton step: half a radian, or half a characteristic length.
pub(crate) const LONGEST_STEP: f64 = 0.5;

/// Share of a Newton step below which there is no way nearer to a solution.
const SMALLEST_SHARE: f64 = 1e-7;

/// How much nearer to where a motion points the one of two solutions must be to be the one that it goes to.
const CLEARLY: f64 = 0.25;

/// Pivot ratio of the equations below which two assembly modes meet: the pose is then only known to the
/// square root of rounding.
pub const FOLD_PIVOTS: f64 = 1e-5;

/// Target of an actuated leg: the position of its foot on the rail (zero for a telescopic leg, whose foot is
/// B), and the squared distance from there to b \[T25\] \[T69\].
#[derive(Clone, Copy, Debug)]
pub struct LegTarget<T> {
    pub place: T,
    pub square: T,
}

impl<T: Real> LegTarget<T> {
    /// From the one number that varies: the squared length of a telescopic leg, the place of a carriage.
    #[inline(always)]
    pub fn of(leg: &Leg, number: T) -> Self {
        let (place, square) = leg.drive.asked(number);
        LegTarget { place, square }
    }

    /// Nothing.
    #[inline(always)]
    pub fn none() -> Self {
        LegTarget { place: T::zero(), square: T::zero() }
    }

    /// r from the given foot, from r of B.
    #[inline(always)]
    pub fn vector(&self, leg: &Leg, r: Vec3<T>) -> Vec3<T> {
        leg.drive.vector(r, self.place)
    }

    /// The rate of `(ℓ² - r·r)/2` when what is asked for changes; r as above.
    #[inline(always)]
    pub fn change(leg: &Leg, r: Vec3<T>, rate: &LegTarget<T>) -> T {
        leg.drive.asked_rate(r, rate.place, rate.square)
    }
}

/// The equations at a pose, pure numbers: `(r·r - ℓ²)/2Λ²` of the actuated legs and g of the independent
/// constraints \[T25\]. The matrix is their derivative by (v/Λ, ω).
#[derive(Clone, Copy, Debug)]
pub struct System<T> {
    pub residual: [T; 6],
    pub matrix: [[T; 6]; 6],
}

#[inline(always)]
pub fn system<T: Real>(mech: &Mechanism, pose: &Pose<T>, asked: &[LegTarget<T>; 6]) -> System<T> {
    let scale = mech.characteristic_length;
    let mut system = System { residual: [T::zero(); 6], matrix: [[T::zero(); 6]; 6] };
    for_each_row!(mech, |k, row| {
        let (value, row, unit) = match row {
            Row::Leg(leg) => {
                let (e, r) = leg::vectors(leg, pose);
                let r = asked[k].vector(leg, r);
                let value = (r.dot(r) - asked[k].square).scale(0.5);
                (value, Wrench::at(e, r), scale * scale)
            }
            // No step spins \[T71\].
            Row::Idle(idle) => (T::zero(), idle::row(idle, pose), 1.0),
            Row::Constraint(c) => {
                (constraint::value(c, pose), constraint::row(c, pose), constraint::unit(c, scale))
            }
        };
        system.put(k, scale, value, row, unit);
    });
    system
}

impl<T: Real> System<T> {
    /// Sets an equation, made a pure number by dividing it by `unit`.
    #[inline(always)]
    fn put(&mut self, i: usize, scale: f64, value: T, row: Wrench<T>, unit: f64) {
        let unit = 1.0 / unit;
        let (a, b) = (row.force.scale(unit * scale), row.torque.scale(unit));
        self.residual[i] = value.scale(unit);
        self.matrix[i] = [a.x, a.y, a.z, b.x, b.y, b.z];
    }
}

/// Varying number of each actuated leg, in the order of the equations: its squared length, or the position of
/// its carriage.
#[must_use]
pub fn numbers(mech: &Mechanism, coordinates: &[f64]) -> [f64; 6] {
    let mut numbers = [0.0; 6];
    for ((number, (_, leg)), &q) in pairs(pairs(&mut numbers, mech.actuated()), coordinates) {
        *number = leg.drive.number(q);
    }
    numbers
}

/// Targets of the actuated legs, at most six.
#[must_use]
pub fn asked(mech: &Mechanism, coordinates: &[f64]) -> [LegTarget<f64>; 6] {
    let mut asked = [LegTarget::none(); 6];
    for (asked, of_leg) in pairs(&mut asked, asked_of_all(mech, coordinates)) {
        *asked = of_leg;
    }
    asked
}

/// Targets of the actuated legs, however many they are.
pub fn asked_of_all(mech: &Mechanism, coordinates: &[f64]) -> impl Iterator<Item = LegTarget<f64>> {
    pairs(mech.actuated(), coordinates).map(|((_, leg), &q)| LegTarget::of(leg, leg.drive.number(q)))
}

/// Whether actuated legs can have these coordinates: numbers, and lengths none below zero.
#[must_use]
pub fn are_coordinates(mech: &Mechanism, coordinates: &[f64]) -> bool {
    pairs(mech.actuated(), coordinates).all(|((_, leg), q)| *q >= leg.drive.kind().least && q.is_finite())
}

/// A solution (v/Λ, ω) of the system as a step of the pose.
#[inline(always)]
pub fn step_of<T: Real>(mech: &Mechanism, x: [T; 6], share: T) -> Twist<T> {
    let Twist { v, omega } = Twist::from_array(x);
    Twist::new(v * share * T::lit(mech.characteristic_length), omega * share)
}

/// A Newton step from a pose towards `F = to`, and what it is judged by.
#[derive(Clone, Copy, Debug)]
struct NewtonStep {
    step: [f64; 6],
    size: f64,
    residual: f64,
    pivots: f64,
    /// Sign of the determinant: it changes where an assembly mode ends.
    sign: f64,
}

#[inline(always)]
fn newton(mech: &Mechanism, pose: &Pose<f64>, asked: &[LegTarget<f64>; 6], to: &[f64; 6]) -> NewtonStep {
    let System { mut residual, matrix } = system(mech, pose, asked);
    let mut rhs = [0.0; 6];
    for i in 0..6 {
        residual[i] -= to[i];
        rhs[i] = -residual[i];
    }
    let solved = solve(matrix, rhs);
    NewtonStep {
        step: solved.x,
        size: size(&solved.x),
        residual: residual.iter().fold(0.0, |m, f| if f.abs() > m || f.is_nan() { f.abs() } else { m }),
        pivots: solved.pivots,
        sign: solved.sign,
    }
}

/// The size of a solution (v/Λ, ω) of the system.
#[inline(always)]
pub(crate) fn size(x: &[f64; 6]) -> f64 {
    x.iter().map(|e| e * e).sum::<f64>().sqrt()
}

/// Result of an iteration.
#[derive(Clone, Copy, Debug)]
pub struct FoundPose {
    pub pose: Pose<f64>,
    /// The largest error of a length or of a constraint, m.
    pub residual: f64,
    pub iterations: u32,
    /// Sign of det J at the pose.
    pub sign: f64,
    pub status: Status,
}

/// The pose with the given lengths of the actuated legs, in the assembly mode of the guess \[T26\], \[T27\].
///
/// Where the mode ends in a singularity on the way, the nearest other solution is sought and reported as one
/// of another mode.
#[must_use]
pub fn forward_kinematics(mech: &Mechanism, lengths: &[f64], guess: &Pose<f64>) -> FoundPose {
    let asked = asked(mech, lengths);
    if !are_coordinates(mech, lengths) {
        let nan = f64::NAN;
        return FoundPose {
            pose: *guess,
            residual: nan,
            iterations: 0,
            sign: nan,
            status: Status::InvalidInput,
        };
    }
    let (continued, steps) = continuation(mech, &asked, guess, SHORTEST_PIECE);
    if let Some(pose) = continued {
        let found = polish(mech, &asked, &pose);
        return FoundPose { iterations: steps + found.iterations, ..found };
    }
    let other = polish(mech, &asked, guess);
    let status = if other.status == Status::Ok { Status::ModeJump } else { other.status };
    FoundPose { iterations: steps + other.iterations, status, ..other }
}

/// The solution that a motion through the poses `before` and `last` leads to if it goes on evenly, where this
/// is one of another mode than the one that was `found`, and clearly the nearer to where the motion points:
/// then the motion has passed a singularity between the states, which the lengths alone do not show \[T27\].
#[must_use]
pub fn passed(
    mech: &Mechanism,
    lengths: &[f64],
    before: &Pose<f64>,
    last: &Pose<f64>,
    found: &FoundPose,
) -> Option<FoundPose> {
    let asked = asked(mech, lengths);
    let turn = last.rotation * before.rotation.transpose();
    let ahead = Pose { rotation: turn * last.rotation, o: last.o + last.o - before.o };
    if newton(mech, &ahead, &asked, &[0.0; 6]).sign == found.sign {
        return None;
    }
    let (pose, steps) = continuation(mech, &asked, &ahead, SHORTEST_PIECE);
    let other = polish(mech, &asked, &pose?);
    let from_ahead = |pose: &Pose<f64>| {
        let turned = (ahead.rotation.transpose() * pose.rotation).rotation_vector().norm();
        turned.hypot((pose.o - ahead.o).norm() / mech.characteristic_length)
    };
    let nearer = from_ahead(&other.pose) < CLEARLY * from_ahead(&found.pose);
    (other.status == Status::Ok && nearer).then_some(FoundPose {
        iterations: found.iterations + steps + other.iterations,
        status: Status::ModeJump,
        ..other
    })
}

/// Follows the solutions of `F = (1 - t) F(guess)` from the guess at t = 0 to t = 1 by Newton's method, in
/// one piece if it contracts, else in as many as it takes \[T27\]. None where the determinant would change
/// its sign or pieces shorter than `shortest` be needed: a singularity lies on the path. Tells the number of
/// Newton steps.
#[must_use]
pub fn continuation(
    mech: &Mechanism,
    asked: &[LegTarget<f64>; 6],
    guess: &Pose<f64>,
    shortest: f64,
) -> (Option<Pose<f64>>, u32) {
    let System { residual: errors, matrix } = system(mech, guess, asked);
    let sign = solve(matrix, errors).sign;
    let (mut pose, mut t, mut piece, mut steps) = (*guess, 0.0, 1.0_f64, 0);
    while t < 1.0 {
        piece = smaller(piece, 1.0 - t);
        let rest = errors.map(|e| (1.0 - t - piece) * e);
        let (mut trial, mut last, mut arrived) = (pose, f64::INFINITY, false);
        for _ in 0..PIECE_STEPS {
            let at = newton(mech, &trial, asked, &rest);
            steps += 1;
            if at.sign != sign || !(at.size <= LONGEST_STEP && at.size <= CONTRACTION * last) {
                // Steps of the size of rounding contract no more.
                arrived = at.size <= SMALL_STEP && at.sign == sign;
                break;
            }
            trial = trial.stepped(&step_of(mech, at.step, 1.0));
            last = at.size;
            if at.size <= SMALL_STEP {
                arrived = true;
                break;
            }
        }
        if arrived {
            (pose, t, piece) = (trial, t + piece, 2.0 * piece);
        } else {
            piece *= 0.5;
            if piece < shortest {
                return (None, steps);
            }
        }
    }
    (Some(pose), steps)
}

/// A solution near a pose, whatever its mode, by Newton steps that are shortened until they come nearer
/// \[T26\].
#[must_use]
pub fn polish(mech: &Mechanism, asked: &[LegTarget<f64>; 6], guess: &Pose<f64>) -> FoundPose {
    let mut pose = *guess;
    let mut at = newton(mech, &pose, asked, &[0.0; 6]);
    let (mut share, mut iterations) = (1.0_f64, 0);
    while !(at.residual <= ROUNDING) && iterations < NEWTON_STEPS {
        share = smaller(share, LONGEST_STEP / at.size);
        let trial_pose = pose.stepped(&step_of(mech, at.step, share));
        let trial = newton(mech, &trial_pose, asked, &[0.0; 6]);
        iterations += 1;
        // The last step of a quadratic iteration ends in rounding, whatever it does to the residual.
        let last = at.size <= SMALL_STEP && trial.residual <= MOST_ROUNDING;
        if last || trial.residual <= (1.0 - 0.1 * share) * at.residual {
            (pose, at, share) = (trial_pose, trial, smaller(2.0 * share, 1.0));
        } else {
            share *= 0.25;
        }
        if last || !(share > SMALLEST_SHARE) {
            break;
        }
    }
    let status = if !(at.residual <= MOST_ROUNDING) {
        Status::NotConverged
    } else if at.pivots > FOLD_PIVOTS {
        Status::Ok
    } else {
        Status::Singular
    };
    FoundPose { pose, residual: error(mech, asked, &pose), iterations, sign: at.sign, status }
}

/// The largest error of a length or of a constraint, m; NaN where one is not known.
#[inline(always)]
#[must_use]
pub fn error<V: Ordered>(mech: &Mechanism, asked: &[LegTarget<V>], pose: &Pose<V>) -> V {
    let (mut largest, mut unknown, mut count) = (V::zero(), V::zero(), 0);
    for leg in &mech.legs {
        if leg.actuated {
            let r = asked[count].vector(leg, leg::vectors(leg, pose).1);
            let e = (r.norm() - asked[count].square.sqrt()).abs();
            (largest, unknown, count) = (largest.most(e), unknown + e * V::zero(), count + 1);
        }
    }
    for c in &mech.independent {
        let e = constraint::distance(c, pose, mech.characteristic_length);
        (largest, unknown) = (largest.most(e), unknown + e * V::zero());
    }
    largest + unknown
}
