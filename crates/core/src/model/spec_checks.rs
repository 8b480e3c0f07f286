//! Checks of a description: every fault that one part shows by itself.
//!
//! What parts must be to each other is checked where they are put together, in
//! [`assemble`](crate::assembly::build::assemble).

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use crate::model::drive::DriveKind;
use crate::model::joint::JointKind;
use crate::model::spec::{
    ANGLE_TOLERANCE, BodySpec, Fault, JointSpec, LegSpec, LimitsSpec, SliderSpec, Spec,
};
use crate::number::order::{by_size, largest};
use crate::spatial::{Mat3, Vec3};

impl Spec {
    /// Faults of names, numbers and bodies, which say nothing of the geometry.
    #[must_use]
    pub fn check_values(&self) -> Vec<Fault> {
        let mut faults = Faults::default();
        faults.finite3("dynamics.gravity", self.gravity);
        if !(self.efficiency > 0.0 && self.efficiency <= 1.0) {
            let message = format!("is {}; must be above 0 and at most 1", self.efficiency);
            faults.add("dynamics.efficiency", message);
        }
        for (place, mu) in [("linear", self.linear_damping), ("angular", self.angular_damping)] {
            if !(mu >= 0.0 && mu.is_finite()) {
                faults.add(format!("dynamics.{place}_damping"), format!("is {mu}; must be zero or positive"));
            }
        }
        faults.finite3("load.force", self.load.force);
        faults.finite3("load.torque", self.load.torque);
        faults.finite3("tool.point", self.tool.point);
        faults.axis("tool.axis", self.tool.axis);
        faults.body("platform", self.platform.as_ref());
        for (place, rod) in numbered("rods", &self.rods) {
            faults.body(&place, rod.body.as_ref());
            faults.range(&place, rod.range.filter(|_| self.angles_known));
        }
        for (place, leg) in numbered("legs", &self.legs) {
            faults.leg(&place, leg, self.angles_known);
        }
        faults.limits(self);
        faults.same_names(numbered("legs", &self.legs).map(|(place, leg)| (place, leg.name.as_str())));
        faults.same_names(numbered("rods", &self.rods).map(|(place, rod)| (place, rod.name.as_str())));
        faults.0
    }

    /// Faults of the points and axes, each by itself.
    #[must_use]
    pub fn check_parts(&self) -> Vec<Fault> {
        let mut faults = Faults::default();
        if self.legs.is_empty() {
            faults.add("legs", "there is none; a mechanism needs at least one leg");
        }
        if let Some(home) = &self.home {
            faults.finite3("home.position", home.position);
            faults.finite3("home.rotation_vector", home.rotation_vector);
        }
        for (place, rod) in numbered("rods", &self.rods) {
            faults.finite3(&format!("{place}.point"), rod.point);
            faults.axis(&format!("{place}.axis"), rod.axis);
        }
        for (place, leg) in numbered("legs", &self.legs) {
            for (side, joint) in [("base", &leg.base), ("platform", &leg.platform)] {
                faults.joint(&format!("{place}.{side}"), joint, self.rods.len());
            }
            if leg.platform.rod.is_some() {
                faults.add(format!("{place}.platform.rod"), "a rod carries base joints only");
            }
            if let Some(slider) = &leg.slider {
                faults.axis(&format!("{place}.slider.axis"), slider.axis);
            }
        }
        faults.0
    }
}

/// The parts that could be read, each with its place.
fn numbered<'a, T>(kind: &str, parts: &'a [Option<T>]) -> impl Iterator<Item = (String, &'a T)> {
    parts.iter().enumerate().filter_map(move |(i, part)| Some((format!("{kind}.{}", i + 1), part.as_ref()?)))
}

/// The list of faults while it grows.
#[derive(Default)]
struct Faults(Vec<Fault>);

impl Faults {
    fn add(&mut self, place: impl Into<String>, message: impl Into<String>) {
        self.0.push(Fault::new(place, message));
    }

    fn finite3(&mut self, place: &str, a: Vec3<f64>) -> bool {
        let finite = a.array().iter().all(|c| c.is_finite());
        if !finite {
            self.add(place, format!("is {:?}; each component must be a finite number", a.array()));
        }
        finite
    }

    fn axis(&mut self, place: &str, a: Vec3<f64>) {
        if !self.finite3(place, a) {
            return;
        }
        let length = a.norm();
        if length == 0.0 {
            self.add(place, "is zero; an axis needs a direction");
        } else if !AXIS_LENGTHS.contains(&length) {
            self.add(place, format!("has the length {length:e}; must be between 1e-100 and 1e100"));
        }
    }

    fn leg(&mut self, place: &str, leg: &LegSpec, angles_known: bool) {
        for (side, joint) in [("base", &leg.base), ("platform", &leg.platform)] {
            if let Some(cone) = joint.cone.as_ref().filter(|_| angles_known)
                && !(cone.angle > 0.0 && cone.angle <= std::f64::consts::PI)
            {
                let message = format!("is {} rad; must be above 0 and at most pi", cone.angle);
                self.add(format!("{place}.{side}.cone.angle"), message);
            }
            if joint.range.is_some() && !joint.joint.has_range() {
                let message = format!(
                    "must not be given; only R joints have a range, this is {}",
                    joint.joint.letter()
                );
                self.add(format!("{place}.{side}.range"), message);
            }
            self.range(&format!("{place}.{side}"), joint.range.filter(|_| angles_known));
        }
        if let Some([min, max]) = leg.stroke {
            // A carriage may be on either side of its rail's point; a length is none below zero.
            let DriveKind { least, coordinate_unit: unit, .. } = *leg.drive();
            let need = if least == 0.0 { "0 <= min < max" } else { "min < max" };
            if !(min >= least && min < max && max.is_finite()) {
                let message = format!("min is {min} {unit}, max is {max} {unit}; needs {need}");
                self.add(format!("{place}.stroke"), message);
            }
        }
        if let Some(slider) = &leg.slider {
            self.slider(place, slider);
        }
        if let Some(radius) = leg.radius
            && !(radius > 0.0 && radius.is_finite())
        {
            self.add(format!("{place}.radius"), format!("is {radius} m; must be positive"));
        }
        if let Some([min, max]) = leg.force
            && !(min < max && min.is_finite() && max.is_finite())
        {
            let unit = leg.drive().force_unit;
            let message = format!("min is {min} {unit}, max is {max} {unit}; needs min < max");
            self.add(format!("{place}.force"), message);
        }
        if leg.force.is_some() && !leg.actuated {
            self.add(format!("{place}.force"), "must not be given; a passive leg has no active force");
        }
        for (part, body) in leg.turning_bodies() {
            self.body(&format!("{place}.{part}"), body);
        }
        if leg.base.joint.normal().is_none() && leg.platform.joint.normal().is_none() {
            for (part, body) in leg.turning_bodies() {
                if body.is_some_and(|b| !symmetric_about_leg(b)) {
                    self.add(
                        format!("{place}.{part}"),
                        "a leg with S at both ends spins freely, so its bodies must be symmetric about the \
                         leg: mass centre on it, inertia [[a, 0, 0], [0, b, 0], [0, 0, a]]",
                    );
                }
            }
        }
    }

    /// Strut and carriage of a slider; its axis is one of the parts.
    fn slider(&mut self, place: &str, slider: &SliderSpec) {
        if !(slider.strut > 0.0 && slider.strut.is_finite()) {
            self.add(format!("{place}.slider.strut"), format!("is {} m; must be positive", slider.strut));
        }
        if slider.branch.abs() != 1.0 {
            let message = format!(
                "is {}; must be 1 where the strut leans forward along the axis, seen from the carriage, or \
                 -1 where it leans back",
                slider.branch
            );
            self.add(format!("{place}.slider.branch"), message);
        }
        if let Some(carriage) = &slider.carriage {
            self.finite3(&format!("{place}.carriage.center"), carriage.center);
            if !(carriage.mass > 0.0 && carriage.mass.is_finite()) {
                let message = format!(
                    "is {} kg; must be positive (leave the carriage out to have none)",
                    carriage.mass
                );
                self.add(format!("{place}.carriage.mass"), message);
            }
        }
    }

    /// The range of an angle. The circle has no ends: a rotation of 350 degrees is one of -10.
    fn range(&mut self, place: &str, range: Option<[f64; 2]>) {
        if let Some([min, max]) = range
            && !(min < max && max - min <= TAU)
        {
            let message =
                format!("min is {min} rad, max is {max} rad; needs min < max, at most a full turn apart");
            self.add(format!("{place}.range"), message);
        }
    }

    /// Limits of the whole, and what they need of the legs.
    fn limits(&mut self, spec: &Spec) {
        let LimitsSpec { sigma_min, clearance, joint_reach } = spec.limits;
        if let Some(floor) = sigma_min.filter(|&s| !(s > 0.0 && s.is_finite())) {
            self.add("limits.sigma_min", format!("is {floor}; must be positive"));
        }
        if let Some(gap) = clearance.filter(|&c| !(c >= 0.0 && c.is_finite())) {
            self.add("limits.clearance", format!("is {gap} m; must be zero or positive"));
        }
        if let Some(reach) = joint_reach.filter(|&r| !(r > 0.0 && r.is_finite())) {
            self.add("limits.joint_reach", format!("is {reach} m; must be positive"));
        }
        if joint_reach.is_some() && clearance.is_none() {
            self.add("limits.joint_reach", "has no effect without limits.clearance; give both or none");
        }
        let Some(gap) = clearance else { return };
        for (place, leg) in numbered("legs", &spec.legs) {
            let Some(radius) = leg.radius else {
                self.add(format!("{place}.radius"), "is missing; limits.clearance needs it of every leg");
                continue;
            };
            if let Some(reach) = joint_reach.filter(|&reach| reach <= radius + gap) {
                let message = format!(
                    "is {reach} m; must exceed radius and clearance of leg \"{}\", together {} m, which it \
                     otherwise misses at its own joint in every pose",
                    leg.name,
                    radius + gap
                );
                self.add("limits.joint_reach", message);
            }
        }
    }

    fn joint(&mut self, place: &str, joint: &JointSpec, rods: usize) {
        self.finite3(&format!("{place}.point"), joint.point);
        for (key, axis) in [("axis", joint.axis), ("normal", joint.normal)] {
            if let Some(axis) = axis {
                self.axis(&format!("{place}.{key}"), axis);
            }
        }
        let on_rod = joint.rod.is_some() && joint.joint == JointKind::ON_ROD;
        let (axis, normal) = (joint.joint.has_axis() && !on_rod, joint.joint.has_normal());
        for (key, needed, given) in
            [("axis", axis, joint.axis.is_some()), ("normal", normal, joint.normal.is_some())]
        {
            if needed && !given {
                self.add(
                    format!("{place}.{key}"),
                    format!("is missing; a {} joint needs it", joint.joint.letter()),
                );
            }
        }
        if let Some(rod) = joint.rod {
            if joint.joint != JointKind::ON_ROD {
                self.add(
                    format!("{place}.joint"),
                    format!("is {}; on a rod it must be R", joint.joint.letter()),
                );
            }
            if rod >= rods {
                self.add(format!("{place}.rod"), "names no rod of this mechanism");
            }
        }
        if let (true, Some(axis), Some(normal)) = (joint.joint.has_normal(), joint.axis, joint.normal)
            && axis.dot(normal).abs() > ANGLE_TOLERANCE * axis.norm() * normal.norm()
        {
            self.add(format!("{place}.normal"), "must be perpendicular to the axis");
        }
        if let Some(axis) = joint.cone.as_ref().and_then(|cone| cone.axis) {
            self.axis(&format!("{place}.cone.axis"), axis);
        }
    }

    fn body(&mut self, place: &str, body: Option<&BodySpec>) {
        let Some(body) = body else { return };
        self.finite3(&format!("{place}.center"), body.center);
        if !(body.mass > 0.0 && body.mass.is_finite()) {
            self.add(
                format!("{place}.mass"),
                format!("is {} kg; must be positive (leave the body out to have none)", body.mass),
            );
        }
        if let Some(message) = inertia_fault(&body.inertia) {
            self.add(format!("{place}.inertia"), message);
        }
    }

    fn same_names<'a>(&mut self, names: impl Iterator<Item = (String, &'a str)>) {
        let mut seen: Vec<(String, &str)> = Vec::new();
        for (place, name) in names {
            if let Some((first, _)) = seen.iter().find(|(_, other)| *other == name) {
                self.add(
                    format!("{place}.name"),
                    format!("is \"{name}\", the name of {first}; each needs its own"),
                );
            }
            seen.push((place, name));
        }
    }
}

/// Lengths of axes in a file: any, as long as squares of it are numbers.
const AXIS_LENGTHS: RangeInclusive<f64> = 1e-100..=1e100;

/// Relative slack for inertias, which files give with few digits.
const INERTIA_TOLERANCE: f64 = 1e-9;

fn symmetric_about_leg(body: &BodySpec) -> bool {
    let i = &body.inertia;
    let slack = INERTIA_TOLERANCE * (i[0][0] + i[1][1] + i[2][2]);
    let off = [i[0][1], i[0][2], i[1][2], i[1][0], i[2][0], i[2][1], i[0][0] - i[2][2]];
    body.center.x == 0.0 && body.center.z == 0.0 && off.iter().all(|e| e.abs() <= slack)
}

fn inertia_fault(rows: &[[f64; 3]; 3]) -> Option<String> {
    if rows.iter().flatten().any(|e| !e.is_finite()) {
        return Some("holds a value that is not a finite number".into());
    }
    let scale = largest(rows.iter().flatten().map(|e| e.abs()));
    let transposed = Mat3::from_rows(*rows).transpose().rows();
    let skew = rows
        .iter()
        .flatten()
        .zip(transposed.iter().flatten())
        .any(|(a, b)| (a - b).abs() > INERTIA_TOLERANCE * scale);
    if skew {
        return Some("is not symmetric; the inertia matrix equals its transpose".into());
    }
    let mut principal: Vec<f64> =
        nalgebra::Matrix3::from_fn(|i, j| rows[i][j]).symmetric_eigenvalues().iter().copied().collect();
    principal.sort_by(|&a, &b| by_size(a, b));
    let shown = format!("[{:.6e}, {:.6e}, {:.6e}] kg m^2", principal[0], principal[1], principal[2]);
    if principal[0] <= 0.0 {
        return Some(format!("is not positive definite: its principal moments are {shown}"));
    }
    if principal[0] + principal[1] < principal[2] * (1.0 - INERTIA_TOLERANCE) {
        return Some(format!(
            "belongs to no body: of its principal moments {shown} the largest exceeds the sum of the others"
        ));
    }
    None
}
