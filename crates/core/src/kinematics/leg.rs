//! One leg: where it is, how its platform end moves, how it turns, and how its links move.

use crate::kinematics::quadratic_forms::{Hessian, add_centripetal, point_columns};
use crate::model::mechanism::{Direction, Drive, Leg, Mechanism, Turning};
use crate::model::spec::Axes;
use crate::number::real::{Constant, Ordered, Real};
use crate::spatial::{Mat3, Motion, Pose, Vec3, Wrench};

/// Where the leg is, base axes \[T1\] \[T67\].
#[derive(Clone, Copy, Debug)]
pub struct Position<T> {
    /// From o to b.
    pub e: Vec3<T>,
    /// From the strut's foot to b: from B, or from the carriage of a slider.
    pub r: Vec3<T>,
    /// Of the strut.
    pub length: T,
    /// Unit vector of r.
    pub delta: Vec3<T>,
    /// Of the prismatic joint: the length ℓ, or the place q of the carriage.
    pub coordinate: T,
}

/// e from o to b and r from B to b.
#[inline(always)]
pub fn vectors<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> (Vec3<T>, Vec3<T>) {
    let e = pose.rotation.of(leg.platform.point);
    (e, pose.o + e - Vec3::lift(leg.base.point))
}

/// [Eq. 2, 3] \[T1\] `e = R m, b = o + e, r = b - B, δ = r/ℓ`; of a slider \[T67\], whose coordinate is not a number where
/// its strut does not reach the rail.
#[inline(always)]
pub fn position<T: Real>(leg: &Leg<impl Constant<T>>, pose: &Pose<T>) -> Position<T> {
    let (e, r) = vectors(leg, pose);
    match leg.drive {
        Drive::Telescope => {
            let length = r.norm();
            Position { e, r, length, delta: r * (T::one() / length), coordinate: length }
        }
        Drive::Slider { rail, strut, branch } => {
            let (a, c) = (Vec3::lift(rail), strut.lift());
            let along = a.dot(r);
            let across = r - a * along;
            let ahead = (c * c - across.dot(across)).sqrt().scale(branch);
            let r = across + a * ahead;
            Position { e, r, length: c, delta: r * (T::one() / c), coordinate: along - ahead }
        }
    }
}

/// r·d, d being the direction that a fixed joint gives to the leg: its length, or less than zero where the leg would have to
/// point backwards \[T9\].
#[inline(always)]
pub fn ahead<S: Constant<T>, T: Real>(mech: &Mechanism<S>, direction: &Direction<S>, pose: &Pose<T>) -> T {
    let d = match direction.side {
        Axes::Base => Vec3::lift(direction.axis),
        Axes::Platform => pose.rotation.of(direction.axis),
    };
    vectors(&mech.legs[direction.leg], pose).1.dot(d)
}

/// Where the strut begins, base axes.
#[inline(always)]
pub fn foot<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> Vec3<T> {
    let base = Vec3::lift(leg.base.point);
    match leg.drive {
        Drive::Telescope => base,
        Drive::Slider { rail, .. } => base + Vec3::<T>::lift(rail) * p.coordinate,
    }
}

/// δ·d, d being the direction of the prismatic joint: one of a telescopic leg, zero where a strut is square to its rail.
#[inline(always)]
pub fn transmission<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> T {
    match leg.drive {
        Drive::Telescope => T::one(),
        Drive::Slider { rail, .. } => p.delta.dot(Vec3::lift(rail)),
    }
}

/// The wrench of a unit force of the actuator, a row of the Jacobian [Eq. 6] \[T68\].
#[inline(always)]
pub fn row<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> Wrench<T> {
    match leg.drive {
        Drive::Telescope => Wrench::at(p.e, p.delta),
        Drive::Slider { .. } => Wrench::at(p.e, p.delta * (T::one() / transmission(leg, p))),
    }
}

/// The symmetric h with `ℓ'' = (δ, e×δ)·A + Vᵀ h V` \[T11\], the symmetric part of [Eq. 15]; of a slider with
/// `q'' = (δ, e×δ)·A/(δ·a) + Vᵀ h V` \[T68\].
#[inline(always)]
pub fn hessian<T: Real>(leg: &Leg<impl Constant<T>>, p: &Position<T>) -> Hessian<T> {
    // (δ·d) q'' = δ·a_b + |P v_b|²/ℓ with P = 1 - dδᵀ/(δ·d).
    let mut h = [[T::zero(); 6]; 6];
    add_centripetal(&mut h, p.e, p.delta);
    let inverse = T::one() / p.length;
    let mut columns = point_columns(p.e);
    let along = match leg.drive {
        Drive::Telescope => p.delta,
        Drive::Slider { rail, .. } => Vec3::<T>::lift(rail) * (T::one() / transmission(leg, p)),
    };
    for v in &mut columns {
        *v = *v - along * p.delta.dot(*v);
    }
    for i in 0..6 {
        for j in 0..6 {
            h[i][j] = columns[i].dot(columns[j]).mul_add(inverse, h[i][j]);
        }
    }
    if let Drive::Slider { .. } = leg.drive {
        let inverse = T::one() / transmission(leg, p);
        for row in &mut h {
            for x in row {
                *x = *x * inverse;
            }
        }
    }
    h
}

/// The unit axis behind a leg's frame in base axes, and whether it turns with the platform.
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

/// The leg's frame at a pose, and what the spin needs of it \[T5\].
#[derive(Clone, Copy, Debug)]
pub struct Frame<T> {
    /// Columns n, δ, m = n×δ.
    pub axes: Mat3<T>,
    /// |u×δ|: zero where a U joint's axis lies along the leg, one for an R or F joint.
    pub sine: T,
    /// κ = u·δ/|u×δ| of a U joint: how much the leg spins as it swings; zero for other joints.
    pub slope: T,
}

impl<T: Real> Frame<T> {
    #[inline(always)]
    pub fn n(&self) -> Vec3<T> {
        self.axes.0[0]
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

/// How the platform end moves, and with it the leg's coordinate and direction \[T2\]-\[T4\] \[T68\].
#[derive(Clone, Copy, Debug)]
pub struct End<T> {
    /// Base axes.
    pub v_b: Vec3<T>,
    pub a_b: Vec3<T>,
    /// Of the coordinate: ℓ' and ℓ'', or q' and q''.
    pub rate: T,
    pub acceleration: T,
    /// δ' along n and m.
    pub delta_rate: [T; 2],
    /// δ'' along n and m; along δ it is -|δ'|².
    pub delta_acceleration: [T; 2],
}

#[inline(always)]
pub fn end<T: Real>(
    leg: &Leg<impl Constant<T>>,
    p: &Position<T>,
    f: &Frame<T>,
    platform: &Motion<T>,
) -> End<T> {
    let Motion { twist, acceleration, .. } = platform;
    let (omega, e, inverse) = (twist.omega, p.e, T::one() / p.length);
    // [Eq. 20] [T2] v_b = v + ω×e;  [Eq. 34] a_b = a + ε×e + ω×(ω×e)
    let spin_e = omega.cross(e);
    let v_b = twist.v + spin_e;
    let a_b = acceleration.a + acceleration.eps.cross(e) + omega.cross(spin_e);
    let (v, a) = (f.axes.transpose_mul(v_b), f.axes.transpose_mul(a_b));
    match leg.drive {
        Drive::Telescope => {
            // In the leg's axes: [Eq. 6] [T3] ℓ' = δ·v_b;  δ' = (v_b - ℓ'δ)/ℓ
            let rate = [v.x * inverse, v.z * inverse];
            // [Eq. 15] [T4] ℓ'' = δ·a_b + v_b·δ';  δ'' = (a_b - ℓ''δ - 2ℓ'δ')/ℓ
            let second = v.x.mul_add(rate[0], v.z.mul_add(rate[1], a.y));
            let twice = v.y + v.y;
            let delta_acceleration = [(a.x - twice * rate[0]) * inverse, (a.z - twice * rate[1]) * inverse];
            End { v_b, a_b, rate: v.y, acceleration: second, delta_rate: rate, delta_acceleration }
        }
        Drive::Slider { rail, .. } => {
            // [T68] q' = δ·v_b/(δ·a);  δ' = (v_b - q'a)/c
            let d = f.axes.transpose_mul(Vec3::lift(rail));
            let share = T::one() / d.y;
            let q = v.y * share;
            let rate = [(v.x - q * d.x) * inverse, (v.z - q * d.z) * inverse];
            // [T68] q'' = (δ·a_b + c |δ'|²)/(δ·a);  δ'' = (a_b - q''a)/c
            let square = rate[0].mul_add(rate[0], rate[1] * rate[1]);
            let second = p.length.mul_add(square, a.y) * share;
            let delta_acceleration = [(a.x - second * d.x) * inverse, (a.z - second * d.z) * inverse];
            End { v_b, a_b, rate: q, acceleration: second, delta_rate: rate, delta_acceleration }
        }
    }
}

/// How the leg turns \[T6\].
#[derive(Clone, Copy, Debug)]
pub struct Turn<T> {
    pub spin: T,
    pub spin_rate: T,
    /// Angular velocity and acceleration along n, δ, m.
    pub omega: Vec3<T>,
    pub eps: Vec3<T>,
}

/// The leg's angular velocity and acceleration: with u = L [Eq. 22-28], with u = -e/|e| on the platform [Eq. 29-35].
#[inline(always)]
pub fn turn<T: Real>(
    leg: &Leg<impl Constant<T>>,
    platform: &Motion<T>,
    end: &End<T>,
    f: &Frame<T>,
) -> Turn<T> {
    let ([a, b], [a1, b1]) = (end.delta_rate, end.delta_acceleration);
    let (spin, spin_rate) = match leg.turning {
        Turning::Across(Axes::Platform, _) | Turning::Along(Axes::Platform, _) => {
            let omega = f.axes.transpose_mul(platform.twist.omega);
            let eps = f.axes.transpose_mul(platform.acceleration.eps);
            // As the platform sees it: δ' - ω×δ, and δ'' - ε×δ - ω×(ω×δ) - 2ω×(δ' - ω×δ) along n
            let (a, b) = (a + omega.z, b - omega.x);
            let a1 = a1 + eps.z - omega.y * (omega.x + b + b);
            let (s, s1) = spin(leg.turning, f.slope, a, b, a1);
            // The platform's turn about δ, and its rate, come on top.
            (omega.y + s, eps.y + omega.x.mul_add(a, omega.z * b) + s1)
        }
        _ => spin(leg.turning, f.slope, a, b, a1),
    };
    // [T6] ω = δ×δ' + sδ;  ε = δ×δ'' + s'δ + sδ'
    Turn {
        spin,
        spin_rate,
        omega: Vec3::new(b, spin, -a),
        eps: Vec3::new(spin.mul_add(a, b1), spin_rate, spin.mul_add(b, -a1)),
    }
}

/// [T6] `s = κa`, `s' = κ(a₁ - 2bs) - ab` for δ' = (a, b) and δ'' = (a₁, ·) along n and m, seen from the body of u; an R
/// or F joint, where a = 0, lets nothing spin.
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

/// All of a leg at an instant.
#[derive(Clone, Copy, Debug)]
pub struct State<T> {
    pub position: Position<T>,
    pub end: End<T>,
    pub frame: Frame<T>,
    pub turn: Turn<T>,
}

impl<T: Real> State<T> {
    /// Angular velocity, base axes.
    #[inline(always)]
    pub fn omega(&self) -> Vec3<T> {
        self.frame.axes * self.turn.omega
    }

    /// Angular acceleration, base axes.
    #[inline(always)]
    pub fn eps(&self) -> Vec3<T> {
        self.frame.axes * self.turn.eps
    }
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
    let end = end(leg, &position, &frame, platform);
    let turn = turn(leg, platform, &end, &frame);
    State { position, end, frame, turn }
}

#[inline(always)]
pub fn state<T: Real>(leg: &Leg<impl Constant<T>>, platform: &Motion<T>) -> State<T> {
    moving(leg, &place(leg, &platform.pose), platform)
}

/// Carries a force F at b and a torque M on the leg, both along n, δ, m, to the platform: `F·v_b + M·ω_leg` as a wrench
/// at o \[T14\] \[T69\].
#[inline(always)]
pub fn carry<T: Real>(
    leg: &Leg<impl Constant<T>>,
    state: &State<T>,
    force: Vec3<T>,
    torque: Vec3<T>,
) -> Wrench<T> {
    let State { position: p, frame: f, .. } = state;
    let (inverse, [_, delta, m]) = (T::one() / p.length, f.axes.0);
    // M·ω = (M×δ)·δ' + (M·δ) s, and δ' = (v_b - ℓ'δ)/ℓ
    let along_n = f.slope.mul_add(torque.y, -torque.z).mul_add(inverse, force.x);
    let along_m = torque.x.mul_add(inverse, force.z);
    let along_delta = match leg.drive {
        Drive::Telescope => force.y,
        Drive::Slider { rail, .. } => {
            // δ' = (v_b - (δ·v_b) a/(δ·a))/c: what turns the strut along the rail is felt along δ.
            let d = f.axes.transpose_mul(Vec3::lift(rail));
            force.y - ((along_n - force.x) * d.x + (along_m - force.z) * d.z) / d.y
        }
    };
    let wrench = Wrench::at(p.e, f.axes * Vec3::new(along_n, along_delta, along_m));
    match leg.turning {
        // s = κ n·(δ' - ω×δ) + ω·δ
        Turning::Across(Axes::Platform, _) | Turning::Along(Axes::Platform, _) => {
            wrench + Wrench::new(Vec3::zero(), (delta + m * f.slope) * torque.y)
        }
        _ => wrench,
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
    state: &State<T>,
    center: Vec3<f64>,
    velocity: Vec3<T>,
    acceleration: Vec3<T>,
) -> PointMotion<T> {
    let (axes, Turn { omega, eps, .. }, center) = (state.frame.axes, state.turn, Vec3::lift(center));
    let spin = omega.cross(center);
    PointMotion {
        offset: axes * center,
        velocity: velocity + axes * spin,
        acceleration: acceleration + axes * (eps.cross(center) + omega.cross(spin)),
    }
}

/// The piston's mass centre, offset from b [Eq. 38, 39] \[T8\].
#[inline(always)]
pub fn piston<T: Real>(leg: &Leg<impl Constant<T>>, state: &State<T>) -> PointMotion<T> {
    point_motion(state, leg.piston.center, state.end.v_b, state.end.a_b)
}

/// The cylinder's mass centre, offset from B [Eq. 38, 39] \[T8\]; that of a carriage from the strut's foot.
#[inline(always)]
pub fn cylinder<T: Real>(leg: &Leg<impl Constant<T>>, state: &State<T>) -> PointMotion<T> {
    match leg.drive {
        Drive::Telescope => point_motion(state, leg.cylinder.center, Vec3::zero(), Vec3::zero()),
        Drive::Slider { rail, .. } => {
            let (a, End { rate, acceleration, .. }) = (Vec3::<T>::lift(rail), state.end);
            let offset = Vec3::lift(leg.cylinder.center);
            PointMotion { offset, velocity: a * rate, acceleration: a * acceleration }
        }
    }
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
    let State { position: p, end, frame: f, turn } = leader;
    let ([a, b], inverse) = (end.delta_rate, T::one() / f.sine);
    let rate = a * inverse;
    // n'·δ' = -s m·δ', and |L×δ|' = n·(L×δ') = (L·δ) m·δ'
    let acceleration = (end.delta_acceleration[0] - b * (turn.spin + rate * axis.dot(p.delta))) * inverse;
    RodTurn { rate, acceleration }
}
