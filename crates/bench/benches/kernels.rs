//! Scalar cost of the kernels for one state of the published manipulator.

#[path = "../../core/tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use polypod_core::dynamics::forward_dynamics;
use polypod_core::dynamics::inverse_dynamics;
use polypod_core::forward_kinematics::newton;
use polypod_core::kinematics::jacobian;
use polypod_core::kinematics::leg;
use polypod_core::number::real::{Dual, Real};
use polypod_core::spatial::{Acceleration, Motion, Pose, Twist, Vec3, Wrench};

/// Different states in turn, so that nothing is learnt from the last one.
const STATES: usize = 64;

fn lifted<T: Real>(state: &Motion<f64>) -> Motion<T> {
    let lift = Vec3::<T>::lift;
    Motion {
        pose: Pose::lift(&state.pose),
        twist: Twist::new(lift(state.twist.v), lift(state.twist.omega)),
        acceleration: Acceleration::new(lift(state.acceleration.a), lift(state.acceleration.eps)),
    }
}

fn kernels(criterion: &mut Criterion) {
    let mech = common::published();
    let states = common::states(&mech, STATES, 1);
    let mut group = criterion.benchmark_group("one state, scalar");
    group.throughput(Throughput::Elements(1));
    let mut measure = |name: &str, run: &dyn Fn(&Motion<f64>)| {
        let mut next = (0..STATES).cycle();
        group.bench_function(name, |b| {
            b.iter(|| run(black_box(&states[next.next().unwrap_or(0)])));
        });
    };
    measure("inverse kinematics", &|s| {
        for leg in &mech.legs {
            black_box(leg::position(leg, &s.pose).length);
        }
    });
    measure("Jacobian", &|s| {
        black_box(jacobian::jacobian(&mech, &s.pose));
    });
    measure("Hessian", &|s| {
        black_box(jacobian::hessian(&mech, &s.pose));
    });
    measure("inverse dynamics", &|s| {
        black_box(inverse_dynamics::inverse_dynamics(&mech, s, mech.load.wrench));
    });
    measure("forward dynamics", &|s| {
        let forces = black_box([100.0; 5]);
        black_box(forward_dynamics::forward_dynamics(&mech, &s.pose, &s.twist, &forces, mech.load.wrench));
    });
    measure("forward kinematics from a guess 1 mm off", &|s| {
        let mut lengths: Vec<f64> = mech.legs.iter().map(|leg| leg::position(leg, &s.pose).length).collect();
        lengths[0] += 1e-3;
        black_box(newton::forward_kinematics(&mech, &lengths, &s.pose));
    });
    measure("inverse dynamics and one derivative", &|s| {
        let platform = lifted::<Dual<f64>>(s);
        let load = Wrench::new(Vec3::lift(mech.load.wrench.force), Vec3::lift(mech.load.wrench.torque));
        black_box(inverse_dynamics::inverse_dynamics(&mech, &platform, load));
    });
    group.finish();
}

criterion_group!(benches, kernels);
criterion_main!(benches);
