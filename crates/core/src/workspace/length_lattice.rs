//! The reachable workspace in joint space: the poses for a lattice of leg lengths, by continuation from one
//! of them \[T41\].
//!
//! Nodes are kept in slabs, one for each index of the first axis. In a wave each slab predicts where steps
//! from its own newest poses lead, and then takes in those that lead to it: slabs share the threads, and wait
//! for nothing else.

use rayon::prelude::*;

use crate::forward_kinematics::newton::forward_kinematics;
use crate::kinematics::leg;
use crate::model::limit::{Bound, Measure};
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::WIDTH;
use crate::number::order::{larger, largest};
use crate::spatial::{Pose, Vec3};
use crate::workspace::lattice_poses::{Front, NONE, Reached, Slab};
use crate::workspace::lattice_steps::{AXES, Met, Predicted, Room, Way, follow, marker, predict};

/// Two poses with the same lengths and a marker this near are one, relative to the characteristic length.
const SAME: f64 = 1e-4;

/// Lengths of one actuated leg.
#[derive(Clone, Copy, Debug)]
struct Axis {
    least: f64,
    step: f64,
    count: usize,
    /// The node nearest to the start pose.
    center: usize,
    /// From a node to the next along the axis; the last axis runs fastest.
    stride: usize,
}

impl Axis {
    /// Index of a node along the axis.
    fn place(&self, node: usize) -> usize {
        node / self.stride % self.count
    }

    fn length(&self, place: usize) -> f64 {
        self.least + self.step * place as f64
    }
}

/// A step to a neighbour: along an axis by one node, back (even) or on (odd).
#[derive(Clone, Copy, Debug)]
struct Step {
    direction: u8,
    /// The pose that it is made from, by its place in the front.
    source: u32,
    node: usize,
    /// First-order prediction of the marker's position at the end, and its tolerance, m.
    marker: [f32; 3],
    within: f32,
}

/// Steps to the slab before, to the same one, and to the slab behind.
type Steps = [Vec<Step>; 3];

/// The poses at the nodes of the lattice, reached wave by wave. A node may have several: those of one aspect
/// with the same lengths. Memory: 5 bytes for each node and 16 for each pose, and 500 for each that a wave
/// reaches.
#[derive(Clone, Debug)]
pub struct Lattice {
    axes: Vec<Axis>,
    slabs: Vec<Slab>,
    /// The poses that the last wave reached in each slab.
    fronts: Vec<Front>,
    pub reached: Reached,
    /// Least and greatest coordinates of o that are looked at, m.
    bounds: [[f64; 2]; 3],
    /// Lower end of the first layer of z and the height of each, m.
    pub layers: (f64, f64),
}

impl Step {
    /// The direction back.
    fn back(&self) -> u16 {
        1 << (self.direction ^ 1)
    }
}

fn short(place: Vec3<f64>) -> [f32; 3] {
    place.array().map(|x| x as f32)
}

impl Lattice {
    /// Lengths from the least to the greatest of each stroke in steps of about `step`, and layers of z of the
    /// height `layer`; o within `bounds`. None where an actuated leg has no stroke or is no telescopic one,
    /// or the node next to the start pose has no pose inside all limits in its mode.
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
                if leg.drive.moves_foot() {
                    return None;
                }
                let end = |least: bool| {
                    mech.limits.iter().find_map(|l| match (&l.measure, l.bound) {
                        (Measure::Length(k), Bound::Least(x)) if *k == i && least => Some(x),
                        (Measure::Length(k), Bound::Most(x)) if *k == i && !least => Some(x),
                        _ => None,
                    })
                };
                let (least, most) = (end(true)?, end(false)?);
                let pieces = larger(((most - least) / step).round(), 1.0);
                let step = (most - least) / pieces;
                let center =
                    ((leg::position(leg, start).coordinate - least) / step).round().clamp(0.0, pieces);
                Some(Axis { least, step, count: pieces as usize + 1, center: center as usize, stride: 1 })
            })
            .collect();
        let mut axes = axes?;
        let mut size = 1;
        for axis in axes.iter_mut().rev() {
            axis.stride = size;
            size *= axis.count;
        }
        let longest = largest(axes.iter().map(|a| a.length(a.count)));
        let middle = largest(mech.legs.iter().map(|leg| leg.base.point.z));
        let reach = longest + largest(mech.legs.iter().map(|leg| leg.platform.point.norm()));
        let layers = (middle - reach, layer);
        let nodes = axes.first()?.stride;
        let slabs: Vec<Slab> = (0..axes[0].count).map(|i| Slab::new(i * nodes, nodes)).collect();
        let fronts = vec![Front::default(); slabs.len()];
        let reached = Reached::new((2.0 * reach / layer).ceil() as usize);
        let mut lattice = Lattice { axes, slabs, fronts, reached, bounds, layers };
        let center: usize = lattice.axes.iter().map(|a| a.center * a.stride).sum();
        let lengths: Vec<f64> = lattice.axes.iter().map(|a| a.length(a.center)).collect();
        let found = forward_kinematics(mech, &lengths, start);
        if found.status != Status::Ok || !(Room { mech, bounds: &lattice.bounds }).holds(&found.pose) {
            return None;
        }
        let first = lattice.axes[0].center;
        lattice.slabs[first].keep(center, short(marker(mech, &found.pose)));
        lattice.fronts[first].push(center, found.pose, 0);
        lattice.reached.record(found.pose.o, layers);
        (lattice.reached.inside, lattice.reached.poses) = (1, 1);
        Some(lattice)
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.slabs.iter().map(|slab| slab.last.len()).sum()
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The squared lengths of a node.
    fn squares(&self, node: usize) -> [f64; 6] {
        let mut squares = [0.0; 6];
        for (square, axis) in squares.iter_mut().zip(&self.axes) {
            let length = axis.length(axis.place(node));
            *square = length * length;
        }
        squares
    }

    /// Steps from the poses of the last wave to the neighbours of their nodes; the number of new poses. Those
    /// at one node are found in the order of the poses that they are reached from: the number of threads
    /// changes nothing.
    pub fn wave(&mut self, mech: &Mechanism) -> usize {
        let steps: Vec<Steps> = self.fronts.par_iter().map(|front| self.steps(mech, front)).collect();
        let mut slabs = std::mem::take(&mut self.slabs);
        let found: Vec<(Front, Reached)> = slabs
            .par_iter_mut()
            .enumerate()
            .map(|(i, slab)| {
                // From the slabs before, within, and behind, which is the order of the poses.
                let before = i.checked_sub(1).map(|i| &steps[i][2]);
                let behind = steps.get(i + 1).map(|steps| &steps[0]);
                let steps = before.into_iter().chain([&steps[i][1]]).chain(behind).flatten();
                self.receive(mech, slab, i, steps.copied())
            })
            .collect();
        self.slabs = slabs;
        self.fronts.clear();
        for (front, reached) in found {
            self.reached.add(&reached);
            self.fronts.push(front);
        }
        self.fronts.iter().map(|front| front.nodes.len()).sum()
    }

    /// The steps from the poses of a front, without those back.
    fn steps(&self, mech: &Mechanism, front: &Front) -> Steps {
        let mut steps = Steps::default();
        let (mut changes, mut predicted) = ([[[0.0; WIDTH]; 2]; AXES], Predicted::default());
        for start in (0..front.nodes.len()).step_by(WIDTH) {
            let nodes = &front.nodes[start..front.nodes.len().min(start + WIDTH)];
            for (axis, changes) in self.axes.iter().zip(&mut changes) {
                for (k, &node) in nodes.iter().enumerate() {
                    let square = |place: f64| (axis.least + axis.step * place).powi(2);
                    let place = axis.place(node) as f64;
                    changes[0][k] = square(place - 1.0) - square(place);
                    changes[1][k] = square(place + 1.0) - square(place);
                }
            }
            predict(mech, &front.poses[start..start + nodes.len()], &changes, &mut predicted);
            for (k, &node) in nodes.iter().enumerate() {
                for (a, axis) in self.axes.iter().enumerate() {
                    let place = axis.place(node);
                    for on in 0..2 {
                        let direction = 2 * a + on;
                        let leaves = if on == 1 { place + 1 == axis.count } else { place == 0 };
                        if leaves || front.came[start + k] >> direction & 1 == 1 {
                            continue;
                        }
                        let to = if a == 0 { 2 * on } else { 1 };
                        steps[to].push(Step {
                            direction: direction as u8,
                            source: (start + k) as u32,
                            node: if on == 1 { node + axis.stride } else { node - axis.stride },
                            marker: predicted.marker(a, on, k),
                            within: predicted.within(a, on, k),
                        });
                    }
                }
            }
        }
        steps
    }

    /// Makes the steps to a slab that lead to no pose known there. Where several lead to one node, the first
    /// of them is made, and the others wait for what it finds.
    fn receive(
        &self,
        mech: &Mechanism,
        slab: &mut Slab,
        index: usize,
        steps: impl Iterator<Item = Step>,
    ) -> (Front, Reached) {
        let room = Room { mech, bounds: &self.bounds };
        let same = (SAME * mech.characteristic_length) as f32;
        let (mut front, mut reached) = (Front::default(), Reached::new(self.reached.profile.len()));
        let known_before = slab.known.len();
        let mut waiting: Vec<Step> = steps.collect();
        while !waiting.is_empty() {
            let mut made = Vec::new();
            waiting.retain(|step| {
                if let Some(known) = slab.find(step.node, step.marker, step.within) {
                    front.note(known.checked_sub(known_before), step.back());
                    return false;
                }
                let awaited = &mut slab.awaited[step.node - slab.first];
                if !std::mem::replace(awaited, true) {
                    made.push(*step);
                    return false;
                }
                true
            });
            let ways = made.iter().enumerate().map(|(i, step)| self.way(i, index, step));
            follow(room, ways, |i, met| match met {
                Met::Place(o) => reached.record(o, self.layers),
                Met::Limit => reached.at_limits += 1,
                Met::Singularity => reached.singular += 1,
                Met::Pose(pose) => {
                    let (step, marker) = (&made[i], short(marker(mech, &pose)));
                    if let Some(known) = slab.find(step.node, marker, same) {
                        front.note(known.checked_sub(known_before), step.back());
                        return;
                    }
                    reached.inside += u64::from(slab.last[step.node - slab.first] == NONE);
                    reached.poses += 1;
                    reached.record(pose.o, self.layers);
                    slab.keep(step.node, marker);
                    front.push(step.node, pose, step.back());
                }
            });
            for step in &made {
                slab.awaited[step.node - slab.first] = false;
            }
        }
        (front.in_order(), reached)
    }

    /// The way of a step to the slab with an index.
    fn way(&self, number: usize, slab: usize, step: &Step) -> Way {
        let source = match step.direction {
            0 => slab + 1,
            1 => slab - 1,
            _ => slab,
        };
        let (front, i) = (&self.fronts[source], step.source as usize);
        let along = usize::from(step.direction / 2);
        let axis = &self.axes[along];
        let from = axis.length(axis.place(front.nodes[i]));
        Way::new(number, front.poses[i], along, from * from, self.squares(step.node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::published;
    use crate::forward_kinematics::newton::{LegTarget, continuation, size, step_of, system};
    use crate::kinematics::coordinate_sets::Set;
    use crate::model::limit::Limit;
    use crate::model::spec::Axes;
    use crate::numerics::gauss::solve;
    use crate::workspace::fit_orientation::{ON_LIMIT, margins};

    const BOUNDS: [[f64; 2]; 3] = [[-0.8, 0.8], [-0.8, 0.8], [0.5, 1.0]];

    /// The published manipulator; with a cone and a floor of the conditioning as well, the latter tested pose
    /// by pose.
    fn mechanisms() -> [Mechanism; 2] {
        let mut limited = published();
        let limit = |measure, bound| Limit { name: String::new(), measure, bound, scale: 1.0 };
        limited.limits.push(limit(Measure::Cone(0, Axes::Platform), Bound::Most(2.0)));
        limited.limits.push(limit(Measure::Conditioning, Bound::Least(0.03)));
        [published(), limited]
    }

    fn lattice(mech: &Mechanism, step: f64) -> Lattice {
        let start = Set::of(mech)[1].pose(mech, &[0.0, 0.0, 0.74, 0.3, 0.1, 0.0, 0.0]);
        Lattice::new(mech, &start, BOUNDS, step, 0.01).expect("a start")
    }

    /// The steps from the poses of the last wave as ways, with the poses and squared lengths at both ends.
    fn ways(mech: &Mechanism, lattice: &Lattice) -> Vec<(Way, Pose<f64>, [[f64; 6]; 2])> {
        let mut ways = Vec::new();
        for (slab, front) in lattice.fronts.iter().enumerate() {
            for (to, steps) in lattice.steps(mech, front).iter().enumerate() {
                for step in steps {
                    let (node, pose) = (front.nodes[step.source as usize], front.poses[step.source as usize]);
                    let ends = [lattice.squares(node), lattice.squares(step.node)];
                    ways.push((lattice.way(ways.len(), slab + to - 1, step), pose, ends));
                }
            }
        }
        ways
    }

    /// Path followed alone, by its definition.
    fn alone(mech: &Mechanism, pose: &Pose<f64>, [from, to]: &[[f64; 6]; 2]) -> Vec<Met> {
        // Shares of the way that are to be reached next, the nearest one last.
        let (mut pose, mut share, mut goals, mut met) = (*pose, 0.0, vec![1.0], vec![]);
        while let Some(&goal) = goals.last() {
            let ahead = std::array::from_fn(|k| {
                if from[k] == to[k] { to[k] } else { (1.0 - goal) * from[k] + goal * to[k] }
            });
            let ahead: [f64; 6] = ahead;
            let asked = ahead.map(|square| LegTarget { place: 0.0, square });
            let found = continuation(mech, &asked, &pose, 1.0).0;
            let inside = |pose: &Pose<f64>| {
                let o = pose.o.array();
                (0..3).all(|k| BOUNDS[k][0] <= o[k] && o[k] <= BOUNDS[k][1])
                    && margins(mech, pose).iter().all(|margin| *margin >= -ON_LIMIT)
            };
            match found {
                Some(found) if inside(&found) => {
                    (pose, share) = (found, goal);
                    met.push(if goal < 1.0 { Met::Place(pose.o) } else { Met::Pose(pose) });
                    goals.pop();
                }
                _ if goal - share > 1.0 / 64.0 => goals.push(0.5 * (share + goal)),
                Some(_) => return [met, vec![Met::Limit]].concat(),
                None => return [met, vec![Met::Singularity]].concat(),
            }
        }
        met
    }

    /// Poses met on each path, paths followed side by side.
    fn followed(mech: &Mechanism, ways: &[Way]) -> Vec<Vec<Met>> {
        let mut met = vec![vec![]; ways.len()];
        let room = Room { mech, bounds: &BOUNDS };
        let numbered = ways.iter().cloned().enumerate().map(|(step, mut way)| {
            way.step = step;
            way
        });
        follow(room, numbered, |i, one| met[i].push(one));
        met
    }

    /// Equality up to the rounding of fused registers.
    fn near(a: &Met, b: &Met) -> bool {
        match (a, b) {
            (Met::Place(a), Met::Place(b)) => (*a - *b).norm() < 1e-9,
            (Met::Pose(a), Met::Pose(b)) => (a.o - b.o).norm() < 1e-9,
            (Met::Limit, Met::Limit) | (Met::Singularity, Met::Singularity) => true,
            _ => false,
        }
    }

    #[test]
    fn ways_side_by_side_are_those_alone() {
        let (mut limits, mut singularities, mut poses) = (0, 0, 0);
        for mech in mechanisms() {
            let mut lattice = lattice(&mech, 0.05);
            for _ in 0..5 {
                lattice.wave(&mech);
            }
            let ways = ways(&mech, &lattice);
            assert!(ways.len() > 200);
            let each: Vec<Way> = ways.iter().map(|(way, ..)| way.clone()).collect();
            for (met, (way, pose, ends)) in followed(&mech, &each).iter().zip(&ways) {
                let [by_itself] = &followed(&mech, std::slice::from_ref(way))[..] else { panic!("one way") };
                assert_eq!(format!("{met:?}"), format!("{by_itself:?}"));
                let plain = alone(&mech, pose, ends);
                assert!(
                    met.len() == plain.len() && met.iter().zip(&plain).all(|(a, b)| near(a, b)),
                    "{met:?} {plain:?}"
                );
                for one in met {
                    limits += u32::from(matches!(one, Met::Limit));
                    singularities += u32::from(matches!(one, Met::Singularity));
                    poses += u32::from(matches!(one, Met::Pose(_)));
                }
            }
        }
        assert!(limits > 30 && singularities > 30 && poses > 300, "{limits} {singularities} {poses}");
    }

    #[test]
    fn steps_are_predicted_by_the_first_newton_step() {
        let mech = published();
        let mut lattice = lattice(&mech, 0.05);
        lattice.wave(&mech);
        lattice.wave(&mech);
        let mut count = 0;
        for front in &lattice.fronts {
            for step in lattice.steps(&mech, front).iter().flatten() {
                let pose = &front.poses[step.source as usize];
                let at = system(
                    &mech,
                    pose,
                    &lattice.squares(step.node).map(|square| LegTarget { place: 0.0, square }),
                );
                let x = solve(at.matrix, at.residual.map(|f| -f)).x;
                let next = pose.stepped(&step_of(&mech, x, 1.0));
                let off = marker(&mech, &next) - Vec3::from(step.marker.map(f64::from));
                assert!(off.norm() < 1e-6 * mech.characteristic_length);
                let within = 0.25 * size(&x) * mech.characteristic_length;
                assert!((f64::from(step.within) - within).abs() < 1e-6 * within);
                count += 1;
            }
        }
        assert!(count > 100);
    }

    #[test]
    fn no_step_leads_back() {
        let mech = published();
        let mut lattice = lattice(&mech, 0.05);
        let start = lattice.fronts.iter().find_map(|front| front.nodes.first().copied());
        lattice.wave(&mech);
        for front in &lattice.fronts {
            let steps = lattice.steps(&mech, front);
            assert!(steps.iter().flatten().all(|step| Some(step.node) != start));
        }
    }
}
