//! Joint reactions at many states.

use super::block::{self, Answers, At, Codes, Working};
use super::checks::within_limits;
use super::dynamics::Loads;
use super::{States, Table};
use crate::dynamics::joint_reactions::{self, LinkJoint};
use crate::dynamics::self_stress::Solver;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;

/// Reactions of all joints on the links on their platform's side, each at its joint's point \[T44\] \[T45\]
/// \[T46\] \[T47\] \[T48\], in the order of [`joint_reactions::joints`]. Which components are determinate is
/// given by 1 and 0. `scale`, m, is what torques are divided by where the least sum of squares is sought.
#[must_use]
pub fn joint_reactions(mech: &Mechanism, states: &States, loads: &Loads, scale: f64) -> Table {
    let joints = joint_reactions::joints(mech);
    let width = joints.len();
    let six = || vec![width, 6];
    let fields = [
        ("points", vec![width, 3]),
        ("axes", vec![width, 3, 3]),
        ("reactions", six()),
        ("reactions_in_joint", six()),
        ("least", six()),
        ("least_in_joint", six()),
        ("determinate", six()),
        ("determinate_in_joint", six()),
        ("constraint_wrench", vec![6]),
    ];
    let operation = JointReactions { mech, joints: &joints, states, loads, scale };
    block::table(&operation, states.len(), fields)
}

struct JointReactions<'a> {
    mech: &'a Mechanism,
    joints: &'a [LinkJoint],
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
    scale: f64,
}

impl<'a> Working<9> for JointReactions<'a> {
    type Room<V: Lanes> = Solver<'a, V>;

    fn room<V: Lanes>(&self) -> Solver<'a, V> {
        Solver::new(self.mech, self.joints, self.scale)
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut Solver<'a, V>, at: At, answers: &mut Answers<'_, 9>) -> Codes<V> {
        let (mech, ids) = (self.mech, Answers::<9>::fields());
        let (platform, load, codes) = self.states.loaded_at(mech, self.loads, at);
        let codes = codes.unless(room.solve(&platform, load), Status::Singular);
        for j in 0..self.joints.len() {
            let (place, assumed, least) = (&room.places[j], room.assumed[j], room.least[j]);
            let axes = place.axes.transpose().0;
            answers.put(ids[0], j, place.point.array());
            for k in 0..3 {
                answers.put(ids[1], 3 * j + k, axes[k].array());
            }
            answers.put(ids[2], j, assumed.array());
            answers.put(ids[3], j, place.seen(assumed).array());
            answers.put(ids[4], j, least.array());
            answers.put(ids[5], j, place.seen(least).array());
            answers.put(ids[6], j, room.determinate[j]);
            answers.put(ids[7], j, room.determinate_in_joint[j]);
        }
        answers.put(ids[8], 0, room.constraint.array());
        within_limits(mech, &platform.pose, codes)
    }
}
