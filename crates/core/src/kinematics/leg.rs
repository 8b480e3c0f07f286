//! Kinematics of one leg: position, motion of its platform end, rotation, and motion of its links.

pub use crate::kinematics::leg_state::{EndMotion, Frame, LegRotation, LegState, PointMotion, Position};
use crate::kinematics::quadratic_forms::Hessian;
use crate::model::mechanism::{Direction, Leg, Mechanism, Turning};
use crate::model::spec::Axes;
use crate::number::real::{Constant, Ordered, Real};
use crate::spatial::{Mat3, Motion, Pose, Vec3, Wrench};

/// e from o to b and r from B to b.
#[inline(always)]
pub fn vectors<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> (Vec3<T>, Vec3<T>) {
    let e = pose.rotation.of(leg.platform.point);
    (e, pose.o + e - Vec3::lift(leg.base.point))
}

/// [Eq. 2, 3] \[T1\] `e = R m, b = o + e, r = b - B, δ = r/ℓ`; of a slider \[T67\], whose coordinate is not a
/// number where its strut does not reach the rail.
#[inline(always)]
pub fn position<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> Position<T> {
    let (e, r) = vectors(leg, pose);
    leg.drive.position(e, r)
}

/// r·d, d being the direction that a fixed joint gives to the leg: its length, or less than zero where the
/// leg would have to point backwards \[T9\].
#[inline(always)]
pub fn ahead<S: Constant<T>, T: Real>(mech: &Mechanism<S>, direction: &Direction<S>, pose: &Pose<T>) -> T {
    let d = match direction.side {
        Axes::Base => Vec3::lift(direction.axis),
        Axes::Platform => pose.rotation.of(direction.axis),
    };
    vectors(&mech.legs[direction.leg], pose).1.dot(d)
}

/// Whether no leg points backwards from a fixed joint: constraints leave both ways \[T9\].
#[inline(always)]
pub fn all_ahead<V: Ordered>(mech: &Mechanism<impl Constant<V>>, pose: &Pose<V>) -> V::Mask {
    let mut all = V::one();
    for direction in &mech.directions {
        all = V::select(ahead(mech, direction, pose).greater(V::zero()), all, V::zero());
    }
    all.greater(V::zero())
}

/// Foot of the strut, base axes.
#[inline(always)]
pub fn foot<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> Vec3<T> {
    leg.drive.foot(Vec3::lift(leg.base.point), p)
}

/// δ·d, d being the direction of the prismatic joint: one of a telescopic leg, zero where a strut is
/// perpendicular to its rail.
#[inline(always)]
pub fn transmission<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> T {
    leg.drive.transmission(p)
}

/// The equation of a leg's coordinate at a pose, and its branch, without a root.
#[inline(always)]
pub fn closure<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>, coordinate: T) -> (T, T) {
    leg.drive.closure(vectors(leg, pose).1, coordinate)
}

/// The wrench of a unit force of the actuator, a row of the Jacobian [Eq. 6] \[T68\].
#[inline(always)]
pub fn row<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> Wrench<T> {
    leg.drive.row(p)
}

/// The symmetric h with `ℓ'' = (δ, e×δ)·A + Vᵀ h V` \[T11\], the symmetric part of [Eq. 15]; of a slider with
/// `q'' = (δ, e×δ)·A/(δ·a) + Vᵀ h V` \[T68\].
#[inline(always)]
pub fn hessian<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> Hessian<T> {
    leg.drive.hessian(p)
}

/// The unit axis behind a leg's frame in base axes, and whether it rotates with the platform.
#[inline(always)]
pub(crate) fn turning_axis<T: Real>(turning: Turning<impl Constant<T>>, pose: &Pose<T>) -> (Vec3<T>, bool) {
    match turning {
        Turning::Across(Axes::Platform, u) | Turning::Along(Axes::Platform, u) => {
            (pose.rotation * Vec3::lift(u), true)
        }
        Turning::Across(Axes::Base, u) | Turning::Along(Axes::Base, u) | Turning::Free(u) => {
            (Vec3::lift(u), false)
        }
    }
}

/// [T5] N, along n: `u×δ` for a U joint, `u` for R and F.
#[inline(always)]
pub fn normal<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>, p: &Position<T>) -> Vec3<T> {
    let (u, _) = turning_axis(leg.turning, pose);
    match leg.turning {
        Turning::Across(..) => u.cross(p.delta),
        // Any direction will do; the second is for a leg that comes near the first.
        Turning::Free(first) => {
            let (a, b) = (u.cross(p.delta), Vec3::lift(first.perpendicular()).cross(p.delta));
            let clear = a.dot(a).value().greater(T::Value::lit(0.25));
            Vec3::new(T::select(clear, a.x, b.x), T::select(clear, a.y, b.y), T::select(clear, a.z, b.z))
        }
        Turning::Along(..) => u,
    }
}

/// [T5] `n = N/|N|`.
#[inline(always)]
pub fn frame<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>, p: &Position<T>) -> Frame<T> {
    let ((u, _), normal) = (turning_axis(leg.turning, pose), normal(leg, pose, p));
    let sine = normal.norm();
    let inverse = T::one() / sine;
    let n = normal * inverse;
    let slope = match leg.turning {
        Turning::Across(..) => u.dot(p.delta) * inverse,
        Turning::Along(..) | Turning::Free(_) => T::zero(),
    };
    Frame { axes: Mat3::from_columns(n, p.delta, n.cross(p.delta)), sine, slope }
}

/// How the platform end moves, and with it the leg's coordinate and direction \[T2\] \[T3\] \[T4\] \[T68\].
#[inline(always)]
pub fn end<T: Real>(
    leg: &Leg<impl Constant<T>>,
    p: &Position<T>,
    f: &Frame<T>,
    platform: &Motion<T>,
) -> EndMotion<T> {
    let Motion { twist, acceleration, .. } = platform;
    let (omega, e) = (twist.omega, p.e);
    // [Eq. 20] [T2] v_b = v + ω×e;  [Eq. 34] a_b = a + ε×e + ω×(ω×e)
    let spin_e = omega.cross(e);
    let v_b = twist.v + spin_e;
    let a_b = acceleration.a + acceleration.eps.cross(e) + omega.cross(spin_e);
    leg.drive.end(p, f, v_b, a_b)
}

/// The leg's angular velocity and acceleration: with u = L [Eq. 22, 23, 24, 25, 26, 27, 28], with u = -e/|e|
/// on the platform [Eq. 29, 30, 31, 32, 33, 34, 35].
#[inline(always)]
pub fn turn<T: Real>(
    leg: &Leg<impl Constant<T>>,
    platform: &Motion<T>,
    end: &EndMotion<T>,
    f: &Frame<T>,
) -> LegRotation<T> {
    let ([a, b], [a1, b1]) = (end.delta_rate, end.delta_acceleration);
    let (spin, spin_rate) = match leg.turning {
        Turning::Across(Axes::Platform, _) | Turning::Along(Axes::Platform, _) => {
            let omega = f.axes.transpose_mul(platform.twist.omega);
            let eps = f.axes.transpose_mul(platform.acceleration.eps);
            // As the platform sees it: δ' - ω×δ, and δ'' - ε×δ - ω×(ω×δ) - 2ω×(δ' - ω×δ) along n
            let (a, b) = (a + omega.z, b - omega.x);
            let a1 = a1 + eps.z - omega.y * (omega.x + b + b);
            let (s, s1) = spin(leg.turning, f.slope, a, b, a1);
            // The platform's rotation about δ, and its rate, come on top.
            (omega.y + s, eps.y + omega.x.mul_add(a, omega.z * b) + s1)
        }
        _ => spin(leg.turning, f.slope, a, b, a1),
    };
    // [T6] ω = δ×δ' + sδ;  ε = δ×δ'' + s'δ + sδ'
    LegRotation {
        spin,
        spin_rate,
        omega: Vec3::new(b, spin, -a),
        eps: Vec3::new(spin.mul_add(a, b1), spin_rate, spin.mul_add(b, -a1)),
    }
}

/// [T6] `s = κa`, `s' = κ(a₁ - 2bs) - ab` for δ' = (a, b) and δ'' = (a₁, ·) along n and m, seen from the body
/// of u; an R or F joint, where a = 0, lets nothing spin.
#[inline(always)]
fn spin<T: Real>(turning: Turning<impl Constant<T>>, slope: T, a: T, b: T, a1: T) -> (T, T) {
    match turning {
        Turning::Across(..) => {
            let s = slope * a;
            (s, slope * (a1 - (b + b) * s) - a * b)
        }
        Turning::Along(..) | Turning::Free(_) => (T::zero(), T::zero()),
    }
}

/// Where a leg is at a pose, however that moves.
pub type LegPlacement<T> = (Position<T>, Frame<T>);

#[inline(always)]
pub fn place<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> LegPlacement<T> {
    let position = position(leg, pose);
    (position, frame(leg, pose, &position))
}

/// A leg that is there when the platform moves.
#[inline(always)]
pub fn moving<T: Real>(
    leg: &Leg<impl Constant<T>>,
    &(position, frame): &LegPlacement<T>,
    platform: &Motion<T>,
) -> LegState<T> {
    let end = end(leg, &position, &frame, platform);
    let turn = turn(leg, platform, &end, &frame);
    LegState { position, end, frame, turn }
}

#[inline(always)]
pub fn state<T: Real>(leg: &Leg<impl Constant<T>>, platform: &Motion<T>) -> LegState<T> {
    moving(leg, &place(leg, &platform.pose), platform)
}

/// Carries a force F at b and a torque M on the leg, both along n, δ, m, to the platform: `F·v_b + M·ω_leg`
/// as a wrench at o \[T14\] \[T69\].
#[inline(always)]
pub fn carry<T: Real>(
    leg: &Leg<impl Constant<T>>,
    state: &LegState<T>,
    force: Vec3<T>,
    torque: Vec3<T>,
) -> Wrench<T> {
    let LegState { position: p, frame: f, .. } = state;
    let (inverse, [_, delta, m]) = (T::one() / p.length, f.axes.0);
    // M·ω = (M×δ)·δ' + (M·δ) s, and δ' = (v_b - ℓ'δ)/ℓ
    let along_n = f.slope.mul_add(torque.y, -torque.z).mul_add(inverse, force.x);
    let along_m = torque.x.mul_add(inverse, force.z);
    let along_delta = leg.drive.carried_along(f, force, [along_n, along_m]);
    let wrench = Wrench::at(p.e, f.axes * Vec3::new(along_n, along_delta, along_m));
    match leg.turning {
        // s = κ n·(δ' - ω×δ) + ω·δ
        Turning::Across(Axes::Platform, _) | Turning::Along(Axes::Platform, _) => {
            wrench + Wrench::new(Vec3::zero(), (delta + m * f.slope) * torque.y)
        }
        _ => wrench,
    }
}

/// The piston's mass centre, offset from b [Eq. 38, 39] \[T8\].
#[inline(always)]
pub fn piston<T: Real>(leg: &Leg<impl Constant<T>>, state: &LegState<T>) -> PointMotion<T> {
    state.point_motion(leg.piston.center, state.end.v_b, state.end.a_b)
}

/// The cylinder's mass centre, offset from B [Eq. 38, 39] \[T8\]; that of a carriage from the strut's foot.
#[inline(always)]
pub fn cylinder<T: Real>(leg: &Leg<impl Constant<T>>, state: &LegState<T>) -> PointMotion<T> {
    leg.drive.first_link(leg.cylinder.center, state)
}

/// Rotation of a rod about its own line, from the leg that leads it \[T7\].
#[derive(Clone, Copy, Debug)]
pub struct RodRotation<T> {
    pub rate: T,
    pub acceleration: T,
}

/// [Eq. 25, 36, 37] \[T7\] `ω_L = n·δ'/|L×δ|`, and its rate.
#[inline(always)]
pub fn rod_turn<T: Real>(axis: Vec3<T>, leader: &LegState<T>) -> RodRotation<T> {
    let LegState { position: p, end, frame: f, turn } = leader;
    let ([a, b], inverse) = (end.delta_rate, T::one() / f.sine);
    let rate = a * inverse;
    // n'·δ' = -s m·δ', and |L×δ|' = n·(L×δ') = (L·δ) m·δ'
    let acceleration = (end.delta_acceleration[0] - b * (turn.spin + rate * axis.dot(p.delta))) * inverse;
    RodRotation { rate, acceleration }
}
