//! Local coordinates (a chart) of the constraint manifold, by tangent-space parametrisation, and
//! accelerations in them \[T53\].
//!
//! A chart is made at a pose. Its coordinates θ, as many as the mechanism has degrees of freedom, are steps
//! along the twists that the constraints allow there; across them the pose is put on the constraints by
//! Newton's method. So whatever integrates θ stays on the constraints, as exactly as numbers can.

use nalgebra::DMatrix;

use crate::kinematics::constraint;
use crate::model::mechanism::{Constraint, MAX_CONSTRAINTS, Mechanism};
use crate::numerics::gauss::{Solved, solve};
use crate::numerics::svd::Svd;
use crate::spatial::{Acceleration, Pose, Twist, Vec3, Wrench};

/// Newton steps from a chart's tangent to the constraints; quadratic, so that a few are enough wherever θ is
/// small.
const NEWTON_STEPS: usize = 20;

/// A step across, relative to the characteristic length, that is rounding.
const ROUNDING: f64 = 4e-16;

/// Largest step across, relative to the characteristic length, that still counts as rounding after
/// convergence.
const MOST_ROUNDING: f64 = 1e-13;

/// Coordinates about a pose. A vector of the chart is (Δo, Λw), with w the vector of the Cayley map.
#[derive(Clone, Debug)]
pub struct Chart {
    pose: Pose<f64>,
    scale: f64,
    /// Orthonormal: first those along the constraints, then those across.
    basis: [[f64; 6]; 6],
    freedoms: usize,
}

/// A pose of the chart, with what its rates need.
#[derive(Clone, Copy, Debug)]
pub struct ChartPoint {
    pub pose: Pose<f64>,
    pub twist: Twist<f64>,
    /// Vector of the Cayley map from the chart's own pose.
    turn: Vec3<f64>,
}

impl Chart {
    /// The chart at a pose on the constraints; none where these are dependent.
    #[must_use]
    pub fn at(mech: &Mechanism, pose: &Pose<f64>) -> Option<Self> {
        let pose = Pose { rotation: pose.rotation.orthonormalised(), o: pose.o };
        let (scale, freedoms) = (mech.characteristic_length, mech.dof());
        let mut chart = Chart { pose, scale, basis: [[0.0; 6]; 6], freedoms };
        let rows: Vec<[f64; 6]> = mech.independent.iter().map(|c| chart.row(c, &pose)).collect();
        let m = DMatrix::from_fn(6, 6, |i, j| rows.get(i).map_or(0.0, |row| row[j]));
        let Svd { values, v_t: vectors, .. } = Svd::of(&m)?;
        if !rows.is_empty() && !(values[rows.len() - 1] > 1e-9 * values[0]) {
            return None;
        }
        // Singular vectors come with the rows' own first.
        chart.basis = std::array::from_fn(|i| std::array::from_fn(|j| vectors[((i + rows.len()) % 6, j)]));
        Some(chart)
    }

    #[must_use]
    pub fn freedoms(&self) -> usize {
        self.freedoms
    }

    /// A constraint's row for vectors of the chart's own pose, of a constraint counted as a length.
    fn row(&self, c: &Constraint, pose: &Pose<f64>) -> [f64; 6] {
        let unit = constraint::length(c, self.scale);
        let row = constraint::row(c, pose);
        Wrench::new(row.force * unit, row.torque * (unit / self.scale)).array()
    }

    fn twist_of(&self, x: &[f64; 6]) -> Twist<f64> {
        let t = Twist::from_array(*x);
        Twist::new(t.v, t.omega * (1.0 / self.scale))
    }

    /// The sum of basis vectors with these shares, beginning with the `first`.
    fn sum(&self, first: usize, shares: &[f64]) -> [f64; 6] {
        let mut x = [0.0; 6];
        for (share, vector) in shares.iter().zip(&self.basis[first..]) {
            for (x, b) in x.iter_mut().zip(vector) {
                *x += share * b;
            }
        }
        x
    }

    /// Shares ν of the directions across, as many as there are constraints, with
    /// `(row · L(w) across) ν = rhs`.
    fn across(
        &self,
        mech: &Mechanism,
        pose: &Pose<f64>,
        turn: Vec3<f64>,
        rhs: impl Fn(usize, &Wrench<f64>) -> f64,
    ) -> Solved<f64, [f64; MAX_CONSTRAINTS]> {
        let columns: Vec<Twist<f64>> =
            self.basis[self.freedoms..].iter().map(|b| self.moved(turn, b)).collect();
        let mut m: [[f64; MAX_CONSTRAINTS]; MAX_CONSTRAINTS] =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
        let mut values = [0.0; MAX_CONSTRAINTS];
        for (i, c) in mech.independent.iter().enumerate() {
            let row = constraint::row(c, pose) * constraint::length(c, self.scale);
            for (j, column) in columns.iter().enumerate() {
                m[i][j] = row.power(column);
            }
            values[i] = rhs(i, &row);
        }
        solve(m, values)
    }

    /// The twist at the rotation w of a rate x' of the chart's vector: ω = (w' + ½ w×w')/(1 + ¼ w·w).
    fn moved(&self, turn: Vec3<f64>, rate: &[f64; 6]) -> Twist<f64> {
        let Twist { v, omega: w1 } = self.twist_of(rate);
        Twist::new(v, (w1 + turn.cross(w1) * 0.5) * (1.0 / (1.0 + 0.25 * turn.dot(turn))))
    }

    /// The pose at θ and the twist of the rates θ'; none where the chart ends.
    #[must_use]
    pub fn place(&self, mech: &Mechanism, theta: &[f64], rates: &[f64]) -> Option<ChartPoint> {
        let along = self.sum(0, theta);
        let mut nu = [0.0; MAX_CONSTRAINTS];
        let count = mech.independent.len();
        let mut last = f64::INFINITY;
        let mut at = self.stepped(&along, &nu[..count]);
        for _ in 0..NEWTON_STEPS {
            let (pose, turn) = at;
            let value = |i: usize, _: &Wrench<f64>| {
                let c = &mech.independent[i];
                -constraint::value(c, &pose) * constraint::length(c, self.scale)
            };
            let step = self.across(mech, &pose, turn, value).x;
            let size = step.iter().fold(0.0_f64, |m, s| if s.abs() > m || s.is_nan() { s.abs() } else { m });
            let size = size / self.scale;
            // The last steps of a quadratic iteration end in rounding.
            if !size.is_finite() || (size >= last && last <= MOST_ROUNDING) {
                break;
            }
            for (n, s) in nu.iter_mut().zip(&step) {
                *n += s;
            }
            (at, last) = (self.stepped(&along, &nu[..count]), size);
            if size <= ROUNDING {
                break;
            }
        }
        if !(last <= MOST_ROUNDING) {
            return None;
        }
        let (pose, turn) = at;
        let forward = self.moved(turn, &self.sum(0, rates));
        let back = self.across(mech, &pose, turn, |_, row| -row.power(&forward)).x;
        let aside = self.moved(turn, &self.sum(self.freedoms, &back[..count]));
        let twist = Twist::new(forward.v + aside.v, forward.omega + aside.omega);
        Some(ChartPoint { pose, twist, turn })
    }

    fn stepped(&self, along: &[f64; 6], nu: &[f64]) -> (Pose<f64>, Vec3<f64>) {
        let across = self.sum(self.freedoms, nu);
        let step = self.twist_of(&std::array::from_fn(|i| along[i] + across[i]));
        (self.pose.stepped(&step), step.omega)
    }

    /// θ' of a twist at the chart's own pose; what of it the constraints forbid is left out.
    #[must_use]
    pub fn rates(&self, twist: &Twist<f64>) -> Vec<f64> {
        self.shares(&Twist::new(twist.v, twist.omega * self.scale).array())
    }

    /// θ'' of an acceleration at a point of the chart: with `w' = ω - ½ w×ω + ¼ w (w·ω)`, differentiated
    /// once.
    #[must_use]
    pub fn second_rates(&self, place: &ChartPoint, acceleration: &Acceleration<f64>) -> Vec<f64> {
        let (w, omega, eps) = (place.turn, place.twist.omega, acceleration.eps);
        let w1 = omega - w.cross(omega) * 0.5 + w * (0.25 * w.dot(omega));
        let w2 = eps - (w1.cross(omega) + w.cross(eps)) * 0.5
            + w1 * (0.25 * w.dot(omega))
            + w * (0.25 * (w1.dot(omega) + w.dot(eps)));
        self.shares(&Twist::new(acceleration.a, w2 * self.scale).array())
    }

    /// Shares of the directions along the constraints.
    fn shares(&self, x: &[f64; 6]) -> Vec<f64> {
        let dot = |b: &[f64; 6]| b.iter().zip(x).map(|(b, x)| b * x).sum();
        self.basis[..self.freedoms].iter().map(dot).collect()
    }
}
