//! As many actuators as it takes, of those of a redundantly actuated mechanism \[T73\].

use nalgebra::DVector;

use crate::kinematics::rows::pure_rows;
use crate::mobility::degrees_of_freedom::{RANK_TOLERANCE, generic_poses};
use crate::model::mechanism::Mechanism;
use crate::number::order::{by_size, smaller};
use crate::spatial::Pose;

/// Remainder of a row below which it is rounding.
const SINGULAR: f64 = 1e-12;

/// The mechanism with so many of its actuated legs passive that J is square, best conditioned at one of a few
/// generic poses: rows are chosen one by one, that with the largest rest. None for a mechanism that is
/// singular by design.
#[must_use]
pub fn sufficient_actuators(mech: &Mechanism) -> Option<Mechanism> {
    let numbers: Vec<usize> = mech.actuated().map(|(k, _)| k).collect();
    let best = |pose: &Pose<f64>| -> Option<(f64, Vec<usize>)> {
        let rows = pure_rows(mech, pose, mech.characteristic_length);
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let rest = |basis: &[DVector<f64>], row: &[f64; 6]| {
            let mut rest = DVector::from_column_slice(row);
            for _ in 0..2 {
                for b in basis {
                    rest.axpy(-b.dot(&rest), b, 1.0);
                }
            }
            rest
        };
        for row in &rows[numbers.len()..] {
            basis.push(rest(&basis, row).try_normalize(SINGULAR)?);
        }
        let mut chosen: Vec<usize> = Vec::new();
        let mut least = f64::INFINITY;
        while basis.len() < 6 {
            let left =
                (0..numbers.len()).filter(|k| !chosen.contains(k)).map(|k| (k, rest(&basis, &rows[k])));
            let (k, row) = left.max_by(|a, b| by_size(a.1.norm(), b.1.norm()))?;
            least = smaller(least, row.norm());
            basis.push(row.try_normalize(RANK_TOLERANCE)?);
            chosen.push(k);
        }
        Some((least, chosen))
    };
    let poses = generic_poses(mech);
    let (_, chosen) = poses.iter().filter_map(best).max_by(|a, b| by_size(a.0, b.0))?;
    let mut square = mech.clone();
    for (k, &number) in numbers.iter().enumerate() {
        square.legs[number].actuated = chosen.contains(&k);
    }
    square.limits.clear();
    Some(square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{pentapod, redundant};
    use crate::mobility::singularity;

    #[test]
    fn the_chosen_actuators_are_just_enough() {
        for mech in [redundant(1), redundant(2), pentapod(6, "platform", 3), pentapod(7, "base", 4)] {
            let square = sufficient_actuators(&mech).expect("not singular by design");
            assert_eq!(square.rows(), 6, "{}", mech.name);
            let sigma = singularity::smallest(&square, &mech.home, mech.characteristic_length);
            assert!(sigma > 1e-3, "{}: {sigma}", mech.name);
        }
    }
}
