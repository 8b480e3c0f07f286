//! The reachable workspace in joint space: the poses for a lattice of leg lengths, by continuation from one of them
//! \[T41\].

use rayon::prelude::*;

use crate::forward::{continuation, forward_kinematics, squares};
use crate::leg;
use crate::limits::{Bound, Measure};
use crate::mechanism::Mechanism;
use crate::reach::{ON_LIMIT, margins, nearest};
use crate::spatial::Pose;
use crate::status::Status;

/// Shortest piece of the way from a node to the next: what needs shorter ones is taken to end there.
const SHORTEST_PIECE: f64 = 1.0 / 32.0;

/// Nodes of the last wave from which a node is tried; where the mode ends for some it mostly does for all.
const TRIES: usize = 3;

/// Lengths of one actuated leg.
#[derive(Clone, Copy, Debug)]
struct Axis {
    least: f64,
    step: f64,
    count: i64,
    /// The node nearest to the start pose.
    center: i64,
}

/// The nodes of the lattice, reached wave by wave.
#[derive(Clone, Debug)]
pub struct Lattice {
    axes: Vec<Axis>,
    /// Whether each node has been reached; the last axis runs fastest.
    seen: Vec<bool>,
    /// The nodes that the last wave reached, in order, with their poses.
    front: Vec<(usize, Pose<f64>)>,
    pub reached: Reached,
    /// Lower end of the first layer of z and the height of each, m.
    pub layers: (f64, f64),
}

/// What the waves have met.
#[derive(Clone, Debug)]
pub struct Reached {
    /// Nodes with a pose inside all limits.
    pub inside: u64,
    /// Nodes with a pose beyond some limit other than a stroke.
    pub outside: u64,
    /// Nodes next to a wave that it did not reach: there the mode ends. A later wave may still reach them.
    pub ends: u64,
    /// Least and greatest coordinate of o, m.
    pub extents: [[f64; 2]; 3],
    /// Least and greatest x and y of o in each layer of z.
    pub profile: Vec<[f64; 4]>,
}

impl Reached {
    fn new(layers: usize) -> Self {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let profile = vec![[none[0], none[1], none[0], none[1]]; layers];
        Reached { inside: 0, outside: 0, ends: 0, extents: [none; 3], profile }
    }
}

impl Lattice {
    /// Lengths from the least to the greatest of each stroke in steps of about `step`, and layers of z of the height
    /// `layer`. None where an actuated leg has no stroke, or the node next to the start pose has no pose in its mode.
    #[must_use]
    pub fn new(mech: &Mechanism, start: &Pose<f64>, step: f64, layer: f64) -> Option<Self> {
        let axes: Option<Vec<Axis>> = mech
            .actuated()
            .map(|(i, leg)| {
                let end = |least: bool| {
                    mech.limits.iter().find_map(|l| match (&l.measure, l.bound) {
                        (Measure::Length(k), Bound::Least(x)) if *k == i && least => Some(x),
                        (Measure::Length(k), Bound::Most(x)) if *k == i && !least => Some(x),
                        _ => None,
                    })
                };
                let (least, most) = (end(true)?, end(false)?);
                let pieces = ((most - least) / step).round().max(1.0);
                let step = (most - least) / pieces;
                let center = ((leg::position(leg, start).length - least) / step).round().clamp(0.0, pieces);
                Some(Axis { least, step, count: pieces as i64 + 1, center: center as i64 })
            })
            .collect();
        let axes = axes?;
        let longest: f64 = axes.iter().map(|a| a.least + a.step * a.count as f64).fold(0.0, f64::max);
        let middle = mech.legs.iter().map(|leg| leg.base.point.z).fold(0.0, f64::max);
        let reach = longest + mech.legs.iter().map(|leg| leg.platform.point.norm()).fold(0.0, f64::max);
        let layers = (2.0 * reach / layer).ceil() as usize;
        let size = axes.iter().map(|a| a.count as usize).product();
        let mut lattice = Lattice {
            axes,
            seen: vec![false; size],
            front: vec![],
            reached: Reached::new(layers),
            layers: (middle - reach, layer),
        };
        let center = lattice.axes.iter().fold(0, |node, a| node * a.count + a.center);
        let found = forward_kinematics(mech, &lattice.lengths(center), start);
        if found.status != Status::Ok {
            return None;
        }
        lattice.seen[center as usize] = true;
        lattice.front = vec![(center as usize, found.pose)];
        lattice.record(mech, 0);
        Some(lattice)
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.seen.len()
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.seen.is_empty()
    }

    /// The lengths of a node.
    fn lengths(&self, node: i64) -> Vec<f64> {
        let mut rest = node;
        let mut lengths: Vec<f64> = self
            .axes
            .iter()
            .rev()
            .map(|a| {
                let i = rest % a.count;
                rest /= a.count;
                a.least + a.step * i as f64
            })
            .collect();
        lengths.reverse();
        lengths
    }

    /// The nodes one step away along each axis.
    fn neighbours(&self, node: i64) -> impl Iterator<Item = usize> {
        let mut stride = 1;
        let along = self.axes.iter().rev().map(move |a| {
            let (i, by) = (node / stride % a.count, stride);
            stride *= a.count;
            [(i > 0).then_some(node - by), (i + 1 < a.count).then_some(node + by)]
        });
        along.flatten().flatten().map(|n| n as usize)
    }

    /// Continues from the nodes of the last wave to their neighbours; the number of those reached. Each is tried from the
    /// nodes of the last wave in their order, so that the result does not depend on the number of threads.
    pub fn wave(&mut self, mech: &Mechanism) -> usize {
        let mut tries: Vec<(usize, usize)> = Vec::new();
        for (i, &(node, _)) in self.front.iter().enumerate() {
            tries.extend(self.neighbours(node as i64).filter(|&n| !self.seen[n]).map(|n| (n, i)));
        }
        tries.sort_unstable();
        let candidates: Vec<&[(usize, usize)]> = tries.chunk_by(|a, b| a.0 == b.0).collect();
        let found: Vec<Option<(usize, Pose<f64>)>> = candidates
            .par_iter()
            .map(|from| {
                let lengths = self.lengths(from[0].0 as i64);
                let squares = squares(&lengths);
                from.iter().take(TRIES).find_map(|&(node, i)| {
                    let (found, _) = continuation(mech, &squares, &self.front[i].1, SHORTEST_PIECE);
                    found.map(|pose| (node, pose))
                })
            })
            .collect();
        self.reached.ends += found.iter().filter(|f| f.is_none()).count() as u64;
        self.front = found.into_iter().flatten().collect();
        for i in 0..self.front.len() {
            self.seen[self.front[i].0] = true;
            self.record(mech, i);
        }
        self.front.len()
    }

    fn record(&mut self, mech: &Mechanism, i: usize) {
        let pose = self.front[i].1;
        let reached = &mut self.reached;
        // The lengths of a node on the stroke's end are there up to rounding.
        if !(nearest(mech, &margins(mech, &pose)) >= -ON_LIMIT) {
            reached.outside += 1;
            return;
        }
        reached.inside += 1;
        let o = pose.o.array();
        for (extent, x) in reached.extents.iter_mut().zip(o) {
            *extent = [extent[0].min(x), extent[1].max(x)];
        }
        let layer = ((o[2] - self.layers.0) / self.layers.1).floor();
        if let Some(p) = reached.profile.get_mut(layer.max(0.0) as usize) {
            *p = [p[0].min(o[0]), p[1].max(o[0]), p[2].min(o[1]), p[3].max(o[1])];
        }
    }
}
