//! Construction of a mechanism from its description. Relations between the parts are checked here, on all
//! parts that could be read, and every fault is reported at once.

use crate::assembly::drives;
use crate::assembly::universal_legs;
use crate::kinematics::constraint;
use crate::kinematics::leg;
use crate::limits::margins;
use crate::mobility::degrees_of_freedom;
use crate::model::joint::{Joint, JointKind, Normal};
use crate::model::mechanism::{
    Body, Constraint, ConstraintKind, Direction, Leg, Load, Mechanism, Mobility, Rod, Turning,
};
use crate::model::spec::Axes;
use crate::model::spec::{
    ANGLE_TOLERANCE, BodySpec, Fault, JointSpec, LENGTH_TOLERANCE, LegSpec, RodSpec, Spec,
};
use crate::number::order::{larger, largest};
use crate::number::real::count;
use crate::number::real::{Constant, Scalar, Trig};
use crate::spatial::{Mat3, Pose, Vec3, Wrench};

/// How far, relative to the characteristic length, the home pose may miss a constraint.
const HOME_TOLERANCE: f64 = 1e-6;

/// The shortest leg, m: below it the unit of lengths is wrong, and constraints in metres drown in rounding.
const SHORTEST_LEG: f64 = 1e-6;

/// The mechanism that a spec describes.
///
/// # Errors
/// Every fault that the spec shows, with its place; none if the spec only lacks parts that its reader has
/// reported.
pub fn assemble(spec: &Spec) -> Result<Mechanism, Vec<Fault>> {
    let (values, parts) = (spec.check_values(), spec.check_parts());
    let home = spec
        .home
        .as_ref()
        .map(|h| Pose { rotation: Mat3::from_rotation_vector(h.rotation_vector), o: h.position });
    let relations = if spec.angles_known { check_relations(spec, home.as_ref()) } else { vec![] };
    let complete = spec.legs.iter().all(Option::is_some) && spec.rods.iter().all(Option::is_some);
    let geometry_sound = parts.is_empty() && relations.is_empty() && complete && spec.angles_known;
    let mut faults = [values, parts, relations].concat();
    let (true, Some(home)) = (geometry_sound, home) else { return Err(faults) };
    let mut mech = build(spec, home);
    let off_home = check_home(&mech);
    // Where a number is wrong the machine may be none that ranks tell anything about.
    if off_home.is_empty() && (faults.is_empty() || degrees_of_freedom::is_possible(&mech, &mech.home)) {
        let (independent, idle, mobility) = degrees_of_freedom::analyse(&mech);
        (mech.independent, mech.idle) = (independent, idle);
        mech.mobility = mobility;
        mech.limits = margins::of(&mech, spec);
        faults.extend(check_freedoms(&mech));
    }
    faults.extend(off_home);
    if faults.is_empty() { Ok(mech) } else { Err(faults) }
}

/// The mechanism without its mobility, which needs ranks.
fn build(spec: &Spec, home: Pose<f64>) -> Mechanism {
    let rods: Vec<Rod> =
        spec.rods.iter().flatten().enumerate().map(|(i, rod)| make_rod(spec, i, rod)).collect();
    let legs: Vec<Leg> = spec.legs.iter().flatten().map(|leg| make_leg(leg, &rods, &home)).collect();
    let constraints = constraints(&legs, &rods, &home);
    let reach: f64 = legs.iter().map(|leg| leg.platform.point.dot(leg.platform.point)).sum();
    let mean_square = reach / count(legs.len());
    // A platform that is a point has no size of its own; the home lengths then set the scale.
    let longest = largest(legs.iter().map(|leg| leg::position(leg, &home).length));
    let is_point = mean_square.sqrt() <= LENGTH_TOLERANCE * longest;
    let characteristic_length = if is_point { longest } else { mean_square.sqrt() };

    Mechanism {
        name: spec.name.clone(),
        directions: Direction::of_all(&legs),
        legs,
        rods,
        platform: make_body(spec.platform.as_ref()),
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
        idle: Vec::new(),
        characteristic_length,
        mobility: Mobility::default(),
        limits: Vec::new(),
    }
}

/// All constraints of legs and rods.
pub(crate) fn constraints<S: Trig + Constant<S>>(
    legs: &[Leg<S>],
    rods: &[Rod<S>],
    home: &Pose<f64>,
) -> Vec<Constraint<S>> {
    let of_legs = legs.iter().enumerate().flat_map(|(i, leg)| constraint::of_leg(i, leg));
    let of_rods = rods.iter().enumerate().flat_map(|(i, rod)| constraint::of_rod(legs, i, rod.axis, home));
    of_legs.chain(of_rods).collect()
}

fn check_home(mech: &Mechanism) -> Vec<Fault> {
    let missed = |c: &Constraint| constraint::distance(c, &mech.home, mech.characteristic_length);
    let off = |c: &&Constraint| !(missed(c) <= HOME_TOLERANCE * mech.characteristic_length);
    mech.constraints
        .iter()
        .filter(off)
        .map(|c| Fault::new("home", home_message(mech, c, missed(c))))
        .collect()
}

/// Whether actuators can control the degrees of freedom, and whether the two ways to count degrees of freedom
/// agree.
fn check_freedoms(mech: &Mechanism) -> Option<Fault> {
    let (actuators, dof) = (mech.actuated().count(), mech.dof());
    let Mobility { joint_freedoms, closure_rank, passive, .. } = mech.mobility;
    let held = universal_legs::about(mech).map_or_else(String::new, |about| format!(". {about}"));
    if joint_freedoms != closure_rank + dof + passive {
        let message = format!(
            "its constraints leave {dof} degrees of freedom, but its loop closures {joint_freedoms} - \
             {closure_rank} - {passive}; this combination of joints is not modelled{held}"
        );
        return Some(Fault::new("mechanism", message));
    }
    let idle = mech.idle.len();
    if dof == 0 {
        let message = "together they leave the platform no degree of freedom; release a joint";
        return Some(Fault::new("legs", format!("{message}{held}")));
    }
    if idle == dof {
        let all = if dof == 1 {
            "the one degree of freedom of the platform is".to_owned()
        } else {
            format!("all {dof} degrees of freedom of the platform are")
        };
        let message = format!("{all} idle, so that no leg moves it; move a joint off the others");
        return Some(Fault::new("legs", message));
    }
    let apart = match idle {
        0 => String::new(),
        1 => ", one of them idle".to_owned(),
        _ => format!(", {idle} of them idle"),
    };
    let needed = dof - idle;
    let message = format!(
        "{actuators} actuated legs for {dof} degrees of freedom{apart}; at least {needed} legs must be \
         actuated"
    );
    (actuators < needed).then(|| Fault::new("legs", message))
}

/// Faults in the relations between parts.
fn check_relations(spec: &Spec, home: Option<&Pose<f64>>) -> Vec<Fault> {
    let mut faults = check_rods(spec);
    faults.extend(check_ends(spec));
    for (i, leg) in spec.legs.iter().enumerate() {
        if let (Some(leg), Some(home)) = (leg, home) {
            faults.extend(check_leg_at_home(spec, &format!("legs.{}", i + 1), leg, home));
        }
    }
    faults
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
            let scale = largest([offset.norm(), leg.base.point.norm(), rod.point.norm()]);
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
                    "an R joint on a rod is perpendicular to the rod and to the leg; give no axis",
                ));
            }
        }
    }
    faults
}

/// Two legs with the same two points are one leg twice.
fn check_ends(spec: &Spec) -> Vec<Fault> {
    let mut faults = Vec::new();
    let same = |a: Vec3<f64>, b: Vec3<f64>| (a - b).norm() <= LENGTH_TOLERANCE * larger(a.norm(), b.norm());
    for (j, second) in spec.legs.iter().enumerate() {
        for (i, first) in spec.legs.iter().enumerate().take(j) {
            let (Some(a), Some(b)) = (first, second) else {
                continue;
            };
            if same(a.base.point, b.base.point) && same(a.platform.point, b.platform.point) {
                // Once is enough: in a file with its legs many times, each would coincide with many.
                faults.push(Fault::new(
                    format!("legs.{}", j + 1),
                    format!("its base point and platform point coincide with those of legs.{}", i + 1),
                ));
                break;
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
    let Some(r) = drives::check(place, leg, r, &mut faults) else { return faults };
    if r.norm() <= LENGTH_TOLERANCE * (leg.base.point.norm() + e.norm() + home.o.norm()) || r.norm() == 0.0 {
        faults.push(Fault::new(place, "base point and platform point coincide at the home pose"));
        return faults;
    }
    if r.norm() < SHORTEST_LEG {
        let message = format!(
            "is {:.3e} m long at the home pose, less than {SHORTEST_LEG:e} m; check the unit of length",
            r.norm()
        );
        faults.push(Fault::new(place, message));
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
        let kind = if joint.rod.is_some() { JointKind::WITH_ROD } else { joint.joint };
        if let Some(need) = kind.misplaced(along, across, ANGLE_TOLERANCE) {
            let key = if joint.rod.is_some() { "rod" } else { "axis" };
            faults.push(Fault::new(
                format!("{place}.{side}.{key}"),
                format!(
                    "makes {degrees:.4} degrees with the leg at the home pose; {need}: correct the axis, the \
                     points or the home pose"
                ),
            ));
        }
    }
    faults
}

fn home_message(mech: &Mechanism, c: &Constraint, missed: f64) -> String {
    let leg = &mech.legs[c.leg];
    let close = |p: &Pose<f64>| (p.o - mech.home.o).norm() <= mech.characteristic_length;
    // The angle of kind E is that of the home pose, whichever it is.
    let others: Vec<Constraint> =
        mech.constraints.iter().filter(|c| c.kind != ConstraintKind::E).copied().collect();
    let found = degrees_of_freedom::project(&others, mech.characteristic_length, &mech.home);
    let nearest = found.filter(close).map_or_else(String::new, |p| {
        let ([x, y, z], [u, v, w]) = (p.o.array(), p.rotation.rotation_vector().array());
        format!(
            "; a pose nearby that satisfies all constraints has position [{x:.9}, {y:.9}, {z:.9}] m and \
             rotation_vector [{u:.9}, {v:.9}, {w:.9}] rad"
        )
    });
    let meaning = match c.kind {
        ConstraintKind::A => {
            "the leg, its axis in the base and its axis in the platform must lie in one plane"
        }
        ConstraintKind::B => "the leg must be perpendicular to its axis in the base",
        ConstraintKind::C => "the leg must be perpendicular to its axis in the platform",
        ConstraintKind::D => "its axis in the base must be perpendicular to its axis in the platform",
        ConstraintKind::E => "legs on one rod must keep the angle between their planes",
    };
    let instead = universal_legs::instead(leg).map_or_else(String::new, |instead| format!("; {instead}"));
    let off = match c.kind {
        ConstraintKind::D => {
            format!(
                "{:.4} degrees",
                constraint::value(c, &mech.home).clamp(-1.0, 1.0).asin().to_degrees().abs()
            )
        }
        _ => format!("{missed:.3e} m"),
    };
    format!(
        "misses the constraint of leg \"{}\" ({}) by {off}: {meaning}{instead}{nearest}",
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
        body: make_body(rod.body.as_ref()),
        leader,
    }
}

fn make_leg(spec: &LegSpec, rods: &[Rod], home: &Pose<f64>) -> Leg {
    let r = home.o + home.rotation * spec.platform.point - spec.base.point;
    let delta = drives::strut_at_home(spec, r).unwrap_or(r).unit();
    let rod = spec.base.rod;
    let mut base = make_joint(&spec.base, delta);
    if let Some(rod) = rod {
        base.kind = JointKind::WITH_ROD;
        base.axis = Some(rods[rod].axis);
    }
    let platform = make_joint(&spec.platform, home.rotation.transpose_mul(delta));
    let turning = turning(&base, &platform).unwrap_or_else(|| Turning::Free(delta.perpendicular()));
    Leg {
        name: spec.name.clone(),
        actuated: spec.actuated,
        drive: drives::make(spec),
        radius: spec.radius,
        base,
        platform,
        rod,
        cylinder: drives::own_body(spec).unwrap_or_else(|| make_body(spec.cylinder.as_ref())),
        piston: make_body(spec.piston.as_ref()),
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
        cone_axis,
    }
}

/// Joint axis that determines a leg's normal: its joint on the base, else that on the platform; none for S at
/// both ends.
pub(crate) fn turning<S: Scalar>(base: &Joint<S>, platform: &Joint<S>) -> Option<Turning<S>> {
    turning_of(base, Axes::Base).or_else(|| turning_of(platform, Axes::Platform))
}

fn turning_of<S: Scalar>(joint: &Joint<S>, side: Axes) -> Option<Turning<S>> {
    joint.normal().map(|normal| match normal {
        Normal::Across(u) => Turning::Across(side, u),
        Normal::Along(u) => Turning::Along(side, u),
    })
}

fn make_body(spec: Option<&BodySpec>) -> Body {
    spec.map_or(Body::NONE, |b| Body { mass: b.mass, center: b.center, inertia: Mat3::from_rows(b.inertia) })
}
