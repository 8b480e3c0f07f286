//! Active forces and multipliers that balance a wrench on the platform, `Aᵀ f + Cᵀ λ = -W` [Eq. 43]: by
//! Gaussian elimination where J is square \[T15\], the forces of least norm where actuators are redundant
//! \[T72\].

use crate::dynamics::inverse_dynamics::{Balance, transposed};
use crate::kinematics::jacobian::scaled_jacobian;
use crate::kinematics::redundant_rows::RedundantRows;
use crate::kinematics::rows::{Matrix6, RowNumbers};
use crate::model::mechanism::Mechanism;
use crate::number::lanes::Lanes;
use crate::number::slices::{self, pairs};
use crate::number::work::work;
use crate::numerics::gauss::{Solved, solve_all};
use crate::spatial::{Motion, Pose, Twist, Wrench};

/// Room for the balance of one state after another.
pub struct ForceSolver<V> {
    pub numbers: RowNumbers,
    /// For each row of J: active forces, torques of local degrees of freedom, multipliers of the independent
    /// constraints.
    pub forces: Vec<V>,
    /// Active forces to be near to, where actuators are redundant; none for zeros.
    pub preferred: Vec<V>,
    redundant: Option<RedundantRows<V>>,
}

impl<V: Lanes> ForceSolver<V> {
    #[must_use]
    pub fn new(mech: &Mechanism) -> Self {
        ForceSolver {
            numbers: RowNumbers::of(mech),
            forces: vec![V::zero(); mech.rows()],
            preferred: vec![],
            redundant: mech.is_redundant().then(|| RedundantRows::new(mech)),
        }
    }

    /// Finds the forces; tells how regular J is: its pivot ratio, or a lower bound of its singular values'
    /// ratio.
    #[inline(always)]
    pub fn solve(&mut self, mech: &Mechanism, pose: &Pose<V>, balance: Balance<V>) -> V {
        match &mut self.redundant {
            None => {
                let (forces, pivots) = balance.solved(mech, pose);
                slices::copy(&forces, &mut self.forces[..6]);
                pivots
            }
            Some(rows) => {
                rows.factor(mech, pose);
                rows.solve(-balance.wrench, &self.preferred, &[]);
                rows.put_forces(&mut self.forces);
                rows.regular
            }
        }
    }

    /// The same for a motion under load.
    #[inline(always)]
    pub fn solve_motion(&mut self, mech: &Mechanism, platform: &Motion<V>, load: Wrench<V>) -> V {
        let balance = V::apart(BalanceOf { mech, platform, load });
        self.solve(mech, &platform.pose, balance)
    }

    /// Twists that are free to move under given forces of all actuators, where these are redundant \[T46\].
    #[inline(always)]
    pub(crate) fn put_freedoms(&self, twists: &mut [[V; 6]]) {
        if let Some(rows) = &self.redundant {
            rows.put_freedoms(twists);
        }
    }
}

work! {
    BalanceOf<'a, V: Lanes> { mech: &'a Mechanism, platform: &'a Motion<V>, load: Wrench<V> } -> Balance<V> {
        Balance::of(mech, platform, load)
    }
}

/// Forces and multipliers that balance a unit of each force and torque on the platform \[T15\]; where
/// actuators are redundant also those for a unit that each row of J is off by \[T74\].
pub struct UnitForceResponse<V> {
    /// The columns, where J is square.
    square: Matrix6<V>,
    /// Where it is not: one column of all rows after the other.
    columns: Vec<V>,
    rows: usize,
    pub regular: V,
    redundant: Option<RedundantRows<V>>,
}

work! {
    /// The columns where J is square.
    UnitForces<'a, V: Lanes> { mech: &'a Mechanism, pose: &'a Pose<V> } -> Solved<V, Matrix6<V>> {
        let inverse = V::lit(1.0 / mech.characteristic_length);
        let mut rhs = [[V::zero(); 6]; 6];
        for k in 0..6 {
            rhs[k][k] = if k < 3 { -V::one() } else { -inverse };
        }
        solve_all(transposed(&scaled_jacobian(mech, pose)), rhs)
    }
}

impl<V: Lanes> UnitForceResponse<V> {
    /// Room for one pose after another.
    #[must_use]
    pub fn new(mech: &Mechanism) -> Self {
        let rows = mech.rows();
        let columns = if mech.is_redundant() { 6 + rows } else { 0 };
        UnitForceResponse {
            square: [[V::zero(); 6]; 6],
            columns: vec![V::zero(); rows * columns],
            rows,
            regular: V::zero(),
            redundant: mech.is_redundant().then(|| RedundantRows::new(mech)),
        }
    }

    #[inline(always)]
    pub fn set(&mut self, mech: &Mechanism, pose: &Pose<V>) {
        let Some(rows) = &mut self.redundant else {
            Solved { x: self.square, pivots: self.regular, .. } = V::apart(UnitForces { mech, pose });
            return;
        };
        rows.factor(mech, pose);
        self.regular = rows.regular;
        for (k, column) in self.columns.chunks_exact_mut(self.rows).enumerate() {
            rows.solve_unit(k);
            rows.put_forces(column);
        }
    }

    /// The forces that balance a wrench, and y of \[T72\], zero where J is square.
    #[inline(always)]
    pub fn balance(&mut self, w: Wrench<V>, forces: &mut [V]) -> Twist<V> {
        match &mut self.redundant {
            None => {
                self.put(w, &[], forces);
                Twist::zero()
            }
            Some(rows) => {
                rows.solve(-w, &[], &[]);
                rows.put_forces(forces);
                rows.motion
            }
        }
    }

    /// The forces that balance a wrench and what rows are off by; none where J is square.
    #[inline(always)]
    pub fn put(&self, w: Wrench<V>, off: &[V], forces: &mut [V]) {
        let w = w.array();
        if self.redundant.is_none() {
            let mut sum = [V::zero(); 6];
            for k in 0..6 {
                for i in 0..6 {
                    sum[i] = self.square[k][i].mul_add(w[k], sum[i]);
                }
            }
            return slices::copy(&sum, forces);
        }
        slices::fill(forces, V::zero());
        for (k, column) in self.columns.chunks_exact(self.rows).take(6 + off.len()).enumerate() {
            let x = if k < 6 { w[k] } else { off[k - 6] };
            for (force, unit) in pairs(&mut *forces, column) {
                *force = unit.mul_add(x, *force);
            }
        }
    }
}
