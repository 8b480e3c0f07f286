//! Differences between instruction sets. One test, in a process of its own: the choice is that of the whole
//! process.

mod common;

use common::published;
use polypod_core::kinematics::coordinate_sets::Set;
use polypod_core::number::lanes;
use polypod_core::workspace::lattice_poses::Reached;
use polypod_core::workspace::length_lattice::Lattice;

fn reached(set: &str) -> Reached {
    assert!(lanes::use_instructions(set));
    let mech = published();
    let start = Set::of(&mech)[1].pose(&mech, &[0.0, 0.0, 0.74, 0.3, 0.1, 0.0, 0.0]);
    let bounds = [[-1.0, 1.0], [-1.0, 1.0], [0.0, 1.0]];
    let mut lattice = Lattice::new(&mech, &start, bounds, 0.05, 0.01).expect("a start");
    while lattice.wave(&mech) > 0 {}
    lattice.reached
}

#[test]
fn a_lattice_has_the_same_nodes_on_all_instructions() {
    let sets = lanes::instruction_sets();
    let runs: Vec<Reached> = sets.iter().map(|set| reached(set)).collect();
    let fuses = |set: &str| !["sse2", "scalar"].contains(&set);
    for (set, run) in sets.iter().zip(&runs) {
        let (first, _) =
            runs.iter().zip(&sets).find(|(_, other)| fuses(other) == fuses(set)).expect("itself");
        assert_eq!(format!("{run:?}"), format!("{first:?}"), "{set}: registers that round alike");
        let counts = |r: &Reached| [r.inside, r.poses, r.at_limits, r.singular];
        assert_eq!(counts(run), counts(&runs[0]), "{set}");
        for (a, b) in run.extents.iter().flatten().zip(runs[0].extents.iter().flatten()) {
            assert!((a - b).abs() < 1e-9, "{set}: {a} {b}");
        }
    }
}
