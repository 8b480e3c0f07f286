//! Base inertial parameters: the minimal set of combinations that determine the active forces \[T58\].

use nalgebra::{DMatrix, DVector};

use crate::dynamics::regressor::{InertialParameter, Regressor};
use crate::kinematics::jacobian::{MotionSolver, PlatformMotion};
use crate::kinematics::rows::RowNumbers;
use crate::mobility::degrees_of_freedom;
use crate::model::mechanism::Mechanism;
use crate::number::order::largest;
use crate::numerics::random::Random;
use crate::spatial::{Acceleration, Mat3, Motion, Pose, Twist};

/// Relative remainder of a column after orthogonalisation against all before it, below which it counts as
/// dependent.
pub const DEPENDENT: f64 = 1e-8;

/// A coefficient below this, in pure numbers, is the rounding of zero.
const ZERO: f64 = 1e-9;

/// Equations for each parameter.
const SURPLUS: usize = 3;

/// Spread about home of the random poses: in characteristic lengths and radians.
const SPREAD: f64 = 0.5;

/// Pivot ratio of the Jacobian below which a drawn pose is passed over: forces there are large and say
/// little.
const PIVOTS: f64 = 1e-3;

/// Draws for each state that is needed.
const TRIES: usize = 50;

/// Some parameters stand for all: forces are those of the base parameters `π_b = combination · π`.
#[derive(Clone, Debug)]
pub struct BaseParameters {
    /// The parameters that are kept, numbers in the list of all.
    pub columns: Vec<usize>,
    /// One row for each of them, one column for each parameter.
    pub combination: DMatrix<f64>,
    /// Relative remainder of each column after orthogonalisation against those kept before it: shows how
    /// clear the rank is.
    pub remainders: Vec<f64>,
}

/// Base parameters from the regressors of random states; none if too few states could be drawn.
#[must_use]
pub fn base_parameters(mech: &Mechanism) -> Option<BaseParameters> {
    let regressor = Regressor::new(mech);
    let units: Vec<f64> = regressor.parameters.iter().map(|p| unit(p, mech.characteristic_length)).collect();
    let stacked = stacked(mech, &regressor, &units)?;
    let (columns, remainders) = independent_columns(&stacked);
    let (q, r) = stacked.select_columns(&columns).qr().unpack();
    let solved = r.solve_upper_triangular(&(q.transpose() * &stacked))?;
    let combination = DMatrix::from_fn(columns.len(), units.len(), |i, j| {
        let c: f64 = solved[(i, j)];
        // Its own parameter counts once, the others kept not at all.
        let c = if columns.contains(&j) { f64::from(u8::from(columns[i] == j)) } else { c };
        if c.abs() <= ZERO { 0.0 } else { c * units[columns[i]] / units[j] }
    });
    Some(BaseParameters { columns, combination, remainders })
}

/// The parameter's unit, so that a column is that of a pure number: m = 1 kg, m c = Λ kg, I = Λ² kg.
fn unit(p: &InertialParameter, scale: f64) -> f64 {
    match p.numbers[0] {
        0 => 1.0,
        1..=3 => scale,
        _ => scale * scale,
    }
}

/// Regressors of active forces at random states, each state's rows divided by their largest entry.
fn stacked(mech: &Mechanism, regressor: &Regressor, units: &[f64]) -> Option<DMatrix<f64>> {
    let (legs, width) = (mech.actuated().count(), units.len());
    let states = (SURPLUS * width).div_ceil(legs);
    let mut draw = Random(0x9E37_79B9_7F4A_7C15);
    let mut rows = DMatrix::zeros(states * legs, width);
    let mut found = 0;
    for _ in 0..TRIES * states {
        if found == states {
            return Some(rows);
        }
        let Some(state) = random_state(mech, &mut draw) else { continue };
        let columns = regressor.columns(mech, &state);
        let entries = DMatrix::from_fn(legs, width, |i, j| columns[j][i] * units[j]);
        let size = entries.amax();
        if size.is_finite() && size > 0.0 {
            rows.rows_mut(found * legs, legs).copy_from(&(entries / size));
            found += 1;
        }
    }
    (found == states).then_some(rows)
}

/// A pose about home that keeps the constraints, moving as random leg rates and accelerations say; these are
/// scaled so that weight and inertia are alike.
fn random_state(mech: &Mechanism, draw: &mut Random) -> Option<Motion<f64>> {
    let size = mech.characteristic_length;
    let gravity = mech.gravity.norm();
    let gravity = if gravity > 0.0 { gravity } else { 1.0 };
    let start = Pose {
        rotation: Mat3::from_rotation_vector(draw.vector(Random::number) * SPREAD) * mech.home.rotation,
        o: mech.home.o + draw.vector(Random::number) * (SPREAD * size),
    };
    let driven = RowNumbers::of(mech).idle().end;
    let rates: Vec<f64> = (0..driven).map(|_| draw.number() * (gravity * size).sqrt()).collect();
    let accelerations: Vec<f64> = (0..driven).map(|_| draw.number() * gravity).collect();
    let pose = degrees_of_freedom::project(&mech.constraints, size, &start)?;
    // What redundant legs do at random they do not agree on: the motion nearest to it is random, too.
    let mut solver = MotionSolver::new(mech);
    solver.driven = rates;
    let PlatformMotion { motion: twist, regular, .. } = solver.twist(mech, &pose);
    solver.driven = accelerations;
    let Twist { v, omega } = solver.acceleration(mech, &pose, &twist).motion;
    (regular > PIVOTS).then_some(Motion { pose, twist, acceleration: Acceleration::new(v, omega) })
}

/// Columns that are no combination of those before them, by orthogonalisation in order, and for every column
/// what is left of it.
fn independent_columns(m: &DMatrix<f64>) -> (Vec<usize>, Vec<f64>) {
    let largest = largest(m.column_iter().map(|c| c.norm()));
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let (mut columns, mut remainders) = (Vec::new(), Vec::new());
    for (j, column) in m.column_iter().enumerate() {
        let mut rest = column.into_owned();
        let size = rest.norm();
        // Twice is enough: what rounding left of the basis in the first pass is taken off in the second.
        for _ in 0..2 {
            for b in &basis {
                rest.axpy(-b.dot(&rest), b, 1.0);
            }
        }
        let remainder = if size > DEPENDENT * largest { rest.norm() / size } else { 0.0 };
        remainders.push(remainder);
        if remainder > DEPENDENT {
            columns.push(j);
            basis.push(rest.normalize());
        }
    }
    (columns, remainders)
}
