//! Joint reactions against the rates of momentum of every link, for every leg of the catalogue and for rods
//! with one to three legs.

mod common;

use common::{mechanisms, moving, parts, states};
use polypod_core::dynamics::inverse_dynamics;
use polypod_core::dynamics::joint_reactions::{self, Given, JointFrame};
use polypod_core::dynamics::self_stress;
use polypod_core::kinematics::leg;
use polypod_core::model::mechanism::{Body, Mechanism};
use polypod_core::number::order::{larger, largest};
use polypod_core::number::real::{Dual, F, Jet, Real, Scalar};
use polypod_core::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3, Wrench};

/// Of the largest reaction: what a balance may leave.
const CLOSED: f64 = 1e-9;

fn samples(mech: &Mechanism) -> Vec<Motion<f64>> {
    states(mech, 6, 17)
}

fn load(mech: &Mechanism, state: &Motion<f64>) -> Wrench<f64> {
    inverse_dynamics::load_in_base(mech.load.wrench, mech.load.axes, &state.pose)
}

/// Weight less the rates of linear momentum, and of angular momentum about the mass centre, of a link that
/// moves as its axes do; with its mass centre.
fn by_momentum(body: &Body, axes: Mat3<Jet<f64>>, place: Vec3<Jet<f64>>, gravity: Vec3<f64>) -> Link {
    let [center, _, acceleration] = parts(place + axes * Vec3::lift(body.center));
    // ω = ½ Σ x_i × x_i' and its rate, over the columns of the axes.
    let mut omega = [Vec3::zero(); 2];
    for column in axes.0 {
        let [x, d, dd] = parts(column);
        omega = [omega[0] + x.cross(d) * 0.5, omega[1] + x.cross(dd) * 0.5];
    }
    let spin = common::jets(omega[0], omega[1], Vec3::zero());
    let [_, momentum_rate, _] = parts(axes * (Mat3::lift(body.inertia) * axes.transpose_mul(spin)));
    Link { center, given: Wrench::new((gravity - acceleration) * body.mass, -momentum_rate) }
}

#[derive(Clone, Copy)]
struct Link {
    center: Vec3<f64>,
    /// About the mass centre.
    given: Wrench<f64>,
}

/// All moving links by name.
fn links(mech: &Mechanism, state: &Motion<f64>) -> Vec<(String, Link)> {
    let pose = moving(state);
    let mut all = Vec::new();
    for leg in &mech.legs {
        let p = leg::position(leg, &pose);
        let mut axes = leg::frame(leg, &pose, &p).axes;
        if ["SPS", "PSS"].contains(&leg.letters().as_str()) {
            // It does not spin, and its bodies are symmetric: any axes that rotate with δ will do.
            axes = without_spin(axes, parts(p.delta));
        }
        let (foot, [first, second]) = (leg::foot(leg, &p), leg.links());
        // A carriage keeps the base's axes.
        let below = if first == "carriage" { Mat3::identity() } else { axes };
        let lower = by_momentum(&leg.cylinder, below, foot, mech.gravity);
        let upper = by_momentum(&leg.piston, axes, foot + p.r, mech.gravity);
        all.push((format!("{first} {}", leg.name), lower));
        all.push((format!("{second} {}", leg.name), upper));
    }
    for rod in &mech.rods {
        let leader = &mech.legs[rod.leader];
        let (axis, n) = (Vec3::lift(rod.axis), leg::frame(leader, &pose, &leg::position(leader, &pose)).n());
        let axes = Mat3::from_columns(axis, n, axis.cross(n));
        let link = by_momentum(&rod.body, axes, Vec3::lift(rod.point), mech.gravity);
        all.push((format!("rod {}", rod.name), link));
    }
    let mut own = by_momentum(&mech.platform, pose.rotation, pose.o, mech.gravity);
    let load = load(mech, state).moved(state.pose.o - own.center);
    let damping = Wrench::new(state.twist.v * mech.linear_damping, state.twist.omega * mech.angular_damping);
    own.given = (own.given + load - damping.moved(state.pose.o - own.center)) * (1.0 / mech.efficiency);
    all.push(("platform".into(), own));
    all
}

/// The frame with the rates of one that follows δ without spinning.
fn without_spin(axes: Mat3<Jet<f64>>, [delta, d, dd]: [Vec3<f64>; 3]) -> Mat3<Jet<f64>> {
    let (omega, eps) = (delta.cross(d), delta.cross(dd));
    Mat3(axes.0.map(|column| {
        let [x, _, _] = parts(column);
        let rate = omega.cross(x);
        common::jets(x, rate, eps.cross(x) + omega.cross(rate))
    }))
}

#[test]
fn every_link_is_balanced_and_free_turns_carry_nothing() {
    for mech in mechanisms() {
        let joints = joint_reactions::joints(&mech);
        let length = mech.characteristic_length;
        for state in samples(&mech) {
            let found =
                self_stress::solve(&mech, &joints, &state, load(&mech, &state), length).expect("regular");
            for all in [&found.assumed, &found.least] {
                let largest = largest(all.iter().flat_map(|w| [w.force.norm(), w.torque.norm() / length]));
                for (name, link) in links(&mech, &state) {
                    let mut sum = link.given;
                    for ((joint, place), reaction) in joints.iter().zip(&found.places).zip(all) {
                        let here = reaction.moved(place.point - link.center);
                        if joint.links[1] == name {
                            sum = sum + here;
                        } else if joint.links[0] == name {
                            sum = sum - here;
                        }
                    }
                    let left = larger(sum.force.norm(), sum.torque.norm() / length);
                    assert!(left <= CLOSED * largest, "{}, {name}: {left:e} of {largest:e}", mech.name);
                }
                for ((joint, place), reaction) in joints.iter().zip(&found.places).zip(all) {
                    let [x, y, z] = place.seen(*reaction).torque.array();
                    let free: &[f64] = match joint.kind {
                        "S" => &[x, y, z],
                        "U" => &[x, y],
                        "R" => &[x],
                        _ => &[],
                    };
                    let carried = free.iter().any(|t| t.abs() > CLOSED * largest * length);
                    assert!(!carried, "{}, {}: {free:?}", mech.name, joint.name);
                }
            }
        }
    }
}

#[test]
fn prismatic_joints_carry_the_active_forces() {
    for mech in mechanisms() {
        let joints = joint_reactions::joints(&mech);
        for state in samples(&mech) {
            let load = load(&mech, &state);
            let found = self_stress::solve(&mech, &joints, &state, load, 1.0).expect("regular");
            let (active, _) = inverse_dynamics::inverse_dynamics(&mech, &state, load);
            let largest = largest(active.iter().map(|f| f.abs()));
            let mut active = active.iter();
            for (i, leg) in mech.legs.iter().enumerate() {
                let expected = if leg.actuated { *active.next().expect("one for each") } else { 0.0 };
                let k = mech.rods.len() + 3 * i + 1;
                let axial = found.places[k].seen(found.assumed[k]).force.y;
                let error = (axial - expected).abs();
                assert!(error <= CLOSED * largest, "{}, {}: {axial} is not {expected}", mech.name, leg.name);
            }
        }
    }
}

/// As many self-stresses as there are redundant constraints, and none elsewhere.
#[test]
fn components_are_open_where_constraints_are_redundant() {
    let mut redundant = 0;
    for mech in mechanisms() {
        let joints = joint_reactions::joints(&mech);
        let state = samples(&mech)[0];
        let found = self_stress::solve(&mech, &joints, &state, load(&mech, &state), 1.0).expect("regular");
        for (joint, marks) in joints.iter().zip(&found.determinate_in_joint) {
            let number = joint.name.rsplit(' ').next().unwrap_or_default();
            let coupled = mech.mobility.redundant_legs.iter().any(|&i| mech.legs[i].name == number);
            assert!(coupled || marks.iter().all(|&mark| mark), "{}, {}: {marks:?}", mech.name, joint.name);
            redundant += usize::from(marks.contains(&false));
        }
    }
    assert!(redundant >= 12, "two mechanisms have redundant constraints: {redundant} joints");
}

/// Couples of universal joints in the first choice, and all reactions in the second, are perpendicular to the
/// self-stress that the choices differ by; on the published manipulator the first has no couples at all where
/// they are open.
#[test]
fn choices_are_least_and_differ_in_open_components_only() {
    let mut different = 0;
    for mech in mechanisms().into_iter().filter(|m| m.mobility.redundant > 0) {
        let joints = joint_reactions::joints(&mech);
        let length = mech.characteristic_length;
        for state in samples(&mech) {
            let found =
                self_stress::solve(&mech, &joints, &state, load(&mech, &state), length).expect("regular");
            let (mut couples, mut sizes, mut square) = ([0.0; 2], [0.0; 2], 0.0);
            for (j, (joint, place)) in joints.iter().zip(&found.places).enumerate() {
                let [assumed, least] = [found.assumed[j], found.least[j]];
                let step = assumed - least;
                let product = |a: Wrench<f64>, b: Wrench<f64>| {
                    a.force.dot(b.force) + a.torque.dot(b.torque) / (length * length)
                };
                square += product(step, step);
                sizes = [sizes[0] + product(least, step), sizes[1] + product(least, least)];
                if joint.kind == "U" {
                    let torque = assumed.torque * (1.0 / length);
                    let along = torque.dot(step.torque) / length;
                    let own = if step.torque.norm() > 1e-6 { torque.dot(torque) } else { 0.0 };
                    couples = [couples[0] + along, couples[1] + own];
                }
                for (marks, step) in [
                    (found.determinate[j], step.array()),
                    (found.determinate_in_joint[j], place.seen(step).array()),
                ] {
                    let moved = (0..6).any(|k| marks[k] && step[k].abs() > 1e-9 * sizes[1].sqrt());
                    assert!(!moved, "{}, {}: {marks:?} {step:?}", mech.name, joint.name);
                }
            }
            let scale = 1e-9 * sizes[1];
            assert!(
                sizes[0].abs() <= scale && couples[0].abs() <= scale,
                "{}: {sizes:?} {couples:?}",
                mech.name
            );
            if mech.name == "lu" {
                assert!(couples[1] <= 1e-18 * sizes[1], "couples {couples:?}");
            }
            different += usize::from(square > 1e-6 * sizes[1]);
        }
    }
    assert!(different > 0);
}

#[test]
fn joint_axes_are_right_handed() {
    for mech in mechanisms() {
        let places = joint_reactions::places(&mech, &samples(&mech)[0].pose);
        for axes in places.iter().map(|place| place.axes) {
            let square = axes.departures().iter().all(|e| e.abs() < 1e-12);
            assert!(square && axes.determinant() > 0.0, "{}", mech.name);
        }
    }
}

/// With the platform's balance: what other legs do to it, and the active forces, are the rest.
#[test]
fn the_constraint_wrench_is_what_others_leave() {
    for mech in mechanisms() {
        let joints = joint_reactions::joints(&mech);
        for state in samples(&mech) {
            let load = load(&mech, &state);
            let found = self_stress::solve(&mech, &joints, &state, load, 1.0).expect("regular");
            let (active, _) = inverse_dynamics::inverse_dynamics(&mech, &state, load);
            let own = Given::of(&mech, &state, load).platform;
            let mut rest = found.constraint + own;
            let mut active = active.iter();
            for (i, leg) in mech.legs.iter().enumerate() {
                let force = if leg.actuated { *active.next().expect("one for each") } else { 0.0 };
                let constrains = mech.constraints.iter().any(|c| c.leg == i)
                    || (leg.rod.is_some() && mech.legs.iter().filter(|l| l.rod == leg.rod).count() > 1);
                let k = mech.rods.len() + 3 * i + 2;
                rest = rest
                    + if constrains {
                        leg::row(leg, &leg::position(leg, &state.pose)) * force
                    } else {
                        found.least[k].moved(found.places[k].point - state.pose.o)
                    };
            }
            let largest = found.assumed.iter().fold(own.force.norm(), |m, w| larger(m, w.force.norm()));
            let left = larger(rest.force.norm(), rest.torque.norm());
            assert!(left <= CLOSED * largest, "{}: {left:e} of {largest:e}", mech.name);
        }
    }
}

/// Everything but the choice of self-stresses, in the number T.
fn kernels<T: Scalar>(mech: &Mechanism, state: &Motion<f64>, on_platform: &[Wrench<f64>]) -> Vec<f64> {
    let lift = Vec3::<T>::lift;
    let platform = Motion {
        pose: Pose::lift(&state.pose),
        twist: Twist::new(lift(state.twist.v), lift(state.twist.omega)),
        acceleration: Acceleration::new(lift(state.acceleration.a), lift(state.acceleration.eps)),
    };
    let load = load(mech, state);
    let given = Given::of(mech, &platform, Wrench::new(lift(load.force), lift(load.torque)));
    let places: Vec<JointFrame<T>> = joint_reactions::places(mech, &platform.pose);
    let tops: Vec<_> = on_platform.iter().map(|w| Wrench::new(lift(w.force), lift(w.torque))).collect();
    let all = joint_reactions::reactions(mech, &places, &given, &tops);
    let joints = joint_reactions::joints(mech);
    let left = joint_reactions::unbalanced(mech, &joints, &places, platform.pose.o, &given, &all);
    let components = all.iter().flat_map(|w| w.array());
    components.chain(left).map(Real::value).collect()
}

#[test]
fn the_same_source_serves_every_number() {
    for mech in mechanisms() {
        let joints = joint_reactions::joints(&mech);
        for state in samples(&mech) {
            let found =
                self_stress::solve(&mech, &joints, &state, load(&mech, &state), 1.0).expect("regular");
            let tops: Vec<_> =
                (0..mech.legs.len()).map(|i| found.assumed[mech.rods.len() + 3 * i + 2]).collect();
            let plain = kernels::<f64>(&mech, &state, &tops);
            assert_eq!(plain, kernels::<F<false>>(&mech, &state, &tops), "{}: unfused", mech.name);
            assert_eq!(plain, kernels::<Dual<f64>>(&mech, &state, &tops), "{}: dual", mech.name);
        }
    }
}
