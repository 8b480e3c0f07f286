//! Joint reactions at many states.

use super::block::{self, Pieces};
use super::checks::limit_status;
use super::dynamics::Loads;
use super::{FieldId, States, Table};
use crate::mechanism::Mechanism;
use crate::reactions;
use crate::spatial::Wrench;
use crate::status::Status;

/// Reactions of all joints on the links on their platform's side, each at its joint's point \[T44\]-\[T48\], in the order of
/// [`reactions::joints`]. Which components are determinate is told by 1 and 0. `scale`, m, is what torques are divided by
/// where the least sum of squares is sought.
#[must_use]
pub fn joint_reactions(mech: &Mechanism, states: &States, loads: &Loads, scale: f64) -> Table {
    let joints = reactions::joints(mech);
    let (n, width) = (states.len(), joints.len());
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
    let ids: [FieldId; 9] = block::fields();
    let flags = |marks: &[bool; 6]| marks.map(|mark| f64::from(u8::from(mark)));
    block::one_by_one(n, fields, Pieces::SLOW, |rows, i| {
        let (platform, load, status) = states.one(mech, loads, i);
        if status != Status::Ok {
            return status;
        }
        let Some(found) = reactions::solve(mech, &joints, &platform, load, scale) else {
            return Status::Singular;
        };
        for (j, place) in found.places.iter().enumerate() {
            let seen = |w: Wrench<f64>| place.seen(w).array();
            rows.set(ids[0], i, j, &place.point.array());
            rows.set(ids[1], i, j, place.axes.rows().as_flattened());
            rows.set(ids[2], i, j, &found.assumed[j].array());
            rows.set(ids[3], i, j, &seen(found.assumed[j]));
            rows.set(ids[4], i, j, &found.least[j].array());
            rows.set(ids[5], i, j, &seen(found.least[j]));
            rows.set(ids[6], i, j, &flags(&found.determinate[j]));
            rows.set(ids[7], i, j, &flags(&found.determinate_in_joint[j]));
        }
        rows.set(ids[8], i, 0, &found.constraint.array());
        limit_status(mech, &platform.pose)
    })
}
