//! The mechanism: base, platform, legs and rods as data that every kernel reads, made once and never changed.
//!
//! Nothing here knows a mechanism's name: legs differ by their joints, and joints give the leg its
//! [`Turning`] and its [`Constraint`]s.

use crate::constraint::{self, Constraint, ConstraintKind};
use crate::leg;
use crate::mobility::{self, Mobility};
use crate::spatial::{Mat3, Pose, Vec3, Wrench};
use crate::spec::{ANGLE_TOLERANCE, Axes, BodySpec, Fault, JointKind, JointSpec, LegSpec, RodSpec, Spec};

/// Mass, mass centre and inertia about it, in the axes of the link.
#[derive(Clone, Debug)]
pub struct Body {
    pub mass: f64,
    pub center: Vec3<f64>,
    pub inertia: Mat3<f64>,
}

impl Body {
    fn new(spec: Option<&BodySpec>) -> Self {
        spec.map_or(Body { mass: 0.0, center: Vec3::zero(), inertia: Mat3([Vec3::zero(); 3]) }, |b| Body {
            mass: b.mass,
            center: b.center,
            inertia: Mat3::from_rows(b.inertia),
        })
    }
}

/// The body that an axis is fixed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Base,
    Platform,
}

/// What gives the leg's frame (n, δ, n×δ) its direction n, and so its spin about δ \[T5\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turning {
    /// A universal joint: n is along u×δ.
    Across(Side, Vec3<f64>),
    /// A revolute or fixed joint: n is the axis u itself.
    Along(Side, Vec3<f64>),
    /// S at both ends: no spin; u only gives the frame a direction.
    Free(Vec3<f64>),
}

#[derive(Clone, Debug)]
pub struct Joint {
    pub kind: JointKind,
    /// In the axes of its body, m.
    pub point: Vec3<f64>,
    /// Unit axis in the axes of its body: U, the axis fixed to that body; R, its axis; F, the leg's direction.
    pub axis: Option<Vec3<f64>>,
    /// F: the leg's n.
    pub normal: Option<Vec3<f64>>,
    /// Largest cone angle, rad.
    pub cone_limit: Option<f64>,
    /// Unit axis from which the cone angle is measured, in the axes of the body.
    pub cone_axis: Vec3<f64>,
}

#[derive(Clone, Debug)]
pub struct Leg {
    pub name: String,
    pub actuated: bool,
    pub stroke: [f64; 2],
    pub radius: Option<f64>,
    pub base: Joint,
    pub platform: Joint,
    /// The rod that carries the base joint. Seen from the leg the joint is then U with the rod's line as its axis.
    pub rod: Option<usize>,
    /// Centre measured from B, in leg axes.
    pub cylinder: Body,
    /// Centre measured from b, in leg axes.
    pub piston: Body,
    pub turning: Turning,
}

impl Leg {
    /// Letters of its joints from base to platform, `RPU` for one on a rod.
    #[must_use]
    pub fn letters(&self) -> String {
        let base = if self.rod.is_some() { "R" } else { self.base.kind.letter() };
        format!("{base}P{}", self.platform.kind.letter())
    }
}

#[derive(Clone, Debug)]
pub struct Rod {
    pub name: String,
    pub point: Vec3<f64>,
    /// Unit vector L.
    pub axis: Vec3<f64>,
    pub body: Body,
    /// The leg that the rod's turning is computed from, the first that it carries.
    pub leader: usize,
}

#[derive(Clone, Debug)]
pub struct Load {
    pub wrench: Wrench<f64>,
    pub axes: Axes,
}

#[derive(Clone, Debug)]
pub struct Mechanism {
    pub name: String,
    pub legs: Vec<Leg>,
    pub rods: Vec<Rod>,
    pub platform: Body,
    pub gravity: Vec3<f64>,
    pub efficiency: f64,
    pub linear_damping: f64,
    pub angular_damping: f64,
    pub load: Load,
    pub home: Pose<f64>,
    pub tool_point: Vec3<f64>,
    pub tool_axis: Vec3<f64>,
    /// Every scalar constraint of every leg.
    pub constraints: Vec<Constraint>,
    /// Those of them that are independent at generic poses, in the order of the legs.
    pub independent: Vec<Constraint>,
    /// Root mean square distance of the platform joints from o: what lengths are scaled by, m.
    pub characteristic_length: f64,
    pub mobility: Mobility,
}

/// The largest number of independent constraints: one freedom at least must remain.
pub const MAX_CONSTRAINTS: usize = 5;

/// How far, relative to the characteristic length, the home pose may miss a constraint.
const HOME_TOLERANCE: f64 = 1e-6;

/// Legs shorter than this share of the characteristic length have coincident joints.
const LENGTH_TOLERANCE: f64 = 1e-9;

impl Mechanism {
    /// # Errors
    /// Every fault that the spec shows, with its place.
    pub fn new(spec: &Spec) -> Result<Self, Vec<Fault>> {
        let mut faults = spec.check();
        let sound = faults.is_empty();
        let home = spec
            .home
            .as_ref()
            .map(|h| Pose { rotation: Mat3::from_rotation_vector(h.rotation_vector), o: h.position });
        faults.extend(check_rods(spec));
        faults.extend(check_ends(spec));
        if let Some(home) = &home {
            for (i, leg) in spec.legs.iter().enumerate() {
                if let Some(leg) = leg {
                    faults.extend(check_leg_at_home(spec, &format!("legs.{}", i + 1), leg, home));
                }
            }
        }
        let complete = spec.legs.iter().all(Option::is_some) && spec.rods.iter().all(Option::is_some);
        let (true, true, Some(home)) = (sound && faults.is_empty(), complete, home) else {
            if faults.is_empty() {
                faults.push(Fault::new("mechanism", "a part is missing"));
            }
            return Err(faults);
        };

        let rods: Vec<Rod> =
            spec.rods.iter().flatten().enumerate().map(|(i, rod)| make_rod(spec, i, rod)).collect();
        let legs: Vec<Leg> = spec.legs.iter().flatten().map(|leg| make_leg(leg, &rods, &home)).collect();
        let of_legs = legs.iter().enumerate().flat_map(|(i, leg)| constraint::of_leg(i, leg));
        let of_rods =
            rods.iter().enumerate().flat_map(|(i, rod)| constraint::of_rod(&legs, i, rod.axis, &home));
        let constraints: Vec<Constraint> = of_legs.chain(of_rods).collect();
        let reach: f64 = legs.iter().map(|leg| leg.platform.point.dot(leg.platform.point)).sum();
        let mean_square = reach / mobility::count(legs.len());
        // A platform that is a point has no size of its own; the home lengths then set the scale.
        let characteristic_length = if mean_square > 0.0 {
            mean_square.sqrt()
        } else {
            legs.iter().map(|leg| leg::position(leg, &home).length).fold(0.0, f64::max)
        };

        let mut mech = Mechanism {
            name: spec.name.clone(),
            legs,
            rods,
            platform: Body::new(spec.platform.as_ref()),
            gravity: spec.gravity,
            efficiency: spec.efficiency,
            linear_damping: spec.linear_damping,
            angular_damping: spec.angular_damping,
            load: Load { wrench: Wrench::new(spec.load.force, spec.load.torque), axes: spec.load.axes },
            home,
            tool_point: spec.tool.point,
            tool_axis: spec.tool.axis.unit(),
            constraints,
            independent: Vec::new(),
            characteristic_length,
            mobility: Mobility::default(),
        };
        for (i, c) in mech.constraints.iter().enumerate() {
            let missed = constraint::distance(c, &mech.home, characteristic_length);
            if !(missed <= HOME_TOLERANCE * characteristic_length) {
                faults.push(Fault::new("home", home_message(&mech, i, missed)));
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let (independent, mobility) = mobility::analyse(&mech);
        mech.independent = independent;
        mech.mobility = mobility;
        let actuators = mech.legs.iter().filter(|leg| leg.actuated).count();
        let dof = mech.dof();
        let Mobility { joint_freedoms, closure_rank, passive, .. } = mech.mobility;
        if joint_freedoms != closure_rank + dof + passive {
            faults.push(Fault::new(
                "mechanism",
                format!(
                    "its constraints leave {dof} freedoms, but its loop closures {joint_freedoms} - {closure_rank} - \
                     {passive}; this combination of joints is not modelled"
                ),
            ));
        } else if dof == 0 {
            faults.push(Fault::new("legs", "together they leave the platform no freedom; release a joint"));
        } else if actuators < dof {
            faults.push(Fault::new(
                "legs",
                format!("{actuators} actuated legs for {dof} freedoms; at least {dof} legs must be actuated"),
            ));
        } else if actuators > dof {
            faults.push(Fault::new(
                "legs",
                format!(
                    "{actuators} actuated legs for {dof} freedoms; redundant actuation is not there yet: set `actuated \
                     = false` on {} of them",
                    actuators - dof
                ),
            ));
        }
        if faults.is_empty() { Ok(mech) } else { Err(faults) }
    }

    #[must_use]
    pub fn dof(&self) -> usize {
        6 - self.independent.len()
    }

    /// Legs with an actuator, in the order of the Jacobian's rows.
    pub fn actuated(&self) -> impl Iterator<Item = (usize, &Leg)> {
        self.legs.iter().enumerate().filter(|(_, leg)| leg.actuated)
    }

    /// The largest distance by which `pose` misses an independent constraint, m.
    #[must_use]
    pub fn constraint_distance(&self, pose: &Pose<f64>) -> f64 {
        self.independent
            .iter()
            .map(|c| constraint::distance(c, pose, self.characteristic_length))
            .fold(0.0, |m, d| if d > m || d.is_nan() { d } else { m })
    }
}

fn check_rods(spec: &Spec) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (i, rod) in spec.rods.iter().enumerate() {
        let Some(rod) = rod else { continue };
        let carried = |leg: &&LegSpec| leg.base.rod == Some(i);
        if spec.legs.iter().all(Option::is_some) && !spec.legs.iter().flatten().any(|leg| carried(&leg)) {
            faults
                .push(Fault::new(format!("rods.{}", i + 1), "carries no leg; name it in a leg's base joint"));
        }
        for (j, leg) in spec.legs.iter().enumerate() {
            let Some(leg) = leg.as_ref().filter(carried) else {
                continue;
            };
            let offset = leg.base.point - rod.point;
            let axis = rod.axis.unit();
            let off = (offset - axis * offset.dot(axis)).norm();
            let scale = offset.norm().max(leg.base.point.norm()).max(rod.point.norm());
            if off > ANGLE_TOLERANCE * scale {
                faults.push(Fault::new(
                    format!("legs.{}.base.point", j + 1),
                    format!(
                        "lies {off:.6} m off the line of rod \"{}\"; a rod carries joints on its line",
                        rod.name
                    ),
                ));
            }
            if leg.base.axis.is_some() {
                faults.push(Fault::new(
                    format!("legs.{}.base.axis", j + 1),
                    "an R joint on a rod is square to the rod and to the leg; give no axis",
                ));
            }
        }
    }
    faults
}

/// Two legs with the same two points are one leg twice.
fn check_ends(spec: &Spec) -> Vec<Fault> {
    let mut faults = Vec::new();
    let same = |a: Vec3<f64>, b: Vec3<f64>| (a - b).norm() <= LENGTH_TOLERANCE * a.norm().max(b.norm());
    for (j, second) in spec.legs.iter().enumerate() {
        for (i, first) in spec.legs.iter().enumerate().take(j) {
            let (Some(a), Some(b)) = (first, second) else {
                continue;
            };
            if same(a.base.point, b.base.point) && same(a.platform.point, b.platform.point) {
                faults.push(Fault::new(
                    format!("legs.{}", j + 1),
                    format!("its base point and platform point coincide with those of legs.{}", i + 1),
                ));
            }
        }
    }
    faults
}

/// The relations between axes and leg that a leg's joints need, seen at the home pose.
fn check_leg_at_home(spec: &Spec, place: &str, leg: &LegSpec, home: &Pose<f64>) -> Vec<Fault> {
    let mut faults = Vec::new();
    let e = home.rotation * leg.platform.point;
    let r = home.o + e - leg.base.point;
    if r.norm() <= LENGTH_TOLERANCE * (leg.base.point.norm() + e.norm() + home.o.norm()) || r.norm() == 0.0 {
        faults.push(Fault::new(place, "base point and platform point coincide at the home pose"));
        return faults;
    }
    let delta = r.unit();
    let rod_axis = leg.base.rod.and_then(|i| spec.rods.get(i)).and_then(Option::as_ref).map(|rod| rod.axis);
    let sides = [
        ("base", &leg.base, rod_axis.or(leg.base.axis)),
        ("platform", &leg.platform, leg.platform.axis.map(|a| home.rotation * a)),
    ];
    for (side, joint, axis) in sides {
        let Some(axis) = axis.filter(|a| a.norm() > 0.0).map(Vec3::unit) else {
            continue;
        };
        let (along, across) = (axis.dot(delta), axis.cross(delta).norm());
        let degrees = across.atan2(along).to_degrees();
        let joint_kind = if joint.rod.is_some() { JointKind::Universal } else { joint.joint };
        let (wrong, need) = match joint_kind {
            JointKind::Universal => {
                (across <= ANGLE_TOLERANCE, "the axis of a U joint (or its rod) must not lie along it")
            }
            JointKind::Revolute => {
                (along.abs() > ANGLE_TOLERANCE, "the axis of an R joint must be square to it")
            }
            JointKind::Fixed => (
                across > ANGLE_TOLERANCE || along < 0.0,
                "the axis of an F joint must point along it, from B to b",
            ),
            JointKind::Spherical => (false, ""),
        };
        if wrong {
            faults.push(Fault::new(
                format!("{place}.{side}.axis"),
                format!("makes {degrees:.4} degrees with the leg at the home pose; {need}"),
            ));
        }
    }
    faults
}

fn home_message(mech: &Mechanism, index: usize, missed: f64) -> String {
    let c = &mech.constraints[index];
    let leg = &mech.legs[c.leg];
    let nearest = mobility::project(mech, &mech.home).map_or_else(String::new, |p| {
        let [x, y, z] = p.o.array();
        format!("; a pose nearby that satisfies all of them has its o at [{x:.9}, {y:.9}, {z:.9}] m")
    });
    let meaning = match c.kind {
        ConstraintKind::A => {
            "the leg, its axis in the base and its axis in the platform must lie in one plane"
        }
        ConstraintKind::B => "the leg must be square to its axis in the base",
        ConstraintKind::C => "the leg must be square to its axis in the platform",
        ConstraintKind::D => "its axis in the base must be square to its axis in the platform",
        ConstraintKind::E => "legs on one rod must keep the angle between their planes",
    };
    format!(
        "misses the constraint of leg \"{}\" ({}) by {missed:.3e} m: {meaning}{nearest}",
        leg.name,
        leg.letters()
    )
}

fn make_rod(spec: &Spec, index: usize, rod: &RodSpec) -> Rod {
    let leader = spec.legs.iter().flatten().position(|leg| leg.base.rod == Some(index)).unwrap_or(0);
    Rod {
        name: rod.name.clone(),
        point: rod.point,
        axis: rod.axis.unit(),
        body: Body::new(rod.body.as_ref()),
        leader,
    }
}

fn make_leg(spec: &LegSpec, rods: &[Rod], home: &Pose<f64>) -> Leg {
    let delta = (home.o + home.rotation * spec.platform.point - spec.base.point).unit();
    let rod = spec.base.rod;
    let mut base = make_joint(&spec.base, delta);
    if let Some(rod) = rod {
        base.kind = JointKind::Universal;
        base.axis = Some(rods[rod].axis);
    }
    let platform = make_joint(&spec.platform, home.rotation.transpose_mul(delta));
    let turning = match (turning_of(&base, Side::Base), turning_of(&platform, Side::Platform)) {
        (Some(turning), _) | (None, Some(turning)) => turning,
        (None, None) => Turning::Free(delta.perpendicular()),
    };
    Leg {
        name: spec.name.clone(),
        actuated: spec.actuated,
        stroke: spec.stroke.unwrap_or([0.0, f64::INFINITY]),
        radius: spec.radius,
        base,
        platform,
        rod,
        cylinder: Body::new(spec.cylinder.as_ref()),
        piston: Body::new(spec.piston.as_ref()),
        turning,
    }
}

fn make_joint(spec: &JointSpec, direction: Vec3<f64>) -> Joint {
    let cone_axis = spec.cone.as_ref().and_then(|c| c.axis).map_or(direction, Vec3::unit);
    Joint {
        kind: spec.joint,
        point: spec.point,
        axis: spec.axis.map(Vec3::unit),
        normal: spec.normal.map(Vec3::unit),
        cone_limit: spec.cone.as_ref().map(|c| c.angle),
        cone_axis,
    }
}

fn turning_of(joint: &Joint, side: Side) -> Option<Turning> {
    match joint.kind {
        JointKind::Spherical => None,
        JointKind::Universal => joint.axis.map(|u| Turning::Across(side, u)),
        JointKind::Revolute => joint.axis.map(|u| Turning::Along(side, u)),
        JointKind::Fixed => joint.normal.map(|u| Turning::Along(side, u)),
    }
}
