//! The mechanism as it is described from outside: plain data in SI units, parts that could not be read left
//! out.

use serde::Deserialize;

use crate::model::drive::{self, DriveKind};
use crate::model::joint::JointKind;
use crate::spatial::Vec3;

/// A fault of a description: its place, such as `legs.3.stroke` (counted from 1, as in the file), and a
/// message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    pub place: String,
    pub message: String,
}

impl Fault {
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Fault { place: place.into(), message: message.into() }
    }
}

/// Largest angle between the leg and `axis` (body axes; the leg's direction at home when absent).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConeSpec {
    pub angle: f64,
    pub axis: Option<Vec3<f64>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSpec {
    pub joint: JointKind,
    pub point: Vec3<f64>,
    pub axis: Option<Vec3<f64>>,
    pub normal: Option<Vec3<f64>>,
    pub rod: Option<usize>,
    pub cone: Option<ConeSpec>,
    /// R: least and greatest rotation since home, rad.
    pub range: Option<[f64; 2]>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    pub mass: f64,
    pub center: Vec3<f64>,
    /// About the mass centre, rows.
    pub inertia: [[f64; 3]; 3],
}

/// The rail of a leg that slides: its foot moves along `axis` (base axes) from the base point, and its strut
/// keeps its length.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliderSpec {
    pub axis: Vec3<f64>,
    /// Of the strut, m.
    pub strut: f64,
    /// The side to which the strut leans: the sign of its direction along the axis.
    pub branch: f64,
    pub carriage: Option<CarriageSpec>,
}

/// Carriage of a slider, which does not rotate: its mass, and the mass centre from the base joint, base axes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarriageSpec {
    pub mass: f64,
    pub center: Vec3<f64>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegSpec {
    pub name: String,
    pub actuated: bool,
    /// None for a telescopic leg.
    #[serde(default)]
    pub slider: Option<SliderSpec>,
    /// Least and greatest length, or place of the carriage on its rail, m.
    pub stroke: Option<[f64; 2]>,
    pub radius: Option<f64>,
    /// Least and greatest active force, N.
    pub force: Option<[f64; 2]>,
    pub base: JointSpec,
    pub platform: JointSpec,
    pub cylinder: Option<BodySpec>,
    /// Of a slider: the strut.
    pub piston: Option<BodySpec>,
}

impl LegSpec {
    /// Kind of its drive.
    pub(super) fn drive(&self) -> &'static DriveKind {
        match self.slider {
            None => &drive::TELESCOPE,
            Some(_) => &drive::SLIDER,
        }
    }

    /// The bodies that rotate with the leg, and their keys in the file.
    pub(super) fn turning_bodies(&self) -> Vec<(&'static str, Option<&BodySpec>)> {
        let DriveKind { links: [first, second], own_numbers, .. } = self.drive();
        let turns = own_numbers.is_none().then_some((*first, self.cylinder.as_ref()));
        turns.into_iter().chain([(*second, self.piston.as_ref())]).collect()
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodSpec {
    pub name: String,
    pub point: Vec3<f64>,
    pub axis: Vec3<f64>,
    pub body: Option<BodySpec>,
    /// Least and greatest rotation about its line since home, rad.
    pub range: Option<[f64; 2]>,
}

/// The body whose axes numbers are given in, or that something is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axes {
    Base,
    Platform,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadSpec {
    pub force: Vec3<f64>,
    pub torque: Vec3<f64>,
    pub axes: Axes,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HomeSpec {
    pub position: Vec3<f64>,
    pub rotation_vector: Vec3<f64>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolSpec {
    pub point: Vec3<f64>,
    pub axis: Vec3<f64>,
}

/// Limits of the mechanism as a whole.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsSpec {
    /// Floor for the smallest singular value, a pure number.
    pub sigma_min: Option<f64>,
    /// Least distance between the surfaces of struts, and between strut and platform, m.
    pub clearance: Option<f64>,
    /// Length of strut at its joint that does not count for clearances, m.
    pub joint_reach: Option<f64>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    pub name: String,
    /// False where the unit of angles could not be read, so that the geometry cannot be judged.
    pub angles_known: bool,
    pub legs: Vec<Option<LegSpec>>,
    pub rods: Vec<Option<RodSpec>>,
    pub platform: Option<BodySpec>,
    pub gravity: Vec3<f64>,
    pub efficiency: f64,
    pub linear_damping: f64,
    pub angular_damping: f64,
    pub load: LoadSpec,
    pub home: Option<HomeSpec>,
    pub tool: ToolSpec,
    #[serde(default)]
    pub limits: LimitsSpec,
}

impl Spec {
    /// # Errors
    /// The one fault that keeps the text from being read as a spec at all.
    pub fn from_json(text: &str) -> Result<Self, Vec<Fault>> {
        serde_json::from_str(text).map_err(|e| vec![Fault::new("mechanism", e.to_string())])
    }
}

/// Points nearer than this share of a mechanism's lengths coincide.
pub const LENGTH_TOLERANCE: f64 = 1e-9;

/// Sine of the largest angle by which axes given in a file may miss their relation.
pub const ANGLE_TOLERANCE: f64 = 1e-6;
