//! Forward kinematics against inverse kinematics, and all assembly modes against a search from many starts.

mod common;

use common::{Draw, every_leg, on_rod, published, six_sliders, states, with_leg, with_leg_backwards};
use polypod_core::batch::{self, Coordinates, Loads, States};
use polypod_core::forward_kinematics::assembly_modes::{Modes, assembly_modes, start};
use polypod_core::forward_kinematics::newton::{asked, error, forward_kinematics, polish, step_of};
use polypod_core::kinematics::coordinate_sets::{MAX_COORDINATES, Set, Values};
use polypod_core::kinematics::jacobian::scaled_jacobian;
use polypod_core::kinematics::leg;
use polypod_core::kinematics::singular::SINGULAR;
use polypod_core::mobility::independent_coordinates;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::model::status::Status;
use polypod_core::number::order::{larger, largest, smaller};
use polypod_core::numerics::gauss::solve;
use polypod_core::spatial::{Mat3, Pose, Vec3};

fn lengths(mech: &Mechanism, pose: &Pose<f64>) -> Vec<f64> {
    mech.actuated().map(|(_, l)| leg::position(l, pose).coordinate).collect()
}

/// o in metres and rotations in radians: largest difference.
fn apart(a: &Pose<f64>, b: &Pose<f64>) -> f64 {
    larger((a.o - b.o).norm(), (a.rotation.transpose() * b.rotation).rotation_vector().norm())
}

fn sign(mech: &Mechanism, pose: &Pose<f64>) -> f64 {
    solve(scaled_jacobian(mech, pose), [0.0; 6]).sign
}

/// Natural coordinates over the whole workspace, and near a point of them.
fn anywhere(draw: &mut Draw) -> Values<f64> {
    let mut q = [0.0; MAX_COORDINATES];
    let spread = [0.6, 0.4, 0.2, 1.0, 1.0];
    for (k, s) in spread.into_iter().enumerate() {
        q[k] = s * draw.number() + if k == 2 { 0.6 } else { 0.0 };
    }
    q
}

fn near(q: &Values<f64>, spread: f64, draw: &mut Draw) -> Values<f64> {
    let mut near = *q;
    for (k, x) in near.iter_mut().enumerate().take(5) {
        *x += spread * draw.number() * if k == 1 || k == 2 { 0.15 } else { 1.0 };
    }
    near
}

/// The end of many short steps along the straight line of lengths from the guess's own: what continuation
/// means.
fn continued(mech: &Mechanism, to: &[f64], guess: &Pose<f64>) -> Option<Pose<f64>> {
    let from = lengths(mech, guess);
    let (mut pose, mut t, mut h) = (*guess, 0.0_f64, 1e-3_f64);
    while t < 1.0 {
        h = smaller(h, 1.0 - t);
        let between: Vec<f64> =
            from.iter().zip(to).map(|(a, b)| (a * a + (t + h) * (b * b - a * a)).sqrt()).collect();
        let next = polish(mech, &asked(mech, &between), &pose);
        let close = apart(&next.pose, &pose) < 2e-3 && next.iterations < 6;
        if close && next.sign == sign(mech, guess) {
            (pose, t, h) = (next.pose, t + h, 1.5 * h);
        } else {
            h *= 0.5;
        }
        if h < 1e-9 {
            return None;
        }
    }
    Some(pose)
}

#[test]
fn a_round_trip_never_ends_silently_in_another_mode() {
    let mech = published();
    let set = Set::of(&mech)[1];
    let mut draw = Draw::new(5);
    let (mut same, mut reported, mut others) = (0, 0, 0);
    for _ in 0..100_000 {
        let q = anywhere(&mut draw);
        let (pose, guess) = (set.pose(&mech, &q), set.pose(&mech, &near(&q, 0.05, &mut draw)));
        let to = lengths(&mech, &pose);
        let found = forward_kinematics(&mech, &to, &guess);
        if found.status != Status::Ok {
            reported += 1;
        } else if apart(&found.pose, &pose) < 1e-6 {
            assert!(found.residual < 1e-13, "{}", found.residual);
            same += 1;
        } else {
            // Then the guess lies in the mode that was found, and the pose it was made from in another one.
            others += 1;
            assert!(error(&mech, &asked(&mech, &to), &found.pose) < 1e-13);
            if let Some(end) = continued(&mech, &to, &guess) {
                assert!(apart(&end, &found.pose) < 1e-6, "{q:?}");
            } else {
                assert_ne!(found.sign, sign(&mech, &pose), "{q:?}");
            }
        }
    }
    println!("{same} same, {reported} reported, {others} of the guess's own mode");
    assert!(same > 99_000 && others < 300);
}

#[test]
fn newton_converges_quadratically() {
    let mech = published();
    let set = Set::of(&mech)[1];
    let pose = set.pose(&mech, &[0.1, -0.3, 0.6, 0.8, 0.6, 0.0, 0.0]);
    let target = asked(&mech, &lengths(&mech, &pose));
    let mut guess = set.pose(&mech, &[0.13, -0.28, 0.61, 0.77, 0.63, 0.0, 0.0]);
    let mut errors = vec![apart(&guess, &pose)];
    while errors.last().is_some_and(|e| *e > 1e-9) && errors.len() < 10 {
        let polypod_core::forward_kinematics::newton::System { residual, matrix } =
            polypod_core::forward_kinematics::newton::system(&mech, &guess, &target);
        let step = solve(matrix, residual.map(|f| -f)).x;
        guess = guess.stepped(&step_of(&mech, step, 1.0));
        errors.push(apart(&guess, &pose));
    }
    println!("{errors:?}");
    assert!(errors.len() <= 6, "{errors:?}");
    for pair in errors.windows(2).filter(|pair| pair[1] > 1e-13) {
        assert!(pair[1] < 10.0 * pair[0] * pair[0], "{errors:?}");
    }
}

/// Every real pose that plain Newton iterations find from starts all over the space.
fn many_starts(mech: &Mechanism, lengths: &[f64], starts: usize, draw: &mut Draw) -> Vec<Pose<f64>> {
    let home = mech.legs.iter().map(|l| leg::position(l, &mech.home).length);
    let longest = largest(home.chain(lengths.iter().copied()));
    let mut found: Vec<Pose<f64>> = Vec::new();
    for _ in 0..starts {
        let guess =
            Pose { rotation: Mat3::from_rotation_vector(draw.vector() * 2.0), o: draw.vector() * longest };
        let f = polish(mech, &asked(mech, lengths), &guess);
        if f.status == Status::Ok && f.residual < 1e-12 && !found.iter().any(|p| apart(p, &f.pose) < 1e-7) {
            found.push(f.pose);
        }
    }
    found
}

fn has(modes: &Modes, pose: &Pose<f64>, tolerance: f64) -> bool {
    modes.modes.iter().any(|m| apart(&m.pose, pose) < tolerance)
}

fn compare_with_search(mech: &Mechanism, sets: usize, starts: usize) {
    let generic = start(mech).expect("as many equations as unknowns");
    let mut draw = Draw::new(17);
    let (mut all, mut searched) = (0, 0);
    let t = std::time::Instant::now();
    let mut time = t.elapsed();
    for state in states(mech, sets, 23) {
        let to = lengths(mech, &state.pose);
        let t = std::time::Instant::now();
        let modes = assembly_modes(mech, &generic, &to);
        time += t.elapsed();
        assert_eq!(modes.status, Status::Ok, "{}", mech.name);
        assert!(has(&modes, &state.pose, 1e-7), "{}: the pose itself", mech.name);
        for mode in &modes.modes {
            assert!(mode.residual < 1e-12 && mode.sign == sign(mech, &mode.pose) && mode.multiplicity == 1);
        }
        for pose in many_starts(mech, &to, starts, &mut draw) {
            assert!(has(&modes, &pose, 1e-6), "{}: {to:?} has {pose:?} too", mech.name);
            searched += 1;
        }
        all += modes.modes.len();
    }
    println!(
        "{}: {} complex, {all} modes, {searched} by search, {:?} each",
        mech.name,
        generic.solutions(),
        time / sets as u32
    );
}

#[test]
fn all_modes_are_those_of_a_search_from_many_starts() {
    compare_with_search(&published(), 100, 400);
    compare_with_search(&with_leg("SPU", 3), 30, 400);
    let sliders = [with_leg("PRS", 3), with_leg("PUU", 3), six_sliders()];
    for mech in
        [with_leg("RPS", 3), with_leg("UPU", 3), on_rod(1, 3), on_rod(2, 4)].into_iter().chain(sliders)
    {
        compare_with_search(&mech, 20, 200);
    }
}

/// The pose on a line of natural coordinates where det J vanishes, between two values of β.
fn singular_pose(mech: &Mechanism, mut q: Values<f64>, mut low: f64, mut high: f64) -> Pose<f64> {
    let set = Set::of(mech)[1];
    let mut at = |beta: f64| {
        q[3] = beta;
        set.pose(mech, &q)
    };
    let below = sign(mech, &at(low));
    assert_ne!(below, sign(mech, &at(high)), "no singularity between");
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if sign(mech, &at(middle)) == below { low = middle } else { high = middle }
    }
    at(0.5 * (low + high))
}

#[test]
fn modes_that_meet_are_found_together_and_told_apart_next_to_it() {
    let mech = published();
    let generic = start(&mech).expect("as many equations as unknowns");
    let mut draw = Draw::new(3);
    let mut tried = 0;
    for _ in 0..1000 {
        if tried == 20 {
            break;
        }
        let q = anywhere(&mut draw);
        let at = |k: i32| {
            let mut q = q;
            q[3] = f64::from(k) / 20.0;
            (q[3], sign(&mech, &Set::of(&mech)[1].pose(&mech, &q)))
        };
        let Some(k) = (-20..20).find(|&k| at(k).1 != at(k + 1).1) else { continue };
        tried += 1;
        let pose = singular_pose(&mech, q, at(k).0, at(k + 1).0);
        let to = lengths(&mech, &pose);
        let modes = assembly_modes(&mech, &generic, &to);
        assert_eq!(
            modes.status,
            Status::Singular,
            "{:?}",
            modes
                .modes
                .iter()
                .map(|m| (apart(&m.pose, &pose), m.multiplicity, m.singular))
                .collect::<Vec<_>>()
        );
        let double = modes.modes.iter().find(|m| apart(&m.pose, &pose) < 1e-5).expect("the singular pose");
        assert!(double.singular && double.multiplicity == 2, "{double:?}");
        // Lengths a little off across the fold: two modes nearby on one side, none on the other.
        let counts = [-1e-7, 1e-7].map(|off: f64| {
            let mut to = to.clone();
            to[1] += off;
            let modes = assembly_modes(&mech, &generic, &to);
            assert_eq!(modes.status, Status::Ok);
            modes.modes.iter().filter(|m| apart(&m.pose, &pose) < 0.3).map(|m| m.sign).collect::<Vec<_>>()
        });
        let n = [counts[0].len(), counts[1].len()];
        assert!(n[0].abs_diff(n[1]) == 2, "{counts:?}");
    }
    assert_eq!(tried, 20);
}

#[test]
#[ignore = "a sweep"]
fn no_mode_is_missing_over_the_workspace() {
    compare_with_search(&published(), 2000, 400);
}

#[test]
fn a_pose_with_a_leg_backwards_in_a_fixed_joint_is_none() {
    for (i, letters) in every_leg().iter().enumerate() {
        let mech = with_leg(letters, i as u64 + 1);
        let (first, backwards) = (&mech.legs[0], with_leg_backwards(&mech));
        let length = leg::position(first, &mech.home).length;
        let ahead = |pose| mech.directions.iter().map(|d| leg::ahead(&mech, d, pose)).collect::<Vec<_>>();
        let fixed = letters.matches('F').count();
        assert_eq!([ahead(&mech.home).len(), ahead(&backwards).len()], [fixed; 2], "{letters}");
        assert!(ahead(&mech.home).iter().all(|a| (a - length).abs() < 1e-12), "{letters}");
        assert!(ahead(&backwards).iter().all(|a| (a + length).abs() < 1e-12), "{letters}");
        let turned = Mat3::from_rotation_vector(Vec3::new(0.1, 0.2, 0.3)) * mech.home.rotation;
        let off = Pose { rotation: turned, ..backwards };
        let poses: Vec<f64> = [mech.home, backwards, off].iter().flat_map(Pose::matrix).collect();
        let states = States { poses: &poses, twists: &[], accelerations: &[] };
        let values: Vec<f64> = vec![0.0; 3 * mech.legs.len()];
        let none = if fixed > 0 { Status::Backwards } else { Status::Ok };
        for table in [
            batch::inverse_kinematics(&mech, &poses),
            batch::kinematics(&mech, &states),
            batch::inverse_dynamics(&mech, &states, &Loads::Own, None),
            batch::joint_reactions(&mech, &states, &Loads::Own, 1.0),
            batch::limits(&mech, &states, &Loads::Own),
            batch::platform_twist(&mech, &poses, &values),
            batch::singularities(&mech, &poses, 1.0, SINGULAR),
            batch::coordinate_values(&mech, &Set::Pose, &poses),
        ] {
            // A broken constraint is reported first.
            let third = if mech.independent.is_empty() { Status::Ok } else { Status::OffConstraint };
            let name = table.fields[0].name;
            assert_eq!(table.status, [Status::Ok, none, third], "{letters}: {name}");
        }
        let (numbers, zero) = (Set::Pose.values(&mech, &backwards).map(|x| [x]), [0.0]);
        let free = independent_coordinates::best_given(&mech, &Set::Pose);
        let guess = backwards.matrix();
        for (all, guess) in [(true, None), (true, Some(&guess[..])), (false, Some(&guess))] {
            let series = |k: usize| (all || free[k]).then_some([&numbers[k][..], &zero, &zero]);
            let given = (0..6).map(series).collect();
            let input = Coordinates { set: Set::Pose, given, branch: 1.0, guess, continued: false };
            assert_eq!(batch::states(&mech, &input, 1).status, [none], "{letters}: states");
        }
        // Its lengths have it all the same.
        let to: Vec<f64> = mech.legs.iter().map(|l| leg::position(l, &backwards).length).collect();
        for continued in [false, true] {
            let found = batch::forward_kinematics(&mech, &to, Some(&backwards.matrix()), continued);
            assert_eq!(found.status, [none], "{letters}");
            assert!(found.fields[0].data.iter().zip(backwards.matrix()).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
