//! Drives: what the actuator of a leg moves, as data, and the facts that belong to each kind.
//!
//! How a drive moves its leg is in [`kinematics::drive`](crate::kinematics::drive).

use crate::number::real::Real;
use crate::spatial::Vec3;

/// Kind of a leg's prismatic joint, actuated or passive \[T67\].
#[derive(Clone, Copy, Debug)]
pub enum Drive<S = f64> {
    Telescope(Telescope),
    Slider(Slider<S>),
}

/// The strut's far end, along the strut: the joint's coordinate is the length ℓ.
#[derive(Clone, Copy, Debug)]
pub struct Telescope;

/// The strut's foot, along a rail fixed in the base: the coordinate is its place q from B. The strut is
/// rigid.
#[derive(Clone, Copy, Debug)]
pub struct Slider<S = f64> {
    /// Unit vector a, base axes.
    pub rail: Vec3<S>,
    /// c, m.
    pub strut: S,
    /// The sign of δ·a: one of the two places from which a strut reaches b.
    pub branch: f64,
}

/// Facts of a kind of drive.
#[derive(Clone, Copy, Debug)]
pub struct DriveKind {
    /// Of its joint.
    pub letter: &'static str,
    /// Words for the two links of the leg, from the base on, as in a mechanism file.
    pub links: [&'static str; 2],
    /// Units of its coordinate and of its force.
    pub coordinate_unit: &'static str,
    pub force_unit: &'static str,
    /// Component, of a reaction in its joint's axes, that is its force: free where the joint is passive.
    pub active: usize,
    /// The least coordinate that there can be.
    pub least: f64,
    /// Which of the ten numbers of the first link's body have an effect; none where it rotates with the leg
    /// and all may have.
    pub own_numbers: Option<&'static [&'static [usize]]>,
    /// Parts of its geometry, in order.
    pub parts: &'static [Part],
}

/// A vector or a number of the geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vector {
    Point,
    /// A unit vector: a change along it is none.
    Axis,
    /// The unit normal of an F joint: a change along it is none.
    Normal,
    /// One number.
    Length,
}

/// A part of a drive's geometry.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub name: &'static str,
    pub vector: Vector,
}

pub const TELESCOPE: DriveKind = DriveKind {
    letter: "P",
    links: ["cylinder", "piston"],
    coordinate_unit: "m",
    force_unit: "N",
    active: 1,
    least: 0.0,
    own_numbers: None,
    parts: &[],
};

pub const SLIDER: DriveKind = DriveKind {
    letter: "P",
    links: ["carriage", "strut"],
    coordinate_unit: "m",
    force_unit: "N",
    active: 1,
    least: f64::MIN,
    // It does not rotate and is held by a rail: its mass.
    own_numbers: Some(&[&[0]]),
    parts: &[Part { name: "rail", vector: Vector::Axis }, Part { name: "strut", vector: Vector::Length }],
};

impl<S> Drive<S> {
    #[must_use]
    pub const fn kind(&self) -> &'static DriveKind {
        match self {
            Drive::Telescope(_) => &TELESCOPE,
            Drive::Slider(_) => &SLIDER,
        }
    }

    /// Whether it moves the strut's foot, not its far end. Its joint then lies below the base joint, between
    /// the base and the first link, which does not rotate with the leg; the strut keeps its length, and there
    /// may be no place or two from which it reaches b.
    #[must_use]
    #[inline(always)]
    pub const fn moves_foot(&self) -> bool {
        match self {
            Drive::Telescope(_) => false,
            Drive::Slider(_) => true,
        }
    }

    /// Links joined by the base joint, and by the drive's joint: of the ground and the leg's two links.
    #[must_use]
    pub fn between<L: Clone>(&self, [ground, first, second]: [L; 3]) -> [[L; 2]; 2] {
        let (lower, upper) = ([ground, first.clone()], [first, second]);
        if self.moves_foot() { [upper, lower] } else { [lower, upper] }
    }
}

impl<S: Real> Drive<S> {
    /// The drive with other numbers, each from the number of the part that it belongs to and its own value.
    pub fn with<R>(
        &self,
        axis: impl Fn(usize, Vec3<S>) -> Vec3<R>,
        length: impl Fn(usize, S) -> R,
    ) -> Drive<R> {
        match *self {
            Drive::Telescope(telescope) => Drive::Telescope(telescope),
            Drive::Slider(Slider { rail, strut, branch }) => {
                Drive::Slider(Slider { rail: axis(0, rail), strut: length(1, strut), branch })
            }
        }
    }

    /// All numbers of its parts.
    pub fn numbers(&self) -> Vec<S> {
        match *self {
            Drive::Telescope(_) => vec![],
            Drive::Slider(Slider { rail: Vec3 { x, y, z }, strut, .. }) => vec![x, y, z, strut],
        }
    }
}
