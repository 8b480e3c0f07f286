//! Coordinate sets: from coordinates to the pose, and from their rates to twist and acceleration.
//!
//! Each set is one map from numbers to a pose, written once for any [`Trig`] number. Evaluated with [`Jet`]s it gives
//! twist and acceleration exactly. Coordinates that a constraint makes dependent are solved first. This is the one
//! place with trigonometry.

use crate::kinematics::constraint;
use crate::model::mechanism::{Constraint, ConstraintKind, MAX_CONSTRAINTS, Mechanism};
use crate::model::status::Status;
use crate::number::lanes::{Lanes, any};
use crate::number::outlined::Outlined;
use crate::number::real::count;
use crate::number::real::{Constant, Dual, Jet, Mask, Ordered, Real, Scalar, Trig};
use crate::number::slices;
use crate::number::work::Work;
use crate::numerics::gauss::{solve, solve_all};
use crate::spatial::{Acceleration, Mat3, Motion, Pose, Twist, Vec3};

/// Most numbers of any set.
pub const MAX_COORDINATES: usize = 7;

pub type Values<T> = [T; MAX_COORDINATES];

/// Frames of a mechanism whose one independent constraint is of kind A: X along L, x along l.
#[derive(Clone, Copy, Debug)]
pub struct Plane<S = f64> {
    /// Base axes of the angles, columns; the first is L.
    base: Mat3<S>,
    /// Platform axes of the angles, columns; the first is l.
    platform: Mat3<S>,
    /// A point of the line L, base axes: the middle of the base joints that share the constraint.
    base_point: Vec3<S>,
    /// The middle of their platform joints, platform axes; it stays in the plane of L and l.
    platform_point: Vec3<S>,
}

#[derive(Clone, Copy, Debug)]
pub enum Set<S = f64> {
    /// (x, y, z, α, β), γ from [Eq. 5] by its branch.
    Paper(Plane<S>),
    /// (α, p, h, β, γ): no dependent coordinate, no fold \[T20\].
    Natural(Plane<S>),
    /// Tip position and tool axis direction, the rotation about the tool from the constraint \[T21\].
    Tool,
    /// x, y, z and the angles of Rx(rx) Ry(ry) Rz(rz) \[T22\].
    Pose,
}

/// |sin γ| below which the two branches of [Eq. 5] count as one.
const FOLD: f64 = 1e-6;

/// |cos γ| - 1 that is rounding of one.
const COSINE_ROUNDING: f64 = 1e-12;

/// Pivot ratio below which the dependent coordinates are not determined.
pub const DEPENDENT_PIVOTS: f64 = 1e-9;

/// Residual, as a pure number, that is rounding of zero.
const SOLVED: f64 = 1e-12;

const NEWTON_STEPS: usize = 50;

impl<S: Scalar> Set<S> {
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Set::Paper(_) => "paper",
            Set::Natural(_) => "natural",
            Set::Tool => "tool",
            Set::Pose => "pose",
        }
    }

    /// All numbers of the set, dependent ones too, in order.
    #[must_use]
    pub fn names(&self) -> &'static [&'static str] {
        match self {
            Set::Paper(_) => &["x", "y", "z", "alpha", "beta", "gamma"],
            Set::Natural(_) => &["alpha", "p", "h", "beta", "gamma"],
            Set::Tool => &["tip_x", "tip_y", "tip_z", "axis_x", "axis_y", "axis_z", "turn"],
            Set::Pose => &["x", "y", "z", "rx", "ry", "rz"],
        }
    }

    /// The set of the same name for the mechanism while it varies.
    #[must_use]
    pub fn varied<V: Scalar>(&self, mech: &Mechanism<V>) -> Option<Set<V>> {
        Some(match self {
            Set::Paper(_) => Set::Paper(Plane::varied(mech)?),
            Set::Natural(_) => Set::Natural(Plane::varied(mech)?),
            Set::Tool => Set::Tool,
            Set::Pose => Set::Pose,
        })
    }

    /// The map from the numbers to the pose.
    #[inline(always)]
    pub fn pose<T: Trig>(&self, mech: &Mechanism<S>, q: &Values<T>) -> Pose<T>
    where
        S: Constant<T>,
    {
        match self {
            Set::Paper(plane) => {
                // [Eq. 2] R in the order XYX, o = (X_o, Y_o, Z_o)
                let turns = [q[3].sin_cos(), q[4].sin_cos(), q[5].sin_cos()];
                Pose { rotation: plane.rotation(turns), o: Vec3::new(q[0], q[1], q[2]) }
            }
            Set::Natural(plane) => {
                // [T20] middle of b_1 b_3 = point of L + p L + h Rx(α) e_z
                let [alpha, p, h, beta, gamma, ..] = *q;
                let (s, c) = alpha.sin_cos();
                let rotation = plane.rotation([(s, c), beta.sin_cos(), gamma.sin_cos()]);
                let middle = Vec3::lift(plane.base_point) + times(&plane.base, Vec3::new(p, -(h * s), h * c));
                Pose { rotation, o: middle - rotation.of(plane.platform_point) }
            }
            Set::Tool => {
                // [T21] R = (home axis → axis) (rotation about the home axis) R_home
                let [x, y, z, i, j, k, turn] = *q;
                let home_axis = mech.home.rotation * mech.tool_axis;
                let direction = Vec3::new(i, j, k).unit();
                let tilt = Mat3::shortest_turn(Vec3::lift(home_axis), direction);
                let rotation = tilt * turn_about(home_axis, turn) * Mat3::lift(mech.home.rotation);
                Pose { rotation, o: Vec3::new(x, y, z) - rotation * Vec3::lift(mech.tool_point) }
            }
            Set::Pose => {
                let turns = [q[3].sin_cos(), q[4].sin_cos(), q[5].sin_cos()];
                Pose { rotation: turn_xyz(turns), o: Vec3::new(q[0], q[1], q[2]) }
            }
        }
    }
}

impl Set<Dual<f64>> {
    /// Whether its map varies.
    pub(crate) fn varies(&self) -> bool {
        match self {
            Set::Paper(plane) | Set::Natural(plane) => {
                let axes = plane.base.0.into_iter().chain(plane.platform.0);
                let all = axes.chain([plane.base_point, plane.platform_point]);
                all.flat_map(Vec3::array).any(|x| x.d != 0.0)
            }
            Set::Tool | Set::Pose => false,
        }
    }
}

impl Set {
    /// Set with dual numbers of zero rate, for a mechanism that may vary.
    pub(crate) fn lifted(&self) -> Set<Dual<f64>> {
        let lifted = |plane: &Plane| Plane {
            base: Mat3::lift(plane.base),
            platform: Mat3::lift(plane.platform),
            base_point: Vec3::lift(plane.base_point),
            platform_point: Vec3::lift(plane.platform_point),
        };
        match self {
            Set::Paper(plane) => Set::Paper(lifted(plane)),
            Set::Natural(plane) => Set::Natural(lifted(plane)),
            Set::Tool => Set::Tool,
            Set::Pose => Set::Pose,
        }
    }

    /// The sets that a mechanism has.
    #[must_use]
    pub fn of(mech: &Mechanism) -> Vec<Set> {
        let mut sets = Vec::new();
        if let Some(plane) = Plane::of(mech) {
            if plane.lever().0.abs() > 1e-9 * mech.characteristic_length {
                sets.push(Set::Paper(plane));
            }
            sets.push(Set::Natural(plane));
        }
        if mech.dof() >= 5 {
            sets.push(Set::Tool);
        }
        sets.push(Set::Pose);
        sets
    }

    /// Which numbers must be given: for each a `true`; none for the set [`Set::Pose`], where any will do.
    #[must_use]
    pub fn given(&self, mech: &Mechanism) -> Option<Vec<bool>> {
        match self {
            Set::Paper(_) => Some(vec![true, true, true, true, true, false]),
            Set::Natural(_) => Some(vec![true; 5]),
            Set::Tool => Some((0..7).map(|i| i < 6 || mech.dof() == 6).collect()),
            Set::Pose => None,
        }
    }

    /// The numbers of a pose that satisfies the constraints: the inverse of [`Set::pose`].
    #[must_use]
    #[inline(always)]
    pub fn values<T: Trig>(&self, mech: &Mechanism, pose: &Pose<T>) -> Values<T> {
        let mut q = [T::zero(); MAX_COORDINATES];
        let o = pose.o.array();
        match self {
            Set::Paper(plane) => {
                let [alpha, beta, gamma] = plane.angles(pose);
                slices::copy(&[o[0], o[1], o[2], alpha, beta, gamma], &mut q[..6]);
            }
            Set::Natural(plane) => {
                let [alpha, beta, gamma] = plane.angles(pose);
                let middle = Mat3::lift(plane.base).transpose_mul(plane.middle(pose));
                let (s, c) = alpha.sin_cos();
                let h = middle.z * c - middle.y * s;
                slices::copy(&[alpha, middle.x, h, beta, gamma], &mut q[..5]);
            }
            Set::Tool => {
                let axis = pose.rotation.of(mech.tool_axis);
                let home_axis = mech.home.rotation * mech.tool_axis;
                let turn = Mat3::shortest_turn(Vec3::lift(home_axis), axis).transpose()
                    * pose.rotation
                    * Mat3::lift(mech.home.rotation.transpose());
                let across = home_axis.perpendicular();
                let turned = turn.of(across);
                slices::copy(&(pose.o + pose.rotation.of(mech.tool_point)).array(), &mut q[..3]);
                slices::copy(&axis.array(), &mut q[3..6]);
                let side = Vec3::lift(home_axis.cross(across));
                q[6] = side.dot(turned).atan2(Vec3::lift(across).dot(turned));
            }
            Set::Pose => {
                let r = pose.rotation.rows();
                slices::copy(&o, &mut q[..3]);
                q[3] = (-r[1][2]).atan2(r[2][2]);
                q[4] = r[0][2].atan2(r[1][2].mul_add(r[1][2], r[2][2] * r[2][2]).sqrt());
                q[5] = (-r[0][1]).atan2(r[0][0]);
            }
        }
        q
    }
}

impl<S: Scalar> Plane<S> {
    /// The frames of a mechanism with one independent constraint, of kind A; none for others.
    #[must_use]
    pub fn of(mech: &Mechanism<S>) -> Option<Self> {
        let [c] = mech.independent.as_slice() else {
            return None;
        };
        if c.kind != ConstraintKind::A {
            return None;
        }
        // The legs whose A constraint is the same one: same axes, platform joints on one line along l.
        let size = |a: Vec3<S>| a.norm().value();
        let parallel = |a: Vec3<S>, b: Vec3<S>| size(a.cross(b)) <= 1e-9 * size(a) * size(b);
        let sharing: Vec<_> = mech
            .constraints
            .iter()
            .filter(|d| {
                d.kind == ConstraintKind::A
                    && parallel(c.base_axis, d.base_axis)
                    && parallel(c.platform_axis, d.platform_axis)
                    && (d.leg == c.leg
                        || (parallel(c.base_axis, d.base_point - c.base_point)
                            && parallel(c.platform_axis, d.platform_point - c.platform_point)))
            })
            .collect();
        let share = 1.0 / count(sharing.len());
        let mean = |point: fn(&Constraint<S>) -> Vec3<S>| {
            sharing.iter().map(|d| point(d)).fold(Vec3::zero(), |sum, p| sum + p).scale(share)
        };
        Some(Plane {
            base: frame_along(c.base_axis),
            platform: frame_along(c.platform_axis),
            base_point: mean(|d| d.base_point),
            platform_point: mean(|d| d.platform_point),
        })
    }

    /// The frames while the joints that share the constraint vary one by one: the middles then stay on the lines of
    /// the independent one \[T56\].
    fn varied(mech: &Mechanism<S>) -> Option<Self> {
        let (plane, c) = (Plane::of(mech)?, mech.independent.first()?);
        let on = |line: Vec3<S>, from: Vec3<S>, point: Vec3<S>| from + line * line.dot(point - from);
        Some(Plane {
            base_point: on(c.base_axis, c.base_point, plane.base_point),
            platform_point: on(c.platform_axis, c.platform_point, plane.platform_point),
            ..plane
        })
    }

    /// [Eq. 2] `R = Rx(α) Ry(β) Rx(γ)` between the plane's axes of base and platform.
    #[inline(always)]
    fn rotation<T: Trig>(&self, turns: [(T, T); 3]) -> Mat3<T>
    where
        S: Constant<T>,
    {
        let (xyx, [x, y, z]) = (turn_xyx(turns), self.platform.transpose().0);
        Mat3([times(&self.base, xyx.of(x)), times(&self.base, xyx.of(y)), times(&self.base, xyx.of(z))])
    }
}

impl Plane {
    /// The signed distance of the reference point from the line through o along l, and its angle about that line,
    /// within a quarter turn of y: for the paper (e sin θ_1, 0).
    fn lever(&self) -> (f64, f64) {
        let m = self.platform.transpose_mul(self.platform_point);
        let sign = if m.y < 0.0 { -1.0 } else { 1.0 };
        (sign * m.y.hypot(m.z), (sign * m.z).atan2(sign * m.y))
    }

    /// cos of γ plus the lever's angle, by [Eq. 5]: the reference point stays in the plane of L and l, whose normal
    /// is Rx(α) e_y.
    #[inline(always)]
    fn cosine<T: Trig>(&self, o: Vec3<T>, alpha: T) -> T {
        let (s, c) = alpha.sin_cos();
        let normal = times(&self.base, Vec3::new(T::zero(), c, s));
        normal.dot(Vec3::lift(self.base_point) - o) / T::lit(self.lever().0)
    }

    /// From the point of L to the reference point, base axes.
    #[inline(always)]
    fn middle<T: Trig>(&self, pose: &Pose<T>) -> Vec3<T> {
        pose.o + pose.rotation.of(self.platform_point) - Vec3::lift(self.base_point)
    }

    /// (α, β, γ), with α that of the half plane from L to the reference point.
    #[inline(always)]
    fn angles<T: Trig>(&self, pose: &Pose<T>) -> [T; 3] {
        let middle = Mat3::lift(self.base).transpose_mul(self.middle(pose));
        let alpha = (-middle.y).atan2(middle.z);
        let turn = Mat3::lift(self.base.transpose()) * pose.rotation * Mat3::lift(self.platform);
        let rest = Mat3::rotation_x((-alpha).sin_cos()) * turn;
        let l = rest.0[0];
        let beta = (-l.z).atan2(l.x);
        let gamma = (Mat3::rotation_y((-beta).sin_cos()) * rest).0[1];
        [alpha, beta, gamma.z.atan2(gamma.y)]
    }
}

/// Columns x along `axis`, z as near to the body's z as it can be, y to the right of both.
fn frame_along<S: Scalar>(axis: Vec3<S>) -> Mat3<S> {
    let x = axis.unit();
    let y = Vec3::lift(Vec3::Z).cross(x);
    let y = if y.norm().value() > 1e-9 { y.unit() } else { Vec3::lift(Vec3::Y) };
    Mat3::from_columns(x, y, x.cross(y))
}

/// A constant matrix times a vector.
#[inline(always)]
fn times<S: Constant<T>, T: Real>(m: &Mat3<S>, a: Vec3<T>) -> Vec3<T> {
    let [x, y, z] = m.0;
    Vec3::new(
        x.x.times(a.x) + y.x.times(a.y) + z.x.times(a.z),
        x.y.times(a.x) + y.y.times(a.y) + z.y.times(a.z),
        x.z.times(a.x) + y.z.times(a.y) + z.z.times(a.z),
    )
}

/// `Rx(α) Ry(β) Rx(γ)` from sines and cosines.
#[inline(always)]
fn turn_xyx<T: Real>([(s1, c1), (s2, c2), (s3, c3)]: [(T, T); 3]) -> Mat3<T> {
    let (sin, cos) = (c2 * s3, c2 * c3);
    Mat3::from_rows([
        [c2, s2 * s3, s2 * c3],
        [s1 * s2, c1 * c3 - s1 * sin, -(c1 * s3) - s1 * cos],
        [-(c1 * s2), s1 * c3 + c1 * sin, c1 * cos - s1 * s3],
    ])
}

/// `Rx Ry Rz` from sines and cosines.
#[inline(always)]
fn turn_xyz<T: Real>([(s1, c1), (s2, c2), (s3, c3)]: [(T, T); 3]) -> Mat3<T> {
    let (sin, cos) = (s2 * s3, s2 * c3);
    Mat3::from_rows([
        [c2 * c3, -(c2 * s3), s2],
        [c1 * s3 + s1 * cos, c1 * c3 - s1 * sin, -(s1 * c2)],
        [s1 * s3 - c1 * cos, s1 * c3 + c1 * sin, c1 * c2],
    ])
}

/// Rodrigues' formula for a rotation about a constant unit axis.
#[inline(always)]
fn turn_about<T: Trig>(axis: Vec3<f64>, angle: T) -> Mat3<T> {
    let (s, c) = angle.sin_cos();
    let mut columns = Mat3::identity().0;
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    for k in 0..3 {
        let (e, along) = (axes[k], axis * axis.dot(axes[k]));
        columns[k] = Vec3::lift(along) + Vec3::lift(e - along) * c + Vec3::lift(axis.cross(e)) * s;
    }
    Mat3(columns)
}

/// A state of the platform with all numbers of its coordinate set.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateState {
    pub coordinates: Values<Jet<f64>>,
    pub platform: Motion<f64>,
    /// Which of several solutions the dependent coordinates are: the sign of sin γ, or of det ∂g/∂y \[T23\].
    pub branch: f64,
    pub status: Status,
}

/// Pose, twist and acceleration from the given coordinates and their rates; dependent ones are solved from the
/// constraints, starting at those of `guess`.
///
/// `given` marks the entries of `q` that are given. `branch` is the sign of sin γ for [Eq. 5].
#[must_use]
pub fn state(
    mech: &Mechanism,
    set: &Set,
    q: &Values<Jet<f64>>,
    given: &[bool],
    branch: f64,
    guess: &Pose<f64>,
) -> CoordinateState {
    let mut q = *q;
    let finite =
        q.iter().zip(given).all(|(c, g)| !g || (c.x.is_finite() && c.d.is_finite() && c.dd.is_finite()));
    let failing = if finite { first(complete(mech, set, &mut q, branch)) } else { Status::InvalidInput };
    let dependent = Dependent::of(set, given);
    let (status, branch) = match (set, failing) {
        (Set::Paper(_), status) => (status, if finite { branch } else { f64::NAN }),
        (_, Status::Ok) if dependent.count == 0 => (Status::Ok, 1.0),
        (_, Status::Ok) => {
            let start = set.values(mech, guess);
            let (conditions, sign) = solve_dependent(mech, set, &mut q, &dependent, &start, true);
            let status = first(conditions);
            (status, if status == Status::Ok { sign } else { f64::NAN })
        }
        (_, status) => (status, f64::NAN),
    };
    CoordinateState { coordinates: q, platform: motion(&set.pose(mech, &q)), branch, status }
}

/// Conditions, each with the status where it fails; the first that fails counts.
pub type Conditions<V> = [(Mask<V>, Status); 2];

fn first(conditions: Conditions<f64>) -> Status {
    conditions.into_iter().find(|(holds, _)| !holds).map_or(Status::Ok, |(_, status)| status)
}

/// Puts what the set itself makes dependent, which is γ of [Eq. 5], and tells what must hold for a pose with rates.
#[inline(always)]
pub fn complete<V: Ordered>(
    mech: &Mechanism,
    set: &Set,
    q: &mut Values<Jet<V>>,
    branch: f64,
) -> Conditions<V> {
    match set {
        Set::Paper(plane) => branch_of_gamma(plane, q, branch),
        Set::Tool => tool_turn(mech, q),
        _ => [(V::zero().at_most(V::zero()), Status::Ok); 2],
    }
}

/// Pose, twist and acceleration of a pose known with its rates \[T19\].
#[inline(always)]
pub fn motion<T: Real>(pose: &Pose<Jet<T>>) -> Motion<T> {
    let [x, y, z] = pose.rotation.0;
    let (values, rates) = ([parts(x)[0], parts(y)[0], parts(z)[0]], [parts(x)[1], parts(y)[1], parts(z)[1]]);
    let ([o, v, a], second) = (parts(pose.o), [parts(x)[2], parts(y)[2], parts(z)[2]]);
    Motion {
        pose: Pose { rotation: Mat3(values), o },
        twist: Twist::new(v, half_cross(values, rates)),
        acceleration: Acceleration::new(a, half_cross(values, second)),
    }
}

/// Value, rate and second rate.
#[inline(always)]
fn parts<T: Real>(a: Vec3<Jet<T>>) -> [Vec3<T>; 3] {
    [Vec3::new(a.x.x, a.y.x, a.z.x), Vec3::new(a.x.d, a.y.d, a.z.d), Vec3::new(a.x.dd, a.y.dd, a.z.dd)]
}

/// The numbers of the set with their rates along a motion: the inverse of [`state`].
#[must_use]
#[inline(always)]
pub fn along<V: Ordered>(mech: &Mechanism, set: &Set, platform: &Motion<V>) -> Values<Jet<V>> {
    set.values(mech, &platform.jets())
}

/// How pose and constraints, with their rates and second rates, vary with one number of the set or of the geometry, the
/// other numbers and all rates kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variation<V> {
    /// Columns of R, then o: values, rates, second rates.
    pub pose: [[Vec3<V>; 4]; 3],
    /// The independent constraints in pure numbers, likewise.
    pub constraints: [System<V>; 3],
}

impl<V: Real> Variation<V> {
    #[inline(always)]
    fn none() -> Self {
        Variation { pose: [[Vec3::zero(); 4]; 3], constraints: [[V::zero(); MAX_CONSTRAINTS]; 3] }
    }

    /// With the number's rate (order 1) or second rate (order 2) instead: `∂x'/∂q' = ∂x/∂q`, `∂x''/∂q' = 2 ∂x'/∂q`,
    /// `∂x''/∂q'' = ∂x/∂q`.
    #[must_use]
    #[inline(always)]
    pub(crate) fn by_rate(&self, order: usize) -> Self {
        let mut rates = Variation::none();
        for from in 0..3 - order {
            let share = if order == 1 && from == 1 { 2.0 } else { 1.0 };
            for k in 0..4 {
                rates.pose[from + order][k] = self.pose[from][k] * V::lit(share);
            }
            for k in 0..MAX_CONSTRAINTS {
                rates.constraints[from + order][k] = self.constraints[from][k].scale(share);
            }
        }
        rates
    }

    /// The sum with so much of another.
    #[must_use]
    #[inline(always)]
    pub(crate) fn and(mut self, other: &Self, share: V) -> Self {
        for order in 0..3 {
            for k in 0..4 {
                self.pose[order][k] = self.pose[order][k] + other.pose[order][k] * share;
            }
            for k in 0..MAX_CONSTRAINTS {
                let sum = self.constraints[order][k];
                self.constraints[order][k] = other.constraints[order][k].mul_add(share, sum);
            }
        }
        self
    }
}

/// Variation of the coordinates' map with a number of the set, or with one of the mechanism.
pub(crate) struct Varying<'a, V> {
    pub mech: &'a Mechanism<Dual<f64>>,
    pub set: &'a Set<Dual<f64>>,
    pub q: &'a Values<Jet<V>>,
    /// The number of the set.
    pub number: Option<usize>,
}

impl<V: Lanes> Work<V> for Varying<'_, V> {
    type Result = Variation<V>;

    #[inline(always)]
    fn run(self) -> Variation<V> {
        let mut q = [Outlined::zero(); MAX_COORDINATES];
        for k in 0..MAX_COORDINATES {
            let (Jet { x, d, dd }, zero) = (self.q[k], V::zero());
            q[k] = Outlined(Jet::new(Dual::new(x, zero), Dual::new(d, zero), Dual::new(dd, zero)));
        }
        if let Some(k) = self.number {
            q[k].0.x.d = V::one();
        }
        let pose = self.set.pose(self.mech, &q);
        let (values, mut all) = (residual(self.mech, &pose), Variation::none());
        let [x, y, z] = pose.rotation.0;
        let vectors = [x, y, z, pose.o];
        for k in 0..4 {
            let Vec3 { x: Outlined(x), y: Outlined(y), z: Outlined(z) } = vectors[k];
            all.pose[0][k] = Vec3::new(x.x.d, y.x.d, z.x.d);
            all.pose[1][k] = Vec3::new(x.d.d, y.d.d, z.d.d);
            all.pose[2][k] = Vec3::new(x.dd.d, y.dd.d, z.dd.d);
        }
        for k in 0..MAX_CONSTRAINTS {
            let Outlined(Jet { x, d, dd }) = values[k];
            (all.constraints[0][k], all.constraints[1][k], all.constraints[2][k]) = (x.d, d.d, dd.d);
        }
        all
    }
}

/// How dependent coordinates, with their rates and second rates, follow whatever varies, so that the constraints are kept
/// \[T56\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImplicitSensitivity<V: Real> {
    dependent: Dependent,
    /// With each dependent number.
    by: [Variation<V>; MAX_CONSTRAINTS],
    /// The inverse of ∂g/∂y, column by column.
    inverse: [System<V>; MAX_CONSTRAINTS],
    /// Its pivot ratio, one where nothing depends.
    pub pivots: V::Value,
}

impl<V: Lanes> ImplicitSensitivity<V> {
    #[inline(always)]
    pub(crate) fn at(
        mech: &Mechanism<Dual<f64>>,
        set: &Set<Dual<f64>>,
        q: &Values<Jet<V>>,
        given: &[bool],
    ) -> Self {
        let dependent = Dependent::of(set, given);
        let mut unit = [[V::zero(); MAX_CONSTRAINTS]; MAX_CONSTRAINTS];
        for k in 0..MAX_CONSTRAINTS {
            unit[k][k] = V::one();
        }
        let (mut matrix, mut by) = (unit, [Variation::none(); MAX_CONSTRAINTS]);
        for (column, &i) in dependent.numbers().iter().enumerate() {
            by[column] = V::apart(Varying { mech, set, q, number: Some(i) });
            for row in 0..mech.independent.len() {
                matrix[row][column] = by[column].constraints[0][row];
            }
        }
        let solved = solve_all(matrix, unit);
        let pivots = if dependent.count == 0 { V::one() } else { solved.pivots };
        ImplicitSensitivity { dependent, by, inverse: solved.x, pivots }
    }

    /// Variation completed by the dependent coordinates, G_y δy = -δg, then by their rates and second rates
    /// in the same way.
    #[must_use]
    #[inline(always)]
    pub(crate) fn with(&self, mut all: Variation<V>) -> Variation<V> {
        for order in 0..3 {
            let mut step = [V::zero(); MAX_CONSTRAINTS];
            for k in 0..MAX_CONSTRAINTS {
                let off = all.constraints[order][k];
                for i in 0..MAX_CONSTRAINTS {
                    step[i] = (-self.inverse[k][i]).mul_add(off, step[i]);
                }
            }
            for k in 0..self.dependent.count {
                all = all.and(&self.by[k].by_rate(order), step[k]);
            }
        }
        all
    }
}

/// Whether there is a shortest rotation from the tool axis at home: not to no direction, and not to the
/// opposite one.
#[inline(always)]
fn tool_turn<V: Ordered>(mech: &Mechanism, q: &Values<Jet<V>>) -> Conditions<V> {
    let axis = Vec3::new(q[3].x, q[4].x, q[5].x);
    let cosine = axis.dot(Vec3::lift(mech.home.rotation * mech.tool_axis)) / axis.norm();
    [
        (cosine.at_most(cosine), Status::InvalidInput),
        (V::lit(FOLD * FOLD).at_most(V::one() + cosine), Status::Fold),
    ]
}

/// `½ Σ x_i × x_i'` over the columns of R is ω, `½ Σ x_i × x_i''` is ε \[T19\].
#[inline(always)]
fn half_cross<T: Real>([x, y, z]: [Vec3<T>; 3], [dx, dy, dz]: [Vec3<T>; 3]) -> Vec3<T> {
    (x.cross(dx) + y.cross(dy) + z.cross(dz)).scale(0.5)
}

/// γ from [Eq. 5]: `γ = ± arccos(...)`, the sign being the branch.
#[inline(always)]
fn branch_of_gamma<V: Ordered>(plane: &Plane, q: &mut Values<Jet<V>>, branch: f64) -> Conditions<V> {
    let cosine = plane.cosine(Vec3::new(q[0], q[1], q[2]), q[3]);
    let exists = cosine.x.abs().at_most(V::lit(1.0 + COSINE_ROUNDING));
    let regular = V::lit(FOLD * FOLD).at_most(V::one() - cosine.x * cosine.x);
    let inside = cosine.x.most(V::lit(-1.0)).least(V::one());
    let gamma =
        Jet::new(inside, cosine.d, cosine.dd).acos().scale(branch.signum()) - Jet::lit(plane.lever().1);
    let nan = V::lit(f64::NAN);
    q[5] = Jet::new(
        V::select(exists, gamma.x, nan),
        V::select(exists, V::select(regular, gamma.d, nan), nan),
        V::select(exists, V::select(regular, gamma.dd, nan), nan),
    );
    [(exists, Status::NoBranch), (regular, Status::Fold)]
}

type System<T> = [T; MAX_CONSTRAINTS];

/// The numbers of a set that are not given.
#[derive(Clone, Copy, Debug)]
pub struct Dependent {
    indices: [usize; MAX_COORDINATES],
    pub count: usize,
}

impl Dependent {
    #[must_use]
    #[inline]
    pub fn of<S: Scalar>(set: &Set<S>, given: &[bool]) -> Self {
        let mut dependent = Dependent { indices: [0; MAX_COORDINATES], count: 0 };
        for i in (0..set.names().len()).filter(|&i| !given[i]) {
            dependent.indices[dependent.count] = i;
            dependent.count += 1;
        }
        dependent
    }

    #[inline(always)]
    fn numbers(&self) -> &[usize] {
        &self.indices[..self.count]
    }
}

/// Newton on the independent constraints for the coordinates that are not given, from those of `start`, then their rates
/// and second rates from the same matrix: `G_y y' = -ġ(y' = 0)`, `G_y y'' = -g̈(y'' = 0)` \[T23\]. Only where they are
/// `wanted`; every lane goes its own way to its own end. Returns the sign of det G_y too: it tells apart the solutions
/// that meet in a fold.
#[inline(always)]
pub fn solve_dependent<V: Lanes>(
    mech: &Mechanism,
    set: &Set,
    q: &mut Values<Jet<V>>,
    dependent: &Dependent,
    start: &Values<f64>,
    wanted: Mask<V>,
) -> (Conditions<V>, V) {
    let (zero, one, nan) = (V::zero(), V::one(), V::lit(f64::NAN));
    let (numbers, scale, unsolved) = (dependent.numbers(), mech.characteristic_length, *q);
    for &i in numbers {
        q[i] = Jet::lit(start[i]);
    }
    let mut g = residual(mech, &set.pose(mech, &values(q)));
    // One in lanes that are still under way, and in those that have arrived.
    let (mut active, mut converged) = (V::select(wanted, one, zero), zero);
    for _ in 0..NEWTON_STEPS {
        let mut rhs = g;
        for e in &mut rhs {
            *e = -*e;
        }
        let step = solve(gradient(mech, set, q, dependent), rhs).x;
        // No coordinate moves by more than half a radian or half the characteristic length at once.
        let mut largest = zero;
        for (k, &i) in numbers.iter().enumerate() {
            largest = largest.most(step[k].abs().scale(1.0 / reach(set, i, scale)));
        }
        // Else the coordinates do not determine the others; the guess may still be a solution.
        let finite = (size(&step) * zero).at_most(zero);
        let solved = V::select(size(&g).at_most(V::lit(SOLVED)), active, zero);
        converged = V::select(finite, converged, converged.most(solved));
        active = V::select(finite, active, zero);

        let (from, before) = (*q, size(&g));
        let (mut share, mut searching) = ((V::lit(0.5) / largest).least(one), active);
        for _ in 0..8 {
            let moving = searching.greater(zero);
            for (k, &i) in numbers.iter().enumerate() {
                q[i].x = V::select(moving, from[i].x + share * step[k], q[i].x);
            }
            let tried = residual(mech, &set.pose(mech, &values(q)));
            for k in 0..MAX_CONSTRAINTS {
                g[k] = V::select(moving, tried[k], g[k]);
            }
            searching = V::select(size(&g).at_most(before), zero, searching);
            if !any(searching) {
                break;
            }
            share = share.scale(0.5);
        }
        let exact = V::select(size(&g).at_most(zero), one, zero);
        let near = V::select(largest.at_most(V::lit(1e-10)), one, exact);
        let there = V::select(largest.at_most(V::lit(1e-13)), one, exact);
        let under_way = active.greater(zero);
        converged = V::select(under_way, near, converged);
        active = V::select(there.greater(zero), zero, active);
        if !any(active) {
            break;
        }
    }
    let (pivots, sign) = follow(mech, set, q, dependent);
    let (arrived, regular) = (converged.greater(zero), pivots.greater(V::lit(DEPENDENT_PIVOTS)));
    for &i in numbers {
        let Jet { x, d, dd } = q[i];
        let rates = [V::select(regular, d, nan), V::select(regular, dd, nan)];
        let found = Jet::select(arrived, Jet::new(x, rates[0], rates[1]), Jet::new(nan, nan, nan));
        q[i] = Jet::select(wanted, found, unsolved[i]);
    }
    ([(arrived, Status::NotConverged), (regular, Status::Fold)], sign)
}

/// The largest entry's size; NaN if one is.
#[inline(always)]
fn size<V: Ordered>(g: &System<V>) -> V {
    let mut size = V::zero();
    for e in g {
        size = V::select(e.at_most(*e), size.most(e.abs()), *e);
    }
    size
}

/// The numbers without their rates.
#[inline(always)]
fn values<T: Real>(q: &Values<Jet<T>>) -> Values<T> {
    let mut values = [T::zero(); MAX_COORDINATES];
    for k in 0..MAX_COORDINATES {
        values[k] = q[k].x;
    }
    values
}

/// Rates and second rates of the dependent coordinates at known values, from one matrix: `G_y y' = -ġ(y' = 0)`,
/// `G_y y'' = -g̈(y'' = 0)` \[T23\]. They must be zero before. With the pivot ratio and the sign of det G_y.
#[inline(always)]
fn follow<T: Trig, S>(
    mech: &Mechanism<S>,
    set: &Set<S>,
    q: &mut Values<Jet<T>>,
    dependent: &Dependent,
) -> (T::Value, T::Value)
where
    S: Constant<Jet<T>> + Constant<Dual<T>>,
{
    let matrix = gradient(mech, set, q, dependent);
    let mut rhs = [T::zero(); MAX_CONSTRAINTS];
    let g = residual(mech, &set.pose(mech, q));
    for k in 0..MAX_CONSTRAINTS {
        rhs[k] = -g[k].d;
    }
    let first = solve(matrix, rhs);
    for (k, &i) in dependent.numbers().iter().enumerate() {
        q[i].d = first.x[k];
    }
    let g = residual(mech, &set.pose(mech, q));
    for k in 0..MAX_CONSTRAINTS {
        rhs[k] = -g[k].dd;
    }
    let second = solve(matrix, rhs);
    for (k, &i) in dependent.numbers().iter().enumerate() {
        q[i].dd = second.x[k];
    }
    (first.pivots, first.sign)
}

/// The values of the independent constraints in pure numbers; zero beyond their number.
#[inline(always)]
fn residual<N: Real>(mech: &Mechanism<impl Constant<N>>, pose: &Pose<N>) -> System<N> {
    let mut values = [N::zero(); MAX_CONSTRAINTS];
    for k in 0..mech.independent.len() {
        let c = &mech.independent[k];
        values[k] = constraint::value(c, pose).scale(1.0 / constraint::unit(c, mech.characteristic_length));
    }
    values
}

/// Which numbers of the set to give so that the constraints determine the others best at the home pose.
#[must_use]
pub fn best_given(mech: &Mechanism, set: &Set) -> Vec<bool> {
    if let Some(given) = set.given(mech) {
        return given;
    }
    let (count, wanted) = (set.names().len(), mech.independent.len());
    let home = set.values(mech, &mech.home).map(Jet::lit);
    let mut best = (-1.0, vec![true; count]);
    for mask in (0..1_usize << count).filter(|mask| mask.count_ones() as usize == wanted) {
        let given: Vec<bool> = (0..count).map(|i| mask >> i & 1 == 0).collect();
        let dependent = Dependent::of(set, &given);
        let pivots = solve(gradient(mech, set, &home, &dependent), [0.0; MAX_CONSTRAINTS]).pivots;
        if pivots > best.0 {
            best = (pivots, given);
        }
    }
    best.1
}

/// Unit of a dependent coordinate's step: the characteristic length, or a radian.
#[inline(always)]
fn reach(set: &Set, index: usize, scale: f64) -> f64 {
    match set {
        Set::Pose if index < 3 => scale,
        _ => 1.0,
    }
}

/// ∂g/∂y by duals, unused rows and columns those of the identity.
#[inline(always)]
fn gradient<T: Trig, S: Constant<Dual<T>>>(
    mech: &Mechanism<S>,
    set: &Set<S>,
    q: &Values<Jet<T>>,
    dependent: &Dependent,
) -> [System<T>; MAX_CONSTRAINTS] {
    let mut matrix = [[T::zero(); MAX_CONSTRAINTS]; MAX_CONSTRAINTS];
    for k in 0..MAX_CONSTRAINTS {
        matrix[k][k] = T::one();
    }
    for (column, &i) in dependent.numbers().iter().enumerate() {
        let mut seeded = [Dual::lit(0.0); MAX_COORDINATES];
        for k in 0..MAX_COORDINATES {
            seeded[k].x = q[k].x;
        }
        seeded[i].d = T::one();
        let derivatives = residual(mech, &set.pose(mech, &seeded));
        for row in 0..mech.independent.len() {
            matrix[row][column] = derivatives[row].d;
        }
    }
    matrix
}
