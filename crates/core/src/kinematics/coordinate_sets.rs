//! Coordinate sets: from coordinates to the pose, and from their rates to twist and acceleration.
//!
//! Each set is one map from numbers to a pose, written once for any [`Trig`] number. Evaluated with [`Jet`]s
//! it gives twist and acceleration exactly. This is the one place with trigonometry.

use crate::model::mechanism::{Constraint, ConstraintKind, Mechanism};
use crate::number::real::count;
use crate::number::real::{Constant, Dual, Jet, Ordered, Real, Scalar, Trig};
use crate::number::slices;
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

    /// The frames while the joints that share the constraint vary one by one: the middles then stay on the
    /// lines of the independent one \[T56\].
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
    /// The signed distance of the reference point from the line through o along l, and its angle about that
    /// line, within a quarter turn of y: for the paper (e sin θ_1, 0).
    pub(super) fn lever(&self) -> (f64, f64) {
        let m = self.platform.transpose_mul(self.platform_point);
        let sign = if m.y < 0.0 { -1.0 } else { 1.0 };
        (sign * m.y.hypot(m.z), (sign * m.z).atan2(sign * m.y))
    }

    /// cos of γ plus the lever's angle, by [Eq. 5]: the reference point stays in the plane of L and l, whose
    /// normal is Rx(α) e_y.
    #[inline(always)]
    pub(super) fn cosine<T: Trig>(&self, o: Vec3<T>, alpha: T) -> T {
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

/// The numbers of the set with their rates along a motion: the inverse of
/// [`state`](crate::kinematics::dependent_coordinates::state).
#[must_use]
#[inline(always)]
pub fn along<V: Ordered>(mech: &Mechanism, set: &Set, platform: &Motion<V>) -> Values<Jet<V>> {
    set.values(mech, &platform.jets())
}

/// `½ Σ x_i × x_i'` over the columns of R is ω, `½ Σ x_i × x_i''` is ε \[T19\].
#[inline(always)]
fn half_cross<T: Real>([x, y, z]: [Vec3<T>; 3], [dx, dy, dz]: [Vec3<T>; 3]) -> Vec3<T> {
    (x.cross(dx) + y.cross(dy) + z.cross(dz)).scale(0.5)
}
