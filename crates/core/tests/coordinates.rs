//! States of many coordinates are those of each: bit by bit in lanes, within rounding where they go state by
//! state.

mod common;

use common::{mechanisms, states};
use polypod_core::batch::{self, Coordinates};
use polypod_core::kinematics::coordinate_sets::{self, Set};
use polypod_core::mobility::independent_coordinates;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::model::status::Status;
use polypod_core::number::order::larger;

/// Relative to one, or to the number.
const ROUNDING: f64 = 1e-8;

/// For each number of the set its values, rates and second rates along motions, spoilt here and there.
fn series(mech: &Mechanism, set: &Set, count: usize) -> Vec<[Vec<f64>; 3]> {
    let mut series = vec![[(); 3].map(|()| Vec::new()); set.names().len()];
    for (i, motion) in states(mech, count, 17).iter().enumerate() {
        let q = coordinate_sets::along(mech, set, motion);
        for (k, [x, d, dd]) in series.iter_mut().enumerate() {
            x.push(match (set, i, k) {
                (_, 1, 0) => f64::NAN,
                (Set::Paper(_), 2, 1) => 5.0,
                (Set::Tool, 3, 3..6) => -(mech.home.rotation * mech.tool_axis).array()[k - 3],
                (Set::Tool, 4, 3..6) => 0.0,
                (_, 5, 1) => q[k].x + 0.1,
                (Set::Pose, 8, 2 | 5) => 50.0,
                _ => q[k].x,
            });
            d.push(if (i, k) == (6, 0) { f64::INFINITY } else { q[k].d });
            dd.push(if (i, k) == (7, 2) { q[k].dd + 1.0 } else { q[k].dd });
        }
    }
    series
}

#[test]
fn states_of_many_coordinates_are_those_of_each() {
    let count = 29;
    let (mut sets, mut found) = (std::collections::BTreeSet::new(), std::collections::BTreeSet::new());
    for mech in mechanisms() {
        for set in Set::of(&mech) {
            let all = series(&mech, &set, count);
            // The least that must be given, and all that may be: γ of the paper's set is never.
            let least = independent_coordinates::best_given(&mech, &set);
            let most = vec![true; all.len()];
            for given in if matches!(set, Set::Paper(_)) { vec![least] } else { vec![least, most] } {
                for branch in [1.0, -1.0] {
                    let states = |first: usize, count: usize, guess: Option<&[f64]>| {
                        let part = |v: &Vec<f64>| v[first..first + count].to_vec();
                        let parts: Vec<[Vec<f64>; 3]> = all.iter().map(|s| s.each_ref().map(part)).collect();
                        let given = parts.iter().zip(&given);
                        let given = given.map(|(s, g)| g.then(|| s.each_ref().map(|v| &v[..]))).collect();
                        let input = Coordinates { set, given, branch, guess, continued: false };
                        batch::states(&mech, &input, count)
                    };
                    let together = states(0, count, None);
                    for i in 0..count {
                        // With a guess they go state by state.
                        let alone = states(i, 1, Some(&mech.home.matrix()));
                        let one = states(i, 1, None);
                        let place = format!("{} {} {i}", mech.name, set.name());
                        assert_eq!(together.status[i], alone.status[0], "{place}");
                        assert_eq!(together.status[i], one.status[0], "{place}");
                        for (k, field) in together.fields.iter().enumerate() {
                            let width = field.data.len() / count;
                            let row = &field.data[i * width..(i + 1) * width];
                            for (x, y) in row.iter().zip(&one.fields[k].data) {
                                assert!(x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan()), "{place}");
                            }
                            for (x, y) in row.iter().zip(&alone.fields[k].data) {
                                let near = (x - y).abs() <= ROUNDING * larger(x.abs(), 1.0);
                                let same = near || x == y || (x.is_nan() && y.is_nan());
                                assert!(same, "{place}, {}: {x:e} {y:e}", field.name);
                            }
                        }
                        found.insert(together.status[i] as u8);
                    }
                    sets.insert(set.name());
                }
            }
        }
    }
    assert_eq!(sets.len(), 4, "{sets:?}");
    for status in [Status::Ok, Status::InvalidInput, Status::NoBranch, Status::Fold, Status::OffConstraint] {
        assert!(found.contains(&(status as u8)), "{status:?}");
    }
}
