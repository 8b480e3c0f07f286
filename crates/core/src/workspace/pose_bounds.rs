//! What bounds a pose, each as a pure number with its derivative by a motion of the platform: constraints,
//! limits, directions of legs, the sign of det J. An optimisation over poses is subject to these \[T76\].

use crate::kinematics::constraint;
use crate::kinematics::jacobian::scaled_jacobian;
use crate::kinematics::leg;
use crate::model::limit::{Limit, Measure};
use crate::model::mechanism::Mechanism;
use crate::number::real::Dual;
use crate::numerics::gauss;
use crate::spatial::{Pose, Twist, Vec3, Wrench};
use crate::workspace::fit_orientation::{forces_at_rest, margin_rate};

/// Half the step of a difference quotient: of rotations, rad; of positions, times the characteristic length.
const DIFFERENCE: f64 = 1e-6;

/// A function of the pose and of the coordinates of drives with dead positions: its value, the row
/// `(by v, by ω)` of its derivative, and the derivative by the coordinate of one of those legs.
#[derive(Clone, Copy, Debug)]
pub struct Bounded {
    pub value: f64,
    pub row: Wrench<f64>,
    pub by_coordinate: Option<(usize, f64)>,
}

/// What bounds a pose.
#[derive(Clone, Debug)]
pub struct PoseBounds {
    /// The independent constraints: zero at poses of the mechanism. Then the equations of the coordinates of
    /// drives with dead positions, whose places are no smooth functions of the pose there.
    pub constraints: Vec<Bounded>,
    /// The margins of all limits relative to their scales: not below zero inside.
    pub limits: Vec<Bounded>,
    /// Of the legs whose direction a joint gives, how far they reach ahead, in characteristic lengths; of those
    /// drives, the size of δ·d on their branch: above zero.
    pub ahead: Vec<Bounded>,
    /// det of the scaled Jacobian; NaN for redundant actuation, where det `JᵀJ` has one sign.
    pub determinant: Bounded,
}

impl PoseBounds {
    /// At a pose and coordinates, m, of the legs in their order whose drive moves its foot.
    #[must_use]
    pub fn at(mech: &Mechanism, pose: &Pose<f64>, coordinates: &[f64]) -> Self {
        let size = mech.characteristic_length;
        let mut constraints: Vec<Bounded> = mech
            .independent
            .iter()
            .map(|c| {
                let by = 1.0 / constraint::unit(c, size);
                Bounded::of_pose(constraint::value(c, pose), constraint::row(c, pose)).times(by)
            })
            .collect();
        let mut ahead: Vec<Bounded> = mech
            .directions
            .iter()
            .map(|direction| {
                let row = by_twist(|twist| leg::ahead(mech, direction, &pose.along(twist)).d);
                Bounded::of_pose(leg::ahead(mech, direction, pose), row).times(1.0 / size)
            })
            .collect();
        for (k, &leg) in moving_feet(mech).iter().enumerate() {
            let leg = &mech.legs[leg];
            let at = |twist: &Twist<f64>, rate: f64| {
                leg::closure(leg, &pose.along(twist), Dual { x: coordinates[k], d: rate })
            };
            let (equation, branch) = at(&Twist::zero(), 1.0);
            let coupled =
                |value: Dual<f64>, row| Bounded { value: value.x, row, by_coordinate: Some((k, value.d)) };
            constraints.push(coupled(equation, by_twist(|twist| at(twist, 0.0).0.d)));
            ahead.push(coupled(branch, by_twist(|twist| at(twist, 0.0).1.d)));
        }
        PoseBounds {
            constraints,
            limits: limits(mech, pose, coordinates),
            ahead,
            determinant: determinant(mech, pose),
        }
    }
}

impl Bounded {
    fn of_pose(value: f64, row: Wrench<f64>) -> Self {
        Bounded { value, row, by_coordinate: None }
    }

    fn times(self, factor: f64) -> Self {
        let by_coordinate = self.by_coordinate.map(|(k, rate)| (k, rate * factor));
        Bounded { value: self.value * factor, row: self.row * factor, by_coordinate }
    }
}

/// The legs whose drive moves its foot: it has dead positions, where it moves the foot only.
fn moving_feet(mech: &Mechanism) -> Vec<usize> {
    (0..mech.legs.len()).filter(|&leg| mech.legs[leg].drive.moves_foot()).collect()
}

/// The row of a derivative that is known along each twist.
fn by_twist(mut along: impl FnMut(&Twist<f64>) -> f64) -> Wrench<f64> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let force = axes.map(|v| along(&Twist::new(v, Vec3::zero())));
    let torque = axes.map(|omega| along(&Twist::new(Vec3::zero(), omega)));
    Wrench::new(Vec3::from(force), Vec3::from(torque))
}

/// Margins relative to their scales. Derivatives that have no closed form are taken by differences, and so is
/// that of an angle at zero, where it is greatest and the derivative jumps.
fn limits(mech: &Mechanism, pose: &Pose<f64>, coordinates: &[f64]) -> Vec<Bounded> {
    let by_forces = mech.limits.iter().any(|limit| matches!(limit.measure, Measure::Force { .. }));
    let feet = moving_feet(mech);
    let margin = |limit: &Limit, pose: &Pose<f64>| {
        let forces = by_forces.then(|| forces_at_rest(mech, pose));
        limit.margin(mech, pose, forces.as_deref())
    };
    let bounded = |limit: &Limit| {
        if let Measure::Length(leg) = limit.measure
            && let Some(k) = feet.iter().position(|&of| of == leg)
        {
            let Dual { x, d } = limit.bound.margin(Dual { x: coordinates[k], d: 1.0 });
            return Bounded { value: x, row: by_twist(|_| 0.0), by_coordinate: Some((k, d)) }
                .times(1.0 / limit.scale);
        }
        let row = by_twist(|twist| {
            margin_rate(mech, limit, pose, twist)
                .filter(|rate| rate.is_finite())
                .unwrap_or_else(|| difference(mech, pose, twist, |pose| margin(limit, pose)))
        });
        Bounded::of_pose(margin(limit, pose), row).times(1.0 / limit.scale)
    };
    mech.limits.iter().map(bounded).collect()
}

fn determinant(mech: &Mechanism, pose: &Pose<f64>) -> Bounded {
    if mech.is_redundant() {
        return Bounded::of_pose(f64::NAN, by_twist(|_| f64::NAN));
    }
    let at = |pose: &Pose<f64>| gauss::determinant(&scaled_jacobian(mech, pose));
    Bounded::of_pose(at(pose), by_twist(|twist| difference(mech, pose, twist, at)))
}

/// Central difference quotient along a unit of twist.
fn difference(mech: &Mechanism, pose: &Pose<f64>, twist: &Twist<f64>, of: impl Fn(&Pose<f64>) -> f64) -> f64 {
    let size = DIFFERENCE * if twist.omega == Vec3::zero() { mech.characteristic_length } else { 1.0 };
    let stepped = |by: f64| of(&pose.stepped(&Twist::new(twist.v * by, twist.omega * by)));
    (stepped(size) - stepped(-size)) / (2.0 * size)
}
