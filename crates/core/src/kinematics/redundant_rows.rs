//! The Jacobian of a mechanism with redundant actuators, factored: forces of least norm, twists in the sense
//! of least squares, and the null space of the constraints \[T72\] \[T73\].
//!
//! The rows themselves are factored by Householder reflections; products of rows, which would square their
//! condition number, are never formed.

use crate::kinematics::constraint;
use crate::kinematics::rows::Row;
use crate::model::mechanism::Mechanism;
use crate::number::lanes::Lanes;
use crate::number::real::Ordered;
use crate::number::slices::{self, pairs};
use crate::number::work::Work;
use crate::numerics::householder::Householder;
use crate::spatial::{Pose, Twist, Wrench};

/// Largest part of the rates (or accelerations) of legs that may contradict the rest: as much as a twist may
/// miss a constraint by.
const CONTRADICTION: f64 = 1e-6;

/// The rows A of the n actuated legs and C of constraints and local degrees of freedom, in pure numbers,
/// factored as `C = L Qᵀ` and `(A N)ᵀ = L' Q'ᵀ` with the twists N that C allows. Room for one state after
/// another.
#[derive(Clone, Debug)]
pub struct RedundantRows<V> {
    /// Λ, m.
    scale: f64,
    /// From a multiplier of a row of C in pure numbers to one in SI units.
    units: Vec<f64>,
    /// For each row of C in the order of J its number here, where constraints come first.
    numbers: Vec<usize>,
    legs: Vec<[V; 6]>,
    others: Householder<V>,
    on_allowed: Householder<V>,
    /// N: orthonormal twists (v, Λω).
    allowed: Vec<[V; 6]>,
    added: Vec<V>,
    unit: Vec<V>,
    /// A lower bound of the ratio of least to greatest singular value of C and of AN; NaN or zero at singular
    /// poses.
    pub regular: V,
    /// Of the actuated legs.
    pub forces: Vec<V>,
    /// Of local degrees of freedom, then of constraints.
    pub multipliers: Vec<V>,
    /// y: the forces are the preferred ones and the rates that y gives the legs.
    pub motion: Twist<V>,
}

impl<V: Lanes> RedundantRows<V> {
    /// Room for the states of a mechanism.
    #[must_use]
    pub fn new(mech: &Mechanism) -> Self {
        let (n, scale) = (mech.actuated().count(), mech.characteristic_length);
        let units = mech.independent.iter().map(|c| constraint::length(c, scale));
        let units: Vec<f64> = units.chain(mech.idle.iter().map(|_| scale)).collect();
        let numbers = (mech.independent.len()..units.len()).chain(0..mech.independent.len());
        let numbers = numbers.collect();
        Self::with(n, scale, units, numbers)
    }

    fn with(n: usize, scale: f64, units: Vec<f64>, numbers: Vec<usize>) -> Self {
        let held = units.len();
        RedundantRows {
            scale,
            units,
            numbers,
            legs: vec![[V::zero(); 6]; n],
            others: Householder::new(held, 6),
            on_allowed: Householder::new(6 - held, n),
            allowed: vec![[V::zero(); 6]; 6 - held],
            added: vec![V::zero(); n],
            unit: vec![V::zero(); n + held],
            regular: V::zero(),
            forces: vec![V::zero(); n],
            multipliers: vec![V::zero(); held],
            motion: Twist::zero(),
        }
    }

    /// Factors the rows at a pose.
    #[inline(always)]
    pub fn factor(&mut self, mech: &Mechanism, pose: &Pose<V>) {
        V::apart(Factor { rows: self, mech, pose });
    }

    /// The same with given rows of the legs, in pure numbers.
    #[inline(always)]
    pub(crate) fn factor_with(&mut self, mech: &Mechanism, pose: &Pose<V>, legs: &[[V; 6]]) {
        slices::copy(legs, &mut self.legs);
        self.set_others(mech, pose);
        self.factor_set();
    }

    /// The least step (v/Λ, ω) that takes off what the others miss and, within that, most of what legs miss
    /// in the sense of least squares; all in pure numbers, lengths and values divided by Λ.
    #[inline(always)]
    pub(crate) fn least_step(&mut self, legs: &[V], others: &[V]) -> [V; 6] {
        let mut rates = [V::zero(); 6];
        for (k, miss) in others.iter().enumerate() {
            rates[k] = -miss.scale(1.0 / self.units[self.numbers[k]]);
        }
        self.solve(Wrench::zero(), legs, &rates[..others.len()]);
        Twist::new(self.motion.v, self.motion.omega.scale(self.scale)).array()
    }

    /// Solves `f - A y = preferred`, `Aᵀ f + Cᵀ λ = w`, `C y = rates`, in SI units; none for zeros. So f are
    /// the forces nearest to the preferred ones that balance -w \[T72\]; with w zero, y is the twist of least
    /// squares for rates of the legs that are minus the preferred forces \[T73\].
    #[inline(always)]
    pub fn solve(&mut self, w: Wrench<V>, preferred: &[V], rates: &[V]) {
        V::apart(Solve { rows: self, w, preferred, rates });
    }

    /// The same for a unit of one part of the right-hand sides: of -w for the first six, then of preferred
    /// forces and of rates.
    #[inline(always)]
    pub fn solve_unit(&mut self, k: usize) {
        let mut unit = [V::zero(); 6];
        if k < 6 {
            unit[k] = -V::one();
            self.solve(Wrench::from_array(unit), &[], &[]);
            return;
        }
        let row = k - 6;
        let n = self.forces.len();
        for i in 0..n + self.multipliers.len() {
            self.unit[i] = V::lit(f64::from(u8::from(i == row)));
        }
        let unit = std::mem::take(&mut self.unit);
        let (preferred, rates) = unit.split_at(n);
        self.solve(Wrench::zero(), preferred, rates);
        self.unit = unit;
    }

    /// Forces and multipliers in the order of J's rows.
    #[inline(always)]
    pub fn put_forces(&self, all: &mut [V]) {
        let (forces, multipliers) = all.split_at_mut(self.forces.len());
        slices::copy(&self.forces, forces);
        slices::copy(&self.multipliers, multipliers);
    }

    /// Where the legs' rates (or accelerations) have a twist, and that in the sense of least squares;
    /// `others` are those of local degrees of freedom and constraints, or none. `size` is what the legs may
    /// contradict one another by a part of \[T73\].
    #[inline(always)]
    pub fn follow(&mut self, legs: &[V], others: &[V], size: V) -> (Twist<V>, V::Mask) {
        // f - A y = -ℓ' with AᵀF = 0: y in the sense of least squares, f what it misses.
        let mut asked = std::mem::take(&mut self.unit);
        for (x, rate) in pairs(&mut asked, legs) {
            *x = -*rate;
        }
        self.solve(Wrench::zero(), &asked[..legs.len()], others);
        self.unit = asked;
        let mut missed = V::zero();
        for force in &self.forces {
            missed = force.mul_add(*force, missed);
        }
        let most = size.scale(CONTRADICTION);
        (self.motion, missed.at_most(most * most))
    }

    /// Orthonormal twists (v, Λω) that the constraints allow, those of local degrees of freedom among them.
    #[inline(always)]
    pub fn put_freedoms(&self, twists: &mut [[V; 6]]) {
        let constraints = 6 - twists.len();
        for (k, twist) in twists.iter_mut().enumerate() {
            self.others.orthonormal_vector(constraints + k, twist);
        }
    }
}

struct Factor<'a, V> {
    rows: &'a mut RedundantRows<V>,
    mech: &'a Mechanism,
    pose: &'a Pose<V>,
}

impl<V: Lanes> Work<V> for Factor<'_, V> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Factor { rows, mech, pose } = self;
        for (row, (_, leg)) in pairs(&mut rows.legs, mech.actuated()) {
            *row = Row::Leg(leg).pure(pose, rows.scale);
        }
        rows.set_others(mech, pose);
        rows.factor_set();
    }
}

impl<V: Lanes> RedundantRows<V> {
    #[inline(always)]
    fn set_others(&mut self, mech: &Mechanism, pose: &Pose<V>) {
        for (k, c) in mech.independent.iter().enumerate() {
            self.others.set_row(k, &Row::Constraint(c).pure(pose, self.scale));
        }
        for (k, idle) in mech.idle.iter().enumerate() {
            self.others.set_row(mech.independent.len() + k, &Row::Idle(idle).pure(pose, self.scale));
        }
    }

    /// Factors the rows that are set.
    #[inline(always)]
    fn factor_set(&mut self) {
        let RedundantRows { legs, others, on_allowed, allowed, .. } = self;
        others.factor();
        for (k, twist) in allowed.iter_mut().enumerate() {
            others.null_vector(k, twist);
            for (i, row) in legs.iter().enumerate() {
                on_allowed.set(k, i, dot(row, twist));
            }
        }
        on_allowed.factor();
        // Neither is least if one cannot be compared.
        let (first, second) = (others.reciprocal_condition(), on_allowed.reciprocal_condition());
        self.regular = V::select(first.greater(second), second, first + second * V::zero());
    }
}

struct Solve<'a, V> {
    rows: &'a mut RedundantRows<V>,
    w: Wrench<V>,
    preferred: &'a [V],
    rates: &'a [V],
}

impl<V: Lanes> Work<V> for Solve<'_, V> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Solve { rows, w, preferred, rates } = self;
        let RedundantRows {
            scale,
            units,
            numbers,
            legs,
            others,
            on_allowed,
            allowed,
            added,
            forces,
            multipliers,
            motion,
            ..
        } = rows;
        let inverse = 1.0 / *scale;
        let w = Wrench::new(w.force, w.torque.scale(inverse)).array();
        // The least y that the others ask for, and the forces that go with it.
        let mut y = [V::zero(); 6];
        if !rates.is_empty() {
            for (rate, &k) in pairs(rates, &*numbers) {
                y[k] = rate.scale(units[k]);
            }
            others.solve(&mut y);
        }
        for (i, row) in legs.iter().enumerate() {
            let preferred = preferred.get(i).copied().unwrap_or_else(V::zero);
            forces[i] = if rates.is_empty() { preferred } else { preferred + dot(row, &y) };
        }
        // What they leave of the wrench, as far as allowed twists feel it, the least forces balance.
        let unbalanced = unbalanced(w, legs, forces);
        slices::fill(added, V::zero());
        for (x, twist) in pairs(&mut *added, &*allowed) {
            *x = dot(twist, &unbalanced);
        }
        on_allowed.solve_lower(added);
        let mut shares = [V::zero(); 6];
        slices::copy(&added[..allowed.len()], &mut shares[..allowed.len()]);
        on_allowed.rotate(added);
        for (force, x) in pairs(&mut *forces, &*added) {
            *force = *force + *x;
        }
        on_allowed.solve_upper(&mut shares);
        for (share, twist) in pairs(&shares, &*allowed) {
            for j in 0..6 {
                y[j] = share.mul_add(twist[j], y[j]);
            }
        }
        let mut rest = self::unbalanced(w, legs, forces);
        others.solve_transposed(&mut rest);
        for (multiplier, &k) in pairs(multipliers, &*numbers) {
            *multiplier = rest[k].scale(units[k]);
        }
        let Twist { v, omega } = Twist::from_array(y);
        *motion = Twist::new(v, omega.scale(inverse));
    }
}

/// `w - Aᵀ f`.
#[inline(always)]
fn unbalanced<V: Ordered>(w: [V; 6], legs: &[[V; 6]], forces: &[V]) -> [V; 6] {
    let mut rest = w;
    for (row, force) in pairs(legs, forces) {
        for j in 0..6 {
            rest[j] = (-row[j]).mul_add(*force, rest[j]);
        }
    }
    rest
}

#[inline(always)]
fn dot<V: Ordered>(a: &[V; 6], b: &[V; 6]) -> V {
    let mut sum = V::zero();
    for j in 0..6 {
        sum = a[j].mul_add(b[j], sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{Draw, pentapod, redundant, states};
    use crate::kinematics::jacobian::MotionSolver;
    use crate::kinematics::rows::{all_rows, pure_rows};
    use crate::number::order::largest;

    fn mechanisms() -> Vec<Mechanism> {
        vec![redundant(1), redundant(2), pentapod(6, "platform", 3), pentapod(7, "base", 4)]
    }

    fn largest_size(parts: impl IntoIterator<Item = f64>) -> f64 {
        largest(parts.into_iter().map(f64::abs))
    }

    #[test]
    fn all_parts_of_the_balance_hold() {
        let mut draw = Draw::new(7);
        for mech in mechanisms() {
            assert!(mech.is_redundant() && mech.mobility.uncontrolled == 0, "{}", mech.name);
            let (n, mut found) = (mech.actuated().count(), RedundantRows::<f64>::new(&mech));
            for state in states(&mech, 5, 3) {
                let mut numbers = |count: usize| (0..count).map(|_| draw.number()).collect::<Vec<f64>>();
                let (preferred, rates) = (numbers(n), numbers(mech.rows() - n));
                let w = Wrench::from_array(numbers(6).try_into().expect("six"));
                found.factor(&mech, &state.pose);
                found.solve(w, &preferred, &rates);
                let mut forces = vec![0.0; mech.rows()];
                found.put_forces(&mut forces);
                let rows: Vec<_> = all_rows(&mech, &state.pose).into_iter().map(Wrench::from_array).collect();
                let of_legs = (0..n).map(|i| forces[i] - rows[i].power(&found.motion) - preferred[i]);
                let balance = rows.iter().zip(&forces).fold(w, |sum, (row, f)| sum - *row * *f);
                let of_others = (n..rows.len()).map(|k| rows[k].power(&found.motion) - rates[k - n]);
                let missed = largest_size(of_legs.chain(balance.array()).chain(of_others));
                let size = 1.0 + found.motion.v.norm() + largest_size(forces.iter().copied());
                assert!(missed < 1e-12 * size, "{}: {missed}", mech.name);
            }
        }
    }

    #[test]
    fn condition_numbers_are_not_squared() {
        // Two legs nearly in one line hold the first direction by a billionth: products of rows would know
        // nothing of it.
        let tiny = 1e-9;
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        let mut found = RedundantRows::with(7, 1.0, vec![], vec![]);
        found.legs =
            vec![unit(1), unit(1), unit(2), unit(3), unit(4), unit(5), [0.0, 0.0, 0.6, 0.8, 0.0, 0.0]];
        (found.legs[0][0], found.legs[1][0]) = (tiny, -tiny);
        found.factor_set();
        assert!(found.regular > 1e-12);
        found.solve(Wrench::from_array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]), &[], &[]);
        let expected = [1e-3 / (2.0 * tiny), -1e-3 / (2.0 * tiny)];
        assert!((found.forces[0] / expected[0] - 1.0).abs() < 1e-6);
        assert!((found.forces[1] / expected[1] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn freedoms_are_what_constraints_allow() {
        for mech in mechanisms() {
            let mut found = RedundantRows::<f64>::new(&mech);
            found.factor(&mech, &mech.home);
            let mut twists = vec![[0.0; 6]; mech.dof()];
            found.put_freedoms(&mut twists);
            let first = mech.rows() - mech.independent.len();
            for row in &pure_rows(&mech, &mech.home, mech.characteristic_length)[first..] {
                assert!(largest_size(twists.iter().map(|twist| dot(row, twist))) < 1e-14, "{}", mech.name);
            }
            for (i, a) in twists.iter().enumerate() {
                for (j, b) in twists.iter().enumerate() {
                    assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn rates_that_agree_give_the_twist_and_others_none() {
        for mech in mechanisms() {
            let n = mech.actuated().count();
            for state in states(&mech, 5, 5) {
                let rows = all_rows(&mech, &state.pose);
                let rates = rows.iter().map(|row| Wrench::from_array(*row).power(&state.twist));
                let mut solver = MotionSolver::<f64>::new(&mech);
                solver.driven = rates.take(n + mech.idle.len()).collect();
                let found = solver.twist(&mech, &state.pose);
                assert!(found.regular > 1e-12 && found.agrees);
                let off = Twist::new(found.motion.v - state.twist.v, found.motion.omega - state.twist.omega);
                assert!(off.v.norm() + off.omega.norm() < 1e-10, "{}", mech.name);
                solver.driven[0] += 1e-3 * largest_size(solver.driven.iter().copied());
                assert!(!solver.twist(&mech, &state.pose).agrees, "{}", mech.name);
            }
        }
    }
}
