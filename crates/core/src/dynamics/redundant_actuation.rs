//! Mechanisms with more actuated legs than it takes: the Jacobian has more rows than columns \[T72\]-\[T74\].
//!
//! All is solved by singular values of the rows themselves; products of rows, which would square their condition number,
//! are never formed. One state at a time.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::derivatives::{self, Coordinates, DIRECTIONS, Varied};
use crate::dynamics::inverse_dynamics::{load_in_base, own_wrench, resultant};
use crate::kinematics::constraint;
use crate::kinematics::leg;
use crate::kinematics::quadratic_forms::quadratic;
use crate::kinematics::rows::{self, Row, all_hessians, pure_rows};
use crate::mobility::degrees_of_freedom;
use crate::model::mechanism::Mechanism;
use crate::model::spec::Axes;
use crate::number::real::Dual;
use crate::numerics::svd::Svd;
use crate::spatial::{Motion, Pose, Twist, Vec3, Wrench};

/// Least to greatest singular value of the rows below which forces and velocities are not determined.
const SINGULAR: f64 = 1e-12;

/// Largest part of the rates (or accelerations) of legs that may contradict the rest: as much as a twist may miss a
/// constraint by.
const CONTRADICTION: f64 = 1e-6;

/// J at a pose, taken apart: the rows of the legs on the twists that all others allow.
#[derive(Clone, Debug)]
pub(crate) struct Parted {
    scale: f64,
    /// What makes a multiplier of a pure row one of the row.
    units: Vec<f64>,
    /// Rows of the legs in pure numbers.
    legs: DMatrix<f64>,
    /// All other rows, and their singular values.
    rest: DMatrix<f64>,
    others: Svd,
    /// Allowed twists (v, Λω), one a column.
    allowed: DMatrix<f64>,
    on_allowed: Svd,
    pub regular: bool,
}

/// Solution of the balance of a [`Parted`] Jacobian.
#[derive(Clone, Debug)]
pub(crate) struct Balanced {
    /// Of the actuated legs.
    pub forces: Vec<f64>,
    /// Of idle freedoms, then of constraints.
    pub multipliers: Vec<f64>,
    /// y: the legs' forces are their preferred ones and the rates that it gives them.
    pub motion: Twist<f64>,
}

impl Parted {
    /// None where a row is not known.
    pub(crate) fn at(mech: &Mechanism, pose: &Pose<f64>) -> Option<Self> {
        let scale = mech.characteristic_length;
        let rows = pure_rows(mech, pose, scale);
        let n = mech.actuated().count();
        let unit = |row| match row {
            Row::Constraint(c) => constraint::length(c, scale),
            Row::Leg(_) | Row::Idle(_) => scale,
        };
        Self::of(&rows, n, rows::others(mech).map(unit).collect(), scale)
    }

    /// The same of the given rows, the first `n` of them those of legs.
    fn of(rows: &[[f64; 6]], n: usize, units: Vec<f64>, scale: f64) -> Option<Self> {
        let held = rows.len() - n;
        let legs = DMatrix::from_fn(n, 6, |i, j| rows[i][j]);
        let rest = DMatrix::from_fn(held, 6, |i, j| rows[n + i][j]);
        let others = Svd::of(&rest)?;
        let allowed = others.v_t.rows(held, 6 - held).transpose();
        let on_allowed = Svd::of(&(&legs * &allowed))?;
        let whole = |svd: &Svd, rank: usize| rank == 0 || svd.values[rank - 1] > SINGULAR * svd.values[0];
        let regular = whole(&others, held) && whole(&on_allowed, 6 - held);
        Some(Parted { scale, units, legs, rest, others, allowed, on_allowed, regular })
    }

    /// Solves, with the rows `A` of the legs and `C` of all others, `f - A y = preferred`, `Aᵀ f + Cᵀ λ = w`, `C y = rates`:
    /// the forces nearest to the preferred ones that balance -w \[T72\]. All in SI.
    pub(crate) fn solve(&self, preferred: &[f64], w: Wrench<f64>, rates: &[f64]) -> Balanced {
        let (n, held) = (self.legs.nrows(), self.units.len());
        let pure = Wrench::new(w.force, w.torque * (1.0 / self.scale)).array();
        let w = DVector::from_column_slice(&pure);
        let preferred = DVector::from_fn(n, |i, _| preferred.get(i).copied().unwrap_or(0.0));
        // y that the others ask for, of least size.
        let rates = DVector::from_fn(held, |k, _| rates.get(k).map_or(0.0, |rate| rate * self.units[k]));
        let mut y = DVector::zeros(6);
        for k in 0..held {
            let share = self.others.u.column(k).dot(&rates) / self.others.values[k];
            y += self.others.v_t.row(k).transpose() * share;
        }
        let wanted = preferred + &self.legs * &y;
        let onto = self.allowed.transpose() * &w;
        let Svd { values, u, v_t } = &self.on_allowed;
        // f = wanted off the reach of the allowed twists, and what balances w in it.
        let (mut forces, mut shares) = (wanted.clone(), DVector::zeros(6 - held));
        for k in 0..6 - held {
            let (balancing, there) =
                (v_t.row(k).dot(&onto.transpose()) / values[k], u.column(k).dot(&wanted));
            forces += u.column(k) * (balancing - there);
            shares += v_t.row(k).transpose() * ((balancing - there) / values[k]);
        }
        y += &self.allowed * shares;
        let rest = w - self.legs.transpose() * &forces;
        let mut multipliers = DVector::zeros(held);
        for k in 0..held {
            multipliers += self.others.u.column(k)
                * (self.others.v_t.row(k).dot(&rest.transpose()) / self.others.values[k]);
        }
        let motion =
            Twist::new(Vec3::new(y[0], y[1], y[2]), Vec3::new(y[3], y[4], y[5]) * (1.0 / self.scale));
        Balanced {
            forces: forces.iter().copied().collect(),
            multipliers: multipliers.iter().zip(&self.units).map(|(x, unit)| x * unit).collect(),
            motion,
        }
    }

    /// Twists that the constraints, not the idle freedoms, allow: orthonormal (v, Λω) as wrenches that no constraint holds.
    pub(crate) fn freedoms(&self, idle: usize) -> Vec<Wrench<f64>> {
        let held = self.units.len();
        let constraints = self.rest.rows(idle, held - idle).into_owned();
        let Some(svd) = Svd::of(&constraints) else { return vec![] };
        (held - idle..6).map(|k| Wrench::from_array(std::array::from_fn(|i| svd.v_t[(k, i)]))).collect()
    }

    /// What balances a wrench with least forces: active forces and multipliers, in the order of the rows \[T72\].
    pub(crate) fn answer(&self, w: Wrench<f64>) -> Vec<f64> {
        let Balanced { mut forces, multipliers, .. } = self.solve(&[], w * -1.0, &[]);
        forces.extend(multipliers);
        forces
    }
}

/// Active forces and multipliers that keep up a motion.
#[derive(Clone, Debug)]
pub struct Forces {
    /// Of the actuated legs.
    pub forces: Vec<f64>,
    /// Torques of idle freedoms, then multipliers of the independent constraints.
    pub multipliers: Vec<f64>,
    /// Whether they are determined; else all are NaN.
    pub regular: bool,
}

/// The active forces nearest to preferred ones (none for zero) in the sense of least squares, and the multipliers
/// [Eq. 43] \[T72\].
#[must_use]
pub fn inverse_dynamics(
    mech: &Mechanism,
    platform: &Motion<f64>,
    load: Wrench<f64>,
    preferred: &[f64],
) -> Forces {
    let parted = Parted::at(mech, &platform.pose).filter(|parted| parted.regular);
    let solved = parted.map(|parted| parted.solve(preferred, resultant(mech, platform, load) * -1.0, &[]));
    let finite = |x: &Balanced| x.forces.iter().chain(&x.multipliers).all(|x| x.is_finite());
    if let Some(Balanced { forces, multipliers, .. }) = solved.filter(finite) {
        return Forces { forces, multipliers, regular: true };
    }
    let n = mech.actuated().count();
    let (forces, multipliers) = (vec![f64::NAN; n], vec![f64::NAN; mech.rows() - n]);
    Forces { forces, multipliers, regular: false }
}

/// A motion from what legs do, as far as they agree.
#[derive(Clone, Copy, Debug)]
pub struct Followed {
    /// Twist, or acceleration, of o.
    pub motion: Twist<f64>,
    /// Whether the rows determine it, and whether the legs agree on it.
    pub regular: bool,
    pub agrees: bool,
}

/// The platform's twist from the rates of the actuated legs, in the sense of least squares \[T73\]; those of idle freedoms may
/// follow, else they do not spin.
#[must_use]
pub fn platform_twist(mech: &Mechanism, pose: &Pose<f64>, rates: &[f64]) -> Followed {
    let (legs, idle) = rates.split_at(mech.actuated().count());
    follow(mech, pose, legs, idle, norm(legs))
}

/// The platform's acceleration from those of the actuated legs \[T73\]; those of idle freedoms may follow.
#[must_use]
pub fn platform_acceleration(
    mech: &Mechanism,
    pose: &Pose<f64>,
    twist: &Twist<f64>,
    accelerations: &[f64],
) -> Followed {
    let v = twist.array();
    let drift: Vec<f64> = all_hessians(mech, pose).iter().map(|layer| quadratic(layer, &v)).collect();
    let wanted = |(i, drift): (usize, &f64)| accelerations.get(i).copied().unwrap_or(0.0) - drift;
    let rows: Vec<f64> = drift.iter().enumerate().map(wanted).collect();
    let n = mech.actuated().count();
    follow(mech, pose, &rows[..n], &rows[n..], norm(&accelerations[..n]) + norm(&drift[..n]))
}

fn follow(mech: &Mechanism, pose: &Pose<f64>, legs: &[f64], others: &[f64], size: f64) -> Followed {
    let nothing = Followed { motion: Twist::from_array([f64::NAN; 6]), regular: false, agrees: false };
    let Some(parted) = Parted::at(mech, pose).filter(|parted| parted.regular) else { return nothing };
    // f - A y = -ℓ' with AᵀF = 0: y in the sense of least squares, f what it misses.
    let asked: Vec<f64> = legs.iter().map(|x| -x).collect();
    let Balanced { forces: missed, motion, .. } = parted.solve(&asked, Wrench::zero(), others);
    Followed { motion, regular: true, agrees: norm(&missed) <= CONTRADICTION * size }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The mechanism with so many of its actuated legs passive that the rest is just enough, and best conditioned at one of a few
/// generic poses; none if it is singular by design.
#[must_use]
pub fn square(mech: &Mechanism) -> Option<Mechanism> {
    let numbers: Vec<usize> = mech.actuated().map(|(k, _)| k).collect();
    let best = |pose: &Pose<f64>| -> Option<(f64, Vec<usize>)> {
        let rows = pure_rows(mech, pose, mech.characteristic_length);
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let rest = |basis: &[DVector<f64>], row: &[f64; 6]| {
            let mut rest = DVector::from_column_slice(row);
            for _ in 0..2 {
                for b in basis {
                    rest.axpy(-b.dot(&rest), b, 1.0);
                }
            }
            rest
        };
        for row in &rows[numbers.len()..] {
            basis.push(rest(&basis, row).try_normalize(SINGULAR)?);
        }
        let mut chosen: Vec<usize> = Vec::new();
        let mut least = f64::INFINITY;
        while basis.len() < 6 {
            let left =
                (0..numbers.len()).filter(|k| !chosen.contains(k)).map(|k| (k, rest(&basis, &rows[k])));
            let (k, row) = left.max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()))?;
            least = least.min(row.norm());
            basis.push(row.try_normalize(degrees_of_freedom::RANK_TOLERANCE)?);
            chosen.push(k);
        }
        Some((least, chosen))
    };
    let poses = degrees_of_freedom::generic_poses(mech);
    let (_, chosen) = poses.iter().filter_map(best).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut square = mech.clone();
    for (k, &number) in numbers.iter().enumerate() {
        square.legs[number].actuated = chosen.contains(&k);
    }
    square.limits.clear();
    Some(square)
}

/// Inverse dynamics at a state, solved, and how forces answer what balances are off by.
pub(crate) struct Solved {
    pub platform: Motion<f64>,
    /// The load as it is given, with its axes.
    pub load: (Wrench<f64>, Axes),
    pub parted: Parted,
    pub balanced: Balanced,
}

/// Active forces and multipliers, or how they change, in the order of the rows.
pub(crate) type Column = Vec<f64>;

/// Derivatives of the least active forces and of the multipliers by the motion in each direction, the other numbers kept: what
/// the three parts of the balance are off by, the forces answer \[T74\].
pub(crate) fn by_motion(mech: &Mechanism, still: &Varied, at: &Solved) -> Vec<Column> {
    let direction = |k: usize| {
        let mut step = [0.0; DIRECTIONS];
        step[k] = 1.0;
        let varied = derivatives::along(&at.platform, &step);
        let (load, axes) = at.load;
        let load = Wrench::new(load.force.with_rate(Vec3::zero()), load.torque.with_rate(Vec3::zero()));
        let own = own_wrench(mech, &varied, load_in_base(load, axes, &varied.pose));
        answered(&still.mech, at, &varied, own)
    };
    (0..DIRECTIONS).map(direction).collect()
}

/// How forces and multipliers answer what a variation does to legs and rows, and to the platform's own term.
fn answered(
    mech: &Mechanism<Dual<f64>>,
    at: &Solved,
    varied: &Motion<Dual<f64>>,
    own: Wrench<Dual<f64>>,
) -> Column {
    let Balanced { forces, multipliers, motion } = &at.balanced;
    let y = Twist::new(motion.v.with_rate(Vec3::zero()), motion.omega.with_rate(Vec3::zero()));
    let (mut sum, mut row, mut of_legs) = (own, 0, Vec::with_capacity(forces.len()));
    for (i, leg) in mech.legs.iter().enumerate() {
        sum = sum + derivatives::with_leg(mech, i, leg, varied, forces, &mut row);
        if leg.actuated {
            of_legs.push(leg::row(leg, &leg::position(leg, &varied.pose)).power(&y).d);
        }
    }
    let rows = rows::others(mech).map(|row| row.wrench(&varied.pose));
    let mut of_others = Vec::with_capacity(multipliers.len());
    for (row, multiplier) in rows.zip(multipliers) {
        sum = sum + row * Dual::new(*multiplier, 0.0);
        of_others.push(-row.power(&y).d);
    }
    let Balanced { mut forces, multipliers, .. } =
        at.parted.solve(&of_legs, derivatives::rate(sum) * -1.0, &of_others);
    forces.extend(multipliers);
    forces
}

/// Derivatives of the least active forces, of multipliers and of the lengths of all legs by a number of the geometry, the given
/// coordinates, their rates and second rates kept \[T74\].
pub(crate) fn by_geometry(
    varied: &Varied,
    at: &Solved,
    by_motion: &[Column],
    coordinates: &Coordinates<f64>,
    lengths: &mut [f64],
) -> Column {
    let still = derivatives::along(&at.platform, &[0.0; DIRECTIONS]);
    let mut column = answered(&varied.mech, at, &still, Wrench::zero());
    let step = coordinates.following_geometry(varied);
    add(&mut column, &combined(by_motion, &step));
    let moving = derivatives::along(&at.platform, &step);
    for (length, leg) in lengths.iter_mut().zip(&varied.mech.legs) {
        *length = leg::position(leg, &moving.pose).coordinate.d;
    }
    column
}

/// From the columns by motion to the derivative along a step.
pub(crate) fn combined(by_motion: &[Column], step: &[f64; DIRECTIONS]) -> Column {
    let mut sum = vec![0.0; by_motion[0].len()];
    for (column, share) in by_motion.iter().zip(step) {
        let part: Vec<f64> = column.iter().map(|x| x * share).collect();
        add(&mut sum, &part);
    }
    sum
}

fn add(sum: &mut [f64], other: &[f64]) {
    for (a, b) in sum.iter_mut().zip(other) {
        *a += b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{Draw, pentapod, redundant, states};
    use crate::kinematics::rows::all_rows;

    fn mechanisms() -> Vec<Mechanism> {
        vec![redundant(1), redundant(2), pentapod(6, "platform", 3), pentapod(7, "base", 4)]
    }

    /// What the three parts of the balance are off by, in pure numbers.
    fn missed(parted: &Parted, near: &[f64], w: Wrench<f64>, rates: &[f64], found: &Balanced) -> f64 {
        let y = DVector::from_column_slice(
            &Twist::new(found.motion.v, found.motion.omega * parted.scale).array(),
        );
        let f = DVector::from_column_slice(&found.forces);
        let w = Wrench::new(w.force, w.torque * (1.0 / parted.scale)).array();
        let units = DVector::from_column_slice(&parted.units);
        let multipliers = DVector::from_column_slice(&found.multipliers).component_div(&units);
        let first = &f - &parted.legs * &y - DVector::from_column_slice(near);
        let second = parted.legs.transpose() * &f + parted.rest.transpose() * multipliers
            - DVector::from_column_slice(&w);
        let third = &parted.rest * &y - DVector::from_column_slice(rates).component_mul(&units);
        let [first, second, third] =
            [first, second, third].map(|part| part.iter().fold(0.0, |m: f64, x| m.max(x.abs())));
        first.max(second).max(third)
    }

    #[test]
    fn all_parts_of_the_balance_hold() {
        let mut draw = Draw::new(7);
        for mech in mechanisms() {
            assert!(mech.is_redundant() && mech.mobility.uncontrolled == 0, "{}", mech.name);
            for state in states(&mech, 5, 3) {
                let parted = Parted::at(&mech, &state.pose).expect("legs have directions");
                let mut numbers = |count: usize| (0..count).map(|_| draw.number()).collect::<Vec<f64>>();
                let near = numbers(mech.actuated().count());
                let rates = numbers(mech.rows() - near.len());
                let w = Wrench::from_array(numbers(6).try_into().expect("six"));
                let found = parted.solve(&near, w, &rates);
                let size = found.motion.v.norm() + found.forces.iter().fold(1.0, |m: f64, f| m.max(f.abs()));
                assert!(missed(&parted, &near, w, &rates, &found) < 1e-12 * size, "{}", mech.name);
            }
        }
    }

    #[test]
    fn condition_numbers_are_not_squared() {
        // Two legs nearly in one line hold the first direction by a ten-millionth: products of rows would know nothing of it.
        let tiny = 1e-9;
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        let mut rows: Vec<[f64; 6]> = vec![unit(1), unit(1), unit(2), unit(3), unit(4), unit(5)];
        (rows[0][0], rows[1][0]) = (tiny, -tiny);
        rows.push([0.0, 0.0, 0.6, 0.8, 0.0, 0.0]);
        let parted = Parted::of(&rows, 7, vec![], 1.0).expect("finite");
        assert!(parted.regular);
        let found = parted.answer(Wrench::from_array([-1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]));
        let expected = [1e-3 / (2.0 * tiny), -1e-3 / (2.0 * tiny)];
        assert!((found[0] / expected[0] - 1.0).abs() < 1e-6 && (found[1] / expected[1] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn rates_that_agree_give_the_twist_and_others_none() {
        for mech in mechanisms() {
            let n = mech.actuated().count();
            for state in states(&mech, 5, 5) {
                let rows = all_rows(&mech, &state.pose);
                let rate = |row: &[f64; 6]| Wrench::from_array(*row).power(&state.twist);
                let mut rates: Vec<f64> = rows.iter().map(rate).collect();
                let found = platform_twist(&mech, &state.pose, &rates[..n + mech.idle.len()]);
                assert!(found.regular && found.agrees);
                let off = Twist::new(found.motion.v - state.twist.v, found.motion.omega - state.twist.omega);
                assert!(off.v.norm() + off.omega.norm() < 1e-10, "{}", mech.name);
                rates[0] += 1e-3 * norm(&rates);
                let found = platform_twist(&mech, &state.pose, &rates[..n + mech.idle.len()]);
                assert!(found.regular && !found.agrees, "{}", mech.name);
            }
        }
    }

    #[test]
    fn a_square_part_is_just_enough() {
        for mech in mechanisms() {
            let square = square(&mech).expect("not singular by design");
            assert_eq!(square.rows(), 6, "{}", mech.name);
            let values = Svd::of(&DMatrix::from_fn(6, 6, |i, j| {
                pure_rows(&square, &mech.home, mech.characteristic_length)[i][j]
            }));
            assert!(values.expect("finite").values[5] > 1e-3);
        }
    }
}
