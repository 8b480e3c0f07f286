//! Kinematics of many states.

use super::checks::{
    actuated_values, check_finite, check_twist, is_rotation, limit_status, outcome, raw_pose, read_pose, six,
    then,
};
use super::{States, Table};
use crate::jacobian;
use crate::joints::{self, Zero};
use crate::leg;
use crate::mechanism::Mechanism;
use crate::spatial::Twist;
use crate::status::Status;

/// Lengths, vectors r and directions δ of all legs [Eq. 3].
#[must_use]
pub fn inverse_kinematics(mech: &Mechanism, poses: &[f64]) -> Table {
    let (states, legs) = (poses.len() / 16, mech.legs.len());
    let (mut table, [lengths, vectors, directions]) = Table::new(
        states,
        [("lengths", vec![legs]), ("vectors", vec![legs, 3]), ("directions", vec![legs, 3])],
    );
    for i in 0..states {
        let (pose, mut status) = read_pose(mech, poses, i);
        if status == Status::Ok {
            status = limit_status(mech, &pose);
            for (k, leg) in mech.legs.iter().enumerate() {
                let p = leg::position(leg, &pose);
                table.set(lengths, i, k, &[p.length]);
                table.set(vectors, i, k, &p.r.array());
                table.set(directions, i, k, &p.delta.array());
            }
        }
        table.status[i] = status;
    }
    table
}

/// J for each pose, constraint satisfied or not [Eq. 13].
#[must_use]
pub fn jacobians(mech: &Mechanism, poses: &[f64]) -> Table {
    let states = poses.len() / 16;
    let (mut table, [matrix]) = Table::new(states, [("jacobian", vec![6, 6])]);
    for i in 0..states {
        if !is_rotation(poses, i) {
            continue;
        }
        for (k, row) in jacobian::jacobian(mech, &raw_pose(poses, i)).iter().enumerate() {
            table.set(matrix, i, k, row);
        }
    }
    table
}

/// H for each pose, constraint satisfied or not [Eq. 19].
#[must_use]
pub fn hessians(mech: &Mechanism, poses: &[f64]) -> Table {
    let states = poses.len() / 16;
    let (mut table, [layers]) = Table::new(states, [("hessian", vec![6, 6, 6])]);
    for i in 0..states {
        if !is_rotation(poses, i) {
            continue;
        }
        for (k, row) in jacobian::hessian(mech, &raw_pose(poses, i)).as_flattened().iter().enumerate() {
            table.set(layers, i, k, row);
        }
    }
    table
}

/// Every quantity of legs, rods, cylinders, pistons and joints [Eq. 2-39].
#[must_use]
pub fn kinematics(mech: &Mechanism, states: &States) -> Table {
    let (n, legs, rods) = (states.len(), mech.legs.len(), mech.rods.len());
    let (scalar, vector, pair) = (|| vec![legs], || vec![legs, 3], || vec![legs, 2]);
    let (mut table, ids) = Table::new(
        n,
        [
            ("lengths", scalar()),
            ("rates", scalar()),
            ("accelerations", scalar()),
            ("directions", vector()),
            ("leg_omega", vector()),
            ("leg_eps", vector()),
            ("leg_spin", scalar()),
            ("leg_spin_rate", scalar()),
            ("piston_velocity", vector()),
            ("piston_acceleration", vector()),
            ("cylinder_velocity", vector()),
            ("cylinder_acceleration", vector()),
            ("base_joint_angles", pair()),
            ("base_joint_rates", pair()),
            ("platform_joint_angles", pair()),
            ("platform_joint_rates", pair()),
            ("base_cone_angle", scalar()),
            ("platform_cone_angle", scalar()),
            ("rod_angle", vec![rods]),
            ("rod_omega", vec![rods, 3]),
            ("rod_eps", vec![rods, 3]),
        ],
    );
    let zeros: Vec<Zero> = mech.legs.iter().map(|leg| Zero::of(leg, &mech.home)).collect();
    for i in 0..n {
        let (platform, status) = states.read(mech, i);
        table.status[i] = then(status, || limit_status(mech, &platform.pose));
        if status != Status::Ok {
            continue;
        }
        for (k, leg) in mech.legs.iter().enumerate() {
            let state = leg::state(leg, &platform);
            let leg::State { position: p, end, turn, frame } = &state;
            let (piston, cylinder) = (leg::piston(leg, &state), leg::cylinder(leg, &state));
            let [below, above] = joints::angles(leg, &zeros[k], &platform, &state);
            let values: [&[f64]; 18] = [
                &[p.length],
                &[end.rate],
                &[end.acceleration],
                &p.delta.array(),
                &turn.omega.array(),
                &turn.eps.array(),
                &[turn.spin],
                &[turn.spin_rate],
                &piston.velocity.array(),
                &piston.acceleration.array(),
                &cylinder.velocity.array(),
                &cylinder.acceleration.array(),
                &below.angles,
                &below.rates,
                &above.angles,
                &above.rates,
                &[below.cone],
                &[above.cone],
            ];
            for (id, value) in ids.iter().zip(values) {
                table.set(*id, i, k, value);
            }
            for (r, rod) in mech.rods.iter().enumerate().filter(|(_, rod)| rod.leader == k) {
                let rod_turn = leg::rod_turn(rod.axis, &state);
                table.set(ids[18], i, r, &[joints::rod_angle(mech, r, &zeros[k], frame.n())]);
                table.set(ids[19], i, r, &(rod.axis * rod_turn.rate).array());
                table.set(ids[20], i, r, &(rod.axis * rod_turn.acceleration).array());
            }
        }
    }
    table
}

/// The platform's twist from the rates of all legs; those of passive legs are not read [Eq. 13].
#[must_use]
pub fn platform_twist(mech: &Mechanism, poses: &[f64], rates: &[f64]) -> Table {
    let n = poses.len() / 16;
    let (mut table, [field]) = Table::new(n, [("twist", vec![6])]);
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        let legs = actuated_values(mech, rates, i);
        let mut status = then(status, || check_finite(&legs));
        if status == Status::Ok {
            let (twist, pivots) = jacobian::platform_twist(mech, &pose, &legs);
            status = outcome(mech, &twist.array(), pivots);
            if status == Status::Ok {
                table.set(field, i, 0, &twist.array());
            }
        }
        table.status[i] = status;
    }
    table
}

/// The platform's acceleration from its twist and the accelerations of all legs [Eq. 19].
#[must_use]
pub fn platform_acceleration(
    mech: &Mechanism,
    poses: &[f64],
    twists: &[f64],
    accelerations: &[f64],
) -> Table {
    let n = poses.len() / 16;
    let (mut table, [field]) = Table::new(n, [("acceleration", vec![6])]);
    for i in 0..n {
        let (pose, status) = read_pose(mech, poses, i);
        let twist = Twist::from_array(six(twists, i));
        let legs = actuated_values(mech, accelerations, i);
        let status = then(status, || check_twist(mech, &pose, &twist));
        let mut status = then(status, || check_finite(&legs));
        if status == Status::Ok {
            let (a, pivots) = jacobian::platform_acceleration(mech, &pose, &twist, &legs);
            status = outcome(mech, &a.array(), pivots);
            if status == Status::Ok {
                table.set(field, i, 0, &a.array());
            }
        }
        table.status[i] = status;
    }
    table
}
