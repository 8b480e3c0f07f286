//! Local degrees of freedom of the platform (idle ones): rotations about a line fixed in it, or in the base,
//! to which no leg is sensitive at any pose, such as the spin of a rod on which all legs end \[T70\]. Found
//! from ranks, like all degrees of freedom.

use nalgebra::DMatrix;

use crate::kinematics::constraint;
use crate::kinematics::leg;
use crate::model::mechanism::{Constraint, Idle, Leg, Mechanism};
use crate::model::spec::Axes;
use crate::number::order::by_size;
use crate::number::real::{Constant, Real, Scalar};
use crate::numerics::svd::Svd;
use crate::spatial::motion::pure_row;
use crate::spatial::{Pose, Twist, Vec3, Wrench};

/// Singular values, as pure numbers, below which rows do not hold a twist.
const RANK: f64 = 1e-9;

/// How far, as pure numbers, a line may move from pose to pose and a point lie off it: rounding of ranks.
const FIXED: f64 = 1e-7;

/// u in base axes.
#[inline(always)]
pub fn axis<T: Real>(idle: &Idle<impl Constant<T>>, pose: &Pose<T>) -> Vec3<T> {
    match idle.side {
        Axes::Base => Vec3::lift(idle.axis),
        Axes::Platform => pose.rotation.of(idle.axis),
    }
}

/// The row (0, u) of the Jacobian: the rate is the spin ω·u, the multiplier a torque along u. The rate of u
/// does not change the spin, so that its layer of the Hessian is zero.
#[inline(always)]
pub fn row<T: Real>(idle: &Idle<impl Constant<T>>, pose: &Pose<T>) -> Wrench<T> {
    Wrench::new(Vec3::zero(), axis(idle, pose))
}

/// The rotation by one radian about the line, as a twist of o.
pub fn twist(idle: &Idle, pose: &Pose<f64>) -> Twist<f64> {
    let u = axis(idle, pose);
    let arm = match idle.side {
        Axes::Base => pose.o - idle.point,
        Axes::Platform => -(pose.rotation * idle.point),
    };
    Twist::new(u.cross(arm), u)
}

/// The line as it follows joints that vary.
pub(crate) fn varied<S: Scalar>(idle: &Idle, legs: &[Leg<S>]) -> Idle<S> {
    let lift = |a: Vec3<f64>| a.map(S::lit);
    let Idle { side, point, axis, through } = *idle;
    let Some([first, last]) = through else {
        return Idle { side, point: lift(point), axis: lift(axis), through };
    };
    let at = |leg: usize| end(&legs[leg], side);
    let along = (at(last) - at(first)).unit();
    let along = if along.map(Real::value).dot(axis) < 0.0 { -along } else { along };
    Idle { side, point: at(first), axis: along, through }
}

fn end<S: Scalar>(leg: &Leg<S>, side: Axes) -> Vec3<S> {
    match side {
        Axes::Base => leg.base.point,
        Axes::Platform => leg.platform.point,
    }
}

/// The local degrees of freedom of a mechanism with these independent constraints: those twists that no leg
/// and no constraint feels at any of the poses, as far as they are rotations about lines fixed in the
/// platform, then in the base.
pub(crate) fn find(mech: &Mechanism, independent: &[Constraint], poses: &[Pose<f64>]) -> Vec<Idle> {
    let free: Vec<(Pose<f64>, Vec<Twist<f64>>)> =
        poses.iter().map(|pose| (*pose, unfelt(mech, independent, pose))).collect();
    let least = free.iter().map(|(_, twists)| twists.len()).min().unwrap_or(0);
    let generic: Vec<_> = free.into_iter().filter(|(_, twists)| twists.len() == least).collect();
    // A line may be at rest in both bodies, and then counts as one of that body whose joints lie on it.
    let mut lines: Vec<Idle> =
        [Axes::Platform, Axes::Base].into_iter().flat_map(|side| fixed(mech, side, &generic)).collect();
    lines.sort_by_key(|idle| idle.through.is_none());
    let mut found: Vec<Idle> = Vec::new();
    for idle in lines {
        if found.len() < least && is_new(mech, &found, &idle, &generic[0].0) {
            found.push(idle);
        }
    }
    found
}

/// Twists, orthonormal as (v, Λω), that no leg and no constraint feels.
fn unfelt(mech: &Mechanism, independent: &[Constraint], pose: &Pose<f64>) -> Vec<Twist<f64>> {
    let scale = mech.characteristic_length;
    let legs = mech.legs.iter().map(|leg| leg::row(leg, &leg::position(leg, pose)));
    let rows: Vec<[f64; 6]> = legs
        .chain(independent.iter().map(|c| constraint::row(c, pose)))
        .map(|row| pure_row(row * (1.0 / constraint::row_unit(&row, scale)), scale))
        .collect();
    let Some(svd) = Svd::of(&DMatrix::from_fn(rows.len(), 6, |i, j| rows[i][j])) else { return vec![] };
    let floor = RANK * svd.values[0];
    (0..6)
        .filter(|&k| svd.values[k] <= floor)
        .map(|k| twist_of(scale, &std::array::from_fn(|i| svd.v_t[(k, i)])))
        .collect()
}

fn twist_of(scale: f64, x: &[f64; 6]) -> Twist<f64> {
    let [a, b, c, p, q, r] = *x;
    Twist::new(Vec3::new(a, b, c), Vec3::new(p, q, r) * (1.0 / scale))
}

/// The rotations about lines of a body that are among the twists at every pose.
fn fixed(mech: &Mechanism, side: Axes, free: &[(Pose<f64>, Vec<Twist<f64>>)]) -> Vec<Idle> {
    let scale = mech.characteristic_length;
    let nothing = free.is_empty() || free[0].1.is_empty();
    if nothing {
        return vec![];
    }
    // What all have in common is what no complement of any has a share in.
    let mut off = DMatrix::zeros(6 * free.len(), 6);
    for (i, (pose, twists)) in free.iter().enumerate() {
        let seen = twists.iter().map(|twist| seen_from(mech, side, pose, twist));
        let basis: Vec<[f64; 6]> = seen.map(|t| Twist::new(t.v * (1.0 / scale), t.omega).array()).collect();
        let matrix = DMatrix::from_fn(basis.len(), 6, |r, c| basis[r][c]);
        // Orthonormal again: points of reference may differ.
        let Some(svd) = Svd::of(&matrix) else { return vec![] };
        for (k, row) in svd.v_t.row_iter().enumerate().skip(twists.len()) {
            off.row_mut(6 * i + k).copy_from(&row);
        }
    }
    let Some(common) = Svd::of(&off) else { return vec![] };
    let twists: Vec<Twist<f64>> = (0..6)
        .filter(|&k| common.values[k] <= FIXED)
        .map(|k| {
            let [a, b, c, p, q, r] = std::array::from_fn(|i| common.v_t[(k, i)]);
            Twist::new(Vec3::new(a, b, c), Vec3::new(p, q, r))
        })
        .collect();
    turns(&twists).iter().map(|turn| line(mech, side, turn)).collect()
}

/// A twist of o in the axes of a body, at the body's point: o itself, or where o is at home.
fn seen_from(mech: &Mechanism, side: Axes, pose: &Pose<f64>, twist: &Twist<f64>) -> Twist<f64> {
    match side {
        Axes::Platform => {
            let seen = |a| pose.rotation.transpose_mul(a);
            Twist::new(seen(twist.v), seen(twist.omega))
        }
        Axes::Base => Twist::new(twist.v + twist.omega.cross(mech.home.o - pose.o), twist.omega),
    }
}

/// A basis of the twists (in pure numbers) with unit angular velocities at right angles, if all of them are
/// rotations: without pitch, and none a translation.
fn turns(twists: &[Twist<f64>]) -> Vec<Twist<f64>> {
    let pitch = |a: &Twist<f64>, b: &Twist<f64>| a.omega.dot(b.v) + b.omega.dot(a.v);
    if twists.iter().any(|a| twists.iter().any(|b| pitch(a, b).abs() > FIXED)) {
        return vec![];
    }
    let matrix = DMatrix::from_fn(3, twists.len(), |i, k| twists[k].omega.array()[i]);
    let Some(svd) = Svd::of(&matrix).filter(|svd| svd.values.iter().all(|&s| s > FIXED)) else {
        return vec![];
    };
    (0..twists.len())
        .map(|k| {
            let sum = |part: fn(&Twist<f64>) -> Vec3<f64>| {
                let parts = twists.iter().enumerate().map(|(j, t)| part(t) * svd.v_t[(k, j)]);
                parts.fold(Vec3::zero(), |a, b| a + b) * (1.0 / svd.values[k])
            };
            Twist::new(sum(|t| t.v), sum(|t| t.omega))
        })
        .collect()
}

/// The line of a rotation (pure numbers), through the joints on it where all lie there.
fn line(mech: &Mechanism, side: Axes, turn: &Twist<f64>) -> Idle {
    let scale = mech.characteristic_length;
    let largest = turn.omega.array().iter().fold(0.0_f64, |m, x| if x.abs() > m.abs() { *x } else { m });
    let axis = turn.omega * largest.signum();
    let from = if side == Axes::Base { mech.home.o } else { Vec3::zero() };
    let point = from + turn.omega.cross(turn.v) * scale;
    let idle = Idle { side, point, axis, through: None };
    let along = |leg: &Leg| (end(leg, side) - point).dot(axis);
    let on_it = |leg: &Leg| (end(leg, side) - point - axis * along(leg)).norm() <= FIXED * scale;
    if !mech.legs.iter().all(on_it) {
        return idle;
    }
    let order = |a: &usize, b: &usize| by_size(along(&mech.legs[*a]), along(&mech.legs[*b]));
    let ends = (0..mech.legs.len()).min_by(order).zip((0..mech.legs.len()).max_by(order));
    let apart = |[a, b]: &[usize; 2]| along(&mech.legs[*b]) - along(&mech.legs[*a]) > FIXED * scale;
    let through = ends.map(|(first, last)| [first, last]).filter(apart);
    varied(&Idle { through, ..idle }, &mech.legs)
}

/// Whether a rotation is no sum of those found, at a pose, and has a row (0, u) of its own beside theirs:
/// there are three at most.
fn is_new(mech: &Mechanism, found: &[Idle], idle: &Idle, pose: &Pose<f64>) -> bool {
    let all = || found.iter().chain([idle]);
    let twists = all().map(|idle| {
        let Twist { v, omega } = twist(idle, pose);
        Twist::new(v * (1.0 / mech.characteristic_length), omega).array()
    });
    let independent = |rows: Vec<[f64; 6]>| {
        let svd = Svd::of(&DMatrix::from_fn(6, rows.len(), |i, j| rows[j][i]));
        svd.is_some_and(|svd| svd.rank(FIXED) == rows.len())
    };
    independent(twists.collect()) && independent(all().map(|idle| row(idle, pose).array()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{mechanisms, pentapod, states};

    #[test]
    fn the_line_of_the_joints_is_found_and_no_leg_feels_it() {
        for (body, side) in [("platform", Axes::Platform), ("base", Axes::Base)] {
            for seed in 1..6 {
                let mech = pentapod(5, body, seed);
                let [idle] = &mech.idle[..] else { panic!("{} local degrees of freedom", mech.idle.len()) };
                assert_eq!((idle.side, mech.mobility.uncontrolled, mech.rows()), (side, 0, 6));
                for leg in &mech.legs {
                    assert!(idle.axis.cross(end(leg, side) - idle.point).norm() < 1e-12);
                }
                for state in states(&mech, 4, 2) {
                    let spin = twist(idle, &state.pose);
                    for leg in &mech.legs {
                        let rate = leg::row(leg, &leg::position(leg, &state.pose)).power(&spin);
                        assert!(rate.abs() < 1e-14, "{rate}");
                    }
                    assert!((row(idle, &state.pose).power(&spin) - 1.0).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn generic_mechanisms_have_none() {
        for mech in mechanisms() {
            assert!(mech.idle.is_empty(), "{}", mech.name);
        }
    }

    #[test]
    fn screws_and_translations_are_none() {
        let turn = |v: Vec3<f64>, omega: Vec3<f64>| Twist::new(v, omega);
        assert_eq!(turns(&[turn(Vec3::X, Vec3::Z)]).len(), 1);
        assert!(turns(&[turn(Vec3::Z * 0.1, Vec3::Z)]).is_empty(), "a pitch");
        assert!(turns(&[turn(Vec3::X, Vec3::zero())]).is_empty(), "a translation");
        assert!(
            turns(&[turn(Vec3::X, Vec3::Z), turn(Vec3::zero(), Vec3::X)]).is_empty(),
            "lines that do not meet"
        );
        assert_eq!(turns(&[turn(Vec3::X, Vec3::Z), turn(Vec3::zero(), Vec3::Y)]).len(), 2);
    }
}
