//! Joints at the ends of a leg: their kinds, and all that follows from a kind.

use serde::Deserialize;

use crate::number::real::Real;
use crate::spatial::Vec3;

/// The kinds, by their letters:
///
/// | | degrees of freedom | axis, in its body | what it does to the leg's normal n \[T5\] |
/// |---|---|---|---|
/// | S | 3 | none | leaves it free |
/// | U | 2, one on a rod | that fixed to the body | holds it perpendicular to the axis |
/// | R | 1 | its own | holds it along the axis |
/// | F | 0 | the leg's direction δ, and its normal n | holds it along the normal, and δ with it |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum JointKind {
    #[serde(rename = "S")]
    Spherical,
    #[serde(rename = "U")]
    Universal,
    #[serde(rename = "R")]
    Revolute,
    #[serde(rename = "F")]
    Fixed,
}

/// Effect of a joint on the normal n of its leg, with an axis of its body if wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normal<A = ()> {
    /// Perpendicular to the axis.
    Across(A),
    /// Along the axis.
    Along(A),
}

impl JointKind {
    pub const ALL: [Self; 4] =
        [JointKind::Spherical, JointKind::Universal, JointKind::Revolute, JointKind::Fixed];

    /// The kind of a base joint that a rod carries, and what it makes of rod and leg together, seen from the
    /// leg.
    pub const ON_ROD: Self = JointKind::Revolute;
    pub const WITH_ROD: Self = JointKind::Universal;

    #[must_use]
    pub const fn letter(self) -> &'static str {
        match self {
            JointKind::Spherical => "S",
            JointKind::Universal => "U",
            JointKind::Revolute => "R",
            JointKind::Fixed => "F",
        }
    }

    /// Components of a reaction in joint axes, force before torque, that it cannot carry \[T44\].
    #[must_use]
    pub const fn free(self) -> &'static [usize] {
        match self {
            JointKind::Spherical => &[3, 4, 5],
            JointKind::Universal => &[3, 4],
            JointKind::Revolute => &[3],
            JointKind::Fixed => &[],
        }
    }

    #[must_use]
    pub const fn freedoms(self) -> usize {
        self.free().len()
    }

    /// Whether the link is one with the body.
    #[must_use]
    pub fn is_fixed(self) -> bool {
        self.freedoms() == 0
    }

    /// Effect on the leg's normal, if any.
    #[must_use]
    #[inline(always)]
    pub const fn normal(self) -> Option<Normal> {
        match self {
            JointKind::Spherical => None,
            JointKind::Universal => Some(Normal::Across(())),
            JointKind::Revolute | JointKind::Fixed => Some(Normal::Along(())),
        }
    }

    /// Whether it has an axis of its own, and a normal; none has one on a rod.
    #[must_use]
    pub fn has_axis(self) -> bool {
        self.normal().is_some()
    }

    #[must_use]
    pub fn has_normal(self) -> bool {
        self.is_fixed()
    }

    /// Whether its rotation may have a range.
    #[must_use]
    pub fn has_range(self) -> bool {
        self == JointKind::Revolute
    }

    /// How many angles are told of it: that about its axis, then that about n.
    #[must_use]
    #[inline(always)]
    pub const fn angles(self) -> usize {
        match self {
            JointKind::Universal => 2,
            JointKind::Revolute => 1,
            JointKind::Spherical | JointKind::Fixed => 0,
        }
    }

    /// Directions that it rotates about, given its axis and the leg's normal.
    #[must_use]
    pub fn turns(self, axis: Vec3<f64>, n: Vec3<f64>) -> Vec<Vec3<f64>> {
        match self {
            JointKind::Spherical => vec![Vec3::X, Vec3::Y, Vec3::Z],
            JointKind::Universal => vec![axis, n],
            JointKind::Revolute => vec![axis],
            JointKind::Fixed => vec![],
        }
    }

    /// Fault of its axis against a leg of direction δ, to sines below `tolerance`, from the cosine `along`
    /// and the sine `across` of their angle.
    #[must_use]
    pub fn misplaced(self, along: f64, across: f64, tolerance: f64) -> Option<&'static str> {
        let (wrong, need) = match self {
            JointKind::Spherical => (false, ""),
            JointKind::Universal => {
                (across <= tolerance, "the axis of a U joint (or its rod) must not lie along it")
            }
            JointKind::Revolute => {
                (along.abs() > tolerance, "the axis of an R joint must be perpendicular to it")
            }
            JointKind::Fixed => {
                (across > tolerance || along < 0.0, "the axis of an F joint must point along it, from B to b")
            }
        };
        wrong.then_some(need)
    }
}

#[derive(Clone, Debug)]
pub struct Joint<S = f64> {
    pub kind: JointKind,
    /// In the axes of its body, m.
    pub point: Vec3<S>,
    /// Unit axis in the axes of its body: U, the axis fixed to that body; R, its axis; F, the leg's
    /// direction.
    pub axis: Option<Vec3<S>>,
    /// F: the leg's n.
    pub normal: Option<Vec3<S>>,
    /// Unit axis from which the cone angle is measured, in the axes of the body.
    pub cone_axis: Vec3<f64>,
}

impl<S: Copy> Joint<S> {
    /// F: the leg's direction, from B to b.
    #[must_use]
    pub fn direction(&self) -> Option<Vec3<S>> {
        if self.kind.is_fixed() { self.axis } else { None }
    }

    /// Effect on the leg's normal, with the axis for it.
    #[inline(always)]
    pub fn normal(&self) -> Option<Normal<Vec3<S>>> {
        let axis = if let JointKind::Fixed = self.kind { self.normal } else { self.axis };
        match self.kind.normal()? {
            Normal::Across(()) => axis.map(Normal::Across),
            Normal::Along(()) => axis.map(Normal::Along),
        }
    }
}

impl<S: Real> Joint<S> {
    /// Axes of the body that the leg is perpendicular to: R, its axis; F, which holds δ, two of them.
    pub fn square_to_leg(&self) -> Vec<Vec3<S>> {
        match (self.kind, self.axis, self.normal) {
            (JointKind::Revolute, Some(a), _) => vec![a],
            (JointKind::Fixed, Some(d), Some(n)) => vec![n, n.cross(d)],
            _ => vec![],
        }
    }
}
