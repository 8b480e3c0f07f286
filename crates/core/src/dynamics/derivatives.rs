//! Derivatives of inverse dynamics by the motion and by the geometry, by dual numbers, one direction at a
//! time \[T56\].
//!
//! Forces F solve the linear balance W + Jᵀ F = 0, which is differentiated implicitly: Jᵀ δF = -(δW + δJᵀ F),
//! with W and J evaluated in dual numbers and F kept.

use crate::assembly::geometric_parameters::{self, GeometricParameter};
use crate::dynamics::force_balance::UnitForceResponse;
use crate::dynamics::inverse_dynamics::{leg_wrench, load_in_base, own_wrench};
use crate::kinematics::coordinate_sensitivity::{ImplicitSensitivity, Variation, Varying};
use crate::kinematics::coordinate_sets::{self, Set, Values};
use crate::kinematics::leg;
use crate::kinematics::rows::{Row, RowNumbers, for_each_row};
use crate::model::mechanism::{Leg, Mechanism};
use crate::model::spec::Axes;
use crate::number::lanes::Lanes;
use crate::number::real::{Constant, Dual, Jet, Real};
use crate::number::slices::{self, pairs};
use crate::number::work::work;
use crate::spatial::{Acceleration, Motion, Pose, Twist, Vec3, Wrench};

/// Numbers that a motion is varied in: six of the pose (o moves, and the platform rotates about axes of the
/// base through o), six of the twist, six of the acceleration.
pub const DIRECTIONS: usize = 18;

/// The first of them, the only ones that J's rows and the legs' places vary in.
const POSE_DIRECTIONS: usize = 6;

/// Inverse dynamics at a state, solved. Forces and multipliers, or how they change, stand in the order of J's
/// rows.
#[derive(Clone, Copy)]
pub(crate) struct SolvedDynamics<'a, V: Real> {
    pub platform: Motion<V>,
    /// The load as it is given, with its axes.
    pub load: (Wrench<V>, Axes),
    pub numbers: RowNumbers,
    pub forces: &'a [V],
    /// y of \[T72\] where actuators are redundant, else zero.
    pub motion: Twist<V>,
    pub response: &'a UnitForceResponse<V>,
}

/// What a variation takes the balance off by, forces and multipliers kept: the wrench on the platform, and
/// where actuators are redundant what each row of J then does to y \[T74\].
struct Imbalance<'a, 'b, V: Real> {
    at: &'a SolvedDynamics<'a, V>,
    wrench: Wrench<Dual<V>>,
    motion: Twist<Dual<V>>,
    rows: &'b mut [V],
}

impl<'a, 'b, V: Lanes> Imbalance<'a, 'b, V> {
    /// `rows` is room for a number of each row where actuators are redundant, else empty.
    #[inline(always)]
    fn new(at: &'a SolvedDynamics<'a, V>, wrench: Wrench<Dual<V>>, rows: &'b mut [V]) -> Self {
        slices::fill(rows, V::zero());
        let motion = Twist::new(at.motion.v.with_rate(Vec3::zero()), at.motion.omega.with_rate(Vec3::zero()));
        Imbalance { at, wrench, motion, rows }
    }

    /// Adds a leg's own wrench and that of its kept active force, where J's row of this number varies.
    #[inline(always)]
    fn add_leg<S: Constant<Dual<V>>>(
        &mut self,
        mech: &Mechanism<S>,
        index: usize,
        place: &leg::LegPlacement<Dual<V>>,
        varied: &Motion<Dual<V>>,
        row: Option<usize>,
    ) {
        let leg = &mech.legs[index];
        let mut sum = leg_wrench(mech, index, leg, place, varied);
        if let Some(row) = row {
            let unit = leg::row(leg, &place.0);
            sum = sum + unit * Dual::new(self.at.forces[row], V::zero());
            if let Some(off) = self.rows.get_mut(row) {
                *off = unit.power(&self.motion).d;
            }
        }
        self.wrench = self.wrench + sum;
    }

    /// Adds what a local degree of freedom's or a constraint's row does, its multiplier kept.
    #[inline(always)]
    fn add_row<S: Constant<Dual<V>>>(&mut self, row: Row<'_, S>, number: usize, pose: &Pose<Dual<V>>) {
        let unit = row.wrench(pose);
        self.wrench = self.wrench + unit * Dual::new(self.at.forces[number], V::zero());
        if let Some(off) = self.rows.get_mut(number) {
            *off = -unit.power(&self.motion).d;
        }
    }

    /// The forces answer it.
    #[inline(always)]
    fn put(self, column: &mut [V]) {
        self.at.response.put(rate(self.wrench), self.rows, column);
    }
}

work! {
    /// Derivatives of active forces and multipliers by the motion in each direction, the other numbers kept:
    /// one column for each direction. `off` is room for a number of each row where actuators are redundant,
    /// else empty.
    pub(crate) ByMotion<'a, 'b, V: Lanes> {
        mech: &'a Mechanism,
        at: &'a SolvedDynamics<'b, V>,
        off: &'a mut [V],
        places: &'a mut Vec<leg::LegPlacement<Dual<V>>>,
        columns: &'a mut [V],
    } -> () {
        let width = mech.rows();
        let still = along(&at.platform, &[V::zero(); DIRECTIONS]);
        places.clear();
        for leg in &mech.legs {
            places.push(leg::place(leg, &still.pose));
        }
        for direction in 0..DIRECTIONS {
            let mut step = [V::zero(); DIRECTIONS];
            step[direction] = V::one();
            let varied = along(&at.platform, &step);
            let (load, axes) = at.load;
            let load = Wrench::new(load.force.with_rate(Vec3::zero()), load.torque.with_rate(Vec3::zero()));
            let own = own_wrench(mech, &varied, load_in_base(load, axes, &varied.pose));
            let mut imbalance = Imbalance::new(at, own, off);
            let (pose_varies, mut row) = (direction < POSE_DIRECTIONS, 0);
            for (i, leg) in mech.legs.iter().enumerate() {
                let place = if pose_varies { leg::place(leg, &varied.pose) } else { places[i] };
                imbalance.add_leg(mech, i, &place, &varied, (pose_varies && leg.actuated).then_some(row));
                row += usize::from(leg.actuated);
            }
            if pose_varies {
                for_each_row!(others of mech, at.numbers.actuated().end, |number, other| {
                    imbalance.add_row(other, number, &varied.pose);
                });
            }
            imbalance.put(&mut columns[direction * width..(direction + 1) * width]);
        }
    }
}

/// The motion as it varies with a step in all directions.
#[inline(always)]
pub(crate) fn along<V: Lanes>(at: &Motion<V>, step: &[V; DIRECTIONS]) -> Motion<Dual<V>> {
    let Motion { pose, twist, acceleration } = at;
    Motion {
        pose: pose.along(&Twist::new(part(step, 0), part(step, 1))),
        twist: Twist::new(twist.v.with_rate(part(step, 2)), twist.omega.with_rate(part(step, 3))),
        acceleration: Acceleration::new(
            acceleration.a.with_rate(part(step, 4)),
            acceleration.eps.with_rate(part(step, 5)),
        ),
    }
}

/// Three numbers of a step.
#[inline(always)]
fn part<V: Lanes>(step: &[V; DIRECTIONS], k: usize) -> Vec3<V> {
    Vec3::new(step[3 * k], step[3 * k + 1], step[3 * k + 2])
}

/// The step that a motion varies by, in all directions.
#[inline(always)]
fn step_of<V: Lanes>(rates: &Pose<Jet<V>>, varied: &Variation<V>) -> [V; DIRECTIONS] {
    let [now, moved] = [parts_of(rates), varied.pose];
    // ω = ½ Σ x × x' over the columns of R, ε = ½ Σ x × x'' [T19]; a rotation δθ makes δx = δθ × x.
    let (mut turn, mut omega, mut eps) = (Vec3::zero(), Vec3::zero(), Vec3::zero());
    for k in 0..3 {
        turn = turn + now[0][k].cross(moved[0][k]);
        omega = omega + now[0][k].cross(moved[1][k]) + moved[0][k].cross(now[1][k]);
        eps = eps + now[0][k].cross(moved[2][k]) + moved[0][k].cross(now[2][k]);
    }
    let halves = [turn.scale(0.5), omega.scale(0.5), eps.scale(0.5)];
    let mut step = [V::zero(); DIRECTIONS];
    for order in 0..3 {
        let (linear, angular) = (moved[order][3].array(), halves[order].array());
        for i in 0..3 {
            step[6 * order + i] = linear[i];
            step[6 * order + 3 + i] = angular[i];
        }
    }
    step
}

/// Columns of R, then o: values, rates, second rates.
#[inline(always)]
fn parts_of<V: Lanes>(pose: &Pose<Jet<V>>) -> [[Vec3<V>; 4]; 3] {
    let [x, y, z] = pose.rotation.0;
    let (vectors, mut all) = ([x, y, z, pose.o], [[Vec3::zero(); 4]; 3]);
    for k in 0..4 {
        let Vec3 { x, y, z } = vectors[k];
        all[0][k] = Vec3::new(x.x, y.x, z.x);
        all[1][k] = Vec3::new(x.d, y.d, z.d);
        all[2][k] = Vec3::new(x.dd, y.dd, z.dd);
    }
    all
}

#[inline(always)]
fn rate_of<V: Lanes>(a: Vec3<Dual<V>>) -> Vec3<V> {
    Vec3 { x: a.x.d, y: a.y.d, z: a.z.d }
}

#[inline(always)]
pub(crate) fn rate<V: Lanes>(w: Wrench<Dual<V>>) -> Wrench<V> {
    Wrench::new(rate_of(w.force), rate_of(w.torque))
}

/// Rows summed at the same time: a sum waits for its last term, six of them keep the processor busy.
const TOGETHER: usize = 6;

/// Adds the derivative along a step, from the columns by motion, to a column.
#[inline(always)]
fn add_along<V: Lanes>(by_motion: &[V], step: &[V; DIRECTIONS], column: &mut [V]) {
    let width = column.len();
    for first in (0..width).step_by(TOGETHER) {
        let mut sums = [V::zero(); TOGETHER];
        for k in 0..DIRECTIONS {
            // The last rows, again, where there are fewer.
            let from = &by_motion[k * width + first.min(width - TOGETHER)..][..TOGETHER];
            for i in 0..TOGETHER {
                sums[i] = from[i].mul_add(step[k], sums[i]);
            }
        }
        for row in first..width.min(first + TOGETHER) {
            column[row] = column[row] + sums[row - first.min(width - TOGETHER)];
        }
    }
}

/// The coordinates at a state, and how the motion follows them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VariedCoordinates<V: Real> {
    q: Values<Jet<V>>,
    pose: Pose<Jet<V>>,
    pub following: ImplicitSensitivity<V>,
}

impl<V: Lanes> VariedCoordinates<V> {
    #[inline(always)]
    pub(crate) fn at(
        mech: &Mechanism,
        set: &Set,
        still: &Varied,
        given: &[bool],
        platform: &Motion<V>,
    ) -> Self {
        V::apart(CoordinatesAt { mech, set, still, given, platform })
    }

    /// Variation of pose, rates and constraints with a number of the coordinate set.
    #[inline(always)]
    pub(crate) fn varied(&self, still: &Varied, number: usize) -> Variation<V> {
        V::apart(Varying { mech: &still.mech, set: &still.set, q: &self.q, number: Some(number) })
    }

    /// The derivative by a given coordinate that these vary with, or by its rate or second rate (order 1 or
    /// 2), the others of these kept and dependent coordinates following.
    #[inline(always)]
    pub(crate) fn put_derivative(
        &self,
        by_motion: &[V],
        varied: &Variation<V>,
        order: usize,
        column: &mut [V],
    ) {
        slices::fill(column, V::zero());
        add_along(by_motion, &self.step(varied, order), column);
    }

    /// Variation of the motion, with the dependent coordinates.
    #[inline(always)]
    pub(crate) fn step(&self, varied: &Variation<V>, order: usize) -> [V; DIRECTIONS] {
        step_of(&self.pose, &self.following.with(varied.by_rate(order)))
    }

    /// Variation of the motion with a number of the geometry, coordinates kept.
    #[inline(always)]
    pub(crate) fn following_geometry(&self, by: &Varied) -> [V; DIRECTIONS] {
        if !by.moves {
            return [V::zero(); DIRECTIONS];
        }
        let variation = V::apart(Varying { mech: &by.mech, set: &by.set, q: &self.q, number: None });
        step_of(&self.pose, &self.following.with(variation))
    }
}

work! {
    CoordinatesAt<'a, V: Lanes> {
        mech: &'a Mechanism,
        set: &'a Set,
        still: &'a Varied,
        given: &'a [bool],
        platform: &'a Motion<V>,
    } -> VariedCoordinates<V> {
        let q = coordinate_sets::along(mech, set, platform);
        let following = ImplicitSensitivity::at(&still.mech, &still.set, &q, given);
        VariedCoordinates { q, pose: platform.jets(), following }
    }
}

/// A mechanism that varies with one number of its geometry, or with none.
#[derive(Clone, Debug)]
pub(crate) struct Varied {
    pub(crate) mech: Mechanism<Dual<f64>>,
    set: Set<Dual<f64>>,
    /// The legs and independent constraints that vary.
    legs: Vec<usize>,
    constraints: Vec<usize>,
    /// Whether the motion varies with it.
    moves: bool,
}

impl Varied {
    /// Nothing varies.
    pub(crate) fn none(mech: &Mechanism, set: &Set) -> Self {
        let (legs, constraints) = (vec![], vec![]);
        Varied {
            mech: geometric_parameters::varied(mech, None),
            set: set.lifted(),
            legs,
            constraints,
            moves: false,
        }
    }

    /// None if the set is none of the mechanism while it varies.
    pub(crate) fn new(mech: &Mechanism, by: &GeometricParameter, set: &Set) -> Option<Self> {
        let mech = geometric_parameters::varied(mech, Some(by));
        let varies = |a: Vec3<Dual<f64>>| a.array().iter().any(|x| x.d != 0.0);
        let leg_varies = |leg: &Leg<Dual<f64>>| {
            let drive = leg.drive.numbers().iter().any(|x| x.d != 0.0);
            drive || varies(leg.base.point) || varies(leg.platform.point) || varies(leg.turning.axis())
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

work! {
    /// Derivatives of active forces, multipliers and of the lengths of all legs by a number of the geometry,
    /// the given coordinates, their rates and second rates kept and dependent coordinates following. `off` as
    /// in [`ByMotion`].
    pub(crate) ByGeometry<'a, 'b, V: Lanes> {
        varied: &'a Varied,
        at: &'a SolvedDynamics<'b, V>,
        coordinates: &'a VariedCoordinates<V>,
        by_motion: &'a [V],
        off: &'a mut [V],
        column: &'a mut [V],
        lengths: &'a mut [V],
    } -> () {
        let Varied { mech, legs, constraints, moves, .. } = varied;
        // With the motion kept only some legs vary, and the rods that they lead.
        let still = along(&at.platform, &[V::zero(); DIRECTIONS]);
        let mut imbalance = Imbalance::new(at, Wrench::zero(), off);
        for &i in legs {
            let leg = &mech.legs[i];
            let mut row = 0;
            for other in &mech.legs[..i] {
                row += usize::from(other.actuated);
            }
            let place = leg::place(leg, &still.pose);
            imbalance.add_leg(mech, i, &place, &still, leg.actuated.then_some(row));
        }
        for (idle, number) in pairs(&mech.idle, at.numbers.idle()) {
            imbalance.add_row(Row::Idle(idle), number, &still.pose);
        }
        for &k in constraints {
            let number = at.numbers.constraints().start + k;
            imbalance.add_row(Row::Constraint(&mech.independent[k]), number, &still.pose);
        }
        imbalance.put(column);
        let mut step = [V::zero(); DIRECTIONS];
        if *moves {
            step = coordinates.following_geometry(varied);
            add_along(by_motion, &step, column);
        }
        let moving = along(&at.platform, &step);
        for (i, leg) in mech.legs.iter().enumerate() {
            let varies = *moves || legs.contains(&i);
            lengths[i] = if varies { leg::position(leg, &moving.pose).coordinate.d } else { V::zero() };
        }
    }
}
