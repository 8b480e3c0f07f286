//! The two ways to the reachable workspace, each against what defines it, and against each other.

mod common;

use common::{published, with_leg, with_leg_backwards};
use polypod_core::kinematics::constraint::largest_distance;
use polypod_core::kinematics::coordinate_sets::Set;
use polypod_core::kinematics::leg;
use polypod_core::mobility::singularity::conditioning;
use polypod_core::model::limit::{Bound, Limit, Measure};
use polypod_core::model::mechanism::Mechanism;
use polypod_core::number::order::{larger, smaller};
use polypod_core::spatial::{Pose, Vec3};
use polypod_core::workspace::fit_orientation::fit;
use polypod_core::workspace::flood_fill::{Edge, Flood, Grid, Stop};
use polypod_core::workspace::length_lattice::Lattice;

/// Bounds of o as the grid below has them.
const ABOVE: [[f64; 2]; 3] = [[-0.8, 0.8], [-0.8, 0.8], [0.1, 1.0]];

/// A pose of the published manipulator away from its singularities.
fn tilted(mech: &Mechanism) -> Pose<f64> {
    Set::of(mech)[1].pose(mech, &[0.0, 0.0, 0.74, 0.3, 0.1, 0.0, 0.0])
}

fn grid(step: f64) -> Grid {
    let side = (1.6 / step).round() as usize + 1;
    Grid { origin: Vec3::new(-0.8, -0.8, 0.1), step, counts: [side, side, (0.9 / step).round() as usize] }
}

fn flooded(mech: &Mechanism, start: &Pose<f64>, step: f64, keep_aspect: bool) -> Flood {
    let mut flood = Flood::new(mech, grid(step), start, keep_aspect).expect("a start inside");
    while flood.wave(mech) > 0 {}
    flood
}

/// Every leg within its stroke and every constraint kept, from positions alone.
fn assert_inside(mech: &Mechanism, pose: &Pose<f64>) {
    assert!(pose.rotation.departures().iter().all(|e| e.abs() < 1e-12) && pose.rotation.determinant() > 0.0);
    assert!(largest_distance(mech, pose) < 1e-12);
    for leg in &mech.legs {
        let length = leg::position(leg, pose).length;
        assert!((0.65 - 1e-9..=0.85 + 1e-9).contains(&length), "{length}");
    }
}

#[test]
fn a_fitted_pose_is_there_and_inside_and_no_farther_turned_than_it_must_be() {
    let mech = published();
    let start = tilted(&mech);
    let to = start.o + Vec3::new(0.02, -0.03, 0.01);
    let pose = fit(&mech, &start, to).expect("reachable");
    assert_eq!(pose.o, to);
    assert_inside(&mech, &pose);
    assert!((start.rotation.transpose() * pose.rotation).rotation_vector().norm() < 0.2);
    assert!(fit(&mech, &start, Vec3::new(0.0, 0.0, 0.95)).is_none(), "legs are 850 mm long at most");
    let same = fit(&mech, &start, start.o).expect("the start itself");
    assert!((same.rotation.transpose() * start.rotation).rotation_vector().norm() < 1e-12);
}

#[test]
fn boundaries_lie_on_limits_or_on_singularities() {
    let mech = published();
    for keep_aspect in [false, true] {
        let flood = flooded(&mech, &tilted(&mech), 0.05, keep_aspect);
        let edges = flood.edges(&mech);
        assert!(edges.len() > 1000);
        let mut singular = 0;
        for Edge { pose, stop, margin, .. } in &edges {
            assert_inside(&mech, pose);
            match stop {
                Stop::Limit(i) => {
                    assert!(margin.abs() <= 1e-9);
                    let found = mech.limits[*i].margin(&mech, pose, None);
                    assert!(found.abs() <= 1e-9, "{} {found}", mech.limits[*i].name);
                }
                Stop::Singularity => {
                    singular += 1;
                    let sigma = conditioning(&mech, pose, mech.characteristic_length).sigma_min;
                    assert!(sigma < 1e-4, "{sigma}");
                }
                Stop::Grid => assert!(pose.o.z < 0.11),
                Stop::Search => panic!("nothing stops it at {pose:?}"),
            }
        }
        assert_eq!(singular > 0, keep_aspect);
    }
}

#[test]
fn nothing_depends_on_the_number_of_threads() {
    let mech = published();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let flood = flooded(&mech, &tilted(&mech), 0.05, true);
            let edges: Vec<[u64; 4]> = flood
                .edges(&mech)
                .iter()
                .map(|e| [e.share, e.pose.o.x, e.pose.rotation.0[1].y, e.margin].map(f64::to_bits))
                .collect();
            let mut lattice = Lattice::new(&mech, &tilted(&mech), ABOVE, 0.05, 0.01).expect("a start");
            while lattice.wave(&mech) > 0 {}
            let profile: Vec<u64> = lattice.reached.profile.iter().flatten().map(|x| x.to_bits()).collect();
            let reached = &lattice.reached;
            let counts = [reached.inside, reached.poses, reached.at_limits, reached.singular];
            (flood.mask, edges, counts, profile)
        })
    };
    assert!(run(1) == run(2));
}

/// Largest and least coordinates of the boundary.
fn extents(flood: &Flood, mech: &Mechanism) -> [[f64; 2]; 3] {
    let mut extents = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for edge in flood.edges(mech) {
        for (extent, x) in extents.iter_mut().zip(edge.pose.o.array()) {
            *extent = [smaller(extent[0], x), larger(extent[1], x)];
        }
    }
    extents
}

#[test]
fn both_ways_agree_within_the_coarser_step() {
    let mech = published();
    let (start, step) = (tilted(&mech), 0.05);
    let mut lattice = Lattice::new(&mech, &start, ABOVE, step, 0.01).expect("a start");
    while lattice.wave(&mech) > 0 {}
    let reached = &lattice.reached;
    let by_poses = extents(&flooded(&mech, &start, step, true), &mech);
    println!("{:?}\n{by_poses:?}", reached.extents);
    for (by_lengths, by_poses) in reached.extents.iter().flatten().zip(by_poses.iter().flatten()) {
        assert!((by_lengths - by_poses).abs() < step);
    }
    // Several poses of the aspect have the same lengths.
    assert!(10 * reached.poses > 13 * reached.inside);
    assert!(reached.singular > 0 && reached.at_limits > 0);
}

#[test]
fn a_mechanism_without_strokes_has_no_lattice_and_an_unreachable_start_no_flood() {
    let free = with_leg("SPU", 3);
    assert!(Lattice::new(&free, &free.home, ABOVE, 0.1, 0.1).is_none());
    let mech = published();
    let high = Pose { o: Vec3::new(0.0, 0.0, 0.98), ..mech.home };
    assert!(Flood::new(&mech, grid(0.05), &high, false).is_none());
}

#[test]
fn no_leg_points_backwards_in_a_fixed_joint() {
    for (letters, held) in [("UPF", true), ("FPS", true), ("UPR", false), ("RPS", false)] {
        let mech = with_leg(letters, 8);
        let backwards = with_leg_backwards(&mech);
        assert!(fit(&mech, &mech.home, mech.home.o).is_some(), "{letters}");
        assert_eq!(fit(&mech, &backwards, backwards.o).is_none(), held, "{letters}");
        // Strokes about the lengths that the start has.
        let lattice = |start: &Pose<f64>| {
            let mut mech = mech.clone();
            for i in 0..mech.legs.len() {
                let length = leg::position(&mech.legs[i], start).length;
                for bound in [Bound::Least(length - 0.02), Bound::Most(length + 0.02)] {
                    let (name, measure) = (String::new(), Measure::Length(i));
                    mech.limits.push(Limit { name, measure, bound, scale: 1.0 });
                }
            }
            Lattice::new(&mech, start, [[-4.0, 4.0]; 3], 0.01, 0.1)
        };
        assert!(lattice(&mech.home).is_some(), "{letters}");
        assert_eq!(lattice(&backwards).is_none(), held, "{letters}");
    }
}
