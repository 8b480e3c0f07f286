//! Inverse dynamics by virtual power: every link's weight and inertia is carried to the platform's twist by
//! the transpose of its own Jacobian, then actuators and constraints balance the sum [Eq. 40, 41, 42, 43]
//! \[T13\] \[T14\] \[T15\] \[T16\] \[T17\].

use crate::kinematics::jacobian::scaled;
use crate::kinematics::leg;
use crate::kinematics::rows::{Matrix6, for_each_row};
use crate::model::mechanism::{Body, Leg, Mechanism, Rod};
use crate::model::spec::Axes;
use crate::number::real::{Constant, Real};
use crate::numerics::gauss::solve;
use crate::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3, Wrench};

/// The load on the platform at o; in platform axes it rotates with the platform.
#[inline(always)]
pub fn load_in_base<T: Real>(wrench: Wrench<T>, axes: Axes, pose: &Pose<T>) -> Wrench<T> {
    match axes {
        Axes::Base => wrench,
        Axes::Platform => Wrench::new(pose.rotation * wrench.force, pose.rotation * wrench.torque),
    }
}

/// Weight and inertial force of a link with the acceleration `a` of its mass centre [Eq. 40] \[T13\]:
/// `G + f = m (g - a)`.
#[inline(always)]
pub(crate) fn inertial_force<T: Real>(body: &Body, gravity: Vec3<T>, a: Vec3<T>) -> Vec3<T> {
    (gravity - a) * T::lit(body.mass)
}

/// Inertial torque `t = -(I ε + ω × I ω)` in the link's own axes [Eq. 40, completed] \[T13\].
#[inline(always)]
pub(crate) fn turning_torque<T: Real>(inertia: Mat3<f64>, omega: Vec3<T>, eps: Vec3<T>) -> Vec3<T> {
    let inertia = Mat3::lift(inertia);
    -(inertia * eps + omega.cross(inertia * omega))
}

/// Inertial torque -E [I Eᵀε + (Eᵀω)×(I Eᵀω)] of a link with axes E, in base axes \[T13\].
#[inline(always)]
fn inertial_torque<T: Real>(body: &Body, axes: Mat3<T>, omega: Vec3<T>, eps: Vec3<T>) -> Vec3<T> {
    axes * turning_torque(body.inertia, axes.transpose_mul(omega), axes.transpose_mul(eps))
}

/// The platform's own term of [Eq. 42]: weight, inertia and damping, as a wrench at o.
#[inline(always)]
pub fn platform_wrench<T: Real>(mech: &Mechanism<impl Constant<T>>, platform: &Motion<T>) -> Wrench<T> {
    body_wrench(mech, &mech.platform, platform) + damping_wrench(mech, &platform.twist)
}

/// Weight and inertia of a body that moves with the platform, as a wrench at o.
#[inline(always)]
pub(crate) fn body_wrench<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    body: &Body,
    platform: &Motion<T>,
) -> Wrench<T> {
    let Motion { pose, twist, acceleration } = platform;
    let center = pose.rotation * Vec3::lift(body.center);
    let a = acceleration.a + acceleration.eps.cross(center) + twist.omega.cross(twist.omega.cross(center));
    let force = inertial_force(body, Vec3::lift(mech.gravity), a);
    let torque = inertial_torque(body, pose.rotation, twist.omega, acceleration.eps);
    Wrench::at(center, force) + Wrench::new(Vec3::zero(), torque)
}

/// The platform's damping, a part of [Eq. 42]: `f_d = -μ v, t_d = -μ ω`.
#[inline(always)]
pub fn damping_wrench<T: Real>(mech: &Mechanism<impl Constant<T>>, twist: &Twist<T>) -> Wrench<T> {
    Wrench::new(-(twist.v * T::lit(mech.linear_damping)), -(twist.omega * T::lit(mech.angular_damping)))
}

/// Cylinder, piston and the rods that the leg leads, carried to the platform \[T14\].
#[inline(always)]
pub(crate) fn leg_wrench<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    index: usize,
    leg: &Leg<impl Constant<T>>,
    place: &leg::LegPlacement<T>,
    platform: &Motion<T>,
) -> Wrench<T> {
    let state = leg::moving(leg, place, platform);
    let mut wrench = links_wrench(mech, leg, [&leg.cylinder, &leg.piston], &state);
    for rod in &mech.rods {
        if rod.leader == index {
            wrench = wrench + carried_rod(mech, rod, &rod.body, &state);
        }
    }
    wrench
}

/// Cylinder and piston, or carriage and strut, carried to the platform \[T14\] \[T69\]. All along n, δ, m.
#[inline(always)]
pub(crate) fn links_wrench<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    leg: &Leg<impl Constant<T>>,
    [cylinder, piston]: [&Body; 2],
    state: &leg::LegState<T>,
) -> Wrench<T> {
    let axes = state.frame.axes;
    let at_base = axes.transpose_mul(Vec3::lift(mech.gravity));
    let at_b = at_base - axes.transpose_mul(state.end.a_b);
    let (force, about_b) = turning_force(piston, &state.turn, at_b);
    if leg.drive.moves_foot() {
        let torque = turning_torque(piston.inertia, state.turn.omega, state.turn.eps);
        // The first link's power is what pushes it along the coordinate, times q'.
        let push = leg.drive.own_force(cylinder, Vec3::lift(mech.gravity), state);
        leg::carry(leg, state, force, torque + about_b) + leg::row(leg, &state.position) * push
    } else {
        let (_, about_base) = turning_force(cylinder, &state.turn, at_base);
        // Both rotate as one.
        let inertia = piston.inertia + cylinder.inertia;
        let torque = turning_torque(inertia, state.turn.omega, state.turn.eps);
        leg::carry(leg, state, force, torque + about_b + about_base)
    }
}

/// Weight and inertial force of a link of a leg \[T8\] \[T13\], and its torque about the link's reference
/// point; `push` is gravity less the acceleration of that point.
#[inline(always)]
fn turning_force<T: Real>(body: &Body, turn: &leg::LegRotation<T>, push: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
    let center = Vec3::lift(body.center);
    let force =
        inertial_force(body, push, turn.eps.cross(center) + turn.omega.cross(turn.omega.cross(center)));
    (force, center.cross(force))
}

/// A rod with the given body, carried to the platform by the leg that leads it.
#[inline(always)]
pub(crate) fn carried_rod<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    rod: &Rod<impl Constant<T>>,
    body: &Body,
    leader: &leg::LegState<T>,
) -> Wrench<T> {
    // Torque of its weight and inertia about its line [Eq. 36, 42].
    let about = Vec3::lift(rod.axis).dot(rod_wrench(mech, rod, body, leader).torque);
    // The rod's power is its torque about L times ω_L = n·δ'/|L×δ|, with δ' = (v_b - ℓ'δ)/ℓ and n
    // perpendicular to δ.
    let (p, f) = (&leader.position, &leader.frame);
    Wrench::at(p.e, f.n() * (about / (f.sine * p.length)))
}

/// The rod's weight and inertia as a wrench at its point, from its rotation and its axes (L, n, L×n)
/// [Eq. 36, 42].
#[inline(always)]
pub(crate) fn rod_wrench<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    rod: &Rod<impl Constant<T>>,
    body: &Body,
    leader: &leg::LegState<T>,
) -> Wrench<T> {
    let (axis, n) = (Vec3::lift(rod.axis), leader.frame.n());
    let turn = leg::rod_turn(axis, leader);
    let (omega, eps) = (axis * turn.rate, axis * turn.acceleration);
    let axes = Mat3::from_columns(axis, n, axis.cross(n));
    let center = axes * Vec3::lift(body.center);
    let a = eps.cross(center) + omega.cross(omega.cross(center));
    let force = inertial_force(body, Vec3::lift(mech.gravity), a);
    Wrench::new(force, center.cross(force) + inertial_torque(body, axes, omega, eps))
}

/// The platform's own term and the load, divided by the paper's efficiency η [Eq. 43].
#[inline(always)]
pub(crate) fn own_wrench<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    platform: &Motion<T>,
    load: Wrench<T>,
) -> Wrench<T> {
    (load + platform_wrench(mech, platform)) * T::lit(1.0 / mech.efficiency)
}

/// All that the actuators and constraints must balance, as a wrench at o: the braces of [Eq. 43]. The paper's
/// efficiency η divides the platform's term alone.
#[inline(always)]
pub fn resultant<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    platform: &Motion<T>,
    load: Wrench<T>,
) -> Wrench<T> {
    let mut sum = own_wrench(mech, platform, load);
    for (i, leg) in mech.legs.iter().enumerate() {
        sum = sum + leg_wrench(mech, i, leg, &leg::place(leg, &platform.pose), platform);
    }
    sum
}

/// Active forces along the actuated legs, then the torques of local degrees of freedom and the multipliers of
/// the independent constraints: `F_r = -J⁻ᵀ {...}` [Eq. 43], with the pivot ratio of J.
#[inline(always)]
pub fn inverse_dynamics<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    platform: &Motion<T>,
    load: Wrench<T>,
) -> ([T; 6], T::Value) {
    Balance::of(mech, platform, load).solved(mech, &platform.pose)
}

/// [Eq. 43] as it is set up, leg by leg: the braces, and the first six rows of J.
#[derive(Clone, Copy, Debug)]
pub struct Balance<T> {
    pub wrench: Wrench<T>,
    rows: Matrix6<T>,
    count: usize,
}

impl<T: Real> Balance<T> {
    #[inline(always)]
    pub fn new<S: Constant<T>>(mech: &Mechanism<S>, platform: &Motion<T>, load: Wrench<T>) -> Self {
        Balance { wrench: own_wrench(mech, platform, load), rows: [[T::zero(); 6]; 6], count: 0 }
    }

    /// With all legs.
    #[inline(always)]
    pub fn of<S: Constant<T>>(mech: &Mechanism<S>, platform: &Motion<T>, load: Wrench<T>) -> Self {
        let mut balance = Balance::new(mech, platform, load);
        for (i, leg) in mech.legs.iter().enumerate() {
            balance.add(mech, i, leg, &leg::place(leg, &platform.pose), platform);
        }
        balance
    }

    /// Adds the next leg, at its place.
    #[inline(always)]
    pub fn add<S: Constant<T>>(
        &mut self,
        mech: &Mechanism<S>,
        index: usize,
        leg: &Leg<S>,
        place: &leg::LegPlacement<T>,
        platform: &Motion<T>,
    ) {
        self.wrench = self.wrench + leg_wrench(mech, index, leg, place, platform);
        // Where more legs are actuated J is not square, and is set up elsewhere.
        if leg.actuated && self.count < 6 {
            self.rows[self.count] = leg::row(leg, &place.0).array();
            self.count += 1;
        }
    }

    /// The forces and multipliers, once all legs are there.
    #[inline(always)]
    pub fn solved<S: Constant<T>>(mut self, mech: &Mechanism<S>, pose: &Pose<T>) -> ([T; 6], T::Value) {
        for_each_row!(others of mech, self.count, |k, row| {
            self.rows[k] = row.wrench(pose).array();
        });
        let w = self.wrench;
        let scaled_wrench = Wrench::new(w.force, w.torque * T::lit(1.0 / mech.characteristic_length));
        let mut rhs = scaled_wrench.array();
        for x in &mut rhs {
            *x = -*x;
        }
        let solved = solve(transposed(&scaled(mech, self.rows)), rhs);
        (solved.x, solved.pivots)
    }
}

#[inline(always)]
pub(crate) fn transposed<T: Real>(m: &Matrix6<T>) -> Matrix6<T> {
    let mut transposed = *m;
    for i in 0..6 {
        for j in 0..6 {
            transposed[i][j] = m[j][i];
        }
    }
    transposed
}

/// Kinetic and potential energy of all links \[T17\]. Velocities only: with duals along the motion it
/// gives the power of inertia and weight without the way that [`inverse_dynamics`] takes.
#[inline(always)]
pub fn energy<T: Real>(mech: &Mechanism<impl Constant<T>>, pose: &Pose<T>, twist: &Twist<T>) -> (T, T) {
    let platform = Motion { pose: *pose, twist: *twist, acceleration: Acceleration::zero() };
    let center = pose.rotation * Vec3::lift(mech.platform.center);
    let velocity = twist.v + twist.omega.cross(center);
    let mut sum = (T::zero(), T::zero());
    sum = with_energy(sum, mech, &mech.platform, pose.rotation, twist.omega, velocity, pose.o + center);
    for (i, leg) in mech.legs.iter().enumerate() {
        let state = leg::state(leg, &platform);
        let (axes, omega) = (state.frame.axes, state.omega());
        let foot = leg::foot(leg, &state.position);
        let (piston, cylinder) = (leg::piston(leg, &state), leg::cylinder(leg, &state));
        let place = foot + state.position.r + piston.offset;
        sum = with_energy(sum, mech, &leg.piston, axes, omega, piston.velocity, place);
        let place = foot + cylinder.offset;
        let (own_axes, turn) = leg.drive.first_turn(&state);
        let own_omega = own_axes * turn.omega;
        sum = with_energy(sum, mech, &leg.cylinder, own_axes, own_omega, cylinder.velocity, place);
        for rod in &mech.rods {
            if rod.leader == i {
                let (axis, n) = (Vec3::lift(rod.axis), state.frame.n());
                let omega = axis * leg::rod_turn(axis, &state).rate;
                let axes = Mat3::from_columns(axis, n, axis.cross(n));
                let center = axes * Vec3::lift(rod.body.center);
                let (velocity, place) = (omega.cross(center), Vec3::lift(rod.point) + center);
                sum = with_energy(sum, mech, &rod.body, axes, omega, velocity, place);
            }
        }
    }
    sum
}

/// Kinetic and potential energy with those of one more link: its axes, angular velocity, and velocity and
/// place of its mass centre.
#[inline(always)]
fn with_energy<T: Real>(
    (kinetic, potential): (T, T),
    mech: &Mechanism<impl Constant<T>>,
    body: &Body,
    axes: Mat3<T>,
    omega: Vec3<T>,
    velocity: Vec3<T>,
    place: Vec3<T>,
) -> (T, T) {
    let (omega, mass) = (axes.transpose_mul(omega), T::lit(body.mass));
    let moving = (velocity.dot(velocity) * mass + omega.dot(Mat3::lift(body.inertia) * omega)) * T::lit(0.5);
    (kinetic + moving, potential - Vec3::lift(mech.gravity).dot(place) * mass)
}

/// Forces along c_1 that two coupled legs put on the platform at their ends, and the torque T_c about the
/// rod's line.
#[derive(Clone, Copy, Debug)]
pub struct Coupled<T> {
    pub forces: [T; 2],
    pub torque: T,
}

/// The couple-constrained forces of two legs on one rod from the constraint's multiplier f_c \[T16\].
///
/// The consistent balance: the rod is free to rotate about L, so the moments of both forces about L cancel,
/// and together they are the wrench f_c (c, τ): `f_c1 = f_c d_3/l`, `f_c3 = -f_c d_1/l`, `T_c = f_c1 d_1`. As
/// printed [Eq. 44]: `f_c1 = f_c/(1 + k)`, `f_c3 = f_c - f_c1`, `k = d_1/d_3`, which takes c_3 for c_1 where
/// the paper has c_3 = -c_1.
#[inline(always)]
pub fn coupled_forces<T: Real>(
    mech: &Mechanism<impl Constant<T>>,
    pair: [usize; 2],
    axis: Vec3<impl Constant<T>>,
    platform_axis: Vec3<impl Constant<T>>,
    pose: &Pose<T>,
    f_c: T,
    as_printed: bool,
) -> Coupled<T> {
    let (axis, l) = (Vec3::lift(axis), pose.rotation * Vec3::lift(platform_axis));
    let (first, third) = (leg::position(&mech.legs[pair[0]], pose), leg::position(&mech.legs[pair[1]], pose));
    // c_1 along r_1 × L; d_i is the moment arm about L of a force along c_1 at b_i.
    let c1 = first.r.cross(axis).unit();
    let (d1, d3) = (first.r.cross(axis).dot(c1), third.r.cross(axis).dot(c1));
    let length = (first.e - third.e).dot(l);
    let forces = if as_printed {
        let f1 = f_c / (T::one() + d1 / d3);
        [f1, f_c - f1]
    } else {
        [f_c * d3 / length, -(f_c * d1 / length)]
    };
    Coupled { forces, torque: forces[0] * d1 }
}
