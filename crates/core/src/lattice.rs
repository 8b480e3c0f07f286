//! The reachable workspace in joint space: the poses for a lattice of leg lengths, by continuation from one of them
//! \[T41\].

use rayon::prelude::*;

use crate::forward::{System, continuation, forward_kinematics, size, squares, step_of, system};
use crate::leg;
use crate::limits::{Bound, Measure};
use crate::linear::solve;
use crate::mechanism::Mechanism;
use crate::reach::{ON_LIMIT, margins, nearest};
use crate::spatial::{Pose, Vec3};
use crate::status::Status;

/// Shortest piece of the way to a neighbour: what needs shorter ones is taken to end there. Near a singularity poses go
/// by the root of the lengths, so that the end is known to an eighth of what one step makes there.
const SHORTEST_PIECE: f64 = 1.0 / 64.0;

/// Shortest piece of a continuation that is made in one.
const WHOLE: f64 = 1.0;

/// Share of a predicted step within which a known pose is the one that the step leads to.
const PREDICTED: f64 = 0.25;

/// Two poses with the same lengths and a marker this near are one, relative to the characteristic length.
const SAME: f64 = 1e-4;

/// Where the marker is in platform axes, in characteristic lengths: off every symmetry that a platform may have.
const MARKER: Vec3<f64> = Vec3 { x: 0.53, y: 0.31, z: 0.79 };

/// End of a list of poses.
const NONE: u32 = u32::MAX;

/// Lengths of one actuated leg.
#[derive(Clone, Copy, Debug)]
struct Axis {
    least: f64,
    step: f64,
    count: i64,
    /// The node nearest to the start pose.
    center: i64,
}

/// A pose that has been reached, by its marker: a point of the platform tells poses with the same lengths apart.
#[derive(Clone, Copy, Debug)]
struct Known {
    marker: [f32; 3],
    /// The pose of the same node that was reached before.
    next: u32,
}

/// The poses at the nodes of the lattice, reached wave by wave. A node may have several: those of one aspect with the
/// same lengths. Memory: 4 bytes for each node and 16 for each pose.
#[derive(Clone, Debug)]
pub struct Lattice {
    axes: Vec<Axis>,
    /// The pose of each node that was reached last; the last axis runs fastest.
    last: Vec<u32>,
    known: Vec<Known>,
    /// The poses that the last wave reached, in order, with their nodes.
    front: Vec<(usize, Pose<f64>)>,
    pub reached: Reached,
    /// Least and greatest coordinates of o that are looked at, m.
    bounds: [[f64; 2]; 3],
    /// Lower end of the first layer of z and the height of each, m.
    pub layers: (f64, f64),
}

/// What the waves have met: poses inside all limits, each reached from another one by a step to a neighbour.
#[derive(Clone, Debug)]
pub struct Reached {
    /// Nodes with such a pose.
    pub inside: u64,
    /// The poses.
    pub poses: u64,
    /// Steps to a neighbour that end at a limit other than a stroke, or at the bounds.
    pub at_limits: u64,
    /// Steps to a neighbour that end in a singularity.
    pub singular: u64,
    /// Least and greatest coordinate of o, m: of these poses and of those passed on steps that end on the way.
    pub extents: [[f64; 2]; 3],
    /// Least and greatest x and y of o in each layer of z.
    pub profile: Vec<[f64; 4]>,
}

/// What a step to a neighbour came to.
enum Step {
    New(Pose<f64>),
    /// Poses on the way up to its end.
    Ends {
        passed: Vec<Pose<f64>>,
        singular: bool,
    },
}

impl Reached {
    fn new(layers: usize) -> Self {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let profile = vec![[none[0], none[1], none[0], none[1]]; layers];
        Reached { inside: 0, poses: 0, at_limits: 0, singular: 0, extents: [none; 3], profile }
    }
}

impl Lattice {
    /// Lengths from the least to the greatest of each stroke in steps of about `step`, and layers of z of the height
    /// `layer`; o within `bounds`. None where an actuated leg has no stroke, or the node next to the start pose has no pose inside all
    /// limits in its mode.
    #[must_use]
    pub fn new(
        mech: &Mechanism,
        start: &Pose<f64>,
        bounds: [[f64; 2]; 3],
        step: f64,
        layer: f64,
    ) -> Option<Self> {
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
            last: vec![NONE; size],
            known: vec![],
            front: vec![],
            reached: Reached::new(layers),
            bounds,
            layers: (middle - reach, layer),
        };
        let center = lattice.axes.iter().fold(0, |node, a| node * a.count + a.center);
        let found = forward_kinematics(mech, &lattice.lengths(center), start);
        if found.status != Status::Ok || !lattice.is_inside(mech, &found.pose) {
            return None;
        }
        lattice.keep(mech, center as usize, found.pose);
        Some(lattice)
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.last.len()
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.last.is_empty()
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

    /// The markers of the poses known at a node.
    fn markers(&self, node: usize) -> impl Iterator<Item = Vec3<f64>> {
        let list = std::iter::successors(self.known.get(self.last[node] as usize), |known| {
            self.known.get(known.next as usize)
        });
        list.map(|known| Vec3::from(known.marker.map(f64::from)))
    }

    /// Whether a pose is in the bounds and keeps all limits. The lengths of a node on the stroke's end are there up to
    /// rounding.
    fn is_inside(&self, mech: &Mechanism, pose: &Pose<f64>) -> bool {
        let in_bounds = pose.o.array().iter().zip(&self.bounds).all(|(x, [low, high])| low <= x && x <= high);
        in_bounds && nearest(mech, &margins(mech, pose)) >= -ON_LIMIT
    }

    /// Steps from the poses of the last wave to the neighbours of their nodes; the number of new poses. Those at one node
    /// are found in the order of the poses that they are reached from: the number of threads changes nothing.
    pub fn wave(&mut self, mech: &Mechanism) -> usize {
        let mut steps: Vec<(usize, usize)> = Vec::new();
        for (i, &(node, _)) in self.front.iter().enumerate() {
            steps.extend(self.neighbours(node as i64).map(|n| (n, i)));
        }
        steps.par_sort_unstable();
        let by_node: Vec<&[(usize, usize)]> = steps.chunk_by(|a, b| a.0 == b.0).collect();
        let found: Vec<Vec<Step>> = by_node.par_iter().map(|steps| self.steps_to(mech, steps)).collect();
        let nodes: Vec<usize> = by_node.iter().map(|steps| steps[0].0).collect();
        self.front.clear();
        for (node, steps) in nodes.into_iter().zip(found) {
            for step in steps {
                match step {
                    Step::New(pose) => self.keep(mech, node, pose),
                    Step::Ends { passed, singular } => {
                        for pose in &passed {
                            self.record(pose);
                        }
                        self.reached.singular += u64::from(singular);
                        self.reached.at_limits += u64::from(!singular);
                    }
                }
            }
        }
        self.front.len()
    }

    /// Steps to one node from poses of the last wave, (node, index of the pose), without those to a pose known there.
    fn steps_to(&self, mech: &Mechanism, steps: &[(usize, usize)]) -> Vec<Step> {
        let (node, scale) = (steps[0].0, mech.characteristic_length);
        let to = squares(&self.lengths(node as i64));
        let mut markers: Vec<Vec3<f64>> = self.markers(node).collect();
        let is_known = |markers: &[Vec3<f64>], pose: &Pose<f64>, within: f64| {
            markers.iter().any(|&known| (known - marker(mech, pose)).norm() <= within * scale)
        };
        let mut found = Vec::new();
        for &(_, i) in steps {
            let (neighbour, pose) = &self.front[i];
            let System { residual, matrix } = system(mech, pose, &to);
            let x = solve(matrix, residual.map(|f| -f)).x;
            if is_known(&markers, &pose.stepped(&step_of(mech, x, 1.0)), PREDICTED * size(&x)) {
                continue;
            }
            match self.step(mech, pose, &squares(&self.lengths(*neighbour as i64)), &to) {
                Step::New(pose) if is_known(&markers, &pose, SAME) => {}
                step => {
                    if let Step::New(pose) = &step {
                        markers.push(marker(mech, pose));
                    }
                    found.push(step);
                }
            }
        }
        found
    }

    /// Continues from a pose to other lengths, both given by their squares, in pieces that are halved where the way ends.
    fn step(&self, mech: &Mechanism, pose: &Pose<f64>, from: &[f64; 6], to: &[f64; 6]) -> Step {
        let (mut passed, mut t, mut piece) = (vec![*pose], 0.0, 1.0);
        while t < 1.0 {
            let next: f64 = t + piece;
            let squares = std::array::from_fn(|k| (1.0 - next) * from[k] + next * to[k]);
            let (continued, _) = continuation(mech, &squares, &passed[passed.len() - 1], WHOLE);
            match continued {
                Some(pose) if self.is_inside(mech, &pose) => {
                    passed.push(pose);
                    t = next;
                }
                _ if piece <= SHORTEST_PIECE => return Step::Ends { passed, singular: continued.is_none() },
                _ => piece *= 0.5,
            }
        }
        Step::New(passed[passed.len() - 1])
    }

    /// Keeps a new pose of a node.
    fn keep(&mut self, mech: &Mechanism, node: usize, pose: Pose<f64>) {
        let last = &mut self.last[node];
        self.reached.inside += u64::from(*last == NONE);
        self.reached.poses += 1;
        self.known.push(Known { marker: marker(mech, &pose).array().map(|x| x as f32), next: *last });
        *last = u32::try_from(self.known.len() - 1).expect("fewer poses than memory holds");
        self.front.push((node, pose));
        self.record(&pose);
    }

    /// Takes a pose into the extents.
    fn record(&mut self, pose: &Pose<f64>) {
        let (reached, o) = (&mut self.reached, pose.o.array());
        for (extent, x) in reached.extents.iter_mut().zip(o) {
            *extent = [extent[0].min(x), extent[1].max(x)];
        }
        let layer = ((o[2] - self.layers.0) / self.layers.1).floor();
        if let Some(p) = reached.profile.get_mut(layer.max(0.0) as usize) {
            *p = [p[0].min(o[0]), p[1].max(o[0]), p[2].min(o[1]), p[3].max(o[1])];
        }
    }
}

/// Where a pose has the point by which it is known.
fn marker(mech: &Mechanism, pose: &Pose<f64>) -> Vec3<f64> {
    pose.o + pose.rotation * (MARKER * mech.characteristic_length)
}
