//! Forward dynamics: the acceleration for given forces, and the terms of the equations of motion
//! \[T49\] \[T50\] \[T51\] \[T52\].
//!
//! There are no equations of links here: the resultant of [`dynamics`](crate::dynamics::inverse_dynamics) is
//! affine in the acceleration and, damping aside, quadratic in the twist, so that every term is a difference
//! of resultants.

use crate::dynamics::inverse_dynamics::{damping_wrench, leg_wrench, own_wrench, resultant};
use crate::kinematics::constraint;
use crate::kinematics::coordinate_sets::{MAX_COORDINATES, Set, Values};
use crate::kinematics::dependent_coordinates;
use crate::kinematics::leg;
use crate::kinematics::quadratic_forms::quadratic;
use crate::kinematics::rows::Matrix6;
use crate::kinematics::singular::SINGULAR;
use crate::model::mechanism::{MAX_CONSTRAINTS, Mechanism};
use crate::model::status::Status;
use crate::number::real::{Jet, Ordered, Real};
use crate::number::work::work;
use crate::numerics::gauss::{Solved, solve, solve_first};
use crate::spatial::{Acceleration, Motion, Pose, Twist, Vec3, Wrench};

/// Six accelerations and all multipliers that there can be.
const UNKNOWNS: usize = 6 + MAX_CONSTRAINTS;

/// An acceleration as large as those that weight gives, m/s².
const STANDARD_GRAVITY: f64 = 10.0;

/// Pivot ratio up to which forward dynamics is singular: pivots of its equations go with the square of the
/// constraints' singular values, G M⁻¹ Gᵀ \[T77\].
pub const SINGULAR_BALANCE: f64 = SINGULAR * SINGULAR;

/// Largest relative residual of the rates of coordinates fitted to the twist.
const FOLD_TOLERANCE: f64 = 1e-6;

/// Result of forward dynamics: the platform's acceleration and the multipliers for given forces.
#[derive(Clone, Copy, Debug)]
pub struct Driven<T: Real> {
    pub acceleration: Acceleration<T>,
    /// Of the independent constraints; the rest are zero.
    pub multipliers: [T; MAX_CONSTRAINTS],
    /// Pivot ratio of the equations: zero or NaN where masses and constraints do not determine the
    /// acceleration.
    pub pivots: T::Value,
}

/// The acceleration that keeps the constraints, and their multipliers, from the forces of the actuated legs,
/// in the order of the Jacobian's rows \[T49\].
#[inline(always)]
pub fn forward_dynamics<T: Real>(
    mech: &Mechanism,
    pose: &Pose<T>,
    twist: &Twist<T>,
    forces: &[T],
    load: Wrench<T>,
) -> Driven<T> {
    let scale = mech.characteristic_length;
    let mut push = T::apart(Coasting { mech, pose, twist, load });
    let mut count = 0;
    for leg in &mech.legs {
        if leg.actuated {
            push = push + leg::row(leg, &leg::position(leg, pose)) * forces[count];
            count += 1;
        }
    }
    // All in pure numbers: rotations as arcs at Λ, masses by their mean, so that pivots compare.
    let arc = 1.0 / scale;
    let arcs = [1.0, 1.0, 1.0, arc, arc, arc];
    let mass = T::apart(MassMatrix { mech, pose });
    let mut trace = T::zero();
    for i in 0..6 {
        trace = trace + mass[i][i].scale(arcs[i] * arcs[i]);
    }
    let unit = T::lit(6.0) / trace;
    let (push, v) = (push.array(), twist.array());

    let mut m = [[T::zero(); UNKNOWNS]; UNKNOWNS];
    let mut rhs = [T::zero(); UNKNOWNS];
    for i in 0..6 {
        for j in 0..6 {
            m[i][j] = (mass[i][j] * unit).scale(arcs[i] * arcs[j]);
        }
        rhs[i] = (push[i] * unit).scale(arcs[i]);
    }
    for k in 0..mech.independent.len() {
        let c = &mech.independent[k];
        let (size, row) = (constraint::length(c, scale), constraint::row(c, pose).array());
        for i in 0..6 {
            let entry = row[i].scale(size * arcs[i]);
            (m[6 + k][i], m[i][6 + k]) = (entry, -entry);
        }
        rhs[6 + k] = -quadratic(&constraint::hessian(c, pose), &v).scale(size);
    }
    let Solved { x: [x], pivots, .. } =
        T::apart(SolveDriven { m: &m, rhs: &rhs, count: 6 + mech.independent.len() });
    let (mut acceleration, mut multipliers) = ([T::zero(); 6], [T::zero(); MAX_CONSTRAINTS]);
    for i in 0..6 {
        acceleration[i] = x[i].scale(arcs[i]);
    }
    for k in 0..mech.independent.len() {
        let c = &mech.independent[k];
        multipliers[k] = (x[6 + k] / unit).scale(constraint::length(c, scale));
    }
    Driven { acceleration: Acceleration::from_array(acceleration), multipliers, pivots }
}

work! {
    MassMatrix<'a, T: Real> { mech: &'a Mechanism, pose: &'a Pose<T> } -> Matrix6<T> {
        mass_matrix(mech, pose)
    }
}
work! {
    /// What the links take from the forces in a motion without acceleration.
    Coasting<'a, T: Real> {
        mech: &'a Mechanism,
        pose: &'a Pose<T>,
        twist: &'a Twist<T>,
        load: Wrench<T>,
    } -> Wrench<T> {
        resultant(mech, &coasting(pose, twist), load)
    }
}
work! {
    SolveDriven<'a, T: Real> {
        m: &'a [[T; UNKNOWNS]; UNKNOWNS],
        rhs: &'a [T; UNKNOWNS],
        count: usize,
    } -> Solved<T, [[T; UNKNOWNS]; 1]> {
        solve_first(*m, [*rhs], count)
    }
}

#[inline(always)]
fn coasting<T: Real>(pose: &Pose<T>, twist: &Twist<T>) -> Motion<T> {
    Motion { pose: *pose, twist: *twist, acceleration: Acceleration::zero() }
}

/// M on twists (v, ω): `resultant(A) = resultant(0) - M A` at rest \[T49\].
#[inline(always)]
pub fn mass_matrix<T: Real>(mech: &Mechanism, pose: &Pose<T>) -> [[T; 6]; 6] {
    let still = coasting(pose, &Twist::zero());
    let mut columns = [Wrench::zero(); 6];
    let weight = own_wrench(mech, &still, Wrench::zero());
    for j in 0..6 {
        columns[j] = weight - own_wrench(mech, &accelerated(&still, j), Wrench::zero());
    }
    for (i, leg) in mech.legs.iter().enumerate() {
        let place = leg::place(leg, pose);
        let weight = leg_wrench(mech, i, leg, &place, &still);
        for j in 0..6 {
            columns[j] = columns[j] + weight - leg_wrench(mech, i, leg, &place, &accelerated(&still, j));
        }
    }
    let mut m = [[T::zero(); 6]; 6];
    for j in 0..6 {
        let column = columns[j].array();
        for i in 0..6 {
            m[i][j] = column[i];
        }
    }
    m
}

#[inline(always)]
fn unit<T: Real>(j: usize) -> Twist<T> {
    let mut unit = [T::zero(); 6];
    unit[j] = T::one();
    Twist::from_array(unit)
}

/// At rest with the unit of one acceleration.
#[inline(always)]
fn accelerated<T: Real>(still: &Motion<T>, j: usize) -> Motion<T> {
    let Twist { v, omega } = unit(j);
    Motion { acceleration: Acceleration::new(v, omega), ..*still }
}

/// `M A` for the acceleration with the numbers of a twist; `weight` is the resultant at rest.
#[inline(always)]
fn inertia<T: Real>(mech: &Mechanism, still: &Motion<T>, weight: Wrench<T>, a: &Twist<T>) -> Wrench<T> {
    let moved = Motion { acceleration: Acceleration::new(a.v, a.omega), ..*still };
    weight - resultant(mech, &moved, Wrench::zero())
}

/// The terms of `M q'' + C q' + D q' + g = Jᵀ f + Sᵀ W/η` in some velocities q' of the platform \[T50\]
/// \[T51\] \[T52\]. The first `count` rows and columns are in use.
#[derive(Clone, Copy, Debug)]
pub struct Equations<T> {
    pub count: usize,
    pub mass: [[T; 6]; 6],
    pub coriolis: [[T; 6]; 6],
    pub damping: [[T; 6]; 6],
    pub gravity: [T; 6],
    /// S, its columns: the twist of each unit velocity.
    pub twists: [Twist<T>; 6],
}

/// The terms in platform space, on twists (v, ω) \[T51\].
#[inline(always)]
pub fn platform_equations<T: Real>(mech: &Mechanism, pose: &Pose<T>, twist: &Twist<T>) -> Equations<T> {
    let motion = |v: &[T; 6]| coasting(pose, &Twist::from_array(*v));
    let mut e = equations(mech, 6, &twist.array(), motion);
    // Angular velocities are no rates of coordinates: ½ [h × ω_j + ω × h_j] with the angular momentum h = (M
    // V)_ω.
    let momentum = |v: [T; 6]| {
        let along = |i: usize| (0..6).fold(T::zero(), |sum, j| e.mass[i][j].mul_add(v[j], sum));
        Vec3::new(along(3), along(4), along(5))
    };
    let h = momentum(twist.array());
    let turns: [Vec3<T>; 6] = std::array::from_fn(|j| {
        let w = unit(j);
        (h.cross(w.omega) + twist.omega.cross(momentum(w.array()))) * T::lit(0.5)
    });
    for (j, turn) in turns.iter().enumerate() {
        for (i, t) in turn.array().into_iter().enumerate() {
            e.coriolis[3 + i][j] = e.coriolis[3 + i][j] + t;
        }
    }
    e
}

/// The terms in the given coordinates of a set, dependent ones following \[T52\]; `q` are all its numbers at
/// the pose.
///
/// # Errors
/// The status of a state that the coordinates do not determine.
pub fn coordinate_equations(
    mech: &Mechanism,
    set: &Set,
    given: &[bool],
    (q, branch): (&Values<f64>, f64),
    pose: &Pose<f64>,
    twist: &Twist<f64>,
) -> Result<(Equations<f64>, [f64; 6]), Status> {
    let mask: [bool; MAX_COORDINATES] = std::array::from_fn(|k| given.get(k).copied().unwrap_or(true));
    let free: Vec<usize> = (0..set.names().len()).filter(|&k| mask[k]).collect();
    let state = |rates: &[f64; 6]| {
        let mut jets = q.map(Jet::lit);
        for (&k, &rate) in free.iter().zip(rates) {
            jets[k].d = rate;
        }
        dependent_coordinates::state(mech, set, &jets, &mask, branch, pose, SINGULAR)
    };
    let still = state(&[0.0; 6]);
    if still.status != Status::Ok {
        return Err(still.status);
    }
    let motion = |rates: &[f64; 6]| state(rates).platform;
    let columns: [Twist<f64>; 6] = std::array::from_fn(|j| motion(&unit(j).array()).twist);
    let rates = rates_of(mech, &columns, free.len(), twist);
    let back = motion(&rates).twist;
    let off = Twist::new(back.v - twist.v, back.omega - twist.omega);
    // Near a fold the dependent rates grow until rounding takes their digits; a NaN is refused too.
    if !(square(mech, &off).sqrt() <= FOLD_TOLERANCE * square(mech, twist).sqrt()) {
        return Err(Status::Fold);
    }
    Ok((equations(mech, free.len(), &rates, motion), rates))
}

/// The rates whose twist it is, `S q' = V` in the sense of least squares, rotations counted as arcs.
fn rates_of(mech: &Mechanism, columns: &[Twist<f64>; 6], count: usize, twist: &Twist<f64>) -> [f64; 6] {
    let dot = |a: &Twist<f64>, b: &Twist<f64>| {
        a.v.dot(b.v) + a.omega.dot(b.omega) * mech.characteristic_length * mech.characteristic_length
    };
    let entry = |i: usize, j: usize| match (i < count && j < count, i == j) {
        (true, _) => dot(&columns[i], &columns[j]),
        (false, same) => f64::from(u8::from(same)),
    };
    let m: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
    let rhs = std::array::from_fn(|i| if i < count { dot(&columns[i], twist) } else { 0.0 });
    solve(m, rhs).x
}

/// All terms for the velocities whose `motion` has zero second rates: the acceleration is quadratic in them.
#[inline(always)]
fn equations<T: Real>(
    mech: &Mechanism,
    count: usize,
    rates: &[T; 6],
    motion: impl Fn(&[T; 6]) -> Motion<T>,
) -> Equations<T> {
    let still = motion(&[T::zero(); 6]);
    let weight = resultant(mech, &still, Wrench::zero());
    let twists: [Twist<T>; 6] =
        std::array::from_fn(|j| if j < count { motion(&unit(j).array()).twist } else { Twist::zero() });
    let onto = |w: Wrench<T>| twists.map(|s| w.power(&s));
    let columns = |f: &dyn Fn(usize) -> Wrench<T>| {
        let columns: [[T; 6]; 6] =
            std::array::from_fn(|j| if j < count { onto(f(j)) } else { [T::zero(); 6] });
        std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
    };
    // c(q'): what is quadratic in the velocities, [T50].
    let damping = |t: &Twist<T>| damping_wrench(mech, t) * T::lit(1.0 / mech.efficiency);
    let centripetal = |rates: &[T; 6]| {
        let moving = motion(rates);
        let braked = weight + damping(&moving.twist);
        braked - resultant(mech, &moving, Wrench::zero())
    };
    // The polar form ¼ [c(q' + s e_j) - c(q' - s e_j)]/s, both parts scaled so that what they add is as large
    // as weights.
    let brisk = T::lit((mech.characteristic_length * STANDARD_GRAVITY).sqrt());
    let pace = brisk / size(mech, &motion(rates).twist);
    let polar = |j: usize| {
        let step = brisk / size(mech, &twists[j]);
        let moved =
            |step: T| std::array::from_fn(|i| if i == j { rates[i] * pace + step } else { rates[i] * pace });
        let both = centripetal(&moved(step)) - centripetal(&moved(-step));
        both * (T::lit(0.25) / (step * pace))
    };
    Equations {
        count,
        mass: columns(&|j| inertia(mech, &still, weight, &twists[j])),
        coriolis: columns(&polar),
        damping: columns(&|j| damping(&twists[j]) * T::lit(-1.0)),
        gravity: onto(weight * T::lit(-1.0)),
        twists,
    }
}

/// Size of a twist squared, rotations counted as arcs.
#[inline(always)]
pub(crate) fn square<T: Real>(mech: &Mechanism, twist: &Twist<T>) -> T {
    let scale = mech.characteristic_length;
    twist.v.dot(twist.v) + twist.omega.dot(twist.omega).scale(scale * scale)
}

/// Size of a twist, one for rest: the root has no derivative there.
#[inline(always)]
fn size<T: Real>(mech: &Mechanism, twist: &Twist<T>) -> T {
    let square = square(mech, twist);
    let moving = square.value().greater(T::Value::zero());
    T::select(moving, T::select(moving, square, T::one()).sqrt(), T::one())
}
