//! Singularities at many states.

use super::block::{self, Answers, At, Codes, Operation, Pieces};
use super::checks::{any_pose, finite, kept, reached, read_pose};
use super::{FieldId, Table};
use crate::kinematics::coordinate_sets::Set;
use crate::mobility::independent_coordinates;
use crate::mobility::singularity;
use crate::mobility::singularity_distance::{self, SingularitySearch};
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::spatial::{Pose, Twist};

/// A pose that keeps the constraints, whether or not its legs have frames: a singular pose is one too.
fn read(mech: &Mechanism, poses: &[f64], i: usize) -> (Pose<f64>, Status) {
    let (pose, codes) = any_pose(poses, At::one(i));
    (pose, kept(mech, &pose, reached(mech, &pose, codes)).status())
}

/// Singular values of the leg Jacobian on the twists that the constraints allow, for the length `scale`
/// \[T24\].
#[must_use]
pub fn conditioning(mech: &Mechanism, poses: &[f64], scale: f64) -> Table {
    let n = poses.len() / 16;
    let fields = ["sigma_min", "sigma_max", "condition"].map(|name| (name, vec![]));
    let ids: [FieldId; 3] = block::fields();
    block::one_by_one(n, fields, Pieces::SLOW, |rows, i| {
        let (pose, status) = read_pose(mech, poses, i);
        if status == Status::Ok {
            let c = singularity::conditioning(mech, &pose, scale);
            for (id, value) in ids.into_iter().zip([c.sigma_min, c.sigma_max, c.condition]) {
                rows.set(id, i, 0, &[value]);
            }
        }
        status
    })
}

/// det J in pure numbers and its exact rate along the twist \[T30\]. The rate is NaN where the twist has NaN.
#[must_use]
pub fn determinants(mech: &Mechanism, poses: &[f64], twists: &[f64], scale: f64) -> Table {
    let fields = [("determinant", vec![]), ("rate", vec![])];
    block::table(&Determinants { mech, poses, twists, scale }, poses.len() / 16, fields)
}

struct Determinants<'a> {
    mech: &'a Mechanism,
    poses: &'a [f64],
    twists: &'a [f64],
    scale: f64,
}

impl Operation<2> for Determinants<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 2>) -> Codes<V> {
        let (mech, [value, rate]) = (self.mech, Answers::fields());
        let (pose, codes) = any_pose::<V>(self.poses, at);
        let twist = Twist::from_array(at.read(self.twists));
        let det = singularity::determinant(mech, &pose, &twist, self.scale);
        answers.put(value, 0, [det.x]);
        answers.put(rate, 0, [det.d]);
        kept(mech, &pose, codes).but(finite(&[det.x]), Status::Singular)
    }
}

fn known(determinant: f64) -> Status {
    if determinant.is_finite() { Status::Ok } else { Status::Singular }
}

/// Determinant, singular values, kind and uncontrolled twist at each pose \[T30\] \[T31\] \[T32\] \[T33\]. At
/// a pose where a leg has no direction the status is singular, and only the kind and the measures of legs and
/// constraints stand.
#[must_use]
pub fn singularities(mech: &Mechanism, poses: &[f64], scale: f64, tolerance: f64) -> Table {
    let (n, legs) = (poses.len() / 16, mech.legs.len());
    let fields = [
        ("determinant", vec![]),
        ("sigma_min", vec![]),
        ("sigma_max", vec![]),
        ("condition", vec![]),
        ("constraint_sigma", vec![]),
        ("leg_length", vec![legs]),
        ("leg_sine", vec![legs]),
        ("transmission", vec![legs]),
        ("kind", vec![]),
        ("leg", vec![]),
        ("uncontrolled", vec![]),
        ("twist", vec![6]),
        ("axis", vec![3]),
        ("pitch", vec![]),
        ("point", vec![3]),
    ];
    let ids: [FieldId; 15] = block::fields();
    block::one_by_one(n, fields, Pieces::SLOW, |rows, i| {
        let (pose, status) = read(mech, poses, i);
        if status != Status::Ok {
            return status;
        }
        let s = singularity::singularity(mech, &pose, scale, tolerance);
        let status = known(s.determinant);
        let c = s.conditioning;
        let values: [&[f64]; 15] = [
            &[s.determinant],
            &[c.sigma_min],
            &[c.sigma_max],
            &[c.condition],
            &[s.constraint_sigma],
            &s.leg_length,
            &s.leg_sine,
            &s.transmission,
            &[f64::from(s.kind as u8)],
            &[s.leg.map_or(-1.0, |leg| leg as f64)],
            &[if status == Status::Ok { s.uncontrolled as f64 } else { f64::NAN }],
            &s.twist.array(),
            &s.screw.axis.array(),
            &[s.screw.pitch],
            &s.screw.point.array(),
        ];
        for (id, value) in ids.into_iter().zip(values) {
            rows.set(id, i, 0, value);
        }
        status
    })
}

/// Coordinates to search along from each pose: those of a set that are given, by name.
#[must_use]
pub fn searched_coordinates(mech: &Mechanism, set: &Set, names: Option<&[String]>) -> Vec<bool> {
    names.map_or_else(
        || independent_coordinates::best_given(mech, set),
        |names| set.names().iter().map(|name| names.iter().any(|n| n == name)).collect(),
    )
}

/// For each given coordinate its value at the nearest singular poses below and above, their kinds, and how
/// far poses were looked at \[T34\].
#[must_use]
pub fn nearest_singular(mech: &Mechanism, poses: &[f64], search: &SingularitySearch) -> Table {
    let n = poses.len() / 16;
    let given: Vec<usize> = (0..search.set.names().len()).filter(|&i| search.given[i]).collect();
    let pair = || vec![given.len(), 2];
    let fields = [("value", vec![given.len()]), ("singular", pair()), ("kind", pair()), ("searched", pair())];
    let [value, singular, kind, searched] = block::fields();
    block::one_by_one(n, fields, Pieces::EACH, |rows, i| {
        let (pose, status) = read_pose(mech, poses, i);
        let found =
            if status == Status::Ok { singularity_distance::start(mech, search, &pose) } else { Err(status) };
        let (q, branch) = match found {
            Ok(start) => start,
            Err(status) => return status,
        };
        for (k, &index) in given.iter().enumerate() {
            rows.set(value, i, k, &[q[index]]);
            let both =
                [-1.0, 1.0].map(|d| singularity_distance::along(mech, search, &pose, (&q, branch), index, d));
            rows.set(singular, i, k, &both.map(|b| b.value));
            rows.set(kind, i, k, &both.map(|b| b.kind.map_or(f64::NAN, |kind| f64::from(kind as u8))));
            rows.set(searched, i, k, &both.map(|b| b.searched));
        }
        Status::Ok
    })
}
