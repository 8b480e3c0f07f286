//! Accelerations from forces against the inverse dynamics, and the charts of simulations against jets, for
//! every leg of the catalogue and for the published manipulator.

mod common;

use common::{close, mechanisms, states};
use polypod_core::dynamics::forward_dynamics::{forward_dynamics, platform_equations};
use polypod_core::dynamics::inverse_dynamics;
use polypod_core::kinematics::chart::Chart;
use polypod_core::kinematics::constraint;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::number::order::larger;
use polypod_core::number::real::{Dual, F, Real};
use polypod_core::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3, Wrench};

/// Relative, for numbers by two routes in double precision.
const EXACT: f64 = 1e-9;

/// The acceleration under the mechanism's own load, with any number.
fn driven<T: Real>(mech: &Mechanism, pose: &Pose<f64>, twist: &Twist<f64>, forces: &[T]) -> [T; 6] {
    let twist = Twist::new(Vec3::lift(twist.v), Vec3::lift(twist.omega));
    let load = Wrench::new(Vec3::lift(mech.load.wrench.force), Vec3::lift(mech.load.wrench.torque));
    forward_dynamics(mech, &Pose::lift(pose), &twist, forces, load).acceleration.array()
}

#[test]
fn accelerations_of_the_forces_of_a_motion_are_its_own() {
    for mech in mechanisms() {
        for Motion { pose, twist, acceleration } in states(&mech, 6, 5) {
            let load = mech.load.wrench;
            let motion = Motion { pose, twist, acceleration };
            let (f, _) = inverse_dynamics::inverse_dynamics(&mech, &motion, load);
            let found = forward_dynamics(&mech, &pose, &twist, &f[..mech.dof()], load);
            close(found.acceleration.a, acceleration.a, EXACT, &mech.name);
            close(found.acceleration.eps, acceleration.eps, EXACT, &mech.name);
            for (multiplier, known) in found.multipliers.iter().zip(&f[mech.dof()..]) {
                let size = f.iter().fold(1.0_f64, |m, x| larger(m, x.abs()));
                assert!((multiplier - known).abs() < EXACT * size, "{}", mech.name);
            }
        }
    }
}

#[test]
fn the_same_source_serves_every_number() {
    for mech in mechanisms() {
        for Motion { pose, twist, .. } in states(&mech, 2, 6) {
            let forces: Vec<f64> = (0..mech.dof()).map(|i| 10.0 * i as f64 - 20.0).collect();
            let plain = driven(&mech, &pose, &twist, &forces);
            let fused =
                driven::<F<true>>(&mech, &pose, &twist, &forces.iter().map(|&f| F(f)).collect::<Vec<_>>());
            // Affine in the forces: the derivative by one of them is a difference, whatever its size.
            let mut rising: Vec<Dual<f64>> = forces.iter().map(|&f| Dual::new(f, 0.0)).collect();
            rising[0].d = 1.0;
            let dual = driven(&mech, &pose, &twist, &rising);
            let mut more = forces.clone();
            more[0] += 100.0;
            let next = driven(&mech, &pose, &twist, &more);
            let size = plain.iter().chain(&next).fold(1.0_f64, |m, x| larger(m, x.abs()));
            for i in 0..6 {
                assert!((plain[i] - fused[i].0).abs() < EXACT * size, "{}", mech.name);
                assert_eq!(dual[i].x, plain[i]);
                assert!((dual[i].d - (next[i] - plain[i]) / 100.0).abs() < EXACT * size, "{}", mech.name);
            }
        }
    }
}

#[test]
fn the_terms_add_up_to_the_resultant() {
    for mech in mechanisms() {
        for Motion { pose, twist, acceleration } in states(&mech, 4, 7) {
            let e = platform_equations(&mech, &pose, &twist);
            let (v, a) = (twist.array(), acceleration.array());
            let motion = Motion { pose, twist, acceleration };
            let known = inverse_dynamics::resultant(&mech, &motion, Wrench::zero()).array();
            let size = known.iter().fold(1.0_f64, |m, x| larger(m, x.abs()));
            for i in 0..6 {
                let sum: f64 =
                    (0..6).map(|j| e.mass[i][j] * a[j] + (e.coriolis[i][j] + e.damping[i][j]) * v[j]).sum();
                assert!((sum + e.gravity[i] + known[i]).abs() < EXACT * size, "{}", mech.name);
            }
        }
    }
}

#[test]
fn charts_keep_the_constraints_and_know_their_rates() {
    for mech in mechanisms() {
        for Motion { pose, twist, .. } in states(&mech, 4, 8) {
            let chart = Chart::at(&mech, &pose).expect("the constraints are independent");
            let rates = chart.rates(&twist);
            assert_eq!(rates.len(), mech.dof());
            let at = |t: f64| {
                let theta: Vec<f64> = rates.iter().map(|r| r * t).collect();
                chart.place(&mech, &theta, &rates).expect("the chart reaches there")
            };
            let start = at(0.0);
            close(start.twist.v, twist.v, EXACT, &mech.name);
            close(start.twist.omega, twist.omega, EXACT, &mech.name);
            let (t, h) = (0.05, 1e-4);
            let [before, now, after] = [at(t - h), at(t), at(t + h)];
            assert!(constraint::largest_distance(&mech, &now.pose) < 1e-13, "{}", mech.name);
            // Along θ = t θ' the second rates are zero: the acceleration by differences of twists must say
            // so.
            let rate = |a: Vec3<f64>, b: Vec3<f64>| (b - a) * (0.5 / h);
            let v = rate(before.pose.o, after.pose.o);
            close(now.twist.v, v, 1e-5, &mech.name);
            let columns = |p: &Pose<f64>| p.rotation.0;
            let turned =
                Mat3(std::array::from_fn(|i| rate(columns(&before.pose)[i], columns(&after.pose)[i])));
            let omega = columns(&now.pose)
                .iter()
                .zip(turned.0)
                .fold(Vec3::zero(), |sum, (c, d)| sum + c.cross(d) * 0.5);
            close(now.twist.omega, omega, 1e-5, &mech.name);
            let acceleration = Acceleration::new(
                rate(before.twist.v, after.twist.v),
                rate(before.twist.omega, after.twist.omega),
            );
            let second = chart.second_rates(&now, &acceleration);
            let size = acceleration.array().iter().fold(1.0_f64, |m, x| larger(m, x.abs()));
            assert!(second.iter().all(|s| s.abs() < 1e-5 * size), "{}: {second:?}", mech.name);
        }
    }
}
