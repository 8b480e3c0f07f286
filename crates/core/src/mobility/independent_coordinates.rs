//! Which coordinates of a set to give, so that the constraints determine the others \[T23\].

use crate::kinematics::coordinate_sets::Set;
use crate::kinematics::dependent_coordinates::{DEPENDENT_PIVOTS, dependent_pivots};
use crate::mobility::degrees_of_freedom::generic_poses;
use crate::model::mechanism::Mechanism;
use crate::number::order::by_size;
use crate::spatial::Pose;

/// A mark for each number of the set, true if it is to be given: as many as there are degrees of freedom.
///
/// Those of a choice are judged by the pivot ratio of ∂g/∂y \[T23\] at generic poses near home, which the
/// machine can have: a choice that is regular at more of them is better, then one whose median is
/// larger. Home itself does not do: it may be a singular pose of the constraints, where no choice is regular.
#[must_use]
pub fn best_given(mech: &Mechanism, set: &Set) -> Vec<bool> {
    if let Some(given) = set.given(mech) {
        return given;
    }
    let (count, dependent) = (set.names().len(), mech.independent.len());
    let poses = generic_poses(mech);
    let choices = (0..1_usize << count)
        .filter(|mask| mask.count_ones() as usize == dependent)
        .map(|mask| (0..count).map(|i| mask >> i & 1 == 0).collect::<Vec<_>>());
    let rated = choices.map(|given| (rating(mech, set, &given, &poses), given));
    // Of equals the first one is taken: from behind the last.
    let all: Vec<_> = rated.collect();
    let best = all.into_iter().rev().max_by(|((a, x), _), ((b, y), _)| a.cmp(b).then(by_size(*x, *y)));
    best.map_or_else(|| vec![true; count], |(_, given)| given)
}

/// At how many poses a choice determines the other coordinates, and the median of its pivot ratios.
fn rating(mech: &Mechanism, set: &Set, given: &[bool], poses: &[Pose<f64>]) -> (usize, f64) {
    let mut pivots: Vec<f64> = poses.iter().map(|pose| dependent_pivots(mech, set, pose, given)).collect();
    pivots.sort_by(|&a, &b| by_size(a, b));
    (pivots.iter().filter(|&&p| p > DEPENDENT_PIVOTS).count(), pivots[pivots.len() / 2])
}
