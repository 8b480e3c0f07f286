//! The scalar constraints that legs put on the platform: five kinds, each with its value, its wrench (the row
//! of the Jacobian) and its Hessian \[T9\] \[T10\] \[T11\] \[T12\].

use crate::kinematics::leg;
use crate::kinematics::quadratic_forms::{Hessian, add_centripetal, add_mixed, point_columns};
use crate::model::joint::Normal;
use crate::model::mechanism::{Constraint, ConstraintKind, Leg, Mechanism, Partner};
use crate::model::spec::{ANGLE_TOLERANCE, LENGTH_TOLERANCE};
use crate::number::order::larger;
use crate::number::real::{Constant, Ordered, Real, Scalar, Trig};
use crate::spatial::{Mat3, Pose, Vec3, Wrench};

/// The constraints of one leg, from what its two joints say about its direction δ and its normal n.
#[must_use]
pub fn of_leg<S: Scalar>(index: usize, leg: &Leg<S>) -> Vec<Constraint<S>> {
    let none = Vec3::zero();
    let make = |kind, base_axis, platform_axis| Constraint {
        kind,
        leg: index,
        base_point: leg.base.point,
        platform_point: leg.platform.point,
        base_axis,
        platform_axis,
        partner: Partner { base_point: none, platform_point: none, turn: Mat3::identity() },
    };
    // A fixed joint holds δ as well: the leg is perpendicular to two axes of the body.
    let (below, above) = (leg.base.square_to_leg(), leg.platform.square_to_leg());
    let b = below.iter().map(|&a| make(ConstraintKind::B, a, none));
    let c = above.iter().map(|&a| make(ConstraintKind::C, none, a));
    let d = |base_axis, platform_axis| make(ConstraintKind::D, base_axis, platform_axis);
    match (leg.base.normal(), leg.platform.normal()) {
        (None, _) | (_, None) => b.chain(c).collect(),
        (Some(Normal::Across(u)), Some(Normal::Across(w))) => vec![make(ConstraintKind::A, u, w)],
        (Some(Normal::Along(a)), Some(Normal::Across(w))) => b.chain([d(a, w)]).collect(),
        (Some(Normal::Across(u)), Some(Normal::Along(a))) => c.chain([d(u, a)]).collect(),
        (Some(Normal::Along(n)), Some(Normal::Along(m))) => {
            // n and m are one line: n is perpendicular to the two directions that are perpendicular to m.
            // With δ held on both sides one more relation keeps the platform from rotating about n.
            let two = |axis: Vec3<S>, direction: Option<Vec3<S>>| {
                let first = direction.unwrap_or_else(|| axis.perpendicular());
                [first, axis.cross(first)]
            };
            match (leg.base.direction(), leg.platform.direction()) {
                (None, None) => b.chain(two(m, None).map(|w| d(n, w))).collect(),
                (Some(delta), None) => b.chain(two(n, Some(delta)).map(|w| d(w, m))).collect(),
                (None, Some(delta)) => c.chain(two(m, Some(delta)).map(|w| d(n, w))).collect(),
                (Some(below), Some(above)) => {
                    let [_, side] = two(m, Some(above));
                    b.chain([d(n, above), d(n, side), d(below, side)]).collect()
                }
            }
        }
    }
}

/// The constraints of a rod that carries several legs: its revolute axes are fixed in it, so that the legs'
/// planes through its line keep the angle that they have at home. L is divided by a length to make g one.
/// Angle and length are the rod's own: they do not vary with points and axes.
#[must_use]
pub fn of_rod<S: Trig + Constant<S>>(
    mech_legs: &[Leg<S>],
    rod: usize,
    axis: Vec3<S>,
    home: &Pose<f64>,
) -> Vec<Constraint<S>> {
    let on: Vec<usize> = (0..mech_legs.len()).filter(|&i| mech_legs[i].rod == Some(rod)).collect();
    let Some((&leader, others)) = on.split_first() else { return vec![] };
    let fixed_axis = axis.map(Real::value);
    let across = |i: usize| {
        let (_, r) = leg::vectors(&mech_legs[i], &Pose::lift(home));
        fixed_axis.cross(r.map(Real::value))
    };
    let first = across(leader);
    let make = |&i: &usize| {
        let second = across(i);
        let angle = first.cross(second).dot(fixed_axis).atan2(first.dot(second));
        // Parallel up to the rounding of a file's numbers is parallel.
        let angle = if angle.abs() <= ANGLE_TOLERANCE { 0.0 } else { angle };
        Constraint {
            kind: ConstraintKind::E,
            leg: i,
            base_point: mech_legs[i].base.point,
            platform_point: mech_legs[i].platform.point,
            base_axis: axis.scale(1.0 / first.norm()),
            platform_axis: Vec3::zero(),
            partner: Partner {
                base_point: mech_legs[leader].base.point,
                platform_point: mech_legs[leader].platform.point,
                turn: Mat3::from_rotation_vector(axis.scale(angle)),
            },
        }
    };
    // Through one point all their planes are the same, whatever the pose.
    let point = |i: usize| mech_legs[i].platform.point.map(Real::value);
    let apart = |i: &&usize| {
        let (a, b) = (point(leader), point(**i));
        (a - b).norm() > LENGTH_TOLERANCE * larger(a.norm(), b.norm())
    };
    others.iter().filter(apart).map(make).collect()
}

/// Vectors of a constraint at a pose, base axes.
struct Vectors<T> {
    e: Vec3<T>,
    r: Vec3<T>,
    /// L or a_B.
    base: Vec3<T>,
    /// l or a_P.
    platform: Vec3<T>,
    /// Of the partner: e_1 and Q r_1.
    e1: Vec3<T>,
    r1: Vec3<T>,
}

#[inline(always)]
fn vectors<T: Real>(c: &Constraint<impl Constant<T>>, pose: &Pose<T>) -> Vectors<T> {
    let e = pose.rotation.of(c.platform_point);
    let e1 = pose.rotation.of(c.partner.platform_point);
    Vectors {
        e,
        r: pose.o + e - Vec3::lift(c.base_point),
        base: Vec3::lift(c.base_axis),
        platform: pose.rotation.of(c.platform_axis),
        e1,
        r1: Mat3::lift(c.partner.turn) * (pose.o + e1 - Vec3::lift(c.partner.base_point)),
    }
}

/// The gradients of kind E with respect to b_1 and b: `Qᵀ (r × L)` and `L × Q r_1`.
#[inline(always)]
fn rod_forces<T: Real>(c: &Constraint<impl Constant<T>>, v: &Vectors<T>) -> (Vec3<T>, Vec3<T>) {
    (Mat3::lift(c.partner.turn).transpose_mul(v.r.cross(v.base)), v.base.cross(v.r1))
}

/// g(pose): metres for kinds A, B, C and E, a cosine for D \[T9\].
#[inline(always)]
pub fn value<T: Real>(c: &Constraint<impl Constant<T>>, pose: &Pose<T>) -> T {
    let Vectors { r, base, platform, r1, .. } = vectors(c, pose);
    match c.kind {
        ConstraintKind::A => platform.cross(r).dot(base),
        ConstraintKind::B => r.dot(base),
        ConstraintKind::C => r.dot(platform),
        ConstraintKind::D => base.dot(platform),
        ConstraintKind::E => r1.cross(r).dot(base),
    }
}

/// The wrench (c, τ) at o with `ġ = c·v + τ·ω` \[T10\]; for kind A it is \[Eq. 11\].
#[inline(always)]
pub fn row<T: Real>(constraint: &Constraint<impl Constant<T>>, pose: &Pose<T>) -> Wrench<T> {
    let v = vectors(constraint, pose);
    let Vectors { e, r, base, platform, .. } = v;
    match constraint.kind {
        ConstraintKind::A => {
            // [Eq. 11] c = L × l, τ = e × c - l × (L × r)
            let c = base.cross(platform);
            Wrench::new(c, e.cross(c) - platform.cross(base.cross(r)))
        }
        ConstraintKind::B => Wrench::at(e, base),
        ConstraintKind::C => Wrench::new(platform, e.cross(platform) + platform.cross(r)),
        ConstraintKind::D => Wrench::new(Vec3::zero(), platform.cross(base)),
        ConstraintKind::E => {
            let (first, second) = rod_forces(constraint, &v);
            Wrench::at(v.e1, first) + Wrench::at(e, second)
        }
    }
}

/// The symmetric 6×6 matrix h with `g̈ = (c, τ)·A + Vᵀ h V` \[T12\]; for kind A the symmetric part of
/// \[Eq. 17\].
#[inline(always)]
pub fn hessian<T: Real>(constraint: &Constraint<impl Constant<T>>, pose: &Pose<T>) -> Hessian<T> {
    let v = vectors(constraint, pose);
    let Vectors { e, r, base, platform, .. } = v;
    let mut h = [[T::zero(); 6]; 6];
    match constraint.kind {
        ConstraintKind::A => {
            // g̈ = [l''×r + 2 l'×v_b + l×a_b]·L with l' = ω × l
            add_centripetal(&mut h, e, base.cross(platform));
            add_centripetal(&mut h, platform, r.cross(base));
            let [x, y, z] = Mat3::identity().0;
            let [x, y, z] = [x.cross(platform), y.cross(platform), z.cross(platform)];
            add_mixed(&mut h, e, [base.cross(x), base.cross(y), base.cross(z)]);
        }
        ConstraintKind::B => add_centripetal(&mut h, e, base),
        ConstraintKind::C => {
            // g̈ = a_b·a_P + 2 v_b·a_P' + r·a_P''
            add_centripetal(&mut h, e, platform);
            add_centripetal(&mut h, platform, r);
            let [x, y, z] = Mat3::identity().0;
            add_mixed(&mut h, e, [x.cross(platform), y.cross(platform), z.cross(platform)]);
        }
        ConstraintKind::D => add_centripetal(&mut h, platform, base),
        ConstraintKind::E => {
            // g̈ = [Q a_1×r + Q r_1×a_b + 2 Q v_1×v_b]·L
            let (first, second) = rod_forces(constraint, &v);
            add_centripetal(&mut h, v.e1, first);
            add_centripetal(&mut h, e, second);
            let turn = Mat3::lift(constraint.partner.turn);
            let (at_first, at_second) = (point_columns(v.e1), point_columns(e));
            for i in 0..6 {
                for j in 0..6 {
                    let q = (turn * at_first[i]).cross(at_second[j]).dot(base);
                    h[i][j] = h[i][j] + q;
                    h[j][i] = h[j][i] + q;
                }
            }
        }
    }
    h
}

/// Divisor of a constraint's value that makes it a pure number: the scale, or 1 for kind D.
#[must_use]
#[inline(always)]
pub fn unit<S>(c: &Constraint<S>, scale: f64) -> f64 {
    if c.kind == ConstraintKind::D { 1.0 } else { scale }
}

/// Factor of a constraint's value that makes it a length: 1, or the scale for kind D.
#[must_use]
pub fn length<S>(c: &Constraint<S>, scale: f64) -> f64 {
    if c.kind == ConstraintKind::D { scale } else { 1.0 }
}

/// Size of a row with its torque part divided by the length `scale`.
#[must_use]
pub fn row_size(row: &Wrench<f64>, scale: f64) -> f64 {
    square(row, scale).sqrt()
}

/// The square of a row's size.
#[inline(always)]
pub(crate) fn square<T: Real>(row: &Wrench<T>, scale: f64) -> T {
    row.force.dot(row.force) + row.torque.dot(row.torque).scale(1.0 / (scale * scale))
}

/// Rows smaller than this vanish: they give no direction and no distance.
pub(crate) const VANISHING_ROW: f64 = 1e-6;

/// Divisor that normalises a row; a row that vanishes stays as small as it is.
#[must_use]
pub fn row_unit(row: &Wrench<f64>, scale: f64) -> f64 {
    larger(row_size(row, scale), VANISHING_ROW)
}

/// How far the platform must move to satisfy the constraint, to first order, rotations counted as arcs at
/// `scale`, m.
#[inline(always)]
#[must_use]
pub fn distance<V: Ordered>(c: &Constraint, pose: &Pose<V>, scale: f64) -> V {
    let size = square(&row(c, pose), scale).sqrt();
    value(c, pose).abs() / V::lit(VANISHING_ROW).most(size)
}

/// The largest distance by which a pose misses an independent constraint, m.
#[must_use]
pub fn largest_distance(mech: &Mechanism, pose: &Pose<f64>) -> f64 {
    let distances = mech.independent.iter().map(|c| distance(c, pose, mech.characteristic_length));
    distances.fold(0.0, |m, d| if d > m || d.is_nan() { d } else { m })
}
