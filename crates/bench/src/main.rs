//! Arithmetic of one state and peak rates of the processor: the counts of each operation for the published
//! manipulator and the peak rates of multiplications and additions, of divisions and of square roots, as
//! JSON.
//!
//! The kernels run with a number that counts. Comparisons, selections, signs and memory are free; a division
//! and a square root count as one flop each, though they take longer. Checks of the input are not in it.

#[path = "../../core/tests/common/mod.rs"]
mod common;

use std::cell::Cell;
use std::hint::black_box;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::time::Instant;

use polypod_core::dynamics::forward_dynamics::forward_dynamics;
use polypod_core::dynamics::inverse_dynamics::inverse_dynamics;
use polypod_core::forward_kinematics::newton::{LegTarget, step_of, system};
use polypod_core::kinematics::jacobian::jacobian;
use polypod_core::kinematics::leg;
use polypod_core::model::mechanism::Mechanism;
use polypod_core::number::lanes::{Lanes, Task, dispatch};
use polypod_core::number::order::larger;
use polypod_core::number::real::{Ordered, Real, Trig};
use polypod_core::numerics::gauss::solve;
use polypod_core::spatial::{Acceleration, Motion, Pose, Twist, Vec3, Wrench};
use serde_json::json;

/// Additions (and subtractions), multiplications, divisions, square roots.
type Counts = [u64; 4];

thread_local! {
    static COUNTS: Cell<Counts> = const { Cell::new([0; 4]) };
}

fn count(operation: usize) {
    COUNTS.with(|cell| {
        let mut counts = cell.get();
        counts[operation] += 1;
        cell.set(counts);
    });
}

/// A double that counts what is done with it.
#[derive(Clone, Copy, Debug)]
struct Counted(f64);

macro_rules! counted {
    ($($op:ident $method:ident $number:literal),*) => {$(
        impl $op for Counted {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                count($number);
                Counted(self.0.$method(other.0))
            }
        }
    )*};
}
counted!(Add add 0, Sub sub 0, Mul mul 1, Div div 2);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Counted(-self.0)
    }
}

impl Real for Counted {
    type Value = Self;
    fn lit(x: f64) -> Self {
        Counted(x)
    }
    fn value(self) -> Self {
        self
    }
    fn sqrt(self) -> Self {
        count(3);
        Counted(self.0.sqrt())
    }
    fn select(choose: bool, a: Self, b: Self) -> Self {
        if choose { a } else { b }
    }
}

impl Ordered for Counted {
    type Mask = bool;
    fn greater(self, than: Self) -> bool {
        self.0 > than.0
    }
    fn at_most(self, other: Self) -> bool {
        self.0 <= other.0
    }
    fn abs(self) -> Self {
        Counted(self.0.abs())
    }
    fn signum(self) -> Self {
        Counted(self.0.signum())
    }
}

/// Not counted: the kernels here need no angles.
impl Trig for Counted {
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.0.sin_cos();
        (Counted(s), Counted(c))
    }
    fn acos(self) -> Self {
        Counted(Trig::acos(self.0))
    }
    fn atan2(self, x: Self) -> Self {
        Counted(Trig::atan2(self.0, x.0))
    }
}

fn counts_of<T>(operation: impl FnOnce() -> T) -> serde_json::Value {
    COUNTS.with(|cell| cell.set([0; 4]));
    black_box(operation());
    let [add, mul, div, sqrt] = COUNTS.with(Cell::get);
    json!({ "add": add, "mul": mul, "div": div, "sqrt": sqrt, "flops": add + mul + div + sqrt })
}

fn counts(mech: &Mechanism, state: &Motion<f64>) -> serde_json::Value {
    let lift = Vec3::<Counted>::lift;
    let platform = Motion {
        pose: Pose::lift(&state.pose),
        twist: Twist::new(lift(state.twist.v), lift(state.twist.omega)),
        acceleration: Acceleration::new(lift(state.acceleration.a), lift(state.acceleration.eps)),
    };
    let Motion { pose, twist, .. } = &platform;
    let load = Wrench::new(lift(mech.load.wrench.force), lift(mech.load.wrench.torque));
    let forces = [Counted(100.0); 6];
    let asked = [LegTarget { place: Counted(0.0), square: Counted(0.5) }; 6];
    json!({
        "inverse_kinematics": counts_of(|| for leg in &mech.legs { black_box(leg::position(leg, pose)); }),
        "jacobian": counts_of(|| jacobian(mech, pose)),
        "kinematics": counts_of(|| every_link(mech, &platform)),
        "inverse_dynamics": counts_of(|| inverse_dynamics(mech, &platform, load)),
        "forward_dynamics": counts_of(|| forward_dynamics(mech, pose, twist, &forces[..mech.dof()], load)),
        "forward_kinematics": counts_of(|| {
            let at = system(mech, pose, &asked);
            let step = solve(at.matrix, at.residual.map(|f| -f)).x;
            pose.stepped(&step_of(mech, step, Counted(1.0)))
        }),
    })
}

/// The motion of every link; the joints' angles are left out.
fn every_link(mech: &Mechanism, platform: &Motion<Counted>) {
    for (i, leg) in mech.legs.iter().enumerate() {
        let state = leg::state(leg, platform);
        black_box((leg::piston(leg, &state), leg::cylinder(leg, &state)));
        for rod in mech.rods.iter().filter(|rod| rod.leader == i) {
            black_box(leg::rod_turn(Vec3::lift(rod.axis), &state));
        }
    }
}

/// As many chains as hide the time that one operation takes.
const CHAINS: usize = 12;
const ROUNDS: usize = 50_000;
/// Short ones, of which the fastest counts: a peak is what nothing else has slowed down.
const RUNS: usize = 50;

/// Operations a second in registers only: fused multiplications and additions (where the registers fuse
/// them), separate ones, divisions, square roots.
type Rates = [f64; 4];

struct Peak<'a>(&'a mut Rates);

impl Task for Peak<'_> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let (a, b) = (V::lit(black_box(0.999)), V::lit(black_box(1e-3)));
        macro_rules! rate {
            ($flops:literal, $x:ident => $next:expr) => {{
                let mut chains = [V::lit(black_box(1.0)); CHAINS];
                let start = Instant::now();
                for _ in 0..ROUNDS {
                    for $x in &mut chains {
                        *$x = $next;
                    }
                }
                black_box(chains);
                ($flops * CHAINS * ROUNDS * V::WIDTH) as f64 / start.elapsed().as_secs_f64()
            }};
        }
        *self.0 = [
            rate!(2, x => x.mul_add(a, b)),
            rate!(2, x => *x * a + b),
            rate!(1, x => a / *x),
            rate!(1, x => x.sqrt()),
        ];
    }
}

fn main() {
    let mech = common::published();
    let state = common::states(&mech, 1, 1)[0];
    let mut peaks = Rates::default();
    for _ in 0..RUNS {
        let mut now = Rates::default();
        dispatch(Peak(&mut now));
        for k in 0..peaks.len() {
            peaks[k] = larger(peaks[k], now[k]);
        }
    }
    let result = json!({
        "per_state": counts(&mech, &state),
        "fused_flops_per_second": peaks[0],
        "separate_flops_per_second": peaks[1],
        "divisions_per_second": peaks[2],
        "roots_per_second": peaks[3],
    });
    println!("{result}");
}
