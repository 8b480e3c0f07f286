//! Performance guarantees of batches: blocks are faster than one state after the other, and no state
//! allocates.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use common::{published, states};
use polypod_core::batch::{self, Coordinates, Loads, States, Table};
use polypod_core::dynamics::inverse_dynamics;
use polypod_core::kinematics::coordinate_sets::Set;
use polypod_core::mobility::independent_coordinates;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::parallel::threads;
use polypod_core::spatial::Motion;

/// The system's allocator, which counts.
struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

struct Arrays {
    poses: Vec<f64>,
    twists: Vec<f64>,
    accelerations: Vec<f64>,
    of_legs: Vec<f64>,
}

impl Arrays {
    fn of(mech: &Mechanism, states: &[Motion<f64>]) -> Self {
        Arrays {
            poses: states.iter().flat_map(|s| s.pose.matrix()).collect(),
            twists: states.iter().flat_map(|s| s.twist.array()).collect(),
            accelerations: states.iter().flat_map(|s| s.acceleration.array()).collect(),
            of_legs: vec![1.0; states.len() * mech.legs.len()],
        }
    }

    fn states(&self) -> States<'_> {
        States { poses: &self.poses, twists: &self.twists, accelerations: &self.accelerations }
    }
}

type Operation = fn(&Mechanism, &Arrays) -> Table;

const OPERATIONS: [(&str, Operation); 17] = [
    ("inverse kinematics", |mech, a| batch::inverse_kinematics(mech, &a.poses)),
    ("Jacobian", |mech, a| batch::jacobians(mech, &a.poses)),
    ("Hessian", |mech, a| batch::hessians(mech, &a.poses)),
    ("kinematics", |mech, a| batch::kinematics(mech, &a.states())),
    ("twist", |mech, a| batch::platform_twist(mech, &a.poses, &a.of_legs)),
    ("acceleration", |mech, a| batch::platform_acceleration(mech, &a.poses, &a.twists, &a.of_legs)),
    ("inverse dynamics", |mech, a| batch::inverse_dynamics(mech, &a.states(), &Loads::Own, None)),
    ("states", |mech, a| {
        let series = [&a.of_legs[..a.poses.len() / 16]; 3];
        let given = vec![Some(series), Some(series), Some(series), Some(series), Some(series)];
        let input = Coordinates { set: Set::of(mech)[1], given, branch: 1.0, guess: None, continued: false };
        batch::states(mech, &input, series[0].len())
    }),
    ("limits", |mech, a| batch::limits(mech, &a.states(), &Loads::Own)),
    ("forward dynamics", |mech, a| {
        batch::forward_dynamics(mech, &a.poses, &a.twists, &a.of_legs, &Loads::Own)
    }),
    ("joint reactions", |mech, a| batch::joint_reactions(mech, &a.states(), &Loads::Own, 1.0)),
    ("derivatives", |mech, a| {
        let set = Set::of(mech)[0];
        let given = independent_coordinates::best_given(mech, &set);
        batch::inverse_dynamics_derivatives(mech, &a.states(), &Loads::Own, &set, &given)
    }),
    ("regressor", |mech, a| batch::regressors(mech, &a.states(), &Loads::Own)),
    ("power", |mech, a| batch::power(mech, &a.states(), &Loads::Own)),
    ("determinant", |mech, a| batch::determinants(mech, &a.poses, &a.twists, 1.0)),
    ("coordinates", |mech, a| batch::coordinate_values(mech, &Set::of(mech)[0], &a.poses)),
    ("coupled forces", |mech, a| {
        batch::coupled_forces(mech, &a.poses, &a.of_legs, false).expect("a pair on a rod").1
    }),
];

/// Both in one test: nothing else is to allocate or to run beside them.
#[test]
fn no_state_allocates_and_blocks_are_faster_than_single_states() {
    let mech = published();
    let few = states(&mech, 100, 1);
    let many: Vec<_> = few.iter().cycle().take(6400).copied().collect();
    threads::set(1);
    let (few_arrays, many_arrays) = (Arrays::of(&mech, &few), Arrays::of(&mech, &many));
    for (name, operation) in OPERATIONS {
        let count = |arrays: &Arrays| {
            let before = COUNT.load(Ordering::Relaxed);
            black_box(operation(&mech, arrays));
            COUNT.load(Ordering::Relaxed) - before
        };
        // Once before, for what is set up at the first call.
        count(&few_arrays);
        let (few, many) = (count(&few_arrays), count(&many_arrays));
        // Long tables take room for a block that is written past the caches.
        assert!(many <= few + 1, "{name}: {many} allocations of 6400 states, {few} of 100");
    }

    let load = mech.load.wrench;
    let one_by_one = || {
        for state in &many {
            black_box(inverse_dynamics::inverse_dynamics(&mech, black_box(state), load));
        }
    };
    let in_blocks = || {
        black_box(batch::inverse_dynamics(&mech, &many_arrays.states(), &Loads::Own, None));
    };
    let least = |run: &dyn Fn()| {
        let time = || {
            let start = Instant::now();
            run();
            start.elapsed()
        };
        (0..15).map(|_| time()).min().expect("some runs")
    };
    // Blocks check their input besides. Where registers are narrow they win less.
    let (alone, together) = (least(&one_by_one), least(&in_blocks));
    assert!(together < alone, "one by one {alone:?}, in blocks {together:?}");
}
