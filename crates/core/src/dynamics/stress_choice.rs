//! The choice among self-stresses: those that are added until reactions are least \[T47\].

use crate::dynamics::joint_reactions::{JointFrame, LinkJoint};
use crate::model::joint::JointKind;
use crate::number::lanes::{Lanes, any};
use crate::number::work::work;
use crate::numerics::householder::Householder;
use crate::spatial::Wrench;

/// A component (torques divided by Λ) that no self-stress of size one changes by more is determinate: poses
/// may miss their constraints by as much.
pub(super) const OPEN: f64 = 1e-6;

/// Cosine of the angle between the couples of two self-stresses that counts as square, and the share of all
/// couples that is rounding.
const SQUARE: f64 = 1e-15;

/// Far more rotations of all pairs than any self-stresses need.
const SWEEPS: usize = 60;

/// Self-stresses, and the rules by which they are added \[T47\].
pub(super) struct Choice<V> {
    pub(super) count: usize,
    /// How many joints there are, and which of them are universal.
    joints: usize,
    universal: Vec<usize>,
    /// Length that divides couples, and torques in the sum of squares that is minimised, m.
    length: f64,
    scale: f64,
    /// The reactions of all joints, of one self-stress after the other.
    pub(super) stresses: Vec<Wrench<V>>,
    /// Their couples in the universal joints, and the sum of squares of each one's; zero if it is as good as
    /// none.
    couples: Vec<V>,
    sizes: Vec<V>,
    /// Products of the self-stresses.
    system: Householder<V>,
    shares: Vec<V>,
}

impl<V: Lanes> Choice<V> {
    pub(super) fn new(joints: &[LinkJoint], count: usize, length: f64, scale: f64) -> Self {
        let is_universal = |&j: &usize| joints[j].kind == JointKind::Universal.letter();
        let universal: Vec<usize> = (0..joints.len()).filter(is_universal).collect();
        Choice {
            count,
            joints: joints.len(),
            length,
            scale,
            stresses: vec![Wrench::zero(); count * joints.len()],
            couples: vec![V::zero(); count * universal.len()],
            universal,
            sizes: vec![V::zero(); count],
            system: Householder::new(count, count),
            shares: vec![V::zero(); count],
        }
    }

    #[inline(always)]
    fn stress(&self, k: usize) -> &[Wrench<V>] {
        &self.stresses[k * self.joints..(k + 1) * self.joints]
    }

    /// Rotates the self-stresses into others, orthonormal as they are, whose couples are perpendicular to one
    /// another.
    #[inline(always)]
    fn turn(&mut self, places: &[JointFrame<V>]) {
        let (width, mut all) = (self.universal.len(), V::zero());
        for s in 0..self.count {
            for u in 0..width {
                let couple = self.couple(places, u, self.stress(s));
                self.couples[s * width + u] = couple;
                all = couple.mul_add(couple, all);
            }
        }
        for _ in 0..SWEEPS {
            let mut turned = V::zero();
            for j in 1..self.count {
                for i in 0..j {
                    turned = turned.most(self.make_square(i, j, all));
                }
            }
            if !any(turned) {
                break;
            }
        }
        for s in 0..self.count {
            let size = self.product_of_couples(s, s);
            self.sizes[s] = V::select(size.greater(V::lit(OPEN * OPEN)), size, V::zero());
        }
    }

    #[inline(always)]
    fn product_of_couples(&self, i: usize, j: usize) -> V {
        let (width, mut sum) = (self.universal.len(), V::zero());
        for u in 0..width {
            sum = self.couples[i * width + u].mul_add(self.couples[j * width + u], sum);
        }
        sum
    }

    /// Rotates a pair where its couples are not perpendicular yet, and tells where.
    #[inline(always)]
    fn make_square(&mut self, i: usize, j: usize, all: V) -> V {
        let (a, b) = (self.product_of_couples(i, i), self.product_of_couples(j, j));
        let product = self.product_of_couples(i, j);
        let counts = a.least(b).greater(all.scale(SQUARE * SQUARE));
        let cosine = V::select(counts, product * product, V::zero());
        let turns = cosine.greater((a * b).scale(SQUARE * SQUARE));
        // The smaller rotation that does it: t = tan of its angle, t² + 2 ζ t = 1.
        let zeta = (b - a) / (product + product);
        let t = zeta.signum() / (zeta.abs() + zeta.mul_add(zeta, V::one()).sqrt());
        let cos = V::one() / t.mul_add(t, V::one()).sqrt();
        let sin = cos * t;
        let width = self.universal.len();
        for u in 0..width {
            let (p, q) = (self.couples[i * width + u], self.couples[j * width + u]);
            self.couples[i * width + u] = V::select(turns, cos * p - sin * q, p);
            self.couples[j * width + u] = V::select(turns, sin * p + cos * q, q);
        }
        for joint in 0..self.joints {
            let (at, other) = (i * self.joints + joint, j * self.joints + joint);
            let (mut p, mut q) = (self.stresses[at].array(), self.stresses[other].array());
            for k in 0..6 {
                let (x, y) = (p[k], q[k]);
                p[k] = V::select(turns, cos * x - sin * y, x);
                q[k] = V::select(turns, sin * x + cos * y, y);
            }
            self.stresses[at] = Wrench::from_array(p);
            self.stresses[other] = Wrench::from_array(q);
        }
        V::select(turns, V::one(), V::zero())
    }

    /// Adds self-stresses until the reactions are least, but first until the couples in universal joints are,
    /// if asked to. A second time takes off the rounding of the first.
    #[inline(always)]
    fn make_least(&mut self, places: &[JointFrame<V>], couples_first: bool, reactions: &mut [Wrench<V>]) {
        if self.count == 0 {
            return;
        }
        for k in 0..self.count {
            for s in 0..self.count {
                // Self-stresses that change couples are left out of the second choice.
                let kept = if couples_first { self.sizes[k].most(self.sizes[s]) } else { V::zero() };
                let unit = V::lit(f64::from(u8::from(k == s)));
                let product = self.product(self.stress(k), self.stress(s));
                self.system.set(k, s, V::select(kept.greater(V::zero()), unit, product));
            }
        }
        self.system.factor();
        for _ in 0..2 {
            if couples_first {
                self.set_shares_of_couples(places, reactions);
                self.take_off(reactions);
            }
            for s in 0..self.count {
                let kept = if couples_first { self.sizes[s] } else { V::zero() };
                let product = self.product(self.stress(s), reactions);
                self.shares[s] = V::select(kept.greater(V::zero()), V::zero(), product);
            }
            self.system.solve(&mut self.shares);
            self.take_off(reactions);
        }
    }

    /// How much of each self-stress there is in the couples.
    #[inline(always)]
    fn set_shares_of_couples(&mut self, places: &[JointFrame<V>], reactions: &[Wrench<V>]) {
        let width = self.universal.len();
        for s in 0..self.count {
            let mut sum = V::zero();
            for u in 0..width {
                let couple = self.couple(places, u, reactions);
                sum = self.couples[s * width + u].mul_add(couple, sum);
            }
            let changes = self.sizes[s].greater(V::zero());
            self.shares[s] = V::select(changes, sum / self.sizes[s], V::zero());
        }
    }

    #[inline(always)]
    fn take_off(&self, reactions: &mut [Wrench<V>]) {
        for s in 0..self.count {
            let (stress, share) = (self.stress(s), self.shares[s]);
            for j in 0..self.joints {
                reactions[j] = reactions[j] - stress[j] * share;
            }
        }
    }

    /// The couple in a universal joint, divided by the characteristic length.
    #[inline(always)]
    fn couple(&self, places: &[JointFrame<V>], universal: usize, reactions: &[Wrench<V>]) -> V {
        let j = self.universal[universal];
        places[j].axes.0[2].dot(reactions[j].torque).scale(1.0 / self.length)
    }

    /// The product whose square the second choice makes least.
    #[inline(always)]
    fn product(&self, a: &[Wrench<V>], b: &[Wrench<V>]) -> V {
        let (mut forces, mut torques) = (V::zero(), V::zero());
        for j in 0..self.joints {
            forces = forces + a[j].force.dot(b[j].force);
            torques = torques + a[j].torque.dot(b[j].torque);
        }
        forces + torques.scale(1.0 / (self.scale * self.scale))
    }
}

work! {
    pub(super) TurnStresses<'a, V: Lanes> { choice: &'a mut Choice<V>, places: &'a [JointFrame<V>] } -> () {
        choice.turn(places);
    }
}
work! {
    pub(super) MakeLeast<'a, V: Lanes> {
        choice: &'a mut Choice<V>,
        places: &'a [JointFrame<V>],
        couples_first: bool,
        reactions: &'a mut [Wrench<V>],
    } -> () {
        choice.make_least(places, couples_first, reactions);
    }
}
