//! The limits of a mechanism, and how far a pose is from each \[T35\] \[T36\] \[T37\] \[T38\].
//!
//! A margin is signed, continuous in the pose and in the unit of what it limits: positive inside, negative
//! outside. Divided by the limit's own scale it is a pure number, so that different limits compare: the least
//! one *binds*.

use std::sync::Arc;

use crate::kinematics::leg::{self, Position};
use crate::kinematics::passive_joints;
use crate::mobility::singularity;
use crate::model::limit::{Bound, Limit, Measure, Strut, Zero};
use crate::model::mechanism::{Leg, Mechanism};
use crate::model::spec::Axes;
use crate::model::spec::{JointSpec, LegSpec, LimitsSpec, RodSpec, Spec};
use crate::model::status::Status;
use crate::number::lanes::{Lanes, Row, WIDTH};
use crate::number::real::{Ordered, Real, Trig};
use crate::spatial::distance::{Hull, Segment, distance};
use crate::spatial::packed_poses::{Poses, get, store};
use crate::spatial::{Pose, Vec3};

impl Bound {
    /// Least and greatest value, infinite where there is none.
    #[must_use]
    pub fn ends(self) -> (f64, f64) {
        match self {
            Bound::Least(least) => (least, f64::INFINITY),
            Bound::Most(most) => (f64::NEG_INFINITY, most),
            Bound::Between(min, max) => (min, max),
        }
    }

    /// Signed slack of a value \[T35\]; of an angle, its arc to the nearer end of the range \[T36\].
    #[inline(always)]
    pub fn margin<T: Trig>(self, value: T) -> T {
        match self {
            Bound::Least(least) => value - T::lit(least),
            Bound::Most(most) => T::lit(most) - value,
            Bound::Between(min, max) => {
                let off = passive_joints::wrapped(value - T::lit(0.5 * (min + max)));
                T::lit(0.5 * (max - min)) - T::select(T::Value::zero().greater(off.value()), -off, off)
            }
        }
    }
}

impl Limit {
    /// A word for its kind, the same in Python.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match (&self.measure, self.bound) {
            (Measure::Length(_), Bound::Least(_)) => "stroke min",
            (Measure::Length(_), _) => "stroke max",
            (Measure::Cone(_, Axes::Base), _) => "base cone",
            (Measure::Cone(_, Axes::Platform), _) => "platform cone",
            (Measure::Angle(_, Axes::Base, _), _) => "base angle",
            (Measure::Angle(_, Axes::Platform, _), _) => "platform angle",
            (Measure::RodAngle(..), _) => "rod angle",
            (Measure::Struts(_), _) => "leg clearance",
            (Measure::Plate(..), _) => "platform clearance",
            (Measure::Conditioning, _) => "conditioning",
            (Measure::Force { .. }, Bound::Least(_)) => "force min",
            (Measure::Force { .. }, _) => "force max",
        }
    }

    #[must_use]
    pub fn unit(&self, mech: &Mechanism) -> &'static str {
        match self.measure {
            Measure::Length(leg) => mech.legs[leg].drive.kind().coordinate_unit,
            Measure::Struts(_) | Measure::Plate(..) => "m",
            Measure::Cone(..) | Measure::Angle(..) | Measure::RodAngle(..) => "rad",
            Measure::Conditioning => "1",
            Measure::Force { leg, .. } => mech.legs[leg].drive.kind().force_unit,
        }
    }

    /// The legs that it concerns; those on the rod for the rotation of a rod, all for the conditioning.
    #[must_use]
    pub fn legs(&self, mech: &Mechanism) -> Vec<usize> {
        match &self.measure {
            Measure::Length(leg)
            | Measure::Cone(leg, _)
            | Measure::Angle(leg, ..)
            | Measure::Force { leg, .. } => vec![*leg],
            Measure::Struts(struts) => struts.iter().map(|s| s.leg).collect(),
            Measure::Plate(strut, _) => vec![strut.leg],
            Measure::RodAngle(rod, _) => {
                (0..mech.legs.len()).filter(|&i| mech.legs[i].rod == Some(*rod)).collect()
            }
            Measure::Conditioning => (0..mech.legs.len()).collect(),
        }
    }

    /// Status of a pose beyond this limit; `Ok` for limits that are not those of a joint.
    #[must_use]
    pub fn status(&self) -> Status {
        match self.measure {
            Measure::Length(_) => Status::OutOfStroke,
            Measure::Cone(..) => Status::OutOfCone,
            Measure::Angle(..) | Measure::RodAngle(..) => Status::OutOfAngle,
            _ => Status::Ok,
        }
    }

    /// The measured quantity of a limit of a joint; NaN for others.
    #[inline(always)]
    pub fn of_joint<T: Trig>(&self, mech: &Mechanism, pose: &Pose<T>, seen: &mut LegCache<T>) -> T {
        match &self.measure {
            Measure::Length(leg) => seen.length(mech, pose, *leg),
            Measure::Cone(leg, side) => cone(mech, *leg, *side, pose, seen),
            Measure::Angle(leg, side, zero) => angle(mech, *leg, *side, zero, pose, seen),
            Measure::RodAngle(rod, zero) => rod_angle(mech, *rod, zero, pose, seen),
            _ => T::lit(f64::NAN),
        }
    }

    /// The measured quantity where the pose alone gives it in closed form; NaN for conditioning and force.
    #[inline(always)]
    fn of_pose<T: Trig>(&self, mech: &Mechanism, pose: &Pose<T>, seen: &mut LegCache<T>) -> T {
        match &self.measure {
            Measure::Struts([a, b]) => {
                distance(&a.in_base(mech, pose), &b.in_base(mech, pose)) - T::lit(a.radius + b.radius)
            }
            Measure::Plate(strut, hull) => {
                hull.distance(&strut.in_platform(mech, pose)) - T::lit(strut.radius)
            }
            _ => self.of_joint(mech, pose, seen),
        }
    }

    /// Quantity of the limit at one pose: none for conditioning and force. No allocation.
    pub fn geometric<T: Trig>(&self, mech: &Mechanism, pose: &Pose<T>) -> Option<T> {
        let closed = !matches!(self.measure, Measure::Conditioning | Measure::Force { .. });
        closed.then(|| self.of_pose(mech, pose, &mut LegCache::default()))
    }

    /// The signed slack at a pose, or at those of all lanes \[T35\]. `forces` are those of the actuators in
    /// the Jacobian's order. Who asks for several limits at a pose has all share what is `seen` of its legs.
    #[inline(always)]
    pub fn margin_at<V: Lanes>(
        &self,
        mech: &Mechanism,
        pose: &Pose<V>,
        forces: &[V],
        seen: &mut LegCache<V>,
    ) -> V {
        self.bound.margin(match self.measure {
            Measure::Conditioning => smallest(mech, pose),
            Measure::Force { row, .. } if row < forces.len() => forces[row],
            Measure::Force { .. } => V::lit(f64::NAN),
            _ => self.of_pose(mech, pose, seen),
        })
    }

    /// Margin of the limit at one pose; without forces the margin of a force is NaN.
    #[must_use]
    pub fn margin(&self, mech: &Mechanism, pose: &Pose<f64>, forces: Option<&[f64]>) -> f64 {
        self.margin_at(mech, pose, forces.unwrap_or_default(), &mut LegCache::default())
    }
}

/// As many legs as lengths are remembered of.
const REMEMBERED: usize = 8;

/// Leg lengths and directions at a pose, computed once for all limits evaluated there.
#[derive(Clone, Copy, Debug)]
pub struct LegCache<T> {
    /// Of the first legs.
    lengths: [T; REMEMBERED],
    count: usize,
    /// The leg that was looked at last: limits that come one after the other are often those of one leg.
    last: Option<(usize, Position<T>)>,
}

impl<T: Real> Default for LegCache<T> {
    #[inline(always)]
    fn default() -> Self {
        LegCache { lengths: [T::zero(); REMEMBERED], count: 0, last: None }
    }
}

impl<T: Real> LegCache<T> {
    /// Remembers the next leg's length.
    #[inline(always)]
    pub(crate) fn next(&mut self, p: &Position<T>) {
        if self.count < REMEMBERED {
            self.lengths[self.count] = p.coordinate;
            self.count += 1;
        }
    }

    #[inline(always)]
    fn length(&mut self, mech: &Mechanism, pose: &Pose<T>, leg: usize) -> T {
        if leg < self.count { self.lengths[leg] } else { self.position(mech, pose, leg).coordinate }
    }

    #[inline(always)]
    fn position(&mut self, mech: &Mechanism, pose: &Pose<T>, leg: usize) -> Position<T> {
        match self.last {
            Some((last, position)) if last == leg => position,
            _ => {
                let position = leg::position(&mech.legs[leg], pose);
                self.last = Some((leg, position));
                position
            }
        }
    }
}

/// The smallest singular value in each lane, one after the other: the rotations it takes differ from pose to
/// pose.
#[inline(always)]
fn smallest<V: Lanes>(mech: &Mechanism, pose: &Pose<V>) -> V {
    let mut poses = [[0.0; WIDTH]; 12];
    store(pose, &mut poses, 0);
    V::load(&smallest_of_each(mech, &poses, V::WIDTH))
}

/// Smallest singular value in each of the first `count` lanes.
#[inline(never)]
fn smallest_of_each(mech: &Mechanism, poses: &Poses, count: usize) -> Row {
    let mut found = [0.0; WIDTH];
    for (lane, sigma) in found.iter_mut().enumerate().take(count) {
        *sigma = singularity::conditioning(mech, &get(poses, lane), mech.characteristic_length).sigma_min;
    }
    found
}

impl Strut {
    #[inline(always)]
    fn in_base<T: Real>(&self, mech: &Mechanism, pose: &Pose<T>) -> Segment<T> {
        let leg = &mech.legs[self.leg];
        let b = pose.o + pose.rotation.of(leg.platform.point);
        Segment(self.foot(mech, pose), b).without(self.cut)
    }

    /// Foot of the strut, base axes.
    #[inline(always)]
    fn foot<T: Real>(&self, mech: &Mechanism, pose: &Pose<T>) -> Vec3<T> {
        let leg = &mech.legs[self.leg];
        if leg.drive.moves_foot() {
            leg::foot(leg, &leg::position(leg, pose))
        } else {
            Vec3::lift(leg.base.point)
        }
    }

    #[inline(always)]
    fn in_platform<T: Real>(&self, mech: &Mechanism, pose: &Pose<T>) -> Segment<T> {
        let leg = &mech.legs[self.leg];
        let foot = pose.rotation.transpose_mul(self.foot(mech, pose) - pose.o);
        Segment(foot, Vec3::lift(leg.platform.point)).without(self.cut)
    }
}

#[inline(always)]
fn cone<T: Trig>(mech: &Mechanism, leg: usize, side: Axes, pose: &Pose<T>, seen: &mut LegCache<T>) -> T {
    let (delta, leg) = (seen.position(mech, pose, leg).delta, &mech.legs[leg]);
    match side {
        Axes::Base => passive_joints::cone_angle(&leg.base, delta),
        Axes::Platform => passive_joints::cone_angle(&leg.platform, pose.rotation.transpose_mul(delta)),
    }
}

/// Rotation of an R joint; of one on a rod, about n.
#[inline(always)]
fn angle<T: Trig>(
    mech: &Mechanism,
    leg: usize,
    side: Axes,
    zero: &Zero,
    pose: &Pose<T>,
    seen: &mut LegCache<T>,
) -> T {
    let (p, leg) = (seen.position(mech, pose, leg), &mech.legs[leg]);
    let n = leg::frame(leg, pose, &p).n();
    let on_rod = side == Axes::Base && leg.rod.is_some();
    passive_joints::angles_at(leg, side, zero, &pose.rotation, n, p.delta)[usize::from(on_rod)]
}

#[inline(always)]
fn rod_angle<T: Trig>(
    mech: &Mechanism,
    rod: usize,
    zero: &Zero,
    pose: &Pose<T>,
    seen: &mut LegCache<T>,
) -> T {
    let leader = mech.rods[rod].leader;
    let p = seen.position(mech, pose, leader);
    passive_joints::rod_angle(mech, rod, zero, leg::frame(&mech.legs[leader], pose, &p).n())
}

/// The signed slack of every limit in the mechanism's order, each in its own unit \[T35\].
///
/// Limits of joints come first, then clearances, conditioning and forces. `forces` as in [`Limit::margin`];
/// only limits of forces need them.
///
/// # Panics
/// If `out` has not one place for each limit.
pub fn margins(mech: &Mechanism, pose: &Pose<f64>, forces: Option<&[f64]>, out: &mut [f64]) {
    assert_eq!(out.len(), mech.limits.len(), "one margin for each limit");
    let (forces, mut seen) = (forces.unwrap_or_default(), LegCache::default());
    for (margin, limit) in out.iter_mut().zip(&mech.limits) {
        *margin = limit.margin_at(mech, pose, forces, &mut seen);
    }
}

/// The limit with the least relative margin, and that margin \[T35\].
#[derive(Clone, Copy, Debug)]
pub struct Binding<V> {
    /// Its number, the first of several; NaN where a margin is NaN, or without limits.
    pub limit: V,
    relative: V,
    /// Zero, or NaN once there was one.
    known: V,
}

impl<V: Ordered> Default for Binding<V> {
    #[inline(always)]
    fn default() -> Self {
        Binding { limit: V::lit(f64::NAN), relative: V::lit(f64::INFINITY), known: V::zero() }
    }
}

impl<V: Ordered> Binding<V> {
    /// Looks at the next limit.
    #[must_use]
    #[inline(always)]
    pub fn or(self, number: usize, relative: V) -> Self {
        let known = V::select(relative.at_most(relative), self.known, V::lit(f64::NAN));
        let less = self.relative.greater(relative);
        Binding {
            limit: V::select(less, V::lit(number as f64), self.limit) + known,
            relative: self.relative.least(relative),
            known,
        }
    }
}

/// The limit with the least margin relative to its scale; none where a margin is NaN, or without limits
/// \[T35\].
#[must_use]
pub fn binding(mech: &Mechanism, margins: &[f64]) -> Option<usize> {
    let mut binding = Binding::default();
    for (k, (margin, limit)) in margins.iter().zip(&mech.limits).enumerate() {
        binding = binding.or(k, margin / limit.scale);
    }
    (!binding.limit.is_nan()).then_some(binding.limit as usize)
}

// --- the list of a mechanism
// ---------------------------------------------------------------------------------

/// The stretch of a strut at its joint that does not count is by default this many times as long as its
/// radius and the clearance together: the strut may then lean until the sine of its angle with the plate is a
/// third.
const REACH: f64 = 3.0;

/// All limits that a description sets: of the joints, leg by leg, then clearances, conditioning, forces.
/// Where it sets none the list is empty.
#[must_use]
pub fn of(mech: &Mechanism, spec: &Spec) -> Vec<Limit> {
    let legs: Vec<&LegSpec> = spec.legs.iter().flatten().collect();
    let mut list = strokes(&legs);
    list.extend(cones(&legs));
    list.extend(angles(mech, &legs));
    list.extend(rod_angles(mech, spec));
    list.extend(clearances(mech, &spec.limits));
    list.extend(spec.limits.sigma_min.map(|floor| Limit {
        name: "conditioning".into(),
        measure: Measure::Conditioning,
        bound: Bound::Least(floor),
        scale: 1.0,
    }));
    list.extend(forces(mech, &legs));
    list
}

/// A least and a greatest value as two limits; `name` takes "min" or "max".
fn both([min, max]: [f64; 2], measure: &Measure, name: impl Fn(&str) -> String) -> [Limit; 2] {
    [("min", Bound::Least(min)), ("max", Bound::Most(max))].map(|(end, bound)| Limit {
        name: name(end),
        measure: measure.clone(),
        bound,
        scale: max - min,
    })
}

fn strokes(legs: &[&LegSpec]) -> Vec<Limit> {
    let of_leg = |(i, leg): (usize, &&LegSpec)| {
        Some(both(leg.stroke?, &Measure::Length(i), |end| format!("stroke {end} of leg {}", leg.name)))
    };
    legs.iter().enumerate().filter_map(of_leg).flatten().collect()
}

/// Both joints of every leg.
fn joints_of<'a>(
    legs: &'a [&'a LegSpec],
) -> impl Iterator<Item = (usize, &'a LegSpec, Axes, &'static str, &'a JointSpec)> {
    legs.iter().enumerate().flat_map(|(i, leg)| {
        [(i, *leg, Axes::Base, "base", &leg.base), (i, *leg, Axes::Platform, "platform", &leg.platform)]
    })
}

fn cones(legs: &[&LegSpec]) -> Vec<Limit> {
    let of_joint = |(i, leg, side, word, joint): (usize, &LegSpec, Axes, &str, &JointSpec)| {
        let angle = joint.cone.as_ref()?.angle;
        Some(Limit {
            name: format!("{word} cone of leg {}", leg.name),
            measure: Measure::Cone(i, side),
            bound: Bound::Most(angle),
            scale: angle,
        })
    };
    joints_of(legs).filter_map(of_joint).collect()
}

fn angles(mech: &Mechanism, legs: &[&LegSpec]) -> Vec<Limit> {
    let of_joint = |(i, leg, side, word, joint): (usize, &LegSpec, Axes, &str, &JointSpec)| {
        let [min, max] = joint.range?;
        Some(Limit {
            name: format!("{word} angle of leg {}", leg.name),
            measure: Measure::Angle(i, side, Zero::of(&mech.legs[i], &mech.home)),
            bound: Bound::Between(min, max),
            scale: max - min,
        })
    };
    joints_of(legs).filter_map(of_joint).collect()
}

fn rod_angles(mech: &Mechanism, spec: &Spec) -> Vec<Limit> {
    let of_rod = |(i, rod): (usize, &RodSpec)| {
        let [min, max] = rod.range?;
        Some(Limit {
            name: format!("angle of rod {}", rod.name),
            measure: Measure::RodAngle(i, Zero::of(&mech.legs[mech.rods[i].leader], &mech.home)),
            bound: Bound::Between(min, max),
            scale: max - min,
        })
    };
    spec.rods.iter().flatten().enumerate().filter_map(of_rod).collect()
}

/// Every pair of struts, then every strut and the platform \[T37\].
fn clearances(mech: &Mechanism, whole: &LimitsSpec) -> Vec<Limit> {
    let Some(clearance) = whole.clearance else { return vec![] };
    let limit = |name: String, measure: Measure| Limit {
        name,
        measure,
        bound: Bound::Least(clearance),
        scale: mech.characteristic_length,
    };
    let struts: Vec<(usize, f64, f64)> = mech
        .legs
        .iter()
        .enumerate()
        .filter_map(|(i, leg)| {
            let radius = leg.radius?;
            Some((i, radius, whole.joint_reach.unwrap_or(REACH * (radius + clearance))))
        })
        .collect();
    let mut list = Vec::new();
    for (k, &(i, r1, reach1)) in struts.iter().enumerate() {
        for &(j, r2, reach2) in &struts[k + 1..] {
            // Joints of one body keep their distance: struts that always touch there are cut there.
            let (a, b) = (&mech.legs[i], &mech.legs[j]);
            let cuts = [(&a.base, &b.base), (&a.platform, &b.platform)]
                .map(|(p, q)| (p.point - q.point).norm() <= r1 + r2 + clearance);
            let cut = |reach: f64| cuts.map(|c| if c { reach } else { 0.0 });
            let struts = [
                Strut { leg: i, radius: r1, cut: cut(reach1) },
                Strut { leg: j, radius: r2, cut: cut(reach2) },
            ];
            list.push(limit(format!("clearance of legs {} and {}", a.name, b.name), Measure::Struts(struts)));
        }
    }
    let points: Vec<Vec3<f64>> = mech.legs.iter().map(|leg| leg.platform.point).collect();
    let hull = Arc::new(Hull::of(&points));
    list.extend(struts.into_iter().map(|(leg, radius, reach)| {
        let strut = Strut { leg, radius, cut: [0.0, reach] };
        let name = format!("clearance of leg {} and the platform", mech.legs[leg].name);
        limit(name, Measure::Plate(strut, Arc::clone(&hull)))
    }));
    list
}

fn forces(mech: &Mechanism, legs: &[&LegSpec]) -> Vec<Limit> {
    let of_row = |(row, (leg, _)): (usize, (usize, &Leg))| {
        let name = |end: &str| format!("force {end} of leg {}", legs[leg].name);
        Some(both(legs[leg].force?, &Measure::Force { leg, row }, name))
    };
    mech.actuated().enumerate().filter_map(of_row).flatten().collect()
}
