//! Statically indeterminate reactions: a particular solution of the equilibrium of all links, the
//! self-stresses (null space), and the two choices among the solutions \[T46\] \[T47\]. For one state or for
//! one in each lane, in memory allocated once.

use crate::dynamics::force_balance::ForceSolver;
use crate::dynamics::joint_reactions::{
    Given, JointFrame, LinkJoint, constraint_wrench, pure, put_places, put_reactions, put_unbalanced,
};
use crate::dynamics::leg_balance::{LegBalance, SolveLeg};
use crate::dynamics::stress_choice::{Choice, MakeLeast, OPEN, TurnStresses};
use crate::kinematics::idle;
use crate::kinematics::singular::WORKING_PRECISION;
use crate::model::mechanism::Mechanism;
use crate::number::lanes::Lanes;
use crate::number::real::{Mask, Real};
use crate::number::slices::{self, pairs};
use crate::number::work::work;
use crate::numerics::householder::Householder;
use crate::spatial::{Motion, Pose, Vec3, Wrench};

/// Largest residual of the equilibrium equations, relative to the reactions.
const RESIDUAL: f64 = 1e-9;

/// Reactions of all joints in the order of [`joints`](crate::dynamics::joint_reactions::joints), each at its
/// joint's point in base axes.
#[derive(Clone, Debug)]
pub struct Reactions {
    pub places: Vec<JointFrame<f64>>,
    /// Universal joints carry no couple, as far as balance lets them \[T47\].
    pub assumed: Vec<Wrench<f64>>,
    /// The least in sum of squares \[T47\].
    pub least: Vec<Wrench<f64>>,
    /// Which components no self-stress changes: in base axes, and in joint axes.
    pub determinate: Vec<[bool; 6]>,
    pub determinate_in_joint: Vec<[bool; 6]>,
    /// On the platform at o, of all legs that constrain it, without their active forces \[T48\].
    pub constraint: Wrench<f64>,
}

/// All reactions that keep up a motion under load, or none at a singular pose. Torques count in the least sum
/// of squares by `scale`, m.
#[must_use]
pub fn solve(
    mech: &Mechanism,
    joints: &[LinkJoint],
    platform: &Motion<f64>,
    load: Wrench<f64>,
    scale: f64,
) -> Option<Reactions> {
    let mut solver = Solver::new(mech, joints, scale);
    let holds = solver.solve(platform, load);
    let flags = |marks: &[[f64; 6]]| marks.iter().map(|marks| marks.map(|mark| mark > 0.0)).collect();
    holds.then(|| Reactions {
        determinate: flags(&solver.determinate),
        determinate_in_joint: flags(&solver.determinate_in_joint),
        constraint: solver.constraint,
        places: solver.places,
        assumed: solver.assumed,
        least: solver.least,
    })
}

/// Solves for the reactions at one state after the other.
pub(crate) struct Solver<'a, V> {
    mech: &'a Mechanism,
    joints: &'a [LinkJoint],
    legs: Vec<LegBalance<V>>,
    /// Wrenches on the platform that hold what nothing in the mechanism does: at o, torques divided by the
    /// characteristic length.
    supports: Vec<Wrench<V>>,
    given: Given<V>,
    none: Given<V>,
    /// The balances of platform and rods, unknown being the shares of what the legs can carry.
    system: Householder<V>,
    unknowns: Vec<V>,
    on_platform: Vec<Wrench<V>>,
    unbalanced: Vec<V>,
    choice: Choice<V>,
    /// Where actuators are redundant.
    forces: Option<ForceSolver<V>>,
    pub places: Vec<JointFrame<V>>,
    /// See [`Reactions`]; 1 for components that are determinate, else 0.
    pub assumed: Vec<Wrench<V>>,
    pub least: Vec<Wrench<V>>,
    pub determinate: Vec<[V; 6]>,
    pub determinate_in_joint: Vec<[V; 6]>,
    pub constraint: Wrench<V>,
}

impl<'a, V: Lanes> Solver<'a, V> {
    /// Room for the states of a mechanism; `scale`, m, is what torques are divided by in the least sum of
    /// squares.
    pub(crate) fn new(mech: &'a Mechanism, joints: &'a [LinkJoint], scale: f64) -> Self {
        let (rods, mut count, mut legs) = (mech.rods.len(), 0, Vec::new());
        for i in 0..mech.legs.len() {
            let pushed = mech.is_redundant() && mech.legs[i].actuated;
            let leg = LegBalance::new(&joints[rods + 3 * i..rods + 3 * i + 3], count, pushed);
            count += leg.carried.len();
            legs.push(leg);
        }
        // Given forces of all actuators hold the platform in all its degrees of freedom, the others in the
        // idle ones.
        let supports = if mech.is_redundant() { mech.dof() } else { mech.idle.len() };
        count += supports;
        let (all, rows) = (joints.len(), 6 + rods);
        let free: usize = joints.iter().map(|joint| joint.free.len()).sum();
        Solver {
            mech,
            joints,
            legs,
            supports: vec![Wrench::zero(); supports],
            given: Given::none(mech),
            none: Given::none(mech),
            // Fewer unknowns than equations has a design that actuators do not control: it has no answer.
            system: Householder::new(rows, count.max(rows)),
            unknowns: vec![V::zero(); count.max(rows)],
            on_platform: vec![Wrench::zero(); mech.legs.len()],
            unbalanced: vec![V::zero(); free + 6],
            choice: Choice::new(joints, count.saturating_sub(rows), mech.characteristic_length, scale),
            forces: mech.is_redundant().then(|| ForceSolver::new(mech)),
            places: vec![JointFrame::nowhere(); all],
            assumed: vec![Wrench::zero(); all],
            least: vec![Wrench::zero(); all],
            determinate: vec![[V::zero(); 6]; all],
            determinate_in_joint: vec![[V::zero(); 6]; all],
            constraint: Wrench::zero(),
        }
    }

    /// Finds all reactions that keep up a motion under load; tells where there are any, which is not at
    /// singular poses.
    #[inline(always)]
    pub(crate) fn solve(&mut self, platform: &Motion<V>, load: Wrench<V>) -> Mask<V> {
        let (mech, pose) = (self.mech, &platform.pose);
        V::apart(SetGiven { given: &mut self.given, mech, platform, load });
        let Some(forces) = &mut self.forces else {
            for k in 0..mech.idle.len() {
                self.supports[k] = Wrench::new(Vec3::zero(), idle::axis(&mech.idle[k], pose));
            }
            return self.solve_given(pose);
        };
        // Redundant actuators push with their least forces \[T72\], which leave the platform's degrees of
        // freedom nothing to hold: what the supports hold shows as an error.
        let regular = forces.solve_motion(mech, platform, load);
        let mut row = 0;
        for (leg, balance) in pairs(&mech.legs, &mut self.legs) {
            balance.push = if leg.actuated { forces.forces[row] } else { V::zero() };
            row += usize::from(leg.actuated);
        }
        for (idle, torque) in pairs(&mech.idle, &forces.forces[forces.numbers.idle()]) {
            self.given.platform = self.given.platform + idle::row(idle, pose) * *torque;
        }
        let mut twists = [[V::zero(); 6]; 6];
        let count = self.supports.len();
        forces.put_freedoms(&mut twists[..count]);
        for (support, twist) in pairs(&mut self.supports, twists) {
            *support = Wrench::from_array(twist);
        }
        let holds = self.solve_given(pose);
        let known = V::select(holds, V::one(), V::zero());
        V::select(regular.greater(V::lit(WORKING_PRECISION)), known, V::zero()).greater(V::zero())
    }

    /// Balances what is given.
    #[inline(always)]
    fn solve_given(&mut self, pose: &Pose<V>) -> Mask<V> {
        let mech = self.mech;
        V::apart(SetPlaces { mech, pose, places: &mut self.places });
        let regular = V::apart(SolveBalances { solver: self, o: pose.o });
        if !mech.is_redundant() {
            self.add_idle_torques();
        }
        self.put_on_platform(true);
        V::apart(PutReactions {
            mech,
            places: &self.places,
            given: &self.given,
            on_platform: &self.on_platform,
            all: &mut self.least,
        });
        let holds = V::apart(Holds { solver: self, o: pose.o, regular });

        for k in 0..self.choice.count {
            self.system.null_vector(k, &mut self.unknowns);
            self.put_on_platform(false);
            let stress = &mut self.choice.stresses[k * self.places.len()..(k + 1) * self.places.len()];
            let (places, given, on_platform) = (&self.places, &self.none, &self.on_platform);
            V::apart(PutReactions { mech, places, given, on_platform, all: stress });
        }
        V::apart(TurnStresses { choice: &mut self.choice, places: &self.places });
        slices::copy(&self.least, &mut self.assumed);
        let (choice, places) = (&mut self.choice, &self.places);
        V::apart(MakeLeast { choice, places, couples_first: false, reactions: &mut self.least });
        let (choice, places) = (&mut self.choice, &self.places);
        V::apart(MakeLeast { choice, places, couples_first: true, reactions: &mut self.assumed });
        V::apart(PutDeterminate { solver: self });
        self.constraint = constraint_wrench(mech, &self.places, pose, &self.assumed);
        holds
    }

    /// Takes the torques of the fictitious supports of local degrees of freedom as given from now on.
    #[inline(always)]
    fn add_idle_torques(&mut self) {
        let (length, first) = (self.mech.characteristic_length, self.supports_from());
        for k in 0..self.supports.len() {
            let Wrench { force, torque } = self.supports[k] * self.unknowns[first + k];
            self.given.platform = self.given.platform + Wrench::new(force, torque.scale(length));
        }
    }

    /// The column of the first fictitious support.
    #[inline(always)]
    fn supports_from(&self) -> usize {
        self.legs.last().map_or(0, |leg| leg.first + leg.carried.len())
    }

    /// The balances of the platform at o and of the rods about their lines; those of the legs hold whatever
    /// their shares are \[T46\].
    #[inline(always)]
    fn set_up(&mut self, o: Vec3<V>) {
        let (mech, length) = (self.mech, self.mech.characteristic_length);
        let (rods, pure_lever) = (mech.rods.len(), 1.0 / length);
        let own = pure(self.given.platform, length).array();
        for x in &mut self.unknowns {
            *x = V::zero();
        }
        for row in 0..6 {
            self.unknowns[row] = -own[row];
        }
        let first = self.supports_from();
        for k in 0..self.supports.len() {
            let support = self.supports[k].array();
            for row in 0..6 {
                self.system.set(row, first + k, support[row]);
            }
            for r in 0..rods {
                self.system.set(6 + r, first + k, V::zero());
            }
        }
        for r in 0..rods {
            self.unknowns[6 + r] = self.places[r].axes.0[0].dot(pure(self.given.rods[r], length).torque);
        }
        for i in 0..mech.legs.len() {
            let below = rods + 3 * i;
            let [cylinder, piston] = self.given.legs[i];
            let leg = &mut self.legs[i];
            let (drive, places) = (mech.legs[i].drive, &self.places[below..below + 3]);
            V::apart(SolveLeg { leg: &mut *leg, drive, places, given: self.given.legs[i], length });
            let (base, end) = (self.places[below].point, self.places[below + 2].point);
            let e = (end - o).scale(pure_lever);
            let particular = leg.particular.moved(e).array();
            for row in 0..6 {
                self.unknowns[row] = self.unknowns[row] - particular[row];
            }
            for k in 0..leg.carried.len() {
                let column = leg.carried[k].moved(e).array();
                for row in 0..6 {
                    self.system.set(row, leg.first + k, column[row]);
                }
            }
            for r in 0..rods {
                let (axis, point) = (self.places[r].axes.0[0], self.places[r].point);
                let on_it = mech.legs[i].rod == Some(r);
                let lever = (end - point).scale(pure_lever);
                for k in 0..leg.carried.len() {
                    let torque = leg.carried[k].moved(lever).torque;
                    let entry = if on_it { axis.dot(torque) } else { V::zero() };
                    self.system.set(6 + r, leg.first + k, entry);
                }
                if on_it {
                    let own = pure(piston.moved(end - point) + cylinder.moved(base - point), length);
                    let torque = own.torque - leg.particular.moved(lever).torque;
                    self.unknowns[6 + r] = self.unknowns[6 + r] + axis.dot(torque);
                }
            }
        }
    }

    #[inline(always)]
    fn put_on_platform(&mut self, particular: bool) {
        let length = self.mech.characteristic_length;
        for i in 0..self.legs.len() {
            self.on_platform[i] = self.legs[i].with(particular, &self.unknowns, length);
        }
    }

    /// Whether the pose is regular, and the reactions found balance every link.
    #[inline(always)]
    fn holds(&mut self, o: Vec3<V>, regular: V) -> Mask<V> {
        let (mech, length) = (self.mech, self.mech.characteristic_length);
        let (given, rows) = (&self.given, &mut self.unbalanced);
        put_unbalanced(mech, self.joints, &self.places, o, given, &self.least, rows);
        let (mut left, mut size) = (V::zero(), V::zero());
        for x in rows {
            left = x.mul_add(*x, left);
        }
        size = add_square(pure(given.platform, length), size);
        for w in &self.least {
            size = add_square(pure(*w, length), size);
        }
        let least = if mech.mobility.uncontrolled == 0 { WORKING_PRECISION } else { f64::INFINITY };
        // Nothing times what is finite is nothing.
        let known = V::select((size * V::zero()).at_most(V::zero()), V::one(), V::zero());
        let balanced = V::select(left.at_most(size.scale(RESIDUAL * RESIDUAL)), known, V::zero());
        V::select(regular.greater(V::lit(least)), balanced, V::zero()).greater(V::zero())
    }

    #[inline(always)]
    fn put_determinate(&mut self) {
        let length = self.mech.characteristic_length;
        for j in 0..self.joints.len() {
            let (mut base, mut seen) = ([V::zero(); 6], [V::zero(); 6]);
            for s in 0..self.choice.count {
                let stress = self.choice.stresses[s * self.joints.len() + j];
                let parts = pure(stress, length).array();
                let seen_parts = pure(self.places[j].seen(stress), length).array();
                // The root of the sum is the most that a self-stress of size one can have, whatever the
                // basis.
                for k in 0..6 {
                    base[k] = parts[k].mul_add(parts[k], base[k]);
                    seen[k] = seen_parts[k].mul_add(seen_parts[k], seen[k]);
                }
            }
            for k in 0..6 {
                let (one, zero, open) = (V::one(), V::zero(), V::lit(OPEN * OPEN));
                self.determinate[j][k] = V::select(base[k].at_most(open), one, zero);
                self.determinate_in_joint[j][k] = V::select(seen[k].at_most(open), one, zero);
            }
        }
    }
}

// Parts of the solution, each a function of its own.
work! {
    SetGiven<'a, V: Lanes> {
        given: &'a mut Given<V>,
        mech: &'a Mechanism,
        platform: &'a Motion<V>,
        load: Wrench<V>,
    } -> () {
        given.set(mech, platform, load);
    }
}
work! {
    SetPlaces<'a, V: Lanes> {
        mech: &'a Mechanism,
        pose: &'a Pose<V>,
        places: &'a mut [JointFrame<V>],
    } -> () {
        put_places(mech, pose, places);
    }
}
work! {
    /// Puts the shares, and tells how regular the balances are.
    SolveBalances<'a, 'b, V: Lanes> { solver: &'a mut Solver<'b, V>, o: Vec3<V> } -> V {
        solver.set_up(o);
        solver.system.factor();
        let regular = solver.system.reciprocal_condition();
        solver.system.solve(&mut solver.unknowns);
        regular
    }
}
work! {
    PutReactions<'a, V: Lanes> {
        mech: &'a Mechanism,
        places: &'a [JointFrame<V>],
        given: &'a Given<V>,
        on_platform: &'a [Wrench<V>],
        all: &'a mut [Wrench<V>],
    } -> () {
        put_reactions(mech, places, given, on_platform, all);
    }
}
work! {
    Holds<'a, 'b, V: Lanes> { solver: &'a mut Solver<'b, V>, o: Vec3<V>, regular: V } -> Mask<V> {
        solver.holds(o, regular)
    }
}
work! {
    PutDeterminate<'a, 'b, V: Lanes> { solver: &'a mut Solver<'b, V> } -> () {
        solver.put_determinate();
    }
}

/// The sum and the squares of a wrench's components.
#[inline(always)]
fn add_square<V: Real>(w: Wrench<V>, mut sum: V) -> V {
    let components = w.array();
    for k in 0..6 {
        sum = components[k].mul_add(components[k], sum);
    }
    sum
}
