//! How near a pose is to a singularity.

use nalgebra::{DMatrix, Matrix6};

use crate::constraint;
use crate::leg;
use crate::mechanism::Mechanism;
use crate::spatial::{Pose, Wrench};

/// Singular values of the leg Jacobian on the twists that the constraints allow; turns are counted as arcs at the
/// characteristic length, so that all entries are pure numbers \[T24\].
#[derive(Clone, Copy, Debug)]
pub struct Conditioning {
    pub sigma_min: f64,
    pub sigma_max: f64,
    /// `sigma_max / sigma_min`.
    pub condition: f64,
}

#[must_use]
pub fn conditioning(mech: &Mechanism, pose: &Pose<f64>) -> Conditioning {
    let scaled = |row: Wrench<f64>| (row.torque * (1.0 / mech.characteristic_length)).array();
    let matrix = |rows: Vec<Wrench<f64>>| {
        DMatrix::from_fn(
            rows.len(),
            6,
            |i, j| {
                if j < 3 { rows[i].array()[j] } else { scaled(rows[i])[j - 3] }
            },
        )
    };
    let legs = matrix(mech.actuated().map(|(_, leg)| leg::row(&leg::position(leg, pose))).collect());
    let g = matrix(mech.independent.iter().map(|c| constraint::row(c, pose)).collect());
    let none = Conditioning { sigma_min: f64::NAN, sigma_max: f64::NAN, condition: f64::NAN };
    if legs.iter().chain(g.iter()).any(|e| !e.is_finite()) {
        return none;
    }
    // Twists that the constraints allow: what G's pseudo-inverse leaves.
    let allowed = if g.nrows() == 0 {
        DMatrix::identity(6, 6)
    } else {
        let Ok(inverse) = g.clone().pseudo_inverse(1e-12) else {
            return none;
        };
        DMatrix::identity(6, 6) - inverse * g
    };
    let reduced = legs * allowed;
    let square = Matrix6::from_fn(|i, j| if i < reduced.nrows() { reduced[(i, j)] } else { 0.0 });
    let mut sigma: Vec<f64> = square.singular_values().iter().copied().collect();
    sigma.sort_by(|a, b| b.total_cmp(a));
    let (sigma_max, sigma_min) = (sigma[0], sigma[mech.dof() - 1]);
    Conditioning { sigma_min, sigma_max, condition: sigma_max / sigma_min }
}
