//! Reactions of all joints: what each makes the link on its base side do to the link on its platform side \[T44\]-\[T48\].
//!
//! The wrenches of the legs on the platform are the unknowns; every other reaction follows from them link by link,
//! from the platform down. What they must satisfy is that no joint carries what it leaves free, and that the platform is
//! balanced. Where constraints are redundant this leaves self-stresses open, which two rules choose.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::{inertial_force, platform_wrench, rod_wrench, turning_torque};
use crate::leg;
use crate::mechanism::{Body, ConstraintKind, Leg, Mechanism};
use crate::real::Real;
use crate::spatial::{Mat3, Motion, Pose, Vec3, Wrench};
use crate::spec::JointKind;
use crate::svd::Svd;

/// Singular value of the balances, as a share of the largest, below which the pose is singular.
const SINGULAR: f64 = 1e-12;

/// Redundant constraints agree as well as the pose keeps them all; what their singular values, zero at an exact pose, may
/// be of the smallest that counts.
const SEPARATION: f64 = 1e-3;

/// What may be left of the balances, relative to their terms.
const RESIDUAL: f64 = 1e-9;

/// A component (torques divided by Λ) that no self-stress of size one changes by more is determinate: poses may miss their
/// constraints by as much.
const OPEN: f64 = 1e-6;

/// A joint between two links.
#[derive(Clone, Debug)]
pub struct Joint {
    /// R, S, U, P, or F where two links are one.
    pub kind: &'static str,
    pub name: String,
    /// The link on the base's side, and that on the platform's.
    pub links: [String; 2],
    /// What it leaves free: components, in joint axes, force before torque, of a reaction that it cannot carry.
    free: Vec<usize>,
}

/// All joints: the rods' bearings, then for each leg base joint, prismatic joint and platform joint.
#[must_use]
pub fn joints(mech: &Mechanism) -> Vec<Joint> {
    let mut all = Vec::new();
    let mut add = |kind: &'static str, name: String, links: [String; 2], free: &[usize]| {
        all.push(Joint { kind, name, links, free: free.to_vec() });
    };
    let rod_name = |rod: usize| format!("rod {}", mech.rods[rod].name);
    for r in 0..mech.rods.len() {
        add("R", rod_name(r), ["base".into(), rod_name(r)], turns(JointKind::Revolute));
    }
    for leg in &mech.legs {
        let (ground, below) = match leg.rod {
            Some(rod) => (rod_name(rod), JointKind::Revolute),
            None => ("base".into(), leg.base.kind),
        };
        let [cylinder, piston] = ["cylinder", "piston"].map(|link| format!("{link} {}", leg.name));
        let above = leg.platform.kind;
        // The prismatic joint carries the active force along δ, and nothing there if it is passive.
        let slide: &[usize] = if leg.actuated { &[] } else { &[1] };
        add(below.letter(), format!("base joint {}", leg.name), [ground, cylinder.clone()], turns(below));
        add("P", format!("prismatic {}", leg.name), [cylinder, piston.clone()], slide);
        add(
            above.letter(),
            format!("platform joint {}", leg.name),
            [piston, "platform".into()],
            turns(above),
        );
    }
    all
}

/// Torques that a joint leaves free, in its axes.
fn turns(kind: JointKind) -> &'static [usize] {
    match kind {
        JointKind::Spherical => &[3, 4, 5],
        JointKind::Universal => &[3, 4],
        JointKind::Revolute => &[3],
        JointKind::Fixed => &[],
    }
}

/// A joint's point and its axes as columns, both in base axes \[T44\].
#[derive(Clone, Copy, Debug)]
pub struct Place<T> {
    pub point: Vec3<T>,
    pub axes: Mat3<T>,
}

impl<T: Real> Place<T> {
    /// A wrench in joint axes.
    #[inline(always)]
    pub fn seen(&self, w: Wrench<T>) -> Wrench<T> {
        Wrench::new(self.axes.transpose_mul(w.force), self.axes.transpose_mul(w.torque))
    }
}

/// Where all joints are, in the order of [`joints`].
#[must_use]
pub fn places<T: Real>(mech: &Mechanism, pose: &Pose<T>) -> Vec<Place<T>> {
    let legs: Vec<_> = mech
        .legs
        .iter()
        .map(|leg| {
            let p = leg::position(leg, pose);
            leg_places(leg, pose, &p, &leg::frame(leg, pose, &p).axes)
        })
        .collect();
    let rods = mech.rods.iter().map(|rod| {
        // The prismatic joint of the leg that leads the rod has the leg's own axes, n first.
        let (axis, n) = (Vec3::lift(rod.axis), legs[rod.leader][1].axes.0[0]);
        Place { point: Vec3::lift(rod.point), axes: Mat3::from_columns(axis, n, axis.cross(n)) }
    });
    rods.chain(legs.iter().flatten().copied()).collect()
}

/// Base joint at B, prismatic joint at b, platform joint at b.
fn leg_places<T: Real>(leg: &Leg, pose: &Pose<T>, p: &leg::Position<T>, axes: &Mat3<T>) -> [Place<T>; 3] {
    let n = axes.0[0];
    // (u, n, u×n) for the two axes of a universal joint; its couple is about the third.
    let of = |kind: JointKind, u: Option<Vec3<T>>| match (kind, u) {
        (JointKind::Universal, Some(u)) => {
            let third = u.cross(n).unit();
            Mat3::from_columns(u, third.cross(u), third)
        }
        _ => *axes,
    };
    let below = match leg.rod {
        Some(_) => *axes,
        None => of(leg.base.kind, leg.base.axis.map(Vec3::lift)),
    };
    let above = of(leg.platform.kind, leg.platform.axis.map(|u| pose.rotation * Vec3::lift(u)));
    let (base, end) = (Vec3::lift(leg.base.point), pose.o + p.e);
    [Place { point: base, axes: below }, Place { point: end, axes: *axes }, Place { point: end, axes: above }]
}

/// Weight, inertia and load of the links: at o for the platform (divided by the efficiency, as in [Eq. 43]), at a rod's
/// point, at B for a cylinder and at b for a piston.
#[derive(Clone, Debug)]
pub struct Given<T> {
    pub platform: Wrench<T>,
    pub rods: Vec<Wrench<T>>,
    /// Cylinder and piston of each leg.
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
        let gravity = Vec3::lift(mech.gravity);
        let states: Vec<_> = mech.legs.iter().map(|leg| leg::state(leg, platform)).collect();
        let link = |body: &Body, center: &leg::PointMotion<T>, state: &leg::State<T>| {
            let turn = &state.turn;
            let torque = state.frame.axes * turning_torque(body.inertia, turn.omega, turn.eps);
            let force = inertial_force(body, gravity, center.acceleration);
            Wrench::new(force, center.offset.cross(force) + torque)
        };
        let legs = mech.legs.iter().zip(&states).map(|(leg, state)| {
            let (cylinder, piston) = (leg::cylinder(leg, state), leg::piston(leg, state));
            [link(&leg.cylinder, &cylinder, state), link(&leg.piston, &piston, state)]
        });
        Given {
            platform: (load + platform_wrench(mech, platform)) * T::lit(1.0 / mech.efficiency),
            rods: mech.rods.iter().map(|rod| rod_wrench(mech, rod, &states[rod.leader])).collect(),
            legs: legs.collect(),
        }
    }
}

/// The reactions of all joints, each at its own point in base axes, from those of the platform joints: every link but the
/// platform is balanced \[T45\].
#[must_use]
pub fn reactions<T: Real>(
    mech: &Mechanism,
    places: &[Place<T>],
    given: &Given<T>,
    on_platform: &[Wrench<T>],
) -> Vec<Wrench<T>> {
    let rods = mech.rods.len();
    let mut all: Vec<Wrench<T>> = given.rods.iter().map(|&own| Wrench::zero() - own).collect();
    for (i, leg) in mech.legs.iter().enumerate() {
        let [base, end] = [0, 1].map(|k| places[rods + 3 * i + k].point);
        let [cylinder, piston] = given.legs[i];
        let on_piston = on_platform[i] - piston;
        let on_cylinder = on_piston.moved(end - base) - cylinder;
        if let Some(rod) = leg.rod {
            all[rod] = all[rod] + on_cylinder.moved(base - places[rod].point);
        }
        all.extend([on_cylinder, on_piston, on_platform[i]]);
    }
    all
}

/// What the reactions must make zero: components that joints do not carry, then the platform's balance at o; torques divided
/// by the characteristic length \[T46\].
#[must_use]
pub fn unbalanced<T: Real>(
    mech: &Mechanism,
    joints: &[Joint],
    places: &[Place<T>],
    o: Vec3<T>,
    given: &Given<T>,
    reactions: &[Wrench<T>],
) -> Vec<T> {
    let inverse = T::lit(1.0 / mech.characteristic_length);
    let pure = |w: Wrench<T>| Wrench::new(w.force, w.torque * inverse).array();
    let mut rows = Vec::new();
    for ((joint, place), &reaction) in joints.iter().zip(places).zip(reactions) {
        let components = pure(place.seen(reaction));
        rows.extend(joint.free.iter().map(|&k| components[k]));
    }
    let mut sum = given.platform;
    for k in platform_joints(mech) {
        sum = sum + reactions[k].moved(places[k].point - o);
    }
    rows.extend(pure(sum));
    rows
}

/// Indices of the platform joints, one for each leg.
fn platform_joints(mech: &Mechanism) -> impl Iterator<Item = usize> {
    let first = mech.rods.len() + 2;
    (0..mech.legs.len()).map(move |i| first + 3 * i)
}

/// Reactions of all joints in the order of [`joints`], each at its joint's point in base axes.
#[derive(Clone, Debug)]
pub struct Reactions {
    pub places: Vec<Place<f64>>,
    /// Universal joints carry no couple, as far as balance lets them \[T47\].
    pub assumed: Vec<Wrench<f64>>,
    /// The least in sum of squares \[T47\].
    pub least: Vec<Wrench<f64>>,
    /// Which components no self-stress changes: in base axes, and in joint axes.
    pub determinate: Vec<[bool; 6]>,
    pub determinate_in_joint: Vec<[bool; 6]>,
    /// On the platform at o, of all legs that constrain it, without their active forces \[T48\].
    pub constraint: Wrench<f64>,
}

/// All reactions that keep up a motion under load, or none at a singular pose. Torques count in the least sum of squares by
/// `scale`, m.
#[must_use]
pub fn solve(
    mech: &Mechanism,
    joints: &[Joint],
    platform: &Motion<f64>,
    load: Wrench<f64>,
    scale: f64,
) -> Option<Reactions> {
    if mech.mobility.uncontrolled > 0 {
        return None;
    }
    let places = places(mech, &platform.pose);
    let given = Given::of(mech, platform, load);
    let balance = Balance { mech, joints, places: &places, o: platform.pose.o };
    let (x, self_stresses) = balance.solve(&given)?;
    let start = reactions(mech, &places, &given, &x);
    let none = Given::none(mech);
    let stresses: Vec<Vec<Wrench<f64>>> =
        self_stresses.iter().map(|top| reactions(mech, &places, &none, top)).collect();

    let everything = |all: &[Wrench<f64>]| -> Vec<f64> { all.iter().flat_map(|w| pure(*w, scale)).collect() };
    let couples = |all: &[Wrench<f64>]| -> Vec<f64> {
        let universal = joints.iter().zip(&places).zip(all).filter(|((joint, _), _)| joint.kind == "U");
        universal.map(|((_, place), w)| place.seen(*w).torque.z / mech.characteristic_length).collect()
    };
    let couple_free = choose(&start, &stresses, &[&couples, &everything]);
    let least = choose(&start, &stresses, &[&everything]);

    let unmoved = |joint: usize, seen: &dyn Fn(Wrench<f64>) -> Wrench<f64>| -> [bool; 6] {
        let parts: Vec<_> =
            stresses.iter().map(|s| pure(seen(s[joint]), mech.characteristic_length)).collect();
        std::array::from_fn(|k| parts.iter().all(|part| part[k].abs() <= OPEN))
    };
    Some(Reactions {
        determinate: (0..joints.len()).map(|j| unmoved(j, &|w| w)).collect(),
        determinate_in_joint: (0..joints.len()).map(|j| unmoved(j, &|w| places[j].seen(w))).collect(),
        constraint: constraint_wrench(mech, &places, &platform.pose, &couple_free),
        places,
        assumed: couple_free,
        least,
    })
}

/// A wrench with its torque divided by a length.
fn pure(w: Wrench<f64>, length: f64) -> [f64; 6] {
    Wrench::new(w.force, w.torque * (1.0 / length)).array()
}

/// The balances of a pose.
struct Balance<'a> {
    mech: &'a Mechanism,
    joints: &'a [Joint],
    places: &'a [Place<f64>],
    o: Vec3<f64>,
}

/// The wrenches of the legs on the platform, each at its b in base axes.
type OnPlatform = Vec<Wrench<f64>>;

impl Balance<'_> {
    /// Wrenches of the legs that balance the links, and those that do so without any given forces, orthonormal with
    /// torques divided by Λ: the self-stresses, as many as there are redundant constraints \[T46\].
    fn solve(&self, given: &Given<f64>) -> Option<(OnPlatform, Vec<OnPlatform>)> {
        let unknowns = 6 * self.mech.legs.len();
        let none = Given::none(self.mech);
        let columns: Vec<Vec<f64>> = (0..unknowns)
            .map(|k| {
                let unit = DVector::from_fn(unknowns, |i, _| f64::from(u8::from(i == k)));
                self.unbalanced(&none, &self.wrenches(&unit))
            })
            .collect();
        let given = self.unbalanced(given, &self.wrenches(&DVector::zeros(unknowns)));
        if columns.iter().flatten().chain(&given).any(|e| !e.is_finite()) {
            return None;
        }
        let m = DMatrix::from_fn(given.len(), unknowns, |i, k| columns[k][i]);
        let rhs = -DVector::from_vec(given);

        let Svd { values: sigma, u, v_t } = Svd::of(&m)?;
        // The rank is that of generic poses [T18]: less is singular, and more is an error of the pose.
        let rank = unknowns - self.mech.mobility.redundant;
        let (least, largest_zero) = (sigma[rank - 1], sigma.get(rank).copied().unwrap_or(0.0));
        if !(least > SINGULAR * sigma[0] && largest_zero <= SEPARATION * least) {
            return None;
        }
        let inverse = |b: &DVector<f64>| {
            let mut x = DVector::zeros(unknowns);
            for k in 0..rank {
                x.axpy(u.column(k).dot(b) / sigma[k], &v_t.row(k).transpose(), 1.0);
            }
            x
        };
        // One step of refinement takes off the rounding of the decomposition.
        let first = inverse(&rhs);
        let x = &first + inverse(&(&rhs - &m * &first));
        let left = (&rhs - &m * &x).norm();
        if !(left <= RESIDUAL * (sigma[0] * x.norm() + rhs.norm())) {
            return None;
        }
        let self_stresses = (rank..unknowns).map(|k| self.wrenches(&v_t.row(k).transpose()));
        Some((self.wrenches(&x), self_stresses.collect()))
    }

    fn unbalanced(&self, given: &Given<f64>, on_platform: &[Wrench<f64>]) -> Vec<f64> {
        let all = reactions(self.mech, self.places, given, on_platform);
        unbalanced(self.mech, self.joints, self.places, self.o, given, &all)
    }

    /// Unknowns as wrenches: their torques are divided by the characteristic length.
    fn wrenches(&self, x: &DVector<f64>) -> OnPlatform {
        let wrench = |i: usize| {
            let w = Wrench::from_array(std::array::from_fn(|k| x[6 * i + k]));
            Wrench::new(w.force, w.torque * self.mech.characteristic_length)
        };
        (0..self.mech.legs.len()).map(wrench).collect()
    }
}

/// What a rule wants least of, in the sense of least squares; linear in the reactions.
type Measure<'a> = &'a dyn Fn(&[Wrench<f64>]) -> Vec<f64>;

/// Reactions that differ from `start` by self-stresses and have the least of the first measure; among those, the least
/// of the second, and so on \[T47\].
fn choose(
    start: &[Wrench<f64>],
    stresses: &[Vec<Wrench<f64>>],
    measures: &[Measure<'_>],
) -> Vec<Wrench<f64>> {
    let mut chosen = start.to_vec();
    // Self-stresses that earlier measures do not see, as combinations of all.
    let mut open = DMatrix::identity(stresses.len(), stresses.len());
    for measure in measures {
        let (now, parts) = (measure(&chosen), stresses.iter().map(|s| measure(s)).collect::<Vec<_>>());
        let seen = DMatrix::from_fn(now.len(), stresses.len(), |i, k| parts[k][i]);
        let excess = DVector::from_vec(now);
        let Some((step, unseen)) = least_squares(&(seen * &open), &excess) else { break };
        for (share, stress) in (&open * step).iter().zip(stresses) {
            for (reaction, part) in chosen.iter_mut().zip(stress) {
                *reaction = *reaction - *part * *share;
            }
        }
        open *= unseen;
    }
    chosen
}

/// The least x with the least `|m x - b|`, and an orthonormal basis of what m takes to zero; none where there are no
/// unknowns.
fn least_squares(m: &DMatrix<f64>, b: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    if m.ncols() == 0 {
        return None;
    }
    let Svd { values: sigma, u, v_t } = Svd::of(m)?;
    let rank = sigma.iter().filter(|&&s| s > OPEN).count();
    let mut x = DVector::zeros(m.ncols());
    for k in 0..rank {
        x.axpy(u.column(k).dot(b) / sigma[k], &v_t.row(k).transpose(), 1.0);
    }
    Some((x, v_t.rows(rank, m.ncols() - rank).transpose()))
}

/// What the legs that constrain the platform do to it at o beyond their active forces \[T48\]. No self-stress changes
/// the sum.
fn constraint_wrench(
    mech: &Mechanism,
    places: &[Place<f64>],
    pose: &Pose<f64>,
    reactions: &[Wrench<f64>],
) -> Wrench<f64> {
    let mut sum = Wrench::zero();
    for (i, above) in platform_joints(mech).enumerate().filter(|&(i, _)| constrains(mech, i)) {
        let p = leg::position(&mech.legs[i], pose);
        let active = if mech.legs[i].actuated { reactions[above - 1].force.dot(p.delta) } else { 0.0 };
        sum = sum + reactions[above].moved(places[above].point - pose.o) - leg::row(&p) * active;
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
