//! The limits of a mechanism as data: what each measures, and its bound \[T35\].

use std::sync::Arc;

use crate::model::spec::Axes;
use crate::spatial::Vec3;
use crate::spatial::distance::Hull;

/// One limit: what it measures, the bound, and the words for it.
#[derive(Clone, Debug)]
pub struct Limit {
    pub name: String,
    pub measure: Measure,
    pub bound: Bound,
    /// Scale of the relative margin, in the unit of the margin: the width of the allowed range, or the size
    /// of the machine.
    pub scale: f64,
}

/// Quantity bounded by a limit. Legs count from 0.
#[derive(Clone, Debug)]
pub enum Measure {
    /// Length of a leg, or place of its carriage, m.
    Length(usize),
    /// Angle between a leg and the cone axis of its joint, rad.
    Cone(usize, Axes),
    /// Rotation of a leg's R joint since home, rad.
    Angle(usize, Axes, Zero),
    /// Rotation of a rod since home, rad.
    RodAngle(usize, Zero),
    /// Distance between the surfaces of two struts, m.
    Struts([Strut; 2]),
    /// Distance between the surface of a strut and the platform, m.
    Plate(Strut, Arc<Hull>),
    /// Smallest singular value, a pure number.
    Conditioning,
    /// Active force of a leg, N; also its row in the Jacobian.
    Force { leg: usize, row: usize },
}

/// A leg as a capsule about its line.
#[derive(Clone, Copy, Debug)]
pub struct Strut {
    pub leg: usize,
    pub radius: f64,
    /// Lengths at B and at b that do not count, m.
    pub cut: [f64; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    Least(f64),
    Most(f64),
    /// A range of an angle, on the circle.
    Between(f64, f64),
}

/// A leg's normal n and direction δ at the home pose, in base axes and in platform axes: where angles are
/// zero.
#[derive(Clone, Copy, Debug)]
pub struct Zero {
    pub(crate) base: (Vec3<f64>, Vec3<f64>),
    pub(crate) platform: (Vec3<f64>, Vec3<f64>),
}
