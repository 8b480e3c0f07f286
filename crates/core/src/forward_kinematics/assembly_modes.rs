//! All assembly modes: every real pose with given leg lengths \[T28\], \[T29\], \[T75\].
//!
//! The equations of [`forward`](crate::forward_kinematics::newton) are polynomials, so that over the complex
//! numbers they have the same number of solutions for almost all lengths. All of them are found once for
//! generic complex lengths; from there they are followed along a path of lengths to the given ones, and the
//! real ones kept.

use crate::forward_kinematics::gauss_newton;
use crate::forward_kinematics::homotopy::{HomotopyPath, Lengths, PathEnd};
use crate::forward_kinematics::newton::{self, FoundPose, LegTarget, system};
use crate::forward_kinematics::path_point::{C, modulus};
use crate::forward_kinematics::start_system::Products;
use crate::kinematics::leg;
use crate::mobility::sufficient_actuators::sufficient_actuators;
use crate::model::mechanism::Idle;
use crate::model::mechanism::{Leg, Mechanism};
use crate::model::spec::Axes;
use crate::model::status::Status;
use crate::number::order::{by_size, larger, largest, smaller};
use crate::number::real::Real;
use crate::number::real::count;
use crate::numerics::random::Random;
use crate::spatial::{Mat3, Pose, Vec3};

/// Error of a predicted step that a path is followed with, as a pure number; the later ones where paths came
/// too close to each other.
const PRECISIONS: [f64; 3] = [3e-2, 1e-4, 1e-6];

/// Precision of the search for the generic solutions, which is made once.
const CLOSE: f64 = 1e-4;

/// Distance, as a pure number, below which two regular solutions are one.
const SAME: f64 = 1e-7;

/// Distance, as a pure number, below which two solutions that meet are one: they are known to the square root
/// of rounding.
const MEETING: f64 = 1e-5;

/// Imaginary part, as a pure number, of a regular solution that is rounding of zero.
const IMAGINARY: f64 = 1e-8;

/// Imaginary part, as a pure number, of solutions that meet; their residual decides whether they are real.
const IMAGINARY_MEETING: f64 = 1e-3;

/// Residual of a real pose, relative to the longest leg, that is rounding of zero.
const EXACT: f64 = 1e-12;

/// Numbers of real poses, as pure numbers, that are the same up to rounding.
const EQUAL: f64 = 1e-9;

/// How far, relative to those at home, the generic squared lengths are from real ones. Nearly singular poses
/// of real mechanisms belong to solutions that run far away as the lengths change: from nearby they stay
/// within reach.
const GENERIC: f64 = 0.1;

/// Searches in a row that must find nothing new before the solutions count as complete.
const CONFIRMATIONS: usize = 2;

/// Searches after which the solutions are given up.
const MOST_ROUNDS: usize = 20;

/// All solutions for generic complex lengths: where every search starts.
#[derive(Clone, Debug)]
pub struct Start {
    asked: [LegTarget<C>; 6],
    poses: Vec<Pose<C>>,
    /// Marks of the poses that are their own mirror images: those of a platform in the base plane.
    own_images: Vec<bool>,
    mirror: Option<Mirror>,
    /// With as many of its legs actuated as it takes, where there are more.
    square: Option<Box<Mechanism>>,
}

impl Start {
    /// Number of complex solutions of the equations for generic lengths.
    #[must_use]
    pub fn solutions(&self) -> usize {
        let images =
            if self.mirror.is_some() { self.own_images.iter().filter(|own| !**own).count() } else { 0 };
        self.poses.len() + images
    }

    /// Adds a solution for the generic lengths, if it is a new one.
    fn extend(&mut self, mech: &Mechanism, pose: Pose<C>) {
        if self.poses.is_empty() {
            // The reflection is one only if it maps solutions to solutions: the planes of rods must agree
            // with it too.
            self.mirror = self.mirror.filter(|m| {
                let residual = system(mech, &m.apply(&pose), &self.asked).residual;
                residual.iter().all(|f| f.norm() < SAME)
            });
        }
        let mirrored = self.mirror.map(|m| m.apply(&pose));
        let same = |known: &Pose<C>| {
            distance(mech, known, &pose) < SAME || mirrored.is_some_and(|m| distance(mech, known, &m) < SAME)
        };
        if !self.poses.iter().any(same) {
            self.poses.push(pose);
            self.own_images.push(mirrored.is_some_and(|m| distance(mech, &pose, &m) < SAME));
        }
    }

    /// Whether solutions come in pairs that a reflection in the base plane exchanges.
    #[must_use]
    pub fn symmetric(&self) -> bool {
        self.mirror.is_some()
    }
}

/// The reflection of a mechanism whose base joints lie in one plane and whose platform joints lie in another:
/// it maps a pose above the base to one below it with the same leg lengths.
#[derive(Clone, Copy, Debug)]
struct Mirror {
    base_normal: Vec3<f64>,
    base_point: Vec3<f64>,
    platform_normal: Vec3<f64>,
    platform_point: Vec3<f64>,
}

impl Mirror {
    fn of(mech: &Mechanism) -> Option<Self> {
        let base: Vec<Vec3<f64>> = mech.legs.iter().map(|leg| leg.base.point).collect();
        let platform: Vec<Vec3<f64>> = mech.legs.iter().map(|leg| leg.platform.point).collect();
        let (base_point, base_normal) = plane(&base)?;
        let (platform_point, platform_normal) = plane(&platform)?;
        // Axes must be their own images, up to their sign.
        let kept =
            |a: Vec3<f64>, n: Vec3<f64>| smaller(a.dot(n).abs(), a.cross(n).norm()) <= 1e-12 * a.norm();
        mech.constraints
            .iter()
            .all(|c| kept(c.base_axis, base_normal) && kept(c.platform_axis, platform_normal))
            .then_some(Mirror { base_normal, base_point, platform_normal, platform_point })
    }

    /// `R' = S_B R S_P`, and the platform's plane point moves as its reflection.
    fn apply<T: Real>(&self, pose: &Pose<T>) -> Pose<T> {
        let two = T::lit(2.0);
        let reflect = |a: Vec3<T>, n: Vec3<T>| a - n * (two * a.dot(n));
        let (base, platform) = (Vec3::lift(self.base_normal), Vec3::lift(self.platform_normal));
        let rotation = Mat3(
            [Vec3::X, Vec3::Y, Vec3::Z]
                .map(|e: Vec3<f64>| reflect(pose.rotation * reflect(Vec3::lift(e), platform), base)),
        );
        let (below, above) = (Vec3::lift(self.base_point), Vec3::lift(self.platform_point));
        let point = below + reflect(pose.o + pose.rotation * above - below, base);
        Pose { rotation, o: point - rotation * above }
    }
}

/// The plane that points lie in, if they do: a point and the unit normal.
fn plane(points: &[Vec3<f64>]) -> Option<(Vec3<f64>, Vec3<f64>)> {
    let first = *points.first()?;
    let far = |from: Vec3<f64>| {
        points.iter().map(|&p| p - from).max_by(|a, b| by_size(a.norm(), b.norm())).unwrap_or(Vec3::zero())
    };
    let along = far(first);
    let normal = points
        .iter()
        .map(|&p| along.cross(p - first))
        .max_by(|a, b| by_size(a.norm(), b.norm()))
        .unwrap_or(Vec3::zero());
    let size = along.norm();
    if !(normal.norm() > 1e-9 * size * size) {
        return None;
    }
    let normal = normal.unit();
    points.iter().all(|&p| normal.dot(p - first).abs() <= 1e-12 * size).then_some((first, normal))
}

/// All solutions for generic complex lengths, by continuation from products of linear forms \[T75\]; none
/// where the legs and constraints are not six equations.
#[must_use]
pub fn start(mech: &Mechanism) -> Option<Start> {
    if mech.mobility.uncontrolled > 0 || mech.idle.len() > 1 {
        return None;
    }
    if mech.is_redundant() {
        let square = sufficient_actuators(mech)?;
        let found = start(&square)?;
        return Some(Start { square: Some(Box::new(square)), ..found });
    }
    search(mech, &mut Random(0x9E37_79B9_7F4A_7C15))
}

/// Generic solutions of a mechanism without redundant legs, by the given random numbers.
fn search(mech: &Mechanism, draw: &mut Random) -> Option<Start> {
    let asked = generic(mech, draw);
    let mut result =
        Start { asked, poses: Vec::new(), own_images: Vec::new(), mirror: Mirror::of(mech), square: None };
    let mut unchanged = 0;
    for _ in 0..MOST_ROUNDS {
        let family = Products::new(mech, asked, draw);
        let (starts, known) = (family.solutions(), result.poses.len());
        for pose in (HomotopyPath { family, precision: CLOSE })
            .follow(&starts)
            .into_iter()
            .filter_map(PathEnd::regular)
        {
            result.extend(mech, pose);
        }
        unchanged = if result.poses.len() == known { unchanged + 1 } else { 0 };
        if unchanged == CONFIRMATIONS {
            return (!result.poses.is_empty()).then_some(result);
        }
    }
    None
}

/// Target of a leg at the home pose.
fn at_home(mech: &Mechanism, leg: &Leg) -> LegTarget<C> {
    let LegTarget { place, square } =
        LegTarget::of(leg, leg.drive.number(leg::position(leg, &mech.home).coordinate));
    LegTarget { place: C::lit(place), square: C::lit(square) }
}

/// Complex squares of lengths a little off those at home, and places of carriages.
fn generic(mech: &Mechanism, draw: &mut Random) -> [LegTarget<C>; 6] {
    let (mut asked, drawn) = ([LegTarget::none(); 6], [(); 6].map(|()| draw.complex().scale(GENERIC)));
    for ((asked, (_, leg)), drawn) in asked.iter_mut().zip(mech.actuated()).zip(drawn) {
        let LegTarget { place, square } = at_home(mech, leg);
        *asked = LegTarget { place, square: square * (C::lit(1.0) + drawn) };
        if leg.drive.moves_foot() {
            asked.place = place + draw.complex().scale(leg.drive.travel() * GENERIC);
        }
    }
    asked
}

/// Distance of two poses as a pure number, idle spins apart \[T71\]: of the columns of R, and of the points o
/// in characteristic lengths, relative to how far off o is. Complex rotations may be large; `RᵀR = 1` then
/// holds and tells them apart only to the square of their size, by which the distance is divided.
fn distance(mech: &Mechanism, a: &Pose<C>, b: &Pose<C>) -> f64 {
    if let [idle] = &mech.idle[..] {
        return distance_of_lines(mech, idle, a, b);
    }
    let size = a.rotation.0.into_iter().map(modulus).fold(1.0, larger);
    let turned = largest(a.rotation.0.iter().zip(b.rotation.0).map(|(&p, q)| modulus(p - q)));
    let moved = modulus(a.o - b.o) / (mech.characteristic_length + modulus(a.o));
    larger(turned / (size * size), moved / size)
}

/// Direction and point of the line of a local degree of freedom at a pose, seen from the other body.
fn line<T: Real>(idle: &Idle, pose: &Pose<T>) -> (Vec3<T>, Vec3<T>) {
    let (axis, point) = (Vec3::lift(idle.axis), Vec3::lift(idle.point));
    match idle.side {
        Axes::Platform => (pose.rotation * axis, pose.o + pose.rotation * point),
        Axes::Base => (pose.rotation.transpose_mul(axis), pose.rotation.transpose_mul(point - pose.o)),
    }
}

/// Distance of two poses apart from the spin of a local degree of freedom: that of its line \[T71\].
fn distance_of_lines(mech: &Mechanism, idle: &Idle, a: &Pose<C>, b: &Pose<C>) -> f64 {
    let ((u, p), (v, q)) = (line(idle, a), line(idle, b));
    let size = larger(modulus(u), 1.0);
    larger(modulus(u - v) / (size * size), modulus(p - q) / (mech.characteristic_length + modulus(p)) / size)
}

/// The pose with the idle line where it is, and the spin that is the shortest rotation from home: a real one
/// where the line is real.
fn unspun(mech: &Mechanism, pose: &Pose<C>) -> Pose<C> {
    let [idle] = &mech.idle[..] else { return *pose };
    let real = |a: Vec3<C>| a.map(|e| e.re);
    let (axis, point) = line(idle, pose);
    let (home, _) = line(idle, &mech.home);
    let turn = Mat3::shortest_turn(home, real(axis).unit());
    let imaginary = |a: Vec3<C>| largest(a.array().iter().map(|e| e.im.abs()));
    let (fixed, off) = (Vec3::lift(idle.point), C::new(0.0, imaginary(axis)));
    let mut found = Pose::lift(&mech.home);
    match idle.side {
        Axes::Platform => {
            found.rotation = Mat3::lift(turn * mech.home.rotation);
            found.o = point - found.rotation * fixed;
        }
        Axes::Base => {
            found.rotation = Mat3::lift(mech.home.rotation * turn.transpose());
            found.o = fixed - found.rotation * point;
        }
    }
    // How far the line is from a real one still shows.
    found.rotation.0[0].x = found.rotation.0[0].x + off;
    found
}

/// A real pose with the given lengths.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub pose: Pose<f64>,
    /// Sign of det J.
    pub sign: f64,
    /// Whether o lies on that side of the base joints on which it lies at home.
    pub above: bool,
    /// Solutions that meet here: more than one at a singular pose.
    pub multiplicity: u32,
    /// Whether the Jacobian is singular to the square root of rounding: the pose is then known to it as well.
    pub singular: bool,
    pub residual: f64,
}

/// The modes, highest first.
#[derive(Clone, Debug)]
pub struct Modes {
    pub modes: Vec<Mode>,
    /// Singular if modes meet, not converged if a path was lost, so that a mode may be missing.
    pub status: Status,
}

/// Every real pose with the given lengths of all actuated legs; passive ones are not read. Where legs are
/// redundant, those of the square mechanism that meet the others as well \[T73\].
#[must_use]
pub fn assembly_modes_of_all(mech: &Mechanism, start: &Start, lengths: &[f64]) -> Modes {
    let of = |mech: &Mechanism| -> Vec<f64> { mech.actuated().map(|(k, _)| lengths[k]).collect() };
    let Some(square) = &start.square else { return assembly_modes(mech, start, &of(mech)) };
    let all = of(mech);
    if !all.iter().all(|l| *l >= 0.0 && l.is_finite()) {
        return Modes { modes: vec![], status: Status::InvalidInput };
    }
    let Modes { mut modes, mut status } = assembly_modes(square, start, &of(square));
    let some = !modes.is_empty();
    modes.retain_mut(|mode| {
        let FoundPose { pose, residual, sign, status, .. } =
            gauss_newton::forward_kinematics(mech, &all, &mode.pose);
        let near = distance(mech, &Pose::lift(&pose), &Pose::lift(&mode.pose)) <= MEETING;
        (mode.pose, mode.residual, mode.sign, mode.singular) =
            (pose, residual, sign, status == Status::Singular);
        near && matches!(status, Status::Ok | Status::Singular)
    });
    if some && modes.is_empty() && status != Status::NotConverged {
        status = Status::Inconsistent;
    } else if status == Status::Singular && !modes.iter().any(|mode| mode.singular) {
        status = Status::Ok;
    }
    Modes { modes, status }
}

/// Every real pose with the given lengths of the actuated legs \[T28\].
#[must_use]
pub fn assembly_modes(mech: &Mechanism, start: &Start, lengths: &[f64]) -> Modes {
    if !newton::are_coordinates(mech, lengths) {
        return Modes { modes: vec![], status: Status::InvalidInput };
    }
    let asked = newton::asked(mech, lengths);
    let to =
        asked.map(|LegTarget { place, square }| LegTarget { place: C::lit(place), square: C::lit(square) });
    let mut ends = Vec::new();
    let mut complete = false;
    for precision in PRECISIONS {
        let family = Lengths { mech, from: start.asked, to };
        let path = HomotopyPath { family, precision };
        ends = path.follow(&start.poses);
        complete = all_kept(mech, &ends);
        if complete {
            break;
        }
    }
    let up = upward(mech);
    let mut modes: Vec<Mode> = Vec::new();
    for (end, own_image) in ends.into_iter().zip(&start.own_images) {
        let (PathEnd::Regular(pose) | PathEnd::Singular(pose)) = end else { continue };
        let mirrored = start.mirror.filter(|_| !own_image).map(|m| m.apply(&pose));
        for pose in std::iter::once(pose).chain(mirrored) {
            if let Some(mode) = real_mode(mech, &asked, &pose, up) {
                keep(mech, &mut modes, mode);
            }
        }
    }
    modes.sort_by_cached_key(|m| std::cmp::Reverse(order(mech, &m.pose, up)));
    let status = match (complete, modes.iter().any(|m| m.singular)) {
        (false, _) => Status::NotConverged,
        (true, true) => Status::Singular,
        (true, false) => Status::Ok,
    };
    Modes { modes, status }
}

/// Sort key of assembly modes: by height, then by the rest of the pose.
fn order(mech: &Mechanism, pose: &Pose<f64>, up: Vec3<f64>) -> [i64; 13] {
    let o = pose.o * (1.0 / mech.characteristic_length);
    let mut numbers =
        [up.dot(o)].into_iter().chain(o.array()).chain(pose.rotation.0.into_iter().flat_map(Vec3::array));
    std::array::from_fn(|_| numbers.next().map_or(0, |x| (x / EQUAL).round() as i64))
}

/// Whether no path was lost, nor left for another: then two would have one regular end.
fn all_kept(mech: &Mechanism, ends: &[PathEnd]) -> bool {
    ends.iter().enumerate().all(|(i, end)| match end {
        PathEnd::Regular(a) => !ends[..i].iter().any(|other| match other {
            PathEnd::Regular(b) => distance(mech, a, b) < SAME,
            _ => false,
        }),
        PathEnd::Singular(_) | PathEnd::Infinite => true,
        PathEnd::Lost => false,
    })
}

/// The real pose that a complex solution is, if it is one.
fn real_mode(mech: &Mechanism, asked: &[LegTarget<f64>; 6], pose: &Pose<C>, up: Vec3<f64>) -> Option<Mode> {
    let pose = &unspun(mech, pose);
    let o = pose.o * C::lit(1.0 / mech.characteristic_length);
    let parts = pose.rotation.0.iter().flat_map(|c| c.array()).chain(o.array());
    let imaginary = largest(parts.map(|e| e.im.abs()));
    if !(imaginary <= IMAGINARY_MEETING) {
        return None;
    }
    let real = |v: Vec3<C>| v.map(|e| e.re);
    let [x, y, _] = pose.rotation.0.map(real);
    let (x, z) = (x.unit(), x.cross(y).unit());
    let guess = Pose { rotation: Mat3::from_columns(x, z.cross(x), z), o: real(pose.o) };
    let FoundPose { pose: found, sign, residual, status, .. } = newton::polish(mech, asked, &guess);
    let longest = largest(asked.iter().map(|a| a.square)).sqrt();
    let moved = distance(mech, &Pose::lift(&found), pose);
    // Off the real poses there are real ones nearby only where modes meet.
    let real = imaginary <= IMAGINARY || status == Status::Singular;
    if !(real && residual <= EXACT * longest && moved <= 10.0 * imaginary + MEETING) {
        return None;
    }
    let above = up.dot(found.o - mech.legs[0].base.point) > 0.0;
    let singular = status == Status::Singular;
    Some(Mode { pose: found, sign, above, multiplicity: 1, singular, residual })
}

/// Adds a mode, or counts it with the one that it meets.
fn keep(mech: &Mechanism, modes: &mut Vec<Mode>, mode: Mode) {
    let lifted = Pose::lift(&mode.pose);
    let same = |m: &&mut Mode| {
        let limit = if m.singular || mode.singular { MEETING } else { SAME };
        distance(mech, &Pose::lift(&m.pose), &lifted) < limit
    };
    match modes.iter_mut().find(same) {
        Some(known) => (known.multiplicity, known.singular) = (known.multiplicity + 1, true),
        None => modes.push(mode),
    }
}

/// The unit normal of the plane of the base joints, or else the direction from their middle, to the side
/// where the platform is at home.
fn upward(mech: &Mechanism) -> Vec3<f64> {
    let points: Vec<Vec3<f64>> = mech.legs.iter().map(|leg| leg.base.point).collect();
    let middle = points.iter().fold(Vec3::zero(), |sum, &p| sum + p) * (1.0 / count(points.len()));
    let home = mech.home.o - middle;
    match plane(&points) {
        Some((_, normal)) if normal.dot(home) < 0.0 => -normal,
        Some((_, normal)) => normal,
        None => home.unit(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common;

    #[test]
    fn the_number_of_solutions_does_not_hang_on_the_numbers_drawn() {
        let known = [Some(52), Some(8), Some(40), None, None];
        let mechanisms = [
            common::published(),
            common::pentapod(5, "platform", 3),
            common::six_sliders(),
            common::with_leg("UPU", 3),
            common::on_rod(2, 4),
        ];
        for (mech, known) in mechanisms.iter().zip(known) {
            let numbers = (1..=4).map(|seed| search(mech, &mut Random(seed)).map(|found| found.solutions()));
            let numbers: Vec<_> = numbers.collect();
            let expected = known.or(numbers[0]);
            println!("{}: {expected:?}", mech.name);
            assert!(numbers.iter().all(|n| n.is_some() && *n == expected), "{}: {numbers:?}", mech.name);
        }
    }
}
