//! Distance from singularity along each coordinate: until det J = 0, the others kept and the dependent ones
//! following \[T34\].

use std::cell::Cell;
use std::f64::consts::PI;

use crate::kinematics::coordinate_sets::{MAX_COORDINATES, Set, Values};
use crate::kinematics::dependent_coordinates::{self, CoordinateState, DEPENDENT_PIVOTS};
use crate::kinematics::singular::SINGULAR;
use crate::mobility::singularity::{self, Kind};
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::order::{larger, largest};
use crate::number::real::{Jet, Real};
use crate::numerics::hermite_roots::{self, Node};
use crate::spatial::{Pose, Vec3};

/// The nearest singular pose in one direction of one coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// The coordinate's value there; infinite in the direction where there is none.
    pub value: f64,
    /// None where det J changes its sign without a singular pose that is known.
    pub kind: Option<Kind>,
    /// The coordinate's value up to which poses were looked at.
    pub searched: f64,
}

/// Search for singularities along coordinates: the set, the given coordinates, and the reach of lengths, m.
#[derive(Clone, Debug)]
pub struct SingularitySearch {
    pub set: Set,
    pub given: Vec<bool>,
    pub reach: f64,
    /// The length that rotations are counted with, m.
    pub scale: f64,
}

/// Steps of a search: rad; share of the scale; of a direction's component.
const STEPS: [f64; 3] = [PI / 180.0, 0.02, 0.01];

/// How far angles and a direction's components go: a full turn, and from one end to the other.
const TURN: f64 = 2.0 * PI;
const ACROSS: f64 = 2.0;

/// Measures up to which the last pose before poses end is singular: near a fold poses go by the root of the
/// coordinate.
const END_TOLERANCE: f64 = 1e-3;

/// Shares of a step before a zero at which a pose is looked for in turn, and up to which its measures tell
/// the kind.
const SHORTLY_BEFORE: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
const NEAR: f64 = 0.01;

/// Two poses this near, as pure numbers, are one.
const SAME_POSE: f64 = 1e-6;

impl SingularitySearch {
    /// Step and reach of a coordinate.
    fn extent(&self, index: usize) -> (f64, f64) {
        match self.set.names()[index] {
            "x" | "y" | "z" | "p" | "h" | "tip_x" | "tip_y" | "tip_z" => (STEPS[1] * self.scale, self.reach),
            "axis_x" | "axis_y" | "axis_z" => (STEPS[2], ACROSS),
            _ => (STEPS[0], TURN),
        }
    }
}

/// The numbers of the set at a pose, and the branch that leads back to the pose.
///
/// # Errors
/// The status of a pose that the coordinates cannot describe.
pub fn start(
    mech: &Mechanism,
    search: &SingularitySearch,
    pose: &Pose<f64>,
) -> Result<(Values<f64>, f64), Status> {
    let q = search.set.values(mech, pose);
    let mut status = Status::NotConverged;
    for branch in [1.0, -1.0] {
        let state = dependent_coordinates::state(
            mech,
            &search.set,
            &q.map(Jet::lit),
            &mask(search),
            branch,
            pose,
            DEPENDENT_PIVOTS,
        );
        if state.status != Status::Ok {
            status = state.status;
        } else if same(&state.platform.pose, pose, search.scale) {
            return Ok((q, branch));
        }
    }
    Err(status)
}

/// Given numbers, as many as any set has: those beyond this set's own are not looked at.
fn mask(search: &SingularitySearch) -> Vec<bool> {
    (0..MAX_COORDINATES).map(|i| search.given.get(i).copied().unwrap_or(true)).collect()
}

fn same(a: &Pose<f64>, b: &Pose<f64>, scale: f64) -> bool {
    let turned = a.rotation.0.iter().zip(b.rotation.0).map(|(x, y): (&Vec3<f64>, _)| (*x - y).norm());
    (a.o - b.o).norm() <= SAME_POSE * scale && largest(turned) <= SAME_POSE
}

/// The poses that one coordinate passes, by the way from its value at the start; the others are kept.
struct CoordinatePath<'a> {
    mech: &'a Mechanism,
    search: &'a SingularitySearch,
    given: Vec<bool>,
    start: Values<f64>,
    branch: f64,
    index: usize,
    direction: f64,
    /// Where the dependent coordinates start from: the last pose, so that they follow their own path.
    last: Cell<Pose<f64>>,
}

impl CoordinatePath<'_> {
    /// The coordinate's value after a way.
    fn place(&self, way: f64) -> f64 {
        self.start[self.index] + self.direction * way
    }

    fn state(&self, way: f64) -> CoordinateState {
        let mut q = self.start.map(Jet::lit);
        q[self.index] = Jet::new(self.place(way), self.direction, 0.0);
        dependent_coordinates::state(
            self.mech,
            &self.search.set,
            &q,
            &self.given,
            self.branch,
            &self.last.get(),
            DEPENDENT_PIVOTS,
        )
    }

    fn pose(&self, way: f64) -> Option<Pose<f64>> {
        let state = self.state(way);
        (state.status == Status::Ok).then_some(state.platform.pose)
    }

    /// det J and its rate, as long as dependent coordinates are on the branch `side`: beyond a fold is
    /// another path.
    fn node(&self, way: f64, side: f64) -> Option<Node> {
        let CoordinateState { platform, branch, status, .. } = self.state(way);
        if status != Status::Ok || branch != side {
            return None;
        }
        self.last.set(platform.pose);
        let det = singularity::determinant(self.mech, &platform.pose, &platform.twist, self.search.scale);
        det.x.is_finite().then_some(Node { t: way, f: det.x, d: det.d })
    }

    /// Kind of singularity of a pose, if it is singular.
    fn kind(&self, pose: &Pose<f64>, tolerance: f64) -> Option<Kind> {
        let found = singularity::singularity(self.mech, pose, self.search.scale, tolerance);
        Some(found.kind).filter(|&kind| kind != Kind::None)
    }

    /// The kind where det J is zero. Where a constraint is lost the dependent coordinates are not determined:
    /// a pose shortly before tells it then.
    fn kind_at_zero(&self, way: f64, step: f64) -> Option<Kind> {
        let here = self.pose(way).and_then(|pose| self.kind(&pose, SINGULAR));
        here.or_else(|| {
            let before =
                SHORTLY_BEFORE.into_iter().find_map(|share| self.pose(larger(way - share * step, 0.0)));
            before.and_then(|pose| self.kind(&pose, NEAR))
        })
    }
}

/// The nearest singular pose when coordinate `index` goes from its value in `q` up (`direction` 1) or down
/// (-1).
#[must_use]
pub fn along(
    mech: &Mechanism,
    search: &SingularitySearch,
    pose: &Pose<f64>,
    (start, branch): (&Values<f64>, f64),
    index: usize,
    direction: f64,
) -> Nearest {
    let (given, last) = (mask(search), Cell::new(*pose));
    let path = CoordinatePath { mech, search, given, start: *start, branch, index, direction, last };
    let side = path.state(0.0).branch;
    let touches = |way: f64| {
        path.pose(way).is_some_and(|pose| singularity::smallest(mech, &pose, search.scale) <= SINGULAR)
    };
    let (step, reach) = search.extent(index);
    let found = hermite_roots::first_zero(|way| path.node(way, side), touches, step, reach);
    let none =
        Nearest { value: direction * f64::INFINITY, kind: Some(Kind::None), searched: path.place(found.end) };
    if let Some(zero) = found.zero {
        return Nearest { value: path.place(zero), kind: path.kind_at_zero(zero, step), ..none };
    }
    // Where poses end, they end at a singular one or at a fold of the coordinates alone.
    match path.kind(&path.last.get(), END_TOLERANCE) {
        Some(kind) if found.end < reach => Nearest { value: none.searched, kind: Some(kind), ..none },
        _ => none,
    }
}
