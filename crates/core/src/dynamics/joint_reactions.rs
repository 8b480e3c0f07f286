//! Reactions of all joints: the wrench of the link on the base's side on the link on the platform's side
//! \[T44\] \[T45\] \[T46\] \[T47\] \[T48\].
//!
//! The wrenches of the legs on the platform are the unknowns; every other reaction follows from them link by
//! link, from the platform down. What they must satisfy is that no joint carries what it leaves free, and
//! that the platform is balanced. Where constraints are redundant this leaves self-stresses open, which two
//! rules choose.

use crate::dynamics::inverse_dynamics::{inertial_force, platform_wrench, rod_wrench, turning_torque};
use crate::kinematics::leg;
use crate::model::joint::{JointKind, Normal};
use crate::model::mechanism::{Body, ConstraintKind, Leg, Mechanism};
use crate::number::real::Real;
use crate::number::slices;
use crate::spatial::{Mat3, Motion, Pose, Vec3, Wrench};

/// A joint between two links.
#[derive(Clone, Debug)]
pub struct LinkJoint {
    /// R, S, U, P, or F where two links are one.
    pub kind: &'static str,
    pub name: String,
    /// The link on the base's side, and that on the platform's.
    pub links: [String; 2],
    /// Components of the reaction that the joint cannot transmit, in joint axes, force before torque.
    pub(crate) free: Vec<usize>,
}

/// All joints: the rods' bearings, then for each leg base joint, prismatic joint and platform joint. A
/// slider's prismatic joint lies below its base joint, between base and carriage.
#[must_use]
pub fn joints(mech: &Mechanism) -> Vec<LinkJoint> {
    let mut all = Vec::new();
    let mut add = |kind: &'static str, name: String, links: [String; 2], free: &[usize]| {
        all.push(LinkJoint { kind, name, links, free: free.to_vec() });
    };
    let rod_name = |rod: usize| format!("rod {}", mech.rods[rod].name);
    for r in 0..mech.rods.len() {
        add("R", rod_name(r), ["base".into(), rod_name(r)], JointKind::ON_ROD.free());
    }
    for leg in &mech.legs {
        let (ground, below) = (leg.rod.map_or_else(|| "base".into(), rod_name), leg.base_kind());
        let [first, second] = leg.links().map(|link| format!("{link} {}", leg.name));
        let above = leg.platform.kind;
        // The prismatic joint carries the active force along its direction, and nothing there if it is
        // passive.
        let active = [leg.drive.kind().active];
        let slide: &[usize] = if leg.actuated { &[] } else { &active };
        let [base_joint, prismatic] = leg.drive.between([ground, first, second.clone()]);
        add(below.letter(), format!("base joint {}", leg.name), base_joint, below.free());
        add(leg.drive.kind().letter, format!("prismatic {}", leg.name), prismatic, slide);
        add(
            above.letter(),
            format!("platform joint {}", leg.name),
            [second, "platform".into()],
            above.free(),
        );
    }
    all
}

/// A joint's point and its axes as columns, both in base axes \[T44\].
#[derive(Clone, Copy, Debug)]
pub struct JointFrame<T> {
    pub point: Vec3<T>,
    pub axes: Mat3<T>,
}

impl<T: Real> JointFrame<T> {
    pub(crate) fn nowhere() -> Self {
        JointFrame { point: Vec3::zero(), axes: Mat3::identity() }
    }

    /// A wrench in joint axes.
    #[inline(always)]
    pub fn seen(&self, w: Wrench<T>) -> Wrench<T> {
        Wrench::new(self.axes.transpose_mul(w.force), self.axes.transpose_mul(w.torque))
    }
}

/// Points and axes of all joints, in the order of [`joints`].
#[must_use]
pub fn places<T: Real>(mech: &Mechanism, pose: &Pose<T>) -> Vec<JointFrame<T>> {
    let mut all = vec![JointFrame::nowhere(); mech.rods.len() + 3 * mech.legs.len()];
    put_places(mech, pose, &mut all);
    all
}

#[inline(always)]
pub(crate) fn put_places<T: Real>(mech: &Mechanism, pose: &Pose<T>, all: &mut [JointFrame<T>]) {
    let rods = mech.rods.len();
    for (i, leg) in mech.legs.iter().enumerate() {
        let (p, frame) = leg::place(leg, pose);
        let [below, slide, above] = leg_places(leg, pose, &p, &frame.axes);
        (all[rods + 3 * i], all[rods + 3 * i + 1], all[rods + 3 * i + 2]) = (below, slide, above);
    }
    for (r, rod) in mech.rods.iter().enumerate() {
        // The prismatic joint of the leg that leads the rod has the leg's own axes, n first.
        let (axis, n) = (Vec3::lift(rod.axis), all[rods + 3 * rod.leader + 1].axes.0[0]);
        all[r] =
            JointFrame { point: Vec3::lift(rod.point), axes: Mat3::from_columns(axis, n, axis.cross(n)) };
    }
}

/// Base joint at B, prismatic joint at b, platform joint at b; of a slider the first two at the strut's foot.
#[inline(always)]
fn leg_places<T: Real>(
    leg: &Leg,
    pose: &Pose<T>,
    p: &leg::Position<T>,
    axes: &Mat3<T>,
) -> [JointFrame<T>; 3] {
    let below = match (leg.rod, leg.base.normal()) {
        (None, Some(Normal::Across(u))) => universal(Vec3::lift(u), axes.0[0]),
        _ => *axes,
    };
    let above = match leg.platform.normal() {
        Some(Normal::Across(u)) => universal(pose.rotation.of(u), axes.0[0]),
        _ => *axes,
    };
    let (base, end) = (leg::foot(leg, p), pose.o + p.e);
    let (point, along) = leg.drive.joint([Vec3::lift(leg.base.point), base, end], axes);
    let slide = JointFrame { point, axes: along };
    [JointFrame { point: base, axes: below }, slide, JointFrame { point: end, axes: above }]
}

/// (u, n, u×n) for the two axes of a universal joint; its couple is about the third.
#[inline(always)]
fn universal<T: Real>(u: Vec3<T>, n: Vec3<T>) -> Mat3<T> {
    let third = u.cross(n).unit();
    Mat3::from_columns(u, third.cross(u), third)
}

/// Weight, inertia and load of the links: at o for the platform (divided by the efficiency, as in [Eq. 43]),
/// at a rod's point, at B for a cylinder and at b for a piston, at its foot for a carriage and at b for a
/// strut.
#[derive(Clone, Debug)]
pub struct Given<T> {
    pub platform: Wrench<T>,
    pub rods: Vec<Wrench<T>>,
    /// The two links of each leg.
    pub legs: Vec<[Wrench<T>; 2]>,
}

impl<T: Real> Given<T> {
    /// Links without weight, inertia and load.
    #[must_use]
    pub fn none(mech: &Mechanism) -> Self {
        let zero = Wrench::zero();
        Given { platform: zero, rods: vec![zero; mech.rods.len()], legs: vec![[zero; 2]; mech.legs.len()] }
    }

    /// Those of a motion under load \[T13\].
    #[must_use]
    pub fn of(mech: &Mechanism, platform: &Motion<T>, load: Wrench<T>) -> Self {
        let mut given = Given::none(mech);
        given.set(mech, platform, load);
        given
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, mech: &Mechanism, platform: &Motion<T>, load: Wrench<T>) {
        let gravity = Vec3::lift(mech.gravity);
        self.platform = (load + platform_wrench(mech, platform)) * T::lit(1.0 / mech.efficiency);
        for (i, leg) in mech.legs.iter().enumerate() {
            let state = leg::state(leg, platform);
            let (cylinder, piston) = (leg::cylinder(leg, &state), leg::piston(leg, &state));
            self.legs[i] = [
                link_wrench(&leg.cylinder, gravity, &cylinder, leg.drive.first_turn(&state)),
                link_wrench(&leg.piston, gravity, &piston, (state.frame.axes, state.turn)),
            ];
            for (r, rod) in mech.rods.iter().enumerate() {
                if rod.leader == i {
                    self.rods[r] = rod_wrench(mech, rod, &rod.body, &state);
                }
            }
        }
    }
}

/// Weight and inertia of a link of a leg, about its reference point.
#[inline(always)]
fn link_wrench<T: Real>(
    body: &Body,
    gravity: Vec3<T>,
    center: &leg::PointMotion<T>,
    (axes, turn): (Mat3<T>, leg::LegRotation<T>),
) -> Wrench<T> {
    let torque = axes * turning_torque(body.inertia, turn.omega, turn.eps);
    let force = inertial_force(body, gravity, center.acceleration);
    Wrench::new(force, center.offset.cross(force) + torque)
}

/// The reactions of all joints, each at its own point in base axes, from those of the platform joints: every
/// link but the platform is balanced \[T45\].
#[must_use]
pub fn reactions<T: Real>(
    mech: &Mechanism,
    places: &[JointFrame<T>],
    given: &Given<T>,
    on_platform: &[Wrench<T>],
) -> Vec<Wrench<T>> {
    let mut all = vec![Wrench::zero(); places.len()];
    put_reactions(mech, places, given, on_platform, &mut all);
    all
}

#[inline(always)]
pub(crate) fn put_reactions<T: Real>(
    mech: &Mechanism,
    places: &[JointFrame<T>],
    given: &Given<T>,
    on_platform: &[Wrench<T>],
    all: &mut [Wrench<T>],
) {
    let rods = mech.rods.len();
    for r in 0..rods {
        all[r] = Wrench::zero() - given.rods[r];
    }
    for (i, leg) in mech.legs.iter().enumerate() {
        let below = rods + 3 * i;
        let (base, end) = (places[below].point, places[below + 2].point);
        let [first, second] = given.legs[i];
        let on_second = on_platform[i] - second;
        let at_base = on_second.moved(end - base);
        let on_first = at_base - first;
        if let Some(rod) = leg.rod {
            all[rod] = all[rod] + on_first.moved(base - places[rod].point);
        }
        let (base_joint, prismatic) =
            if leg.drive.moves_foot() { (at_base, on_first) } else { (on_first, on_second) };
        (all[below], all[below + 1], all[below + 2]) = (base_joint, prismatic, on_platform[i]);
    }
}

/// Residual of the equilibrium equations: components that joints do not transmit, then the platform's balance
/// at o; torques divided by the characteristic length \[T46\].
#[must_use]
pub fn unbalanced<T: Real>(
    mech: &Mechanism,
    joints: &[LinkJoint],
    places: &[JointFrame<T>],
    o: Vec3<T>,
    given: &Given<T>,
    reactions: &[Wrench<T>],
) -> Vec<T> {
    let mut rows = vec![T::zero(); joints.iter().map(|joint| joint.free.len()).sum::<usize>() + 6];
    put_unbalanced(mech, joints, places, o, given, reactions, &mut rows);
    rows
}

#[inline(always)]
pub(crate) fn put_unbalanced<T: Real>(
    mech: &Mechanism,
    joints: &[LinkJoint],
    places: &[JointFrame<T>],
    o: Vec3<T>,
    given: &Given<T>,
    reactions: &[Wrench<T>],
    rows: &mut [T],
) {
    let (length, mut count) = (mech.characteristic_length, 0);
    for j in 0..joints.len() {
        let components = pure(places[j].seen(reactions[j]), length).array();
        for &k in &joints[j].free {
            rows[count] = components[k];
            count += 1;
        }
    }
    let mut sum = given.platform;
    for i in 0..mech.legs.len() {
        let above = platform_joint(mech, i);
        sum = sum + reactions[above].moved(places[above].point - o);
    }
    slices::copy(&pure(sum, length).array(), &mut rows[count..]);
}

/// Index of the platform joint of a leg.
#[inline(always)]
pub(crate) fn platform_joint(mech: &Mechanism, leg: usize) -> usize {
    mech.rods.len() + 3 * leg + 2
}

/// A wrench with its torque divided by a length.
#[inline(always)]
pub(crate) fn pure<T: Real>(w: Wrench<T>, length: f64) -> Wrench<T> {
    Wrench::new(w.force, w.torque.scale(1.0 / length))
}

/// Constraint wrench W_c = Σ[(F, T + e×F) - f (δ, e×δ)] of the constraining legs on the platform at o
/// \[T48\]. No self-stress changes the sum.
#[inline(always)]
pub(crate) fn constraint_wrench<T: Real>(
    mech: &Mechanism,
    places: &[JointFrame<T>],
    pose: &Pose<T>,
    reactions: &[Wrench<T>],
) -> Wrench<T> {
    let mut sum = Wrench::zero();
    for (i, leg) in mech.legs.iter().enumerate() {
        if constrains(mech, i) {
            let (above, p) = (platform_joint(mech, i), leg::position(leg, pose));
            sum = sum + reactions[above].moved(places[above].point - pose.o);
            if leg.actuated {
                sum = sum - leg::row(leg, &p) * leg.drive.active(reactions[above - 1], &p);
            }
        }
    }
    sum
}

/// Whether a leg takes part in a constraint on the platform.
fn constrains(mech: &Mechanism, leg: usize) -> bool {
    mech.constraints.iter().any(|c| {
        let leader = mech.legs[c.leg].rod.map(|rod| mech.rods[rod].leader);
        c.leg == leg || (c.kind == ConstraintKind::E && leader == Some(leg))
    })
}
