//! The mechanism: base, platform, legs and rods as data that every kernel reads, made once by
//! [`assemble`](crate::assembly::build::assemble) and never changed.
//!
//! Nothing here knows a mechanism's name: legs differ by their joints, and joints give the leg its
//! [`Turning`] and its [`Constraint`]s.

use serde::Serialize;

use crate::model::drive::Drive;
use crate::model::joint::{Joint, JointKind};
use crate::model::limit::Limit;
use crate::model::spec::Axes;
use crate::spatial::{Mat3, Pose, Vec3, Wrench};

/// Mass, mass centre and inertia about it, in the axes of the link.
#[derive(Clone, Debug)]
pub struct Body {
    pub mass: f64,
    pub center: Vec3<f64>,
    pub inertia: Mat3<f64>,
}

impl Body {
    /// Of a link that is not described.
    pub const NONE: Self = {
        let zero = Vec3 { x: 0.0, y: 0.0, z: 0.0 };
        Body { mass: 0.0, center: zero, inertia: Mat3([zero; 3]) }
    };
}

/// Joint axis that determines the normal n of the leg's frame (n, δ, n×δ), and with it the spin about δ
/// \[T5\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turning<S = f64> {
    /// A universal joint: n is along u×δ.
    Across(Axes, Vec3<S>),
    /// A revolute or fixed joint: n is the axis u itself.
    Along(Axes, Vec3<S>),
    /// S at both ends: no spin; u only gives the frame a direction.
    Free(Vec3<S>),
}

impl<S> Turning<S> {
    /// u, in the axes of its body.
    pub fn axis(self) -> Vec3<S> {
        match self {
            Turning::Across(_, u) | Turning::Along(_, u) | Turning::Free(u) => u,
        }
    }
}

/// The direction that a fixed joint gives to its leg, in the axes of its body.
#[derive(Clone, Copy, Debug)]
pub struct Direction<S = f64> {
    pub leg: usize,
    pub side: Axes,
    pub axis: Vec3<S>,
}

impl<S: Copy> Direction<S> {
    /// Those of all fixed joints.
    #[must_use]
    pub fn of_all(legs: &[Leg<S>]) -> Vec<Self> {
        let of = |leg, side, joint: &Joint<S>| joint.direction().map(|axis| Direction { leg, side, axis });
        let of_leg =
            |(i, leg): (usize, &Leg<S>)| [of(i, Axes::Base, &leg.base), of(i, Axes::Platform, &leg.platform)];
        legs.iter().enumerate().flat_map(of_leg).flatten().collect()
    }
}

#[derive(Clone, Debug)]
pub struct Leg<S = f64> {
    pub name: String,
    pub actuated: bool,
    pub drive: Drive<S>,
    /// Of the strut, m.
    pub radius: Option<f64>,
    pub base: Joint<S>,
    pub platform: Joint<S>,
    /// The rod that carries the base joint. Seen from the leg the joint is then U with the rod's line as its
    /// axis.
    pub rod: Option<usize>,
    /// Centre measured from B, in leg axes. Of a slider: the carriage, in base axes, which does not rotate.
    pub cylinder: Body,
    /// Centre measured from b, in leg axes. Of a slider: the strut.
    pub piston: Body,
    pub turning: Turning<S>,
}

impl<S> Leg<S> {
    /// The kind of its base joint itself, which on a rod is R.
    #[must_use]
    pub fn base_kind(&self) -> JointKind {
        if self.rod.is_some() { JointKind::ON_ROD } else { self.base.kind }
    }

    /// Letters of its joints from base to platform, `RPU` for one on a rod, `PUS` for a slider.
    #[must_use]
    pub fn letters(&self) -> String {
        let [base, drive] = self.drive.between([0, 1, 2]).map(|[from, _]| from);
        let mut letters = [self.platform.kind.letter(); 3];
        (letters[base], letters[drive]) = (self.base_kind().letter(), self.drive.kind().letter);
        letters.concat()
    }

    /// Words for its two links, from the base on.
    #[must_use]
    pub fn links(&self) -> [&'static str; 2] {
        self.drive.kind().links
    }
}

#[derive(Clone, Debug)]
pub struct Rod<S = f64> {
    pub name: String,
    pub point: Vec3<S>,
    /// Unit vector L.
    pub axis: Vec3<S>,
    pub body: Body,
    /// The leg that the rod's rotation is computed from, the first that it carries.
    pub leader: usize,
}

#[derive(Clone, Debug)]
pub struct Load {
    pub wrench: Wrench<f64>,
    pub axes: Axes,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// U below, U above: leg and both axes lie in one plane, `(l × r)·L = 0` \[Eq. 4\].
    A,
    /// R or F below: the leg is perpendicular to an axis of the base, `r·a_B = 0`.
    B,
    /// R or F above: the leg is perpendicular to an axis of the platform, `r·a_P = 0`.
    C,
    /// R or F against U, R or F: two axes are square, `a_B·a_P = 0`.
    D,
    /// Two legs on one rod: their planes through its line L keep their angle, `(Q r_1 × r)·L = 0`.
    E,
}

#[derive(Clone, Copy, Debug)]
pub struct Constraint<S = f64> {
    pub kind: ConstraintKind,
    pub leg: usize,
    /// B in base axes and m in platform axes.
    pub base_point: Vec3<S>,
    pub platform_point: Vec3<S>,
    /// Unit axes: L or a_B in base axes, l or a_P in platform axes; zero where the kind has none.
    pub base_axis: Vec3<S>,
    pub platform_axis: Vec3<S>,
    /// Kind E only; of no effect elsewhere.
    pub partner: Partner<S>,
}

/// The first leg on the rod of a constraint of kind E.
#[derive(Clone, Copy, Debug)]
pub struct Partner<S = f64> {
    pub base_point: Vec3<S>,
    pub platform_point: Vec3<S>,
    /// Q, the constant rotation about L that takes the plane of the first leg into that of the second.
    pub turn: Mat3<S>,
}

/// A local degree of freedom of the platform: a rotation about a line to which no leg is sensitive.
#[derive(Clone, Copy, Debug)]
pub struct Idle<S = f64> {
    /// The body that the line is fixed in.
    pub side: Axes,
    /// A point of it, in the axes of the body.
    pub point: Vec3<S>,
    /// Its unit direction there, u.
    pub axis: Vec3<S>,
    /// Two legs whose joints in the body lie on the line, if all do: the line follows them.
    pub through: Option<[usize; 2]>,
}

/// A local degree of freedom as data: its line in the axes of its body, m.
#[derive(Clone, Debug, Serialize)]
pub struct IdleRow {
    pub body: &'static str,
    pub point: [f64; 3],
    pub axis: [f64; 3],
}

impl IdleRow {
    pub(crate) fn of(idle: &Idle) -> Self {
        let body = match idle.side {
            Axes::Base => "base",
            Axes::Platform => "platform",
        };
        IdleRow { body, point: idle.point.array(), axis: idle.axis.array() }
    }
}

/// A link of the topology graph with the numbers of its joints.
#[derive(Clone, Debug, Serialize)]
pub struct GraphLink {
    pub name: String,
    pub joints: Vec<usize>,
}

/// A joint of the topology graph between two links.
#[derive(Clone, Debug, Serialize)]
pub struct GraphJoint {
    pub kind: &'static str,
    pub name: String,
    pub links: [usize; 2],
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct Graph {
    pub links: Vec<GraphLink>,
    pub joints: Vec<GraphJoint>,
}

/// The accounting of [Eq. 1], from ranks.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Mobility {
    pub dof: usize,
    pub links: usize,
    pub joints: usize,
    /// Sum of the joints' degrees of freedom.
    pub joint_freedoms: usize,
    pub loops: usize,
    /// Rank of the loop closures, at most six for each loop.
    pub closure_rank: usize,
    /// Closure equations that say nothing new.
    pub redundant: usize,
    /// Legs (from 0) whose constraints the redundant ones couple.
    pub redundant_legs: Vec<usize>,
    /// Degrees of freedom that leave the platform where it is.
    pub passive: usize,
    /// Legs (from 0) that have them.
    pub passive_legs: Vec<usize>,
    /// Degrees of freedom, local ones apart, that remain at generic poses when all actuators are locked: zero
    /// unless the design itself is singular.
    pub uncontrolled: usize,
    /// Degrees of freedom that no leg feels by design: rotations about lines of the platform or of the base
    /// \[T70\].
    pub idle: Vec<IdleRow>,
    /// Scalar constraints of the legs: leg (from 0) and kind, and whether it is one of the independent ones.
    pub constraints: Vec<ConstraintRow>,
    pub graph: Graph,
}

#[derive(Clone, Debug, Serialize)]
pub struct ConstraintRow {
    pub leg: usize,
    pub kind: String,
    pub independent: bool,
}

#[derive(Clone, Debug)]
pub struct Mechanism<S = f64> {
    pub name: String,
    pub legs: Vec<Leg<S>>,
    pub rods: Vec<Rod<S>>,
    /// Directions in which fixed joints hold their legs.
    pub directions: Vec<Direction<S>>,
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
    pub constraints: Vec<Constraint<S>>,
    /// Those of them that are independent at generic poses, in the order of the legs.
    pub independent: Vec<Constraint<S>>,
    /// Degrees of freedom that no leg feels, each with a row of its own in the Jacobian, between those of
    /// legs and constraints \[T70\].
    pub idle: Vec<Idle<S>>,
    /// Root mean square distance of the platform joints from o: what lengths are scaled by, m.
    pub characteristic_length: f64,
    pub mobility: Mobility,
    /// Limits of the mechanism file: joints first, then clearances, conditioning, forces \[T35\].
    pub limits: Vec<Limit>,
}

/// The largest number of independent constraints: one degree of freedom at least must remain.
pub const MAX_CONSTRAINTS: usize = 5;

impl<S> Mechanism<S> {
    #[must_use]
    pub fn dof(&self) -> usize {
        6 - self.independent.len()
    }

    /// Rows of the Jacobian: actuated legs, local degrees of freedom, independent constraints. Six, or more
    /// where actuators are redundant.
    #[must_use]
    #[inline]
    pub fn rows(&self) -> usize {
        self.actuated().count() + self.idle.len() + self.independent.len()
    }

    /// Whether more legs are actuated than it takes: the Jacobian then has more rows than columns \[T72\].
    #[must_use]
    #[inline]
    pub fn is_redundant(&self) -> bool {
        self.rows() > 6
    }

    /// Legs with an actuator and their numbers, in the order of the Jacobian's rows.
    #[inline(always)]
    pub fn actuated(&self) -> Actuated<'_, S> {
        Actuated { legs: &self.legs, next: 0 }
    }
}

/// See [`Mechanism::actuated`].
#[derive(Clone, Debug)]
pub struct Actuated<'a, S> {
    legs: &'a [Leg<S>],
    next: usize,
}

impl<'a, S> Iterator for Actuated<'a, S> {
    type Item = (usize, &'a Leg<S>);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        while let Some(leg) = self.legs.get(self.next) {
            self.next += 1;
            if leg.actuated {
                return Some((self.next - 1, leg));
            }
        }
        None
    }
}
