//! Coordinates of many states.

use super::Table;
use super::block::{self, Answers, At, Codes, Operation, Pieces};
use super::checks::{
    check_legs, finite, forwards, is_rotation, pose_at, raw_pose, then, with_legs, with_motion,
};
use crate::kinematics::coordinate_sets::{self, MAX_COORDINATES, Set, Values};
use crate::kinematics::dependent_coordinates::{self, Conditions, CoordinateState, Dependent};
use crate::kinematics::singular::SINGULAR;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::number::real::{Jet, Mask, Real};
use crate::number::work::work;
use crate::spatial::Motion;

/// Given coordinates of the states with their rates and second rates: `given[k]` holds the three series of
/// the `k`-th number of the set, or nothing where it is to be solved.
#[derive(Clone, Debug)]
pub struct Coordinates<'a> {
    pub set: Set,
    pub given: Vec<Option<[&'a [f64]; 3]>>,
    pub branch: f64,
    /// Poses to start the dependent coordinates from, one for each state or one for all; home without any.
    pub guess: Option<&'a [f64]>,
    /// Start each state from the pose of the last one that was solved.
    pub continued: bool,
}

/// Pose, twist, acceleration and all coordinates of the set [Eq. 2, 5] \[T19\] \[T20\] \[T21\] \[T22\]
/// \[T23\].
#[must_use]
pub fn states(mech: &Mechanism, input: &Coordinates, n: usize) -> Table {
    let names = input.set.names();
    let fields = [
        ("pose", vec![4, 4]),
        ("twist", vec![6]),
        ("acceleration", vec![6]),
        ("coordinates", vec![names.len()]),
        ("coordinate_rates", vec![names.len()]),
        ("coordinate_second_rates", vec![names.len()]),
    ];
    let [poses, twists, accelerations, values, rates, second_rates] = block::fields();
    let mask: Vec<bool> =
        (0..MAX_COORDINATES).map(|k| k >= names.len() || input.given[k].is_some()).collect();
    let all_given = mask.iter().all(|&given| given) && !mech.independent.is_empty();
    if !input.continued && input.guess.is_none() {
        let dependent = Dependent::of(&input.set, &mask);
        let start = input.set.values(mech, &mech.home);
        return block::table(&FromCoordinates { mech, input, dependent, start, all_given }, n, fields);
    }
    let pieces = if input.continued { Pieces::WHOLE } else { Pieces::QUICK };
    block::in_pieces(n, fields, pieces, |rows, states| {
        let (mut last, mut branch) = (mech.home, f64::NAN);
        for i in states {
            let q: Values<Jet<f64>> = std::array::from_fn(|k| match input.given.get(k).copied().flatten() {
                Some([x, d, dd]) => Jet::new(x[i], d[i], dd[i]),
                None => Jet::new(0.0, 0.0, 0.0),
            });
            let guess = match input.guess {
                Some(poses) if i == 0 || !input.continued => {
                    let k = if poses.len() == 16 { 0 } else { i };
                    if !is_rotation(poses, k) {
                        rows.set_status(i, Status::InvalidInput);
                        continue;
                    }
                    raw_pose(poses, k)
                }
                None if !input.continued => mech.home,
                _ => last,
            };
            let state =
                dependent_coordinates::state(mech, &input.set, &q, &mask, input.branch, &guess, SINGULAR);
            let state = checked(mech, state, all_given);
            let jumped = input.continued && state.status == Status::Ok && state.branch * branch < 0.0;
            let status = if jumped { Status::BranchJump } else { state.status };
            rows.set_status(i, status);
            let found = state.platform.pose.rotation.0.iter().all(|c| c.norm().is_finite());
            let solved = found && matches!(status, Status::Ok | Status::Fold);
            if solved {
                if state.status == Status::Ok {
                    (last, branch) = (state.platform.pose, state.branch);
                }
                rows.set(poses, i, 0, &state.platform.pose.matrix());
            }
            if status == Status::Ok {
                rows.set(twists, i, 0, &state.platform.twist.array());
                rows.set(accelerations, i, 0, &state.platform.acceleration.array());
            }
            for k in 0..names.len() {
                if solved || mask[k] {
                    let jet = state.coordinates[k];
                    rows.set(values, i, k, &[jet.x]);
                    rows.set(rates, i, k, &[jet.d]);
                    rows.set(second_rates, i, k, &[jet.dd]);
                }
            }
        }
    })
}

/// States that do not depend on one another, all from home.
struct FromCoordinates<'a> {
    mech: &'a Mechanism,
    input: &'a Coordinates<'a>,
    dependent: Dependent,
    /// The numbers of home.
    start: Values<f64>,
    /// Whether constraints are left to be kept by the given coordinates.
    all_given: bool,
}

impl Operation<6> for FromCoordinates<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 6>) -> Codes<V> {
        let (mech, input) = (self.mech, self.input);
        let [poses, twists, accelerations, values, rates, second_rates] = Answers::fields();
        let (mut q, nan) = ([Jet::lit(0.0); MAX_COORDINATES], V::lit(f64::NAN));
        let mut codes = Codes::ok();
        for k in 0..input.given.len() {
            if let Some([x, d, dd]) = input.given[k] {
                q[k] = Jet::new(at.series(x), at.series(d), at.series(dd));
                codes = codes.unless(finite(&[q[k].x, q[k].d, q[k].dd]), Status::InvalidInput);
            }
        }
        let [pose, regular] = V::apart(Complete { mech, set: &input.set, q: &mut q, branch: input.branch });
        codes = codes.unless(pose.0, pose.1).unless(regular.0, regular.1);
        if self.dependent.count > 0 && !matches!(input.set, Set::Paper(_)) {
            let wanted = codes.are(Status::Ok);
            let (set, q, dependent, start) = (&input.set, &mut q, &self.dependent, &self.start);
            let [found, regular] = V::apart(SolveDependent { mech, set, q, dependent, start, wanted });
            codes = codes.unless(found.0, found.1).unless(regular.0, regular.1);
        }
        let platform = V::apart(MotionOf { mech, set: &input.set, q: &q });
        codes = with_legs(mech, &platform.pose, codes);
        codes = if self.all_given {
            with_motion(mech, &platform, codes)
        } else {
            forwards(mech, &platform.pose, codes)
        };
        // Where branches meet the pose stands without its rates.
        let [x, y, z] = platform.pose.rotation.0;
        let found = finite(&[x.norm(), y.norm(), z.norm()]);
        let (ok, fold) = (codes.are(Status::Ok), codes.are(Status::Fold));
        let mut matrix = [V::zero(); 16];
        matrix[15] = V::one();
        let columns = [x.array(), y.array(), z.array(), platform.pose.o.array()];
        for i in 0..3 {
            for j in 0..4 {
                matrix[4 * i + j] = columns[j][i];
            }
        }
        for i in 0..16 {
            let standing = V::select(ok, matrix[i], V::select(fold, matrix[i], nan));
            matrix[i] = V::select(found, standing, nan);
        }
        let (mut twist, mut acceleration) = (platform.twist.array(), platform.acceleration.array());
        for i in 0..6 {
            twist[i] = V::select(ok, twist[i], nan);
            acceleration[i] = V::select(ok, acceleration[i], nan);
        }
        answers.put(poses, 0, matrix);
        answers.put(twists, 0, twist);
        answers.put(accelerations, 0, acceleration);
        for k in 0..input.given.len() {
            let mut parts = [q[k].x, q[k].d, q[k].dd];
            if input.given[k].is_none() {
                for part in &mut parts {
                    let standing = V::select(ok, *part, V::select(fold, *part, nan));
                    *part = V::select(found, standing, nan);
                }
            }
            answers.put(values, k, [parts[0]]);
            answers.put(rates, k, [parts[1]]);
            answers.put(second_rates, k, [parts[2]]);
        }
        codes.answered()
    }
}

// Parts of the solution, each a function of its own.
work! {
    Complete<'a, V: Lanes> {
        mech: &'a Mechanism,
        set: &'a Set,
        q: &'a mut Values<Jet<V>>,
        branch: f64,
    } -> Conditions<V> {
        dependent_coordinates::complete(mech, set, q, branch)
    }
}
work! {
    SolveDependent<'a, V: Lanes> {
        mech: &'a Mechanism,
        set: &'a Set,
        q: &'a mut Values<Jet<V>>,
        dependent: &'a Dependent,
        start: &'a Values<f64>,
        wanted: Mask<V>,
    } -> Conditions<V> {
        dependent_coordinates::solve_dependent(mech, set, q, dependent, start, wanted, SINGULAR).0
    }
}
work! {
    MotionOf<'a, V: Lanes> { mech: &'a Mechanism, set: &'a Set, q: &'a Values<Jet<V>> } -> Motion<V> {
        coordinate_sets::motion(&set.pose(mech, q))
    }
}

/// A state is none where a leg has no frame or points backwards, or where coordinates that were all given
/// break the constraints.
fn checked(mech: &Mechanism, mut state: CoordinateState, all_given: bool) -> CoordinateState {
    let pose = &state.platform.pose;
    // A root that a constraint has only because a leg has no frame there is none.
    state.status = then(state.status, || check_legs(mech, pose));
    state.status = then(state.status, || {
        let codes = Codes::ok();
        if all_given { with_motion(mech, &state.platform, codes) } else { forwards(mech, pose, codes) }
            .status()
    });
    state
}

/// The numbers of a set at each pose: the inverse of [`states`].
#[must_use]
pub fn coordinate_values(mech: &Mechanism, set: &Set, poses: &[f64]) -> Table {
    let fields = [("coordinates", vec![set.names().len()])];
    block::table(&ValuesAt { mech, set, poses }, poses.len() / 16, fields)
}

struct ValuesAt<'a> {
    mech: &'a Mechanism,
    set: &'a Set,
    poses: &'a [f64],
}

impl Operation<1> for ValuesAt<'_> {
    #[inline(always)]
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, 1>) -> Codes<V> {
        let (mech, [values]) = (self.mech, Answers::fields());
        let (pose, codes) = pose_at::<V>(mech, self.poses, at);
        let q = self.set.values(mech, &pose);
        for k in 0..self.set.names().len() {
            answers.put(values, k, [q[k]]);
        }
        codes
    }
}
