//! Balance of a leg by itself: what its joints transmit to the platform under given forces, and without any.

use crate::dynamics::joint_reactions::{JointFrame, LinkJoint, pure};
use crate::model::drive::Drive;
use crate::model::joint::JointKind;
use crate::number::lanes::Lanes;
use crate::number::work::work;
use crate::numerics::householder::Householder;
use crate::spatial::{Vec3, Wrench};

/// Wrenches of a leg on the platform, at its b in base axes, torques divided by the characteristic length:
/// the particular one that balances the given forces of the leg, and a basis of those that its joints
/// transmit without any.
pub(super) struct LegBalance<V> {
    /// Components that its joints cannot transmit: the joint, from base to platform, and the component.
    free: Vec<(usize, usize)>,
    system: Householder<V>,
    /// The first of its columns in the whole.
    pub(super) first: usize,
    /// The active force, where it is given.
    pub(super) push: V,
    pub(super) particular: Wrench<V>,
    pub(super) carried: Vec<Wrench<V>>,
}

impl<V: Lanes> LegBalance<V> {
    pub(super) fn new(joints: &[LinkJoint], first: usize, pushed: bool) -> Self {
        let mut free: Vec<_> = joints
            .iter()
            .enumerate()
            .flat_map(|(j, joint)| joint.free.iter().map(move |&k| (j, k)))
            .collect();
        if joints[0].kind == JointKind::Spherical.letter() && joints[2].kind == joints[0].kind {
            // Rotation about itself is free at either end, and is one motion: neither end can hold it.
            free.retain(|&at| at != (0, 4));
        }
        if pushed {
            free.push((1, 1));
        }
        let carried = vec![Wrench::zero(); 6 - free.len()];
        LegBalance {
            system: Householder::new(free.len(), 6),
            free,
            first,
            push: V::zero(),
            particular: Wrench::zero(),
            carried,
        }
    }

    /// A joint carries nothing where it is free: no power along its motion there, seen at b \[T44\].
    #[inline(always)]
    fn solve(
        &mut self,
        drive: Drive,
        places: &[JointFrame<V>],
        [first, second]: [Wrench<V>; 2],
        length: f64,
    ) {
        let end = places[2].point;
        // What is given above the joint, at its point.
        let at_base = second.moved(end - places[0].point);
        let both = pure(at_base + first, length);
        let given = if drive.moves_foot() {
            [pure(at_base, length), both, Wrench::zero()]
        } else {
            [both, pure(second, length), Wrench::zero()]
        };
        let mut rhs = [V::zero(); 6];
        for row in 0..self.free.len() {
            let (j, k) = self.free[row];
            let (axis, lever) = (places[j].axes.0[k % 3], end - places[j].point);
            let motion = if k < 3 {
                Wrench::new(axis, Vec3::zero())
            } else {
                Wrench::new(axis.cross(lever).scale(1.0 / length), axis)
            };
            let entries = motion.array();
            for column in 0..6 {
                self.system.set(row, column, entries[column]);
            }
            // The one force that a joint does not leave free but is given is that of an actuator.
            rhs[row] = if k < 3 { axis.dot(given[j].force) + self.push } else { axis.dot(given[j].torque) };
        }
        self.system.factor();
        self.system.solve(&mut rhs);
        self.particular = Wrench::from_array(rhs);
        for k in 0..self.carried.len() {
            let mut x = [V::zero(); 6];
            self.system.null_vector(k, &mut x);
            self.carried[k] = Wrench::from_array(x);
        }
    }

    /// The wrench with the given shares of what it carries.
    #[inline(always)]
    pub(super) fn with(&self, particular: bool, shares: &[V], length: f64) -> Wrench<V> {
        let mut sum = if particular { self.particular } else { Wrench::zero() };
        for k in 0..self.carried.len() {
            sum = sum + self.carried[k] * shares[self.first + k];
        }
        Wrench::new(sum.force, sum.torque.scale(length))
    }
}

work! {
    pub(super) SolveLeg<'a, V: Lanes> {
        leg: &'a mut LegBalance<V>,
        drive: Drive,
        places: &'a [JointFrame<V>],
        given: [Wrench<V>; 2],
        length: f64,
    } -> () {
        leg.solve(drive, places, given, length);
    }
}
