//! Derivatives of inverse dynamics by the motion and by the geometry: the same equations with dual numbers, one
//! direction at a time \[T56\].
//!
//! Forces are the solution of a linear balance, so that what is differentiated is the balance with the forces kept:
//! what it is off by, per unit of the direction, the forces must answer.

use crate::constraint;
use crate::coordinates::{self, MAX_COORDINATES, Set, Values};
use crate::dynamics::{Answering, leg_wrench, load_in_base, own_wrench};
use crate::lanes::{Lanes, Work};
use crate::leg;
use crate::mechanism::{Leg, Mechanism};
use crate::real::{Constant, Dual, Jet, Real};
use crate::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3, Wrench};
use crate::spec::Axes;

/// Numbers that a motion is varied in: six of the pose (o moves, and the platform turns about axes of the base through
/// o), six of the twist, six of the acceleration.
pub const DIRECTIONS: usize = 18;

/// Active forces and multipliers, or how they change.
pub type Column<V> = [V; 6];

/// Inverse dynamics at a state, solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solved<V: Real> {
    pub platform: Motion<V>,
    /// The load as it is given, with its axes.
    pub load: (Wrench<V>, Axes),
    pub forces: Column<V>,
    pub answering: Answering<V>,
}

/// Derivatives of active forces and multipliers by the motion in each direction, the other numbers kept.
#[inline(always)]
pub(crate) fn by_motion<V: Lanes>(mech: &Mechanism, at: &Solved<V>) -> [Column<V>; DIRECTIONS] {
    let mut columns = [[V::zero(); 6]; DIRECTIONS];
    for direction in 0..DIRECTIONS {
        let mut step = [V::zero(); DIRECTIONS];
        step[direction] = V::one();
        let varied = along(&at.platform, &step);
        let (load, axes) = at.load;
        let load = Wrench::new(kept_vector(load.force), kept_vector(load.torque));
        let mut sum = own_wrench(mech, &varied, load_in_base(load, axes, &varied.pose));
        let mut row = 0;
        for (i, leg) in mech.legs.iter().enumerate() {
            sum = sum + with_leg(mech, i, leg, &varied, &at.forces, &mut row);
        }
        for k in 0..mech.independent.len() {
            let multiplier = Dual::new(at.forces[mech.dof() + k], V::zero());
            sum = sum + constraint::row(&mech.independent[k], &varied.pose) * multiplier;
        }
        columns[direction] = at.answering.to(rate(sum));
    }
    columns
}

/// A leg's own wrench on the platform and that of its kept active force; `row` counts the legs that have one.
#[inline(always)]
fn with_leg<S: Constant<Dual<V>>, V: Lanes>(
    mech: &Mechanism<S>,
    index: usize,
    leg: &Leg<S>,
    varied: &Motion<Dual<V>>,
    forces: &Column<V>,
    row: &mut usize,
) -> Wrench<Dual<V>> {
    let place = leg::place(leg, &varied.pose);
    let mut sum = leg_wrench(mech, index, leg, &place, varied);
    if leg.actuated {
        sum = sum + leg::row(&place.0) * Dual::new(forces[*row], V::zero());
        *row += 1;
    }
    sum
}

/// The motion as it varies with a step in all directions.
#[inline(always)]
fn along<V: Lanes>(at: &Motion<V>, step: &[V; DIRECTIONS]) -> Motion<Dual<V>> {
    let (turn, [x, y, z]) = (part(step, 1), at.pose.rotation.0);
    let columns = [with_rate(x, turn.cross(x)), with_rate(y, turn.cross(y)), with_rate(z, turn.cross(z))];
    Motion {
        pose: Pose { rotation: Mat3(columns), o: with_rate(at.pose.o, part(step, 0)) },
        twist: Twist::new(with_rate(at.twist.v, part(step, 2)), with_rate(at.twist.omega, part(step, 3))),
        acceleration: Acceleration::new(
            with_rate(at.acceleration.a, part(step, 4)),
            with_rate(at.acceleration.eps, part(step, 5)),
        ),
    }
}

/// Three numbers of a step.
#[inline(always)]
fn part<V: Lanes>(step: &[V; DIRECTIONS], k: usize) -> Vec3<V> {
    Vec3::new(step[3 * k], step[3 * k + 1], step[3 * k + 2])
}

/// The step that a motion varies by: the inverse of [`along`].
#[inline(always)]
fn step_of<V: Lanes>(varied: &Motion<Dual<V>>) -> [V; DIRECTIONS] {
    let Motion { pose, twist, acceleration } = varied;
    let [x, y, z] = pose.rotation.0;
    let turn =
        (value(x).cross(rate_of(x)) + value(y).cross(rate_of(y)) + value(z).cross(rate_of(z))).scale(0.5);
    let parts = [
        rate_of(pose.o),
        turn,
        rate_of(twist.v),
        rate_of(twist.omega),
        rate_of(acceleration.a),
        rate_of(acceleration.eps),
    ];
    let mut step = [V::zero(); DIRECTIONS];
    for k in 0..6 {
        let part = parts[k].array();
        for i in 0..3 {
            step[3 * k + i] = part[i];
        }
    }
    step
}

#[inline(always)]
fn with_rate<V: Lanes>(a: Vec3<V>, d: Vec3<V>) -> Vec3<Dual<V>> {
    Vec3 { x: Dual::new(a.x, d.x), y: Dual::new(a.y, d.y), z: Dual::new(a.z, d.z) }
}

#[inline(always)]
fn kept_vector<V: Lanes>(a: Vec3<V>) -> Vec3<Dual<V>> {
    with_rate(a, Vec3::zero())
}

#[inline(always)]
fn value<V: Lanes>(a: Vec3<Dual<V>>) -> Vec3<V> {
    Vec3 { x: a.x.x, y: a.y.x, z: a.z.x }
}

#[inline(always)]
fn rate_of<V: Lanes>(a: Vec3<Dual<V>>) -> Vec3<V> {
    Vec3 { x: a.x.d, y: a.y.d, z: a.z.d }
}

#[inline(always)]
fn rate<V: Lanes>(w: Wrench<Dual<V>>) -> Wrench<V> {
    Wrench::new(rate_of(w.force), rate_of(w.torque))
}

/// From the columns by motion to the derivative along a step.
#[inline(always)]
fn combined<V: Lanes>(by_motion: &[Column<V>; DIRECTIONS], step: &[V; DIRECTIONS]) -> Column<V> {
    let mut sum = [V::zero(); 6];
    for k in 0..DIRECTIONS {
        for i in 0..6 {
            sum[i] = by_motion[k][i].mul_add(step[k], sum[i]);
        }
    }
    sum
}

/// What the coordinates are at a state, and which of them are given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given<'a, V> {
    pub q: Values<Jet<V>>,
    pub given: &'a [bool; MAX_COORDINATES],
}

/// The derivative by a given coordinate, its rate or its second rate (order 0, 1 or 2), the others of these kept and
/// dependent coordinates following.
#[inline(always)]
pub(crate) fn by_coordinate<V: Lanes>(
    mech: &Mechanism,
    set: &Set,
    by_motion: &[Column<V>; DIRECTIONS],
    at: &Given<V>,
    coordinate: usize,
    order: usize,
) -> Column<V> {
    let mut q = kept(&at.q);
    match order {
        0 => q[coordinate].x.d = V::one(),
        1 => q[coordinate].d.d = V::one(),
        _ => q[coordinate].dd.d = V::one(),
    }
    combined(by_motion, &step_of(&V::apart(Varying { mech, set, q: &q, given: at.given })))
}

/// Coordinates and their rates that do not vary.
#[inline(always)]
fn kept<V: Lanes>(q: &Values<Jet<V>>) -> Values<Jet<Dual<V>>> {
    let mut kept = [Jet::zero(); MAX_COORDINATES];
    for k in 0..MAX_COORDINATES {
        let Jet { x, d, dd } = q[k];
        kept[k] = Jet::new(Dual::new(x, V::zero()), Dual::new(d, V::zero()), Dual::new(dd, V::zero()));
    }
    kept
}

/// The motion of coordinates that vary, or of a mechanism that does.
struct Varying<'a, S, V> {
    mech: &'a Mechanism<S>,
    set: &'a Set<S>,
    q: &'a Values<Jet<Dual<V>>>,
    given: &'a [bool; MAX_COORDINATES],
}

impl<S, V: Lanes> Work<V> for Varying<'_, S, V>
where
    S: Constant<Jet<Dual<V>>> + Constant<Dual<Dual<V>>>,
{
    type Result = Motion<Dual<V>>;

    #[inline(always)]
    fn run(self) -> Motion<Dual<V>> {
        coordinates::varied(self.mech, self.set, self.q, self.given)
    }
}

/// A mechanism that varies with one number of its geometry.
#[derive(Clone, Debug)]
pub(crate) struct Varied {
    mech: Mechanism<Dual<f64>>,
    set: Set<Dual<f64>>,
    /// The legs and independent constraints that vary.
    legs: Vec<usize>,
    constraints: Vec<usize>,
    /// Whether the motion varies with it.
    moves: bool,
}

impl Varied {
    /// None if the set is none of the mechanism while it varies.
    pub(crate) fn new(mech: Mechanism<Dual<f64>>, set: &Set) -> Option<Self> {
        let varies = |a: Vec3<Dual<f64>>| a.array().iter().any(|x| x.d != 0.0);
        let leg_varies = |leg: &Leg<Dual<f64>>| {
            varies(leg.base.point) || varies(leg.platform.point) || varies(leg.turning.axis())
        };
        let legs = (0..mech.legs.len()).filter(|&i| leg_varies(&mech.legs[i])).collect();
        let constraint_varies = |k: &usize| {
            let (c, p) = (&mech.independent[*k], &mech.independent[*k].partner);
            let own = [c.base_point, c.platform_point, c.base_axis, c.platform_axis];
            own.into_iter().chain([p.base_point, p.platform_point]).chain(p.turn.0).any(varies)
        };
        let constraints: Vec<_> = (0..mech.independent.len()).filter(constraint_varies).collect();
        let set = set.varied(&mech)?;
        Some(Varied { moves: set.varies() || !constraints.is_empty(), set, legs, constraints, mech })
    }
}

/// Derivatives of active forces, multipliers and of the lengths of all legs by a number of the geometry, the given
/// coordinates, their rates and second rates kept and dependent coordinates following.
#[inline(always)]
pub(crate) fn by_geometry<V: Lanes>(
    varied: &Varied,
    solved: &Solved<V>,
    by_motion: &[Column<V>; DIRECTIONS],
    at: &Given<V>,
    lengths: &mut [V],
) -> Column<V> {
    let Varied { mech, set, legs, constraints, moves } = varied;
    // With the motion kept only some legs vary, and the rods that they lead.
    let still = along(&solved.platform, &[V::zero(); DIRECTIONS]);
    let mut sum = Wrench::zero();
    for &i in legs {
        let mut row = 0;
        for other in 0..i {
            row += usize::from(mech.legs[other].actuated);
        }
        sum = sum + with_leg(mech, i, &mech.legs[i], &still, &solved.forces, &mut row);
    }
    for &k in constraints {
        let multiplier = Dual::new(solved.forces[mech.dof() + k], V::zero());
        sum = sum + constraint::row(&mech.independent[k], &still.pose) * multiplier;
    }
    let (mut column, mut moving) = (solved.answering.to(rate(sum)), still);
    if *moves {
        moving = V::apart(Varying { mech, set, q: &kept(&at.q), given: at.given });
        let moved = combined(by_motion, &step_of(&moving));
        for i in 0..6 {
            column[i] = column[i] + moved[i];
        }
    }
    for (i, leg) in mech.legs.iter().enumerate() {
        lengths[i] = leg::position(leg, &moving.pose).length.d;
    }
    column
}
