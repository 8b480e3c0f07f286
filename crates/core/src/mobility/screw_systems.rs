//! Screw systems at a pose: principal screws of the platform's degrees of freedom, and constraint wrenches,
//! by axes and pitches \[T66\].

use nalgebra::DMatrix;

use crate::kinematics::constraint;
use crate::mobility::singularity::{Screw, screw};
use crate::model::mechanism::Mechanism;
use crate::number::order::{by_size, largest};
use crate::numerics::svd::Svd;
use crate::spatial::motion::pure_row;
use crate::spatial::{Pose, Twist, Vec3, Wrench};

/// Tolerance, in pure numbers, below which a singular value of constraints, a rotation or a difference of
/// pitches counts as zero: poses may miss their constraints by as much.
const NOTHING: f64 = 1e-6;

/// The principal screws of the twists that the constraints leave at a pose, translations first: unit
/// translations, and rotations by one radian about axes at right angles, with the slides that go with them
/// where no translation can take them away. Among screws of one pitch the axes are those nearest to the
/// base's. None where a leg has no direction.
#[must_use]
pub fn freedoms(mech: &Mechanism, pose: &Pose<f64>) -> Option<Vec<(Twist<f64>, Screw)>> {
    let scale = mech.characteristic_length;
    // Twists (v, Λω) that no constraint feels.
    let rows = mech.constraints.iter().map(|c| {
        let row = constraint::row(c, pose);
        pure_row(row * (1.0 / constraint::row_unit(&row, scale)), scale)
    });
    let rows: Vec<[f64; 6]> = rows.collect();
    let matrix = DMatrix::from_fn(rows.len().max(1), 6, |i, j| rows.get(i).map_or(0.0, |row| row[j]));
    let held = Svd::of(&matrix)?;
    let free: Vec<Twist<f64>> = (0..6)
        .filter(|&k| held.values[k] <= NOTHING)
        .map(|k| {
            let part = |i: usize| Vec3::new(held.v_t[(k, i)], held.v_t[(k, i + 1)], held.v_t[(k, i + 2)]);
            Twist::new(part(0), part(3) * (1.0 / scale))
        })
        .collect();
    if free.is_empty() {
        return Some(vec![]);
    }
    // Those that rotate, by a radian about axes at right angles, and those that do not.
    let turns = Svd::of(&DMatrix::from_fn(3, free.len(), |i, k| scale * free[k].omega.array()[i]))?;
    let (mut slides, mut screws) = (Vec::new(), Vec::new());
    for k in 0..free.len() {
        let turn = turns.values[k];
        if turn <= NOTHING {
            slides.push(Twist { omega: Vec3::zero(), ..sum(&free, |i| turns.v_t[(k, i)]) });
        } else {
            screws.push(sum(&free, |i| turns.v_t[(k, i)] * scale / turn));
        }
    }
    let mut found = nearest_to_base(&slides, |twist| twist.v);
    let mut by_pitch = diagonal(&simplest(&screws, &found)?, pitch_form);
    while let Some((pitch, _)) = by_pitch.first().copied() {
        let alike = by_pitch.iter().take_while(|(h, _)| h - pitch <= NOTHING * scale).count();
        let group: Vec<Twist<f64>> = by_pitch.drain(..alike).map(|(_, twist)| twist).collect();
        found.extend(nearest_to_base(&group, |twist| twist.omega));
    }
    Some(found.into_iter().map(|twist| (twist, screw(pose.o, &twist, scale))).collect())
}

/// ½ (ω_1·v_2 + ω_2·v_1), the pitch of a twist with itself.
fn pitch_form(a: &Twist<f64>, b: &Twist<f64>) -> f64 {
    0.5 * (a.omega.dot(b.v) + b.omega.dot(a.v))
}

/// The rotations with such translations added that as many pitches as can be are zero; what cannot stays.
fn simplest(turns: &[Twist<f64>], slides: &[Twist<f64>]) -> Option<Vec<Twist<f64>>> {
    let (n, t) = (turns.len(), slides.len());
    if n == 0 || t == 0 {
        return Some(turns.to_vec());
    }
    // Rotation i gets the share (i, s) of slide s: the least shares that leave the least of the form.
    let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i..n).map(move |j| (i, j))).collect();
    let matrix = DMatrix::from_fn(pairs.len(), n * t, |row, column| {
        let ((i, j), (of, slide)) = (pairs[row], (column / t, slides[column % t].v));
        let part = |k: usize, other: usize| if k == of { 0.5 * turns[other].omega.dot(slide) } else { 0.0 };
        part(i, j) + part(j, i)
    });
    let left = |row: usize| -pitch_form(&turns[pairs[row].0], &turns[pairs[row].1]);
    let svd = Svd::of(&matrix)?;
    let mut shares = vec![0.0; n * t];
    for k in (0..n * t).filter(|&k| svd.values[k] > NOTHING) {
        let along: f64 = (0..pairs.len()).map(|row| svd.u[(row, k)] * left(row)).sum();
        for (column, share) in shares.iter_mut().enumerate() {
            *share += svd.v_t[(k, column)] * along / svd.values[k];
        }
    }
    let moved = |i: usize| {
        let slide = sum(slides, |s| shares[i * t + s]);
        Twist::new(turns[i].v + slide.v, turns[i].omega)
    };
    Some((0..n).map(moved).collect())
}

/// The wrench of every constraint of every leg at a pose, of a unit force or else of a unit couple, with its
/// line: axis, pitch (m, infinite for a couple), point. A constraint whose row vanishes has zeros, and no
/// line.
#[must_use]
pub fn constraints(mech: &Mechanism, pose: &Pose<f64>) -> Vec<(Wrench<f64>, Screw)> {
    let scale = mech.characteristic_length;
    let of = |c| {
        let Wrench { force, torque } = constraint::row(c, pose);
        // As of a twist, with the force in place of the rotation and the torque in place of the translation.
        let line = screw(pose.o, &Twist::new(torque, force), scale);
        let couple = !line.pitch.is_finite();
        let size = if couple { torque.norm() } else { force.norm() };
        let unit = if size > 0.0 { 1.0 / size } else { 0.0 };
        (Wrench::new(if couple { Vec3::zero() } else { force * unit }, torque * unit), line)
    };
    mech.constraints.iter().map(of).collect()
}

/// Of the same span and as long, with directions at right angles that are the base's axes where they can be.
fn nearest_to_base(twists: &[Twist<f64>], direction: impl Fn(&Twist<f64>) -> Vec3<f64>) -> Vec<Twist<f64>> {
    let form = |a: &Twist<f64>, b: &Twist<f64>| {
        let (a, b) = (direction(a), direction(b));
        a.x * b.x + 2.0 * a.y * b.y + 3.0 * a.z * b.z
    };
    let upright = |(_, twist): (f64, Twist<f64>)| {
        let parts = direction(&twist).array();
        let largest = largest(parts.iter().map(|x| x.abs()));
        let first = parts.iter().find(|x| x.abs() > (1.0 - NOTHING) * largest);
        sum(&[twist], |_| if first.is_some_and(|x| *x < 0.0) { -1.0 } else { 1.0 })
    };
    diagonal(twists, form).into_iter().map(upright).collect()
}

/// Sums of twists, by a rotation among them, that make a symmetric form diagonal, its least value first.
fn diagonal(twists: &[Twist<f64>], form: impl Fn(&Twist<f64>, &Twist<f64>) -> f64) -> Vec<(f64, Twist<f64>)> {
    let n = twists.len();
    if n == 0 {
        return vec![];
    }
    let eigen = DMatrix::from_fn(n, n, |i, j| form(&twists[i], &twists[j])).symmetric_eigen();
    let mut found: Vec<(f64, Twist<f64>)> =
        (0..n).map(|k| (eigen.eigenvalues[k], sum(twists, |i| eigen.eigenvectors[(i, k)]))).collect();
    found.sort_by(|a, b| by_size(a.0, b.0));
    found
}

fn sum(twists: &[Twist<f64>], share: impl Fn(usize) -> f64) -> Twist<f64> {
    let mut total = Twist::new(Vec3::zero(), Vec3::zero());
    for (i, twist) in twists.iter().enumerate() {
        (total.v, total.omega) = (total.v + twist.v * share(i), total.omega + twist.omega * share(i));
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{mechanisms, states};
    use crate::number::order::larger;

    #[test]
    fn freedoms_are_principal_and_feel_no_constraint() {
        for mech in mechanisms() {
            let scale = mech.characteristic_length;
            for state in states(&mech, 5, 3) {
                let pose = &state.pose;
                let found = freedoms(&mech, pose).expect("every leg has a direction");
                assert_eq!(found.len(), mech.dof(), "{}", mech.name);
                let turns = found.iter().filter(|(twist, _)| twist.omega.norm() > 0.0).count();
                for (i, (a, line)) in found.iter().enumerate() {
                    for (wrench, _) in constraints(&mech, pose) {
                        let size = (wrench.force.norm() + wrench.torque.norm() / scale)
                            * (a.v.norm() + scale * a.omega.norm());
                        let power = wrench.force.dot(a.v) + wrench.torque.dot(a.omega);
                        assert!(power.abs() <= 1e-9 * size, "{}: {power}", mech.name);
                    }
                    // Translations come first; a rotation is that of its screw.
                    let slides = i < found.len() - turns;
                    assert_eq!(slides, line.pitch.is_infinite());
                    let along = if slides { a.v } else { a.omega };
                    assert!((along - line.axis).norm() <= 1e-9);
                    if !slides {
                        let at_o = line.axis * line.pitch + line.axis.cross(pose.o - line.point);
                        assert!((at_o - a.v).norm() <= 1e-9 * (1.0 + a.v.norm()));
                    }
                    for (b, other) in &found[..i] {
                        assert!(!slides || other.pitch.is_infinite());
                        if slides == other.pitch.is_infinite() {
                            assert!(line.axis.dot(other.axis).abs() <= 1e-8);
                        }
                        if !slides && !other.pitch.is_infinite() {
                            let form = a.omega.dot(b.v) + b.omega.dot(a.v);
                            assert!(form.abs() <= 1e-7 * larger(scale, a.v.norm() + b.v.norm()), "{form}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn axes_are_those_of_the_base_where_they_can_be() {
        let turn = |x: f64, y: f64, z: f64| Twist::new(Vec3::zero(), Vec3::new(x, y, z));
        let (c, s) = (0.6, 0.8);
        let found = nearest_to_base(&[turn(-c, s, 0.0), turn(s, c, 0.0)], |twist| twist.omega);
        for (twist, axis) in found.iter().zip([Vec3::X, Vec3::Y]) {
            assert!((twist.omega - axis).norm() <= 1e-14);
        }
    }

    /// A translation along x makes every parallel of a rotation about y a degree of freedom: a screw about it
    /// becomes a rotation, and axes that cross it are brought through one point.
    #[test]
    fn translations_take_away_the_slides_that_they_can() {
        let screw_of = |axis: Vec3<f64>, point: Vec3<f64>, pitch: f64| {
            Twist::new(axis * pitch + point.cross(axis), axis)
        };
        let slides = [Twist::new(Vec3::Y, Vec3::zero()), Twist::new(Vec3::Z, Vec3::zero())];
        let ball = Vec3::new(0.0, 0.0, 0.5);
        let turns = [
            screw_of(Vec3::X, Vec3::zero(), 0.0),
            screw_of(Vec3::Y, ball, 0.3),
            screw_of(Vec3::Z, Vec3::zero(), -0.2),
        ];
        for turn in simplest(&turns, &slides).expect("finite") {
            let line = screw(Vec3::zero(), &turn, 1.0);
            assert!(line.pitch.abs() <= 1e-14, "{}", line.pitch);
            assert!(line.axis.cross(ball - line.point).norm() <= 1e-14);
        }
        // No translation along the axis: the pitch stays.
        let kept = simplest(&[screw_of(Vec3::X, ball, 0.3)], &slides).expect("finite");
        assert!((screw(Vec3::zero(), &kept[0], 1.0).pitch - 0.3).abs() <= 1e-14);
    }

    /// Two rotations about crossed axes: a cylindroid, its principal screws midway between them (Ball, A
    /// Treatise on the Theory of Screws, 1900, section 14).
    #[test]
    fn two_crossed_axes_make_a_cylindroid() {
        let (half, apart) = (0.3_f64, 0.2);
        let turn = |side: f64| {
            let axis = Vec3::new(half.cos(), side * half.sin(), 0.0);
            let point = Vec3::new(0.0, 0.0, side * apart);
            Twist::new(point.cross(axis), axis)
        };
        let (a, b) = (turn(1.0), turn(-1.0));
        // By a radian about axes at right angles.
        let pair = [sum(&[a, b], |_| 0.5 / half.cos()), sum(&[a, b], |i| (0.5 - i as f64) / half.sin())];
        let found = diagonal(&pair, pitch_form);
        let pitches = [-apart * half.tan(), apart / half.tan()];
        for ((pitch, twist), expected) in found.iter().zip(pitches) {
            assert!((pitch - expected).abs() <= 1e-14, "{pitch} {expected}");
            let line = screw(Vec3::zero(), twist, 1.0);
            assert!((line.pitch - expected).abs() <= 1e-14 && line.point.norm() <= 1e-14);
        }
    }
}
