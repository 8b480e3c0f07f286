//! The closed formulas against the derivatives that jets and duals take of positions alone, for every leg of
//! the catalogue and for the published manipulator.

mod common;

use common::{Draw, close, every_leg, mechanisms, moving, on_rod, parts, published, states, with_leg};
use polypod_core::dynamics::inverse_dynamics;
use polypod_core::kinematics::constraint;
use polypod_core::kinematics::coordinate_sets::Set;
use polypod_core::kinematics::jacobian;
use polypod_core::kinematics::leg;
use polypod_core::kinematics::quadratic_forms;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::number::order::{larger, largest};
use polypod_core::number::real::{Dual, F, Real, Scalar};
use polypod_core::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3, Wrench};

/// Relative, for second derivatives by two routes in double precision.
const EXACT: f64 = 1e-10;

/// States to test at: generic ones, and for the published manipulator its nearly singular neighbourhood of
/// home.
fn samples(mech: &Mechanism) -> Vec<Motion<f64>> {
    states(mech, 6, 11)
}

#[test]
fn every_leg_of_the_catalogue_has_the_freedoms_of_its_joints() {
    for letters in every_leg() {
        for seed in 1..4 {
            let mech = with_leg(&letters, seed);
            let leg = &mech.legs[0];
            let joints = leg.base.kind.freedoms() + 1 + leg.platform.kind.freedoms();
            assert_eq!(mech.dof(), joints.min(6), "{letters}");
            assert_eq!(mech.constraints.len(), 6 - joints.min(6), "{letters} has a constraint too many");
            assert_eq!(
                (mech.mobility.redundant, mech.mobility.passive),
                (0, joints.saturating_sub(6)),
                "{letters}"
            );
        }
    }
}

#[test]
fn legs_on_a_rod_keep_the_angle_between_their_planes() {
    for count in 1..=3 {
        let mech = on_rod(count, count as u64);
        let expected = [(5, 0), (3, 0), (2, 1)][count - 1];
        assert_eq!((mech.dof(), mech.mobility.redundant), expected, "{count} legs on a rod");
        let on_it: Vec<_> = mech.legs.iter().filter(|leg| leg.rod.is_some()).collect();
        let planes = |state: &Motion<f64>| -> Vec<f64> {
            let normals = on_it.iter().map(|leg| leg::state(leg, state).frame.n());
            let first = leg::state(on_it[0], state).frame.n();
            normals.map(|n| first.cross(n).dot(mech.rods[0].axis).atan2(first.dot(n))).collect()
        };
        let home = Motion { pose: mech.home, twist: Twist::zero(), acceleration: Acceleration::zero() };
        for state in samples(&mech) {
            for (at_home, now) in planes(&home).iter().zip(planes(&state)) {
                assert!((at_home - now).abs() < 1e-12, "{count} legs: {at_home} became {now}");
            }
        }
    }
    let published = published();
    assert_eq!(
        (published.constraints.len(), published.independent.len(), published.mobility.redundant),
        (3, 1, 2)
    );
}

#[test]
fn leg_motion_is_the_derivative_of_leg_position() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            for leg in &mech.legs {
                let jet = leg::position(leg, &moving(&state));
                let p = leg::position(leg, &state.pose);
                let f = leg::frame(leg, &state.pose, &p);
                let m = leg::end(leg, &p, &f, &state);
                let [_, r1, r2] = parts(leg::foot(leg, &jet) + jet.r);
                let [_, d1, d2] = parts(jet.delta);
                close(m.v_b, r1, EXACT, "v_b");
                close(m.a_b, r2, EXACT, "a_b");
                let ([a, b], speed) = (m.delta_rate, m.delta_rate[0].hypot(m.delta_rate[1]));
                close(f.axes * Vec3::new(a, 0.0, b), d1, EXACT, "δ'");
                let [a, b] = m.delta_acceleration;
                close(f.axes * Vec3::new(a, -speed * speed, b), d2, EXACT, "δ''");
                let scalars = Vec3::new(m.rate, m.acceleration, 0.0);
                close(scalars, Vec3::new(jet.coordinate.d, jet.coordinate.dd, 0.0), EXACT, "ℓ', ℓ''");
            }
        }
    }
}

#[test]
fn leg_turning_is_the_derivative_of_the_leg_frame() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            let moving = moving(&state);
            for (leg, name) in mech.legs.iter().map(|l| (l, format!("{} {}", mech.name, l.letters()))) {
                if ["SPS", "PSS"].contains(&leg.letters().as_str()) {
                    continue; // its frame is arbitrary
                }
                let f = leg::frame(leg, &moving, &leg::position(leg, &moving));
                // ω = ½ Σ x_i × x_i', ε = ½ Σ x_i × x_i'' over the columns of the frame
                let mut angular = [Vec3::zero(); 2];
                for column in f.axes.0 {
                    let [x, d, dd] = parts(column);
                    angular = [angular[0] + x.cross(d) * 0.5, angular[1] + x.cross(dd) * 0.5];
                }
                let whole = leg::state(leg, &state);
                close(whole.omega(), angular[0], EXACT, &format!("{name}: ω"));
                close(whole.eps(), angular[1], 10.0 * EXACT, &format!("{name}: ε"));
            }
        }
    }
}

#[test]
fn links_move_as_their_mass_centres_do() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            let moving = moving(&state);
            for leg in mech.legs.iter().filter(|l| !["SPS", "PSS"].contains(&l.letters().as_str())) {
                let pj = leg::position(leg, &moving);
                let fj = leg::frame(leg, &moving, &pj);
                let whole = leg::state(leg, &state);
                let foot = leg::foot(leg, &pj);
                let axes = if leg.links()[0] == "carriage" { Mat3::identity() } else { fj.axes };
                let piston = parts(foot + pj.r + fj.axes * Vec3::lift(leg.piston.center));
                let cylinder = parts(foot + axes * Vec3::lift(leg.cylinder.center));
                for (found, exact) in
                    [(leg::piston(leg, &whole), piston), (leg::cylinder(leg, &whole), cylinder)]
                {
                    close(found.velocity, exact[1], EXACT, "velocity");
                    close(found.acceleration, exact[2], 10.0 * EXACT, "acceleration");
                }
            }
        }
    }
}

#[test]
fn the_rod_turns_as_its_plane_does() {
    let mech = published();
    for state in samples(&mech) {
        for rod in &mech.rods {
            for leader in [0, 2] {
                let leg = &mech.legs[leader];
                let jet = moving(&state);
                let n = leg::frame(leg, &jet, &leg::position(leg, &jet)).n();
                let [x, d, dd] = parts(n);
                let whole = leg::state(leg, &state);
                let found = leg::rod_turn(rod.axis, &whole);
                close(rod.axis * found.rate, x.cross(d), EXACT, "ω_L");
                close(rod.axis * found.acceleration, x.cross(dd), EXACT, "ε_L");
            }
        }
    }
}

/// Rows and Hessians hold at any pose and for any motion, on the constraints or not.
#[test]
fn rows_and_hessians_are_the_derivatives_of_values() {
    let mut draw = Draw::new(5);
    for mech in mechanisms() {
        for state in samples(&mech) {
            let mut state = state;
            state.pose.o = state.pose.o + draw.vector() * 0.1;
            state.twist = Twist::new(draw.vector(), draw.vector());
            state.acceleration = Acceleration::new(draw.vector(), draw.vector());
            let jet = moving(&state);
            let v = state.twist.array();
            let total = |row: Wrench<f64>, h: &quadratic_forms::Hessian<f64>| {
                let a = Twist::new(state.acceleration.a, state.acceleration.eps);
                Vec3::new(row.power(&state.twist), row.power(&a) + quadratic_forms::quadratic(h, &v), 0.0)
            };
            for c in &mech.constraints {
                let g = constraint::value(c, &jet);
                let h = constraint::hessian(c, &state.pose);
                let found = total(constraint::row(c, &state.pose), &h);
                close(found, Vec3::new(g.d, g.dd, 0.0), EXACT, &format!("{} kind {:?}", mech.name, c.kind));
                symmetric(&h);
            }
            for leg in &mech.legs {
                let length = leg::position(leg, &jet).coordinate;
                let p = leg::position(leg, &state.pose);
                let h = leg::hessian(leg, &p);
                close(total(leg::row(leg, &p), &h), Vec3::new(length.d, length.dd, 0.0), EXACT, "length");
                symmetric(&h);
            }
        }
    }
}

fn symmetric(h: &quadratic_forms::Hessian<f64>) {
    for i in 0..6 {
        for j in 0..i {
            assert!((h[i][j] - h[j][i]).abs() <= 1e-14, "h[{i}][{j}]");
        }
    }
}

#[test]
fn carrying_a_wrench_keeps_its_power() {
    let mut draw = Draw::new(6);
    for mech in mechanisms() {
        for state in samples(&mech) {
            for leg in &mech.legs {
                let (force, torque) = (draw.vector(), draw.vector());
                let whole = leg::state(leg, &state);
                let v_b = whole.frame.axes.transpose_mul(whole.end.v_b);
                let power = force.dot(v_b) + torque.dot(whole.turn.omega);
                let carried = leg::carry(leg, &whole, force, torque).power(&state.twist);
                assert!(
                    (carried - power).abs() <= EXACT * larger(power.abs(), 1.0),
                    "{} {}",
                    mech.name,
                    leg.letters()
                );
            }
        }
    }
}

/// The power balance cannot see ω × I ω, which does no work: this can.
#[test]
fn inertial_wrenches_are_rates_of_momentum() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            let body = &mech.platform;
            let moving = moving(&state);
            let center = parts(moving.o + moving.rotation * Vec3::lift(body.center));
            let (omega, eps) = (state.twist.omega, state.acceleration.eps);
            let spin = common::jets(omega, eps, Vec3::zero());
            let inertia = Mat3::lift(body.inertia);
            let [_, momentum_rate, _] =
                parts(moving.rotation * (inertia * moving.rotation.transpose_mul(spin)));
            let force = (mech.gravity - center[2]) * body.mass;
            let damping = Wrench::new(state.twist.v * mech.linear_damping, omega * mech.angular_damping);
            let found = inverse_dynamics::platform_wrench(&mech, &state) + damping;
            close(found.force, force, EXACT, "force");
            let torque = (center[0] - state.pose.o).cross(force) - momentum_rate;
            close(found.torque, torque, EXACT, "torque");
        }
    }
}

/// Forces times leg rates are what load, damping and weight give and what inertia takes, with energies from
/// velocities alone.
#[test]
fn power_balances() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            let load = inverse_dynamics::load_in_base(mech.load.wrench, mech.load.axes, &state.pose);
            let (f, _) = inverse_dynamics::inverse_dynamics(&mech, &state, load);
            let rates =
                jacobian::jacobian(&mech, &state.pose).map(|row| Wrench::from_array(row).power(&state.twist));
            let actuators: f64 = f.iter().zip(&rates).take(mech.dof()).map(|(f, r)| f * r).sum();
            let own = load + inverse_dynamics::platform_wrench(&mech, &state);
            let (kinetic, potential) = energy_rates(&mech, &state);
            let damping = -(mech.linear_damping * state.twist.v.dot(state.twist.v)
                + mech.angular_damping * state.twist.omega.dot(state.twist.omega));
            let friction = (1.0 / mech.efficiency - 1.0) * own.power(&state.twist);
            let terms = [actuators, load.power(&state.twist), damping, friction, -kinetic, -potential];
            let scale = largest(terms.iter().map(|t| t.abs()));
            let residual: f64 = terms.iter().sum();
            assert!(residual.abs() <= 1e-10 * scale, "{}: {residual:e} of {scale:e}", mech.name);
        }
    }
}

fn energy_rates(mech: &Mechanism, state: &Motion<f64>) -> (f64, f64) {
    let dual =
        |x: Vec3<f64>, d: Vec3<f64>| Vec3::new(Dual::new(x.x, d.x), Dual::new(x.y, d.y), Dual::new(x.z, d.z));
    let pose = Pose {
        rotation: Mat3(state.pose.rotation.0.map(|c| dual(c, state.twist.omega.cross(c)))),
        o: dual(state.pose.o, state.twist.v),
    };
    let twist = Twist::new(
        dual(state.twist.v, state.acceleration.a),
        dual(state.twist.omega, state.acceleration.eps),
    );
    let (kinetic, potential) = inverse_dynamics::energy(mech, &pose, &twist);
    (kinetic.d, potential.d)
}

fn forces<T: Scalar>(mech: &Mechanism, state: &Motion<f64>) -> [f64; 6] {
    let lift = Vec3::<T>::lift;
    let platform = Motion {
        pose: Pose::lift(&state.pose),
        twist: Twist::new(lift(state.twist.v), lift(state.twist.omega)),
        acceleration: Acceleration::new(lift(state.acceleration.a), lift(state.acceleration.eps)),
    };
    let load = Wrench::new(lift(mech.load.wrench.force), lift(mech.load.wrench.torque));
    let (result, _) = inverse_dynamics::inverse_dynamics(mech, &platform, load);
    result.map(Real::value)
}

#[test]
fn the_same_source_serves_every_number() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            let plain = forces::<f64>(&mech, &state);
            assert_eq!(plain, forces::<F<false>>(&mech, &state), "{}: unfused", mech.name);
            assert_eq!(plain, forces::<Dual<f64>>(&mech, &state), "{}: dual", mech.name);
            let scale = largest(plain.iter().map(|f| f.abs()));
            for (a, b) in plain.iter().zip(forces::<F<true>>(&mech, &state)) {
                assert!((a - b).abs() <= 1e-8 * scale, "{}: fused {b} against {a}", mech.name);
            }
        }
    }
}

#[test]
fn duals_differentiate_the_inverse_dynamics() {
    let mech = published();
    for state in samples(&mech) {
        let at = |h: f64| {
            let mut moved = state;
            moved.twist.v.x += h;
            moved.twist.omega.z -= 2.0 * h;
            forces::<f64>(&mech, &moved)
        };
        let seed = |x: f64, d: f64| Dual::new(x, d);
        let v = state.twist.v;
        let w = state.twist.omega;
        let twist = Twist::new(
            Vec3::new(seed(v.x, 1.0), seed(v.y, 0.0), seed(v.z, 0.0)),
            Vec3::new(seed(w.x, 0.0), seed(w.y, 0.0), seed(w.z, -2.0)),
        );
        let acceleration =
            Acceleration::new(Vec3::lift(state.acceleration.a), Vec3::lift(state.acceleration.eps));
        let load = Wrench::new(Vec3::lift(mech.load.wrench.force), Vec3::lift(mech.load.wrench.torque));
        let platform = Motion { pose: Pose::lift(&state.pose), twist, acceleration };
        let (exact, _) = inverse_dynamics::inverse_dynamics(&mech, &platform, load);
        // Forces are quadratic in the twist: central differences are exact up to rounding.
        let (above, below) = (at(0.5), at(-0.5));
        let scale = largest(exact.iter().map(|f| f.d.abs()));
        for k in 0..6 {
            assert!((above[k] - below[k] - exact[k].d).abs() <= 1e-9 * scale, "force {k}");
        }
    }
}

#[test]
fn acceleration_from_the_legs_is_the_acceleration_of_the_platform() {
    for mech in mechanisms() {
        for state in samples(&mech) {
            let motions: Vec<_> = mech.actuated().map(|(_, leg)| leg::state(leg, &state).end).collect();
            let rates: Vec<f64> = motions.iter().map(|m| m.rate).collect();
            let seconds: Vec<f64> = motions.iter().map(|m| m.acceleration).collect();
            let (twist, pivots) = jacobian::platform_twist(&mech, &state.pose, &rates);
            let (a, _) = jacobian::platform_acceleration(&mech, &state.pose, &state.twist, &seconds);
            let tolerance = 1e-12 / pivots;
            close(twist.v, state.twist.v, tolerance, "v");
            close(twist.omega, state.twist.omega, tolerance, "ω");
            close(a.a, state.acceleration.a, tolerance, "a");
            close(a.eps, state.acceleration.eps, tolerance, "ε");
        }
    }
}

#[test]
fn coordinates_of_a_pose_give_the_pose() {
    for mech in mechanisms() {
        for set in Set::of(&mech) {
            for state in samples(&mech) {
                let back = set.pose(&mech, &set.values(&mech, &state.pose));
                close(back.o, state.pose.o, 1e-12, set.name());
                for (a, b) in back.rotation.0.iter().zip(state.pose.rotation.0) {
                    close(*a, b, 1e-12, set.name());
                }
            }
        }
    }
}
