//! Geometric parameters: points and axes of joints and rods; and mechanisms that vary with one of them, by
//! dual numbers \[T56\].

use crate::assembly::build;
use crate::kinematics::idle;
use crate::model::drive::Vector;
use crate::model::joint::Joint;
use crate::model::mechanism::{Direction, Leg, Mechanism, Rod, Turning};
use crate::model::spec::Axes;
use crate::number::real::Dual;
use crate::spatial::Vec3;

/// Owner of points and axes: a rod, or a joint of a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterSite {
    Joint(usize, Axes),
    /// A leg's drive, and which of its parts.
    Drive(usize, usize),
    Rod(usize),
}

/// One component of a point or an axis, in the axes of its body.
#[derive(Clone, Copy, Debug)]
pub struct GeometricParameter {
    pub place: ParameterSite,
    pub vector: Vector,
    pub component: usize,
}

impl GeometricParameter {
    /// `leg 1 base point_x`, `leg 1 rail axis_x`, `leg 1 strut length`, `rod L axis_z`.
    #[must_use]
    pub fn name(&self, mech: &Mechanism) -> String {
        let place = match self.place {
            ParameterSite::Joint(i, Axes::Base) => format!("leg {} base", mech.legs[i].name),
            ParameterSite::Joint(i, Axes::Platform) => format!("leg {} platform", mech.legs[i].name),
            ParameterSite::Drive(i, part) => {
                let Leg { name, drive, .. } = &mech.legs[i];
                format!("leg {name} {}", drive.kind().parts[part].name)
            }
            ParameterSite::Rod(i) => format!("rod {}", mech.rods[i].name),
        };
        let vector = match self.vector {
            Vector::Point => "point",
            Vector::Axis => "axis",
            Vector::Normal => "normal",
            Vector::Length => return format!("{place} length"),
        };
        format!("{place} {vector}_{}", ["x", "y", "z"][self.component])
    }
}

/// All of them in order: base joint and platform joint of each leg and the parts of its drive, as rail and
/// strut; rods. A leg on a rod has the rod's axis, no own.
#[must_use]
pub fn parameters(mech: &Mechanism) -> Vec<GeometricParameter> {
    let joints = mech.legs.iter().enumerate().flat_map(|(i, leg)| {
        let of_joint = move |(side, joint, rod): (Axes, &Joint, Option<usize>)| {
            let (axis, normal) = (joint.kind.has_axis() && rod.is_none(), joint.kind.has_normal());
            let own = [axis.then_some(Vector::Axis), normal.then_some(Vector::Normal)];
            [Some(Vector::Point)]
                .into_iter()
                .chain(own)
                .flatten()
                .map(move |v| (ParameterSite::Joint(i, side), v))
        };
        let joints = [(Axes::Base, &leg.base, leg.rod), (Axes::Platform, &leg.platform, None)];
        let parts = leg.drive.kind().parts.iter().enumerate();
        let drive = parts.map(move |(k, part)| (ParameterSite::Drive(i, k), part.vector));
        joints.into_iter().flat_map(of_joint).chain(drive)
    });
    let of_rod = |i: usize| [Vector::Point, Vector::Axis].map(|vector| (ParameterSite::Rod(i), vector));
    let vectors = joints.chain((0..mech.rods.len()).flat_map(of_rod));
    let count = |vector: Vector| if vector == Vector::Length { 1 } else { 3 };
    vectors
        .flat_map(|(place, vector)| {
            (0..count(vector)).map(move |component| GeometricParameter { place, vector, component })
        })
        .collect()
}

/// The mechanism with the derivative of all its parts by one of its numbers, zero for none. The home pose is
/// kept, and with it the angle between legs on one rod.
#[must_use]
pub fn varied(mech: &Mechanism, by: Option<&GeometricParameter>) -> Mechanism<Dual<f64>> {
    let lift = |place: ParameterSite, vector: Vector, a: Vec3<f64>| -> Vec3<Dual<f64>> {
        let Some(by) = by.filter(|by| (place, vector) == (by.place, by.vector)) else {
            return Vec3::lift(a);
        };
        let step = [Vec3::X, Vec3::Y, Vec3::Z][by.component];
        a.with_rate(if vector == Vector::Point { step } else { step - a * a.dot(step) })
    };
    let joint = |place: ParameterSite, joint: &Joint| Joint {
        kind: joint.kind,
        point: lift(place, Vector::Point, joint.point),
        axis: joint.axis.map(|a| lift(place, Vector::Axis, a)),
        normal: joint.normal.map(|a| lift(place, Vector::Normal, a)),
        cone_axis: joint.cone_axis,
    };
    let rod = |(i, rod): (usize, &Rod)| Rod {
        name: rod.name.clone(),
        point: lift(ParameterSite::Rod(i), Vector::Point, rod.point),
        axis: lift(ParameterSite::Rod(i), Vector::Axis, rod.axis),
        body: rod.body.clone(),
        leader: rod.leader,
    };
    let rods: Vec<_> = mech.rods.iter().enumerate().map(rod).collect();
    let leg = |(i, leg): (usize, &Leg)| {
        let mut base = joint(ParameterSite::Joint(i, Axes::Base), &leg.base);
        if let Some(rod) = leg.rod {
            base.axis = Some(rods[rod].axis);
        }
        let platform = joint(ParameterSite::Joint(i, Axes::Platform), &leg.platform);
        let turning = build::turning(&base, &platform);
        let drive = leg.drive.with(
            |part, axis| lift(ParameterSite::Drive(i, part), Vector::Axis, axis),
            |part, length| {
                let varies = by.is_some_and(|by| by.place == ParameterSite::Drive(i, part));
                Dual::new(length, f64::from(u8::from(varies)))
            },
        );
        Leg {
            name: leg.name.clone(),
            actuated: leg.actuated,
            drive,
            radius: leg.radius,
            rod: leg.rod,
            cylinder: leg.cylinder.clone(),
            piston: leg.piston.clone(),
            turning: turning.unwrap_or_else(|| Turning::Free(Vec3::lift(leg.turning.axis()))),
            base,
            platform,
        }
    };
    let legs: Vec<_> = mech.legs.iter().enumerate().map(leg).collect();
    let constraints = build::constraints(&legs, &rods, &mech.home);
    let rows = constraints.iter().zip(&mech.mobility.constraints);
    Mechanism {
        name: mech.name.clone(),
        platform: mech.platform.clone(),
        gravity: mech.gravity,
        efficiency: mech.efficiency,
        linear_damping: mech.linear_damping,
        angular_damping: mech.angular_damping,
        load: mech.load.clone(),
        home: mech.home,
        tool_point: mech.tool_point,
        tool_axis: mech.tool_axis,
        independent: rows.filter(|(_, row)| row.independent).map(|(c, _)| *c).collect(),
        characteristic_length: mech.characteristic_length,
        mobility: mech.mobility.clone(),
        limits: mech.limits.clone(),
        idle: mech.idle.iter().map(|idle| idle::varied(idle, &legs)).collect(),
        directions: Direction::of_all(&legs),
        legs,
        rods,
        constraints,
    }
}
