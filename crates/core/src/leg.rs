//! One leg: where it is, how its platform end moves, how it turns, and how its links move.

use crate::mechanism::{Leg, Side, Turning};
use crate::quadratic::{Hessian, add_centripetal, point_columns};
use crate::real::{Constant, Ordered, Real};
use crate::spatial::{Mat3, Motion, Pose, Vec3, Wrench};

/// Where the leg is, base axes \[T1\].
#[derive(Clone, Copy, Debug)]
pub struct Position<T> {
    /// From o to b.
    pub e: Vec3<T>,
    /// From B to b.
    pub r: Vec3<T>,
    pub length: T,
    /// Unit vector of r.
    pub delta: Vec3<T>,
}

/// e from o to b and r from B to b.
#[inline(always)]
pub fn vectors<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> (Vec3<T>, Vec3<T>) {
    let e = pose.rotation.of(leg.platform.point);
    (e, pose.o + e - Vec3::lift(leg.base.point))
}

/// [Eq. 2, 3] \[T1\] `e = R m, b = o + e, r = b - B, δ = r/ℓ`.
#[inline(always)]
pub fn position<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> Position<T> {
    let (e, r) = vectors(leg, pose);
    let length = r.norm();
    Position { e, r, length, delta: r * (T::one() / length) }
}

/// The wrench of a unit force of the actuator, a row of the Jacobian [Eq. 6].
#[inline(always)]
pub fn row<T: Real>(p: &Position<T>) -> Wrench<T> {
    Wrench::at(p.e, p.delta)
}

/// The symmetric h with `ℓ'' = (δ, e×δ)·A + Vᵀ h V` \[T11\], the symmetric part of [Eq. 15].
#[inline(always)]
pub fn hessian<T: Real>(p: &Position<T>) -> Hessian<T> {
    // ℓ'' = δ·a_b + |v_b - (δ·v_b) δ|²/ℓ: the second term is |P V|²/ℓ with P = (1 - δδᵀ) [1, -e×].
    let mut h = [[T::zero(); 6]; 6];
    add_centripetal(&mut h, p.e, p.delta);
    let inverse = T::one() / p.length;
    let mut columns = point_columns(p.e);
    for v in &mut columns {
        *v = *v - p.delta * p.delta.dot(*v);
    }
    for i in 0..6 {
        for j in 0..6 {
            h[i][j] = columns[i].dot(columns[j]).mul_add(inverse, h[i][j]);
        }
    }
    h
}

/// How the platform end moves, and with it the leg's length and direction \[T2\]-\[T4\].
#[derive(Clone, Copy, Debug)]
pub struct End<T> {
    pub v_b: Vec3<T>,
    pub a_b: Vec3<T>,
    pub rate: T,
    pub acceleration: T,
    pub delta_rate: Vec3<T>,
    pub delta_acceleration: Vec3<T>,
}

#[inline(always)]
pub fn end<T: Real>(p: &Position<T>, platform: &Motion<T>) -> End<T> {
    let Motion { twist, acceleration, .. } = platform;
    let (omega, e, delta, inverse) = (twist.omega, p.e, p.delta, T::one() / p.length);
    // [Eq. 20] [T2] v_b = v + ω×e;  [Eq. 34] a_b = a + ε×e + ω×(ω×e)
    let spin_e = omega.cross(e);
    let v_b = twist.v + spin_e;
    let a_b = acceleration.a + acceleration.eps.cross(e) + omega.cross(spin_e);
    // [Eq. 6] [T3] ℓ' = δ·v_b;  δ' = (v_b - ℓ'δ)/ℓ
    let rate = delta.dot(v_b);
    let delta_rate = (v_b - delta * rate) * inverse;
    // [Eq. 15] [T4] ℓ'' = δ·a_b + v_b·δ';  δ'' = (a_b - ℓ''δ - 2ℓ'δ')/ℓ
    let second = delta.dot(a_b) + v_b.dot(delta_rate);
    let delta_acceleration = (a_b - delta * second - delta_rate * (rate + rate)) * inverse;
    End { v_b, a_b, rate, acceleration: second, delta_rate, delta_acceleration }
}

/// The unit axis behind a leg's frame in base axes, and whether it turns with the platform.
#[inline(always)]
pub(crate) fn turning_axis<T: Real>(turning: Turning<impl Constant<T>>, pose: &Pose<T>) -> (Vec3<T>, bool) {
    match turning {
        Turning::Across(Side::Platform, u) | Turning::Along(Side::Platform, u) => {
            (pose.rotation * Vec3::lift(u), true)
        }
        Turning::Across(Side::Base, u) | Turning::Along(Side::Base, u) | Turning::Free(u) => {
            (Vec3::lift(u), false)
        }
    }
}

/// The leg's frame at a pose, and what the spin needs of it \[T5\].
#[derive(Clone, Copy, Debug)]
pub struct Frame<T> {
    /// Columns n, δ, n×δ.
    pub axes: Mat3<T>,
    /// The axis u behind n, base axes.
    pub u: Vec3<T>,
    /// |u×δ|: zero where a U joint's axis lies along the leg, one for an R or F joint.
    pub sine: T,
    /// w with `s = N'·w` for the vector N = |N| n; zero for a leg that spins freely.
    pub w: Vec3<T>,
}

impl<T: Real> Frame<T> {
    #[inline(always)]
    pub fn n(&self) -> Vec3<T> {
        self.axes.0[0]
    }
}

/// [T5] `n = (u×δ)/|u×δ|` for a U joint, `n = u` for R and F.
#[inline(always)]
pub fn frame<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>, p: &Position<T>) -> Frame<T> {
    let (u, _) = turning_axis(leg.turning, pose);
    let normal = match leg.turning {
        Turning::Across(..) => u.cross(p.delta),
        // Any direction will do; the second is for a leg that comes near the first.
        Turning::Free(first) => {
            let (a, b) = (u.cross(p.delta), Vec3::lift(first.perpendicular()).cross(p.delta));
            let clear = a.dot(a).value().greater(T::Value::lit(0.25));
            Vec3::new(T::select(clear, a.x, b.x), T::select(clear, a.y, b.y), T::select(clear, a.z, b.z))
        }
        Turning::Along(..) => u,
    };
    let sine = normal.norm();
    let inverse = T::one() / sine;
    let n = normal * inverse;
    let w = match leg.turning {
        Turning::Free(_) => Vec3::zero(),
        Turning::Across(..) | Turning::Along(..) => p.delta.cross(n) * inverse,
    };
    Frame { axes: Mat3::from_columns(n, p.delta, n.cross(p.delta)), u, sine, w }
}

/// How the leg turns \[T6\].
#[derive(Clone, Copy, Debug)]
pub struct Turn<T> {
    pub spin: T,
    pub spin_rate: T,
    pub omega: Vec3<T>,
    pub eps: Vec3<T>,
}

/// The leg's angular velocity and acceleration: with u = L [Eq. 22-28], with u = -e/|e| on the platform [Eq. 29-35].
#[inline(always)]
pub fn turn<T: Real>(
    leg: &Leg<impl Constant<T>>,
    platform: &Motion<T>,
    p: &Position<T>,
    end: &End<T>,
    f: &Frame<T>,
) -> Turn<T> {
    let Motion { pose, twist, acceleration } = platform;
    let (u, moves) = turning_axis(leg.turning, pose);
    // u' = ω_u × u, u'' = ε_u × u + ω_u × u', with ω_u that of the body u is fixed in
    let (u1, u2) = if moves {
        let u1 = twist.omega.cross(u);
        (u1, acceleration.eps.cross(u) + twist.omega.cross(u1))
    } else {
        (Vec3::zero(), Vec3::zero())
    };
    // N = |N| n and its first two rates
    let (normal1, normal2) = match leg.turning {
        Turning::Across(..) => {
            let mixed = u1.cross(end.delta_rate);
            (
                u1.cross(p.delta) + u.cross(end.delta_rate),
                u2.cross(p.delta) + mixed + mixed + u.cross(end.delta_acceleration),
            )
        }
        Turning::Along(..) => (u1, u2),
        Turning::Free(_) => (Vec3::zero(), Vec3::zero()),
    };
    // [T6] s = N'·w with w = δ×N/|N|²;  s' = (N''·(δ×N) + N'·(δ'×N))/|N|² - 2 s (N·N')/|N|²
    let inverse = T::one() / f.sine;
    let spin = normal1.dot(f.w);
    let stretch = f.n().dot(normal1) * inverse;
    let spin_rate =
        normal2.dot(f.w) + normal1.dot(end.delta_rate.cross(f.n())) * inverse - (spin + spin) * stretch;
    // [T6] ω = δ×δ' + sδ;  ε = δ×δ'' + s'δ + sδ'
    Turn {
        spin,
        spin_rate,
        omega: p.delta.cross(end.delta_rate) + p.delta * spin,
        eps: p.delta.cross(end.delta_acceleration) + p.delta * spin_rate + end.delta_rate * spin,
    }
}

/// All of a leg at an instant.
#[derive(Clone, Copy, Debug)]
pub struct State<T> {
    pub position: Position<T>,
    pub end: End<T>,
    pub frame: Frame<T>,
    pub turn: Turn<T>,
}

/// Where a leg is at a pose, however that moves.
pub type Place<T> = (Position<T>, Frame<T>);

#[inline(always)]
pub fn place<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> Place<T> {
    let position = position(leg, pose);
    (position, frame(leg, pose, &position))
}

/// A leg that is there when the platform moves.
#[inline(always)]
pub fn moving<T: Real>(
    leg: &Leg<impl Constant<T>>,
    &(position, frame): &Place<T>,
    platform: &Motion<T>,
) -> State<T> {
    let end = end(&position, platform);
    let turn = turn(leg, platform, &position, &end, &frame);
    State { position, end, frame, turn }
}

#[inline(always)]
pub fn state<T: Real>(leg: &Leg<impl Constant<T>>, platform: &Motion<T>) -> State<T> {
    moving(leg, &place(leg, &platform.pose), platform)
}

/// Carries a force F at b and a torque M on the leg to the platform: `F·v_b + M·ω_leg` as a wrench at o \[T14\].
#[inline(always)]
pub fn carry<T: Real>(
    leg: &Leg<impl Constant<T>>,
    state: &State<T>,
    force: Vec3<T>,
    torque: Vec3<T>,
) -> Wrench<T> {
    let State { position: p, frame: f, .. } = state;
    // M·ω_leg = (M×δ)·δ' + (M·δ) s, and s = N'·w is linear in δ' (through u×δ') and in ω_u (through u').
    let about = torque.dot(p.delta);
    let (direction, turning) = match leg.turning {
        Turning::Across(side, _) => (f.w.cross(f.u) * about, (side, f.u.cross(p.delta.cross(f.w)) * about)),
        Turning::Along(side, _) => (Vec3::zero(), (side, f.u.cross(f.w) * about)),
        Turning::Free(_) => (Vec3::zero(), (Side::Base, Vec3::zero())),
    };
    let conjugate = torque.cross(p.delta) + direction;
    let across = conjugate - p.delta * p.delta.dot(conjugate);
    let wrench = Wrench::at(p.e, force + across * (T::one() / p.length));
    match turning {
        (Side::Platform, couple) => wrench + Wrench::new(Vec3::zero(), couple),
        (Side::Base, _) => wrench,
    }
}

/// A point fixed in a link that turns with the leg: offset from the link's reference point, velocity, acceleration.
#[derive(Clone, Copy, Debug)]
pub struct PointMotion<T> {
    pub offset: Vec3<T>,
    pub velocity: Vec3<T>,
    pub acceleration: Vec3<T>,
}

#[inline(always)]
fn point_motion<T: Real>(
    turn: &Turn<T>,
    offset: Vec3<T>,
    velocity: Vec3<T>,
    acceleration: Vec3<T>,
) -> PointMotion<T> {
    let spin = turn.omega.cross(offset);
    PointMotion {
        offset,
        velocity: velocity + spin,
        acceleration: acceleration + turn.eps.cross(offset) + turn.omega.cross(spin),
    }
}

/// The piston's mass centre, offset from b [Eq. 38, 39] \[T8\].
#[inline(always)]
pub fn piston<T: Real>(leg: &Leg<impl Constant<T>>, state: &State<T>) -> PointMotion<T> {
    let offset = state.frame.axes * Vec3::lift(leg.piston.center);
    point_motion(&state.turn, offset, state.end.v_b, state.end.a_b)
}

/// The cylinder's mass centre, offset from B [Eq. 38, 39] \[T8\].
#[inline(always)]
pub fn cylinder<T: Real>(leg: &Leg<impl Constant<T>>, state: &State<T>) -> PointMotion<T> {
    let offset = state.frame.axes * Vec3::lift(leg.cylinder.center);
    point_motion(&state.turn, offset, Vec3::zero(), Vec3::zero())
}

/// How a rod turns about its own line, from the leg that leads it \[T7\].
#[derive(Clone, Copy, Debug)]
pub struct RodTurn<T> {
    pub rate: T,
    pub acceleration: T,
}

/// [Eq. 25, 36, 37] \[T7\] `ω_L = n·δ'/|L×δ|`, and its rate.
#[inline(always)]
pub fn rod_turn<T: Real>(axis: Vec3<T>, leader: &State<T>) -> RodTurn<T> {
    let State { end, frame: f, turn, .. } = leader;
    let inverse = T::one() / f.sine;
    let rate = f.n().dot(end.delta_rate) * inverse;
    // n' = ω_leg × n, and |L×δ|' = n·(L×δ')
    let n1 = turn.omega.cross(f.n());
    let sine1 = f.n().dot(axis.cross(end.delta_rate));
    let acceleration = (n1.dot(end.delta_rate) + f.n().dot(end.delta_acceleration) - rate * sine1) * inverse;
    RodTurn { rate, acceleration }
}
