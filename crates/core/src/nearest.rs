//! How far each coordinate can go, the others kept and the dependent ones following, until det J is zero \[T34\].

use std::cell::Cell;
use std::f64::consts::PI;

use crate::coordinates::{self, MAX_COORDINATES, Set, Values};
use crate::mechanism::Mechanism;
use crate::real::{Jet, Real};
use crate::roots::{self, Node};
use crate::singularity::{self, Kind, TOLERANCE};
use crate::spatial::{Pose, Vec3};
use crate::status::Status;

/// The nearest singular pose in one direction of one coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// The coordinate's value there; infinite in the direction where there is none.
    pub value: f64,
    pub kind: Kind,
    /// The coordinate's value up to which poses were looked at.
    pub searched: f64,
}

/// What is searched: a set of coordinates, those that are given, and how far the lengths among them may go, m.
#[derive(Clone, Debug)]
pub struct Search {
    pub set: Set,
    pub given: Vec<bool>,
    pub reach: f64,
    /// The length that turns are counted with, m.
    pub scale: f64,
}

/// Steps of a search: rad; share of the scale; of a direction's component.
const STEPS: [f64; 3] = [PI / 180.0, 0.02, 0.01];

/// How far angles and a direction's components go: a full turn, and from one end to the other.
const TURN: f64 = 2.0 * PI;
const ACROSS: f64 = 2.0;

/// Two poses this near, as pure numbers, are one.
const SAME_POSE: f64 = 1e-6;

impl Search {
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
pub fn start(mech: &Mechanism, search: &Search, pose: &Pose<f64>) -> Result<(Values<f64>, f64), Status> {
    let q = search.set.values(mech, pose);
    let mut status = Status::NotConverged;
    for branch in [1.0, -1.0] {
        let state = coordinates::state(mech, &search.set, &q.map(Jet::lit), &mask(search), branch, pose);
        if state.status != Status::Ok {
            status = state.status;
        } else if same(&state.platform.pose, pose, search.scale) {
            return Ok((q, branch));
        }
    }
    Err(status)
}

/// Given numbers, as many as any set has: those beyond this set's own are not looked at.
fn mask(search: &Search) -> Vec<bool> {
    (0..MAX_COORDINATES).map(|i| search.given.get(i).copied().unwrap_or(true)).collect()
}

fn same(a: &Pose<f64>, b: &Pose<f64>, scale: f64) -> bool {
    let turned = a.rotation.0.iter().zip(b.rotation.0).map(|(x, y): (&Vec3<f64>, _)| (*x - y).norm());
    (a.o - b.o).norm() <= SAME_POSE * scale && turned.fold(0.0, f64::max) <= SAME_POSE
}

/// The nearest singular pose when coordinate `index` goes from its value in `q` up (`direction` 1) or down (-1).
#[must_use]
pub fn along(
    mech: &Mechanism,
    search: &Search,
    pose: &Pose<f64>,
    (q, branch): (&Values<f64>, f64),
    index: usize,
    direction: f64,
) -> Nearest {
    let (scale, given) = (search.scale, mask(search));
    // Dependent coordinates start from the last pose, so that they follow their own path.
    let last = Cell::new(*pose);
    let state_at = |x: f64| {
        let mut moved = q.map(Jet::lit);
        moved[index] = Jet::new(q[index] + direction * x, direction, 0.0);
        coordinates::state(mech, &search.set, &moved, &given, branch, &last.get())
    };
    let side = state_at(0.0).branch;
    let node_at = |x: f64| {
        let state = state_at(x);
        // The dependent coordinates must stay on their branch: beyond a fold there is another path.
        if state.status != Status::Ok || state.branch != side {
            return None;
        }
        let det = singularity::determinant(mech, &state.platform.pose, &state.platform.twist, scale);
        last.set(state.platform.pose);
        det.x.is_finite().then_some(Node { t: x, f: det.x, d: det.d })
    };
    let touches = |x: f64| singularity::smallest(mech, &state_at(x).platform.pose, scale) <= TOLERANCE;
    let (step, reach) = search.extent(index);
    let found = roots::first_zero(node_at, touches, step, reach);
    let place = |x: f64| q[index] + direction * x;
    let kind = found.zero.map_or(Kind::None, |x| {
        singularity::singularity(mech, &state_at(x).platform.pose, scale, TOLERANCE).kind
    });
    Nearest { value: found.zero.map_or(direction * f64::INFINITY, place), kind, searched: place(found.end) }
}
