//! Orientation fit: a pose with its point o at a given point that keeps constraints and limits \[T39\].

use crate::dynamics::force_balance::ForceSolver;
use crate::dynamics::inverse_dynamics;
use crate::kinematics::constraint;
use crate::kinematics::leg;
use crate::model::limit::{Limit, Measure};
use crate::model::mechanism::Mechanism;
use crate::number::order::by_size;
use crate::numerics::gauss::solve;
use crate::spatial::{Acceleration, Motion, Pose, Twist, Vec3};

/// Steps after which the search is given up.
const STEPS: usize = 40;

/// Longest step, rad.
const LONGEST_STEP: f64 = 0.2;

/// Tolerances for a limit, in its unit, and for a constraint, as a pure number: rounding of zero.
pub const ON_LIMIT: f64 = 1e-11;
const ON_CONSTRAINT: f64 = 1e-13;

/// Share by which the misses must shrink in two steps for the search to go on.
const PROGRESS: f64 = 0.9;

/// Damping of the least squares, as a pure number: it keeps steps finite where rows depend on one another.
const DAMPING: f64 = 1e-12;

/// The rotation next to that of `pose` with which the platform can be at `o`; none where the search finds
/// none.
///
/// Gauss-Newton steps on the constraints and on the limits that are passed, of least size: what need not
/// rotate does not. Limits that are no function of the pose alone in closed form (conditioning, forces) are
/// checked, not sought.
#[must_use]
pub fn fit(mech: &Mechanism, pose: &Pose<f64>, o: Vec3<f64>) -> Option<Pose<f64>> {
    let mut pose = Pose { rotation: pose.rotation, o };
    let mut misses = [f64::INFINITY; 2];
    for _ in 0..STEPS {
        // Normal equations of rows a·w = b for the rotation w.
        let mut matrix = [[0.0; 3]; 3];
        let mut rhs = [0.0; 3];
        let mut miss = 0.0_f64;
        let mut add = |a: Vec3<f64>, b: f64| {
            let a = a.array();
            for i in 0..3 {
                for j in 0..3 {
                    matrix[i][j] += a[i] * a[j];
                }
                rhs[i] += a[i] * b;
            }
            miss += b * b;
        };
        let mut kept = true;
        for c in &mech.independent {
            let unit = constraint::unit(c, mech.characteristic_length);
            let value = constraint::value(c, &pose) / unit;
            kept &= value.abs() <= ON_CONSTRAINT;
            add(constraint::row(c, &pose).torque * (1.0 / unit), -value);
        }
        for limit in &mech.limits {
            let Some(value) = limit.geometric(mech, &pose) else { continue };
            let margin = limit.bound.margin(value);
            if margin.is_nan() {
                return None;
            }
            if margin < 0.0 {
                kept &= margin >= -ON_LIMIT;
                add(gradient(mech, limit, &pose) * (1.0 / limit.scale), -margin / limit.scale);
            }
        }
        if kept {
            return checked(mech, &pose).then_some(pose);
        }
        if miss > PROGRESS * misses[0] {
            return None;
        }
        misses = [misses[1], miss];
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] += DAMPING;
        }
        let [x, y, z] = solve(matrix, rhs).x;
        let turn = Vec3::new(x, y, z);
        let size = turn.norm();
        let share = if size > LONGEST_STEP { LONGEST_STEP / size } else { 1.0 };
        pose = pose.stepped(&Twist::new(Vec3::zero(), turn * share));
    }
    None
}

/// The derivative of a limit's margin along a twist, by duals; none for those that are no function of the
/// pose alone in closed form.
#[must_use]
pub fn margin_rate(mech: &Mechanism, limit: &Limit, pose: &Pose<f64>, twist: &Twist<f64>) -> Option<f64> {
    Some(limit.bound.margin(limit.geometric(mech, &pose.along(twist))?).d)
}

/// The derivative of a limit's margin by a rotation of the platform about o.
fn gradient(mech: &Mechanism, limit: &Limit, pose: &Pose<f64>) -> Vec3<f64> {
    let about = |axis| margin_rate(mech, limit, pose, &Twist::new(Vec3::zero(), axis)).unwrap_or(0.0);
    Vec3::new(about(Vec3::X), about(Vec3::Y), about(Vec3::Z))
}

/// Whether no leg points backwards and a pose keeps the limits of conditioning and force; the latter at rest
/// under the mechanism's own load.
fn checked(mech: &Mechanism, pose: &Pose<f64>) -> bool {
    let kept = |limit: &Limit| {
        let forces = matches!(limit.measure, Measure::Force { .. }).then(|| forces_at_rest(mech, pose));
        limit.margin(mech, pose, forces.as_deref()) >= 0.0
    };
    let checked = |l: &&Limit| matches!(l.measure, Measure::Conditioning | Measure::Force { .. });
    leg::all_ahead(mech, pose) && mech.limits.iter().filter(checked).all(kept)
}

/// Active forces at rest under the mechanism's own load, N.
pub(crate) fn forces_at_rest(mech: &Mechanism, pose: &Pose<f64>) -> Vec<f64> {
    let rest = Motion { pose: *pose, twist: Twist::zero(), acceleration: Acceleration::zero() };
    let load = inverse_dynamics::load_in_base(mech.load.wrench, mech.load.axes, pose);
    let mut solver = ForceSolver::new(mech);
    solver.solve_motion(mech, &rest, load);
    solver.forces
}

/// The margins of all limits at a pose, each in its own unit.
#[must_use]
pub fn margins(mech: &Mechanism, pose: &Pose<f64>) -> Vec<f64> {
    let needs_forces = mech.limits.iter().any(|l| matches!(l.measure, Measure::Force { .. }));
    let forces = needs_forces.then(|| forces_at_rest(mech, pose));
    mech.limits.iter().map(|l| l.margin(mech, pose, forces.as_deref())).collect()
}

/// The margin of the limit that is nearest relative to its scale; NaN without limits, or if one is unknown.
#[must_use]
pub fn nearest(mech: &Mechanism, margins: &[f64]) -> f64 {
    let relative = |(margin, limit): &(&f64, &Limit)| **margin / limit.scale;
    let least = margins.iter().zip(&mech.limits).min_by(|a, b| by_size(relative(a), relative(b)));
    least.map_or(f64::NAN, |(margin, _)| *margin)
}
