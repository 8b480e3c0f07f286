//! Determinant, kinds and twists for every leg of the catalogue, against matrices made otherwise.

mod common;

use common::{mechanisms, published, states, with_leg};
use nalgebra::Matrix6;
use polypod_core::kinematics::constraint;
use polypod_core::kinematics::jacobian;
use polypod_core::kinematics::leg;
use polypod_core::kinematics::singular::SINGULAR;
use polypod_core::mobility::singularity::{self, Kind, determinant, singularity};
use polypod_core::model::mechanism::{ConstraintKind, Mechanism};
use polypod_core::number::order::larger;
use polypod_core::spatial::{Mat3, Motion, Pose, Twist};

/// The pose after a time on the motion with the constant twist.
fn after(state: &Motion<f64>, time: f64) -> Pose<f64> {
    Pose {
        rotation: Mat3::from_rotation_vector(state.twist.omega * time) * state.pose.rotation,
        o: state.pose.o + state.twist.v * time,
    }
}

#[test]
fn the_determinant_is_that_of_the_jacobian_in_pure_numbers() {
    for mech in mechanisms() {
        let of_kind_d = mech.independent.iter().filter(|c| c.kind == ConstraintKind::D).count();
        for state in states(&mech, 4, 11) {
            for scale in [mech.characteristic_length, 0.37] {
                let j = jacobian::jacobian(&mech, &state.pose);
                let plain = Matrix6::from_fn(|i, k| j[i][k]).determinant();
                let expected = plain * scale.powi(of_kind_d as i32 - 3);
                let found = determinant(&mech, &state.pose, &Twist::zero(), scale);
                assert!((found.x - expected).abs() < 1e-12 * larger(expected.abs(), 1.0), "{}", mech.name);
                assert_eq!(found.d, 0.0);
            }
        }
    }
}

#[test]
fn the_rate_of_the_determinant_is_its_derivative() {
    for mech in mechanisms() {
        for state in states(&mech, 3, 5) {
            let scale = mech.characteristic_length;
            let det = |t: f64| determinant(&mech, &after(&state, t), &Twist::zero(), scale).x;
            let exact = determinant(&mech, &state.pose, &state.twist, scale).d;
            let error = |h: f64| ((det(h) - det(-h)) / (2.0 * h) - exact).abs();
            let size = exact.abs() + det(0.0).abs();
            assert!(error(1e-4) < 1e-5 * size, "{}: {} of {size}", mech.name, error(1e-4));
            assert!(
                error(2e-3) < 1e-9 * size || (error(4e-3) / error(2e-3) - 4.0).abs() < 0.2,
                "{}",
                mech.name
            );
        }
    }
}

/// Norms of the rates that a twist gives to all legs, and to all constraints.
fn noticed(mech: &Mechanism, pose: &Pose<f64>, twist: &Twist<f64>) -> [f64; 2] {
    let legs = mech.actuated().map(|(_, leg)| leg::row(leg, &leg::position(leg, pose)).power(twist));
    let rows = mech.constraints.iter().map(|c| constraint::row(c, pose).power(twist));
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
    [norm(&mut legs.into_iter()), norm(&mut rows.into_iter())]
}

#[test]
fn the_legs_notice_the_least_twist_by_the_smallest_singular_value() {
    for mech in mechanisms() {
        let scale = mech.characteristic_length;
        for state in states(&mech, 4, 23) {
            let s = singularity(&mech, &state.pose, scale, SINGULAR);
            assert_eq!((s.kind, s.leg, s.uncontrolled), (Kind::None, None, 0), "{}", mech.name);
            let [legs, constraints] = noticed(&mech, &state.pose, &s.twist);
            assert!((legs - s.conditioning.sigma_min).abs() < 1e-11, "{}", mech.name);
            assert!(constraints < 1e-9, "{}: {constraints}", mech.name);
            let size = s.twist.v.dot(s.twist.v) + s.twist.omega.dot(s.twist.omega) * scale * scale;
            assert!((size - 1.0).abs() < 1e-12);
            let (screw, omega) = (s.screw, s.twist.omega);
            if screw.pitch.is_infinite() {
                assert!(omega.norm() * scale <= 1e-6 && screw.point == state.pose.o, "{}", mech.name);
                assert!((screw.axis - s.twist.v.unit()).norm() < 1e-12);
                continue;
            }
            // The screw's point moves along the axis only, by the pitch.
            let at_point = s.twist.v + omega.cross(screw.point - state.pose.o);
            let along = screw.axis * (screw.pitch * omega.norm());
            assert!((at_point - along).norm() < 1e-9 * (1.0 + along.norm()), "{}", mech.name);
            assert!((screw.point - state.pose.o).dot(screw.axis).abs() < 1e-9);
        }
    }
}

#[test]
fn all_constraints_count_not_those_in_j_alone() {
    // J with one constraint twice is singular, while all of them together hold the platform.
    let mut mech = with_leg("RPR", 9);
    let state = states(&mech, 1, 3)[0];
    let before = singularity(&mech, &state.pose, mech.characteristic_length, SINGULAR);
    mech.independent[1] = mech.independent[0];
    let s = singularity(&mech, &state.pose, mech.characteristic_length, SINGULAR);
    assert_eq!((s.kind, s.determinant, s.uncontrolled), (Kind::DependentRows, 0.0, 0));
    assert!((s.conditioning.sigma_min - before.conditioning.sigma_min).abs() < 1e-12);
    assert!(singularity::smallest(&mech, &state.pose, mech.characteristic_length) < 1e-12);
}

#[test]
fn a_platform_without_its_constraints_is_a_constraint_singularity() {
    // All rows the same one: of rank one where generic poses have three.
    let mut mech = with_leg("RPR", 9);
    let state = states(&mech, 1, 3)[0];
    let first = mech.constraints[0];
    mech.constraints.iter_mut().for_each(|c| *c = first);
    let s = singularity(&mech, &state.pose, mech.characteristic_length, SINGULAR);
    let lost = mech.independent.len() - 1;
    assert_eq!((s.kind, s.uncontrolled), (Kind::Constraint, lost));
    assert_eq!(s.conditioning.sigma_min, 0.0);
    let [legs, constraints] = noticed(&mech, &state.pose, &s.twist);
    assert!(legs < 1e-12 && constraints < 1e-12, "{legs} {constraints}");
}

#[test]
fn the_scale_changes_numbers_and_no_zero() {
    // det J scales by a power of the length, whatever the pose; so its zeros do not move.
    let mech = published();
    let ratios: Vec<f64> = states(&mech, 5, 7)
        .iter()
        .map(|s| {
            let det = |scale| determinant(&mech, &s.pose, &Twist::zero(), scale).x;
            det(0.3) / det(0.15)
        })
        .collect();
    assert!(ratios.iter().all(|r| (r - 0.125).abs() < 1e-9), "{ratios:?}");
}
