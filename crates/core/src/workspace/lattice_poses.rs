//! Poses that a search over a lattice of leg lengths has reached: in slabs of nodes, on the front of a wave,
//! in sum.

use crate::spatial::{Pose, Vec3};

/// End of a list of poses.
pub(super) const NONE: u32 = u32::MAX;

/// A pose that has been reached, by its marker: a point of the platform tells poses with the same lengths
/// apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    marker: [f32; 3],
    /// The pose of the same node that was reached before.
    next: u32,
}

/// The nodes with one length of the first leg, and the poses reached there.
#[derive(Clone, Debug)]
pub(super) struct Slab {
    /// Index of its first node.
    pub(super) first: usize,
    /// The pose of each node that was reached last.
    pub(super) last: Vec<u32>,
    pub(super) known: Vec<Known>,
    /// Nodes that a step is under way to.
    pub(super) awaited: Vec<bool>,
}

/// Poses that a wave has reached in a slab, in the order of their nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Front {
    pub(super) nodes: Vec<usize>,
    pub(super) poses: Vec<Pose<f64>>,
    /// Directions, as bits, from which steps have led to the pose: the ways back are known.
    pub(super) came: Vec<u16>,
}

/// Poses reached by the search: inside all limits, each by a step from a neighbouring node.
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
    /// Least and greatest coordinate of o, m: of these poses and of those passed on steps that are made in
    /// pieces.
    pub extents: [[f64; 2]; 3],
    /// Least and greatest x and y of o in each layer of z.
    pub profile: Vec<[f64; 4]>,
}

impl Reached {
    pub(super) fn new(layers: usize) -> Self {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let profile = vec![[none[0], none[1], none[0], none[1]]; layers];
        Reached { inside: 0, poses: 0, at_limits: 0, singular: 0, extents: [none; 3], profile }
    }

    /// Takes a position of o into the extents.
    pub(super) fn record(&mut self, o: Vec3<f64>, layers: (f64, f64)) {
        let o = o.array();
        widen(self.extents.as_flattened_mut(), &[o[0], o[0], o[1], o[1], o[2], o[2]]);
        // What is below the first layer counts to it.
        let layer = ((o[2] - layers.0) / layers.1) as usize;
        if let Some(p) = self.profile.get_mut(layer) {
            widen(p, &[o[0], o[0], o[1], o[1]]);
        }
    }

    /// Adds what another part of the lattice has met.
    pub(super) fn add(&mut self, other: &Self) {
        self.inside += other.inside;
        self.poses += other.poses;
        self.at_limits += other.at_limits;
        self.singular += other.singular;
        widen(self.extents.as_flattened_mut(), other.extents.as_flattened());
        widen(self.profile.as_flattened_mut(), other.profile.as_flattened());
    }
}

/// Widens ranges, each a least and a greatest number, to hold others.
fn widen(ranges: &mut [f64], others: &[f64]) {
    for (range, other) in ranges.chunks_exact_mut(2).zip(others.chunks_exact(2)) {
        if other[0] < range[0] {
            range[0] = other[0];
        }
        if other[1] > range[1] {
            range[1] = other[1];
        }
    }
}

impl Slab {
    pub(super) fn new(first: usize, nodes: usize) -> Self {
        Slab { first, last: vec![NONE; nodes], known: vec![], awaited: vec![false; nodes] }
    }

    /// The last of the poses known at a node whose marker is within a distance of a point.
    pub(super) fn find(&self, node: usize, place: [f32; 3], within: f32) -> Option<usize> {
        let mut at = self.last[node - self.first];
        while let Some(known) = self.known.get(at as usize) {
            let [x, y, z] = std::array::from_fn(|k| known.marker[k] - place[k]);
            // An infinite distance is none.
            if x * x + y * y + z * z < within * within {
                return Some(at as usize);
            }
            at = known.next;
        }
        None
    }

    /// Keeps a new pose of a node.
    pub(super) fn keep(&mut self, node: usize, marker: [f32; 3]) {
        let last = &mut self.last[node - self.first];
        self.known.push(Known { marker, next: *last });
        *last = u32::try_from(self.known.len() - 1).expect("fewer poses than memory holds");
    }
}

impl Front {
    pub(super) fn push(&mut self, node: usize, pose: Pose<f64>, came: u16) {
        self.nodes.push(node);
        self.poses.push(pose);
        self.came.push(came);
    }

    /// Notes the direction from which a step has led to one of the poses, if it has.
    pub(super) fn note(&mut self, pose: Option<usize>, direction: u16) {
        if let Some(i) = pose {
            self.came[i] |= direction;
        }
    }

    /// Copy with the poses in the order of their nodes.
    pub(super) fn in_order(&self) -> Self {
        let mut order: Vec<usize> = (0..self.nodes.len()).collect();
        order.sort_by_key(|&i| self.nodes[i]);
        Front {
            nodes: order.iter().map(|&i| self.nodes[i]).collect(),
            poses: order.iter().map(|&i| self.poses[i]).collect(),
            came: order.iter().map(|&i| self.came[i]).collect(),
        }
    }
}
