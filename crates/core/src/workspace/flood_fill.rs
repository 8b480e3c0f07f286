//! The reachable workspace in pose space: the nodes of a grid at which the platform's point o can be, found
//! from a start pose outwards, and where its boundary cuts the edges of the grid \[T40\].

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::kinematics::jacobian::scaled_jacobian;
use crate::model::mechanism::Mechanism;
use crate::numerics::gauss::solve;
use crate::spatial::{Mat3, Pose, Vec3};
use crate::workspace::fit_orientation::{fit, margins, nearest};

/// A cubic grid; its nodes, the middles of cubic cells, are counted with z fastest.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    pub origin: Vec3<f64>,
    pub step: f64,
    pub counts: [usize; 3],
}

/// The six neighbours of a node.
const DIRECTIONS: [[i64; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

/// Pieces of the way between two nodes.
const PIECES: u32 = 5;

/// Pieces in which a neighbour is tried once more that was not reached in one.
const SMALL_PIECES: u32 = 16;

/// Nodes are the middles of cells: where the grid ends, so does the last cell.
const HALF_CELL: f64 = 0.5;

/// Precision of the boundary on an edge, m.
const EXACT: f64 = 1e-12;

/// Margin, in the limit's unit, at which it is what stops the platform.
const AT_LIMIT: f64 = 1e-9;

impl Grid {
    #[must_use]
    pub fn len(&self) -> usize {
        self.counts.iter().product()
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn place(&self, node: usize) -> [i64; 3] {
        let [_, ny, nz] = self.counts;
        [node / (ny * nz), node / nz % ny, node % nz].map(|i| i as i64)
    }

    fn point(&self, place: [i64; 3]) -> Vec3<f64> {
        let [x, y, z] = place.map(|i| i as f64 * self.step);
        self.origin + Vec3::new(x, y, z)
    }

    fn node(&self, place: [i64; 3]) -> Option<usize> {
        let inside = place.iter().zip(self.counts).all(|(&i, n)| i >= 0 && i < n as i64);
        let [x, y, z] = place.map(|i| i as usize);
        inside.then(|| (x * self.counts[1] + y) * self.counts[2] + z)
    }

    fn neighbour(&self, node: usize, direction: usize) -> [i64; 3] {
        let place = self.place(node);
        std::array::from_fn(|k| place[k] + DIRECTIONS[direction][k])
    }
}

/// The reachable nodes, spreading wave by wave. Rotations are kept where a wave may still need them.
#[derive(Clone, Debug)]
pub struct Flood {
    pub grid: Grid,
    /// Whether each node is reachable.
    pub mask: Vec<bool>,
    rotations: BTreeMap<usize, Mat3<f64>>,
    fresh: Vec<usize>,
    /// The sign of det J that must be kept, if singularities are not to be crossed.
    sign: Option<f64>,
}

impl Flood {
    /// Begins at the node next to the start pose; none if it cannot be reached from there.
    #[must_use]
    pub fn new(mech: &Mechanism, grid: Grid, start: &Pose<f64>, keep_aspect: bool) -> Option<Self> {
        let off = (start.o - grid.origin) * (1.0 / grid.step);
        let node = grid.node(off.array().map(|x| x.round() as i64))?;
        let sign = keep_aspect.then(|| sign(mech, start));
        let first = fit(mech, start, start.o)?;
        let pose = moved(mech, &first, grid.point(grid.place(node)), sign)?;
        let mut mask = vec![false; grid.len()];
        mask[node] = true;
        Some(Flood {
            grid,
            mask,
            rotations: BTreeMap::from([(node, pose.rotation)]),
            fresh: vec![node],
            sign,
        })
    }

    /// Tries every unreached neighbour of the nodes that the last wave reached; the number of new ones. Each
    /// is tried from what was known before the wave, so that the result does not depend on the number of
    /// threads.
    pub fn wave(&mut self, mech: &Mechanism) -> usize {
        let mut candidates: Vec<usize> = self
            .fresh
            .iter()
            .flat_map(|&node| (0..6).map(move |d| (node, d)))
            .filter_map(|(node, d)| self.grid.node(self.grid.neighbour(node, d)))
            .filter(|&node| !self.mask[node])
            .collect();
        candidates.sort_unstable();
        candidates.dedup();
        let found: Vec<(usize, Mat3<f64>)> = candidates
            .par_iter()
            .filter_map(|&node| {
                let o = self.grid.point(self.grid.place(node));
                let from = |d: usize| {
                    let neighbour = self.grid.node(self.grid.neighbour(node, d))?;
                    let rotation = *self.rotations.get(&neighbour)?;
                    let pose = Pose { rotation, o: self.grid.point(self.grid.place(neighbour)) };
                    moved(mech, &pose, o, self.sign)
                };
                (0..6).find_map(from).map(|pose| (node, pose.rotation))
            })
            .collect();
        self.mark(&found);
        // Inner nodes are of no more use.
        let touched: Vec<usize> =
            self.fresh.iter().chain(found.iter().map(|(node, _)| node)).copied().collect();
        for node in touched {
            let around = (0..6).map(|d| self.grid.node(self.grid.neighbour(node, d)));
            if around.into_iter().all(|n| n.is_some_and(|n| self.mask[n])) {
                self.rotations.remove(&node);
            }
        }
        self.fresh = found.into_iter().map(|(node, _)| node).collect();
        self.fresh.len()
    }

    /// Tries every unreached neighbour of the reached nodes once more, in small pieces of the way; the number
    /// of new ones. From them waves may go on.
    pub fn retry(&mut self, mech: &Mechanism) -> usize {
        let open = self.open();
        // A node that several neighbours reach is reached once, from the last of them.
        let found: BTreeMap<usize, Mat3<f64>> = open
            .par_iter()
            .filter_map(|&(node, d, rotation)| {
                let (from, to) = (self.grid.place(node), self.grid.neighbour(node, d));
                let beyond = self.grid.node(to)?;
                let (from, to) = (self.grid.point(from), self.grid.point(to));
                let step = |pose: &Pose<f64>, o| moved(mech, pose, o, self.sign);
                let pose = in_pieces(&Pose { rotation, o: from }, to, SMALL_PIECES, step)?;
                Some((beyond, pose.rotation))
            })
            .collect();
        let found: Vec<(usize, Mat3<f64>)> = found.into_iter().collect();
        self.mark(&found);
        self.fresh = found.into_iter().map(|(node, _)| node).collect();
        self.fresh.len()
    }

    /// Takes nodes for reached.
    fn mark(&mut self, found: &[(usize, Mat3<f64>)]) {
        for &(node, rotation) in found {
            self.mask[node] = true;
            self.rotations.insert(node, rotation);
        }
    }

    /// The edges between reached and unreached nodes, those out of the grid too: reached node, direction,
    /// rotation.
    fn open(&self) -> Vec<(usize, usize, Mat3<f64>)> {
        self.rotations
            .iter()
            .flat_map(|(&node, &rotation)| (0..6).map(move |d| (node, d, rotation)))
            .filter(|&(node, d, _)| {
                self.grid.node(self.grid.neighbour(node, d)).is_none_or(|n| !self.mask[n])
            })
            .collect()
    }

    /// Intersections of the boundary with the edges between reached and unreached nodes, in the order of the
    /// reached ones.
    #[must_use]
    pub fn edges(&self, mech: &Mechanism) -> Vec<Edge> {
        let open = self.open();
        open.par_iter().map(|&(node, d, rotation)| self.edge(mech, node, d, rotation)).collect()
    }

    /// Bisects an edge for the last point that can be reached from its inner node.
    fn edge(&self, mech: &Mechanism, node: usize, direction: usize, rotation: Mat3<f64>) -> Edge {
        let inner = self.grid.point(self.grid.place(node));
        let next = self.grid.neighbour(node, direction);
        let way = self.grid.point(next) - inner;
        let ends = self.grid.node(next).is_none();
        let whole = if ends { HALF_CELL } else { 1.0 };
        let mut pose = Pose { rotation, o: inner };
        let (mut low, mut high) = (0.0, whole);
        if let Some(last) = moved(mech, &pose, inner + way * whole, self.sign) {
            (pose, low) = (last, whole);
        }
        while (high - low) * self.grid.step > EXACT {
            let middle = 0.5 * (low + high);
            match moved(mech, &pose, inner + way * middle, self.sign) {
                Some(next) => (pose, low) = (next, middle),
                None => high = middle,
            }
        }
        let margins = margins(mech, &pose);
        let binding = margins.iter().position(|&margin| margin <= AT_LIMIT);
        let ends_here = || moved(mech, &pose, inner + way * high, self.sign).is_none();
        let stop = match (binding, self.sign) {
            _ if ends && low >= whole - EXACT / self.grid.step => Stop::Grid,
            (Some(limit), _) => Stop::Limit(limit),
            (_, Some(_)) if ends_here() => Stop::Singularity,
            _ => Stop::Search,
        };
        Edge { node, direction, share: low, pose, stop, margin: nearest(mech, &margins) }
    }
}

/// Intersection of the boundary with an edge of the grid.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The reached node and the direction of the edge.
    pub node: usize,
    pub direction: usize,
    /// Share of the edge inside.
    pub share: f64,
    /// The last pose.
    pub pose: Pose<f64>,
    pub stop: Stop,
    /// The margin of the limit nearest to it, relative to its scale, in its own unit; NaN without limits.
    pub margin: f64,
}

/// Cause of a point of the workspace boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// On the boundary several limits may bind at once: the first of them in the mechanism's order.
    Limit(usize),
    /// Beyond, the sign of det J would change.
    Singularity,
    /// The grid ends here, not the workspace.
    Grid,
    /// Neither: the search found no pose beyond though no limit binds.
    Search,
}

/// A pose at `o` from one nearby, if there is one, at once or in pieces; with the sign of det J kept at the
/// end of each piece, if it is given.
fn moved(mech: &Mechanism, pose: &Pose<f64>, o: Vec3<f64>, kept: Option<f64>) -> Option<Pose<f64>> {
    let step = |pose: &Pose<f64>, o| fit_in_aspect(mech, pose, o, kept);
    let at_once = if kept.is_none() { step(pose, o) } else { None };
    at_once.or_else(|| in_pieces(pose, o, PIECES, step))
}

/// The fitted pose at `o`, with the sign of det J kept if it is given.
fn fit_in_aspect(mech: &Mechanism, pose: &Pose<f64>, o: Vec3<f64>, kept: Option<f64>) -> Option<Pose<f64>> {
    fit(mech, pose, o).filter(|p| kept.is_none_or(|kept| sign(mech, p) == kept))
}

/// The poses at given places of o that are reached from given ones on straight ways of o in small pieces; with
/// the sign of det J kept, if it must be.
#[must_use]
pub fn led(mech: &Mechanism, ways: &[(Pose<f64>, Vec3<f64>)], keep_aspect: bool) -> Vec<Option<Pose<f64>>> {
    let lead = |(pose, o): &(Pose<f64>, Vec3<f64>)| {
        let kept = keep_aspect.then(|| sign(mech, pose));
        in_pieces(pose, *o, SMALL_PIECES, |pose, o| fit_in_aspect(mech, pose, o, kept))
    };
    ways.par_iter().map(lead).collect()
}

/// The pose at the end of a straight way of o, step by step.
fn in_pieces(
    pose: &Pose<f64>,
    o: Vec3<f64>,
    pieces: u32,
    step: impl Fn(&Pose<f64>, Vec3<f64>) -> Option<Pose<f64>>,
) -> Option<Pose<f64>> {
    (1..=pieces).try_fold(*pose, |at, k| {
        let t = f64::from(k) / f64::from(pieces);
        step(&at, if k < pieces { pose.o * (1.0 - t) + o * t } else { o })
    })
}

/// Of det J; that of det JᵀJ is always one.
fn sign(mech: &Mechanism, pose: &Pose<f64>) -> f64 {
    if mech.is_redundant() {
        return 1.0;
    }
    solve(scaled_jacobian(mech, pose), [0.0; 6]).sign
}
