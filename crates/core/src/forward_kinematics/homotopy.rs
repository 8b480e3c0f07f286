//! Homotopy continuation: paths of complex solutions while the equations change, such as squared leg lengths,
//! several side by side; Runge-Kutta predictor, Newton corrector \[T29\].

use crate::forward_kinematics::newton::{FOLD_PIVOTS, LegTarget, System, system};
use crate::forward_kinematics::path_point::{Block, C, PathPoint, load, store};
use crate::kinematics::leg;
use crate::model::mechanism::Mechanism;
use crate::number::complex::Complex;
use crate::number::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::number::order::{larger, smaller};
use crate::number::real::{Ordered, Real};
use crate::numerics::gauss::{Solved, solve, solve_all};
use crate::spatial::Pose;

/// Coordinates, as pure numbers, of a pose beyond which a path is taken to go to infinity: no real pose is
/// there.
pub const INFINITE: f64 = 1e7;

/// Coordinates, as pure numbers, beyond which a path that cannot be followed further in double precision is
/// taken to go to infinity.
const FAR: f64 = 300.0;

/// Coordinates, as pure numbers, below which a pose may be a real one.
const NEARBY: f64 = 100.0;

/// Share of a path that is tried first.
const FIRST_STEP: f64 = 0.3;

/// Share of a path below which a step is not made shorter.
const SMALLEST_STEP: f64 = 1e-13;

/// Share of a path that may be left where it ends in a singular pose.
const NEAR_END: f64 = 1e-9;

/// Newton steps at the end of a path.
const LAST_STEPS: usize = 40;

/// Size of a Newton step, as a pure number, from which the next one is rounding.
const ROUNDING: f64 = 1e-14;

/// Size of a Newton step, as a pure number, from which the iteration counts as quadratically converged.
const CONVERGED: f64 = 1e-9;

/// Size of a Newton step, as a pure number, that is small enough on the way.
const CLOSE: f64 = 1e-8;

/// How a path ends.
#[derive(Clone, Copy, Debug)]
pub enum PathEnd {
    Regular(Pose<C>),
    /// At a solution where several paths end.
    Singular(Pose<C>),
    Infinite,
    /// On the way: what it leads to is not known.
    Lost,
}

impl PathEnd {
    /// The pose, if it is a regular one.
    #[must_use]
    pub fn regular(self) -> Option<Pose<C>> {
        match self {
            PathEnd::Regular(pose) => Some(pose),
            _ => None,
        }
    }
}

/// Six equations that change from t = 0 to t = 1.
pub trait Family {
    fn mech(&self) -> &Mechanism;

    /// Whether solutions that differ by an idle spin are one \[T71\].
    fn spins(&self) -> bool;

    /// The equations at a point of the path, and the rates at which their residuals fall there. Must be
    /// `#[inline(always)]`.
    fn at<V: Lanes>(&self, place: &PathPoint<Complex<V>>, t: V) -> (System<Complex<V>>, [Complex<V>; 6]);
}

/// Targets of the legs along a straight path of squared lengths.
#[derive(Clone, Copy, Debug)]
pub struct Lengths<'a> {
    pub mech: &'a Mechanism,
    pub from: [LegTarget<C>; 6],
    pub to: [LegTarget<C>; 6],
}

impl Family for Lengths<'_> {
    fn mech(&self) -> &Mechanism {
        self.mech
    }

    fn spins(&self) -> bool {
        !self.mech.idle.is_empty()
    }

    #[inline(always)]
    fn at<V: Lanes>(&self, place: &PathPoint<Complex<V>>, t: V) -> (System<Complex<V>>, [Complex<V>; 6]) {
        let Lengths { mech, from, to } = self;
        let unit = 1.0 / (mech.characteristic_length * mech.characteristic_length);
        let pose = place.pose();
        let mut asked = [LegTarget::none(); 6];
        let mut rates = [Complex::<V>::zero(); 6];
        let mut i = 0;
        for leg in &mech.legs {
            if leg.actuated {
                let (square, square_rate) = between(from[i].square, to[i].square, t);
                let (place, place_rate) = between(from[i].place, to[i].place, t);
                asked[i] = LegTarget { place, square };
                let rate = LegTarget { place: place_rate, square: square_rate };
                let r = asked[i].vector(leg, leg::vectors(leg, &pose).1);
                rates[i] = LegTarget::change(leg, r, &rate).scale(unit);
                i += 1;
            }
        }
        (system(mech, &pose, &asked), rates)
    }
}

/// The paths of the solutions of such equations.
#[derive(Clone, Copy, Debug)]
pub struct HomotopyPath<F> {
    pub family: F,
    /// Error of a predicted step, as a pure number.
    pub precision: f64,
}

/// Where one of several solutions on their way is.
#[derive(Clone, Copy, Debug)]
struct TrackedPath {
    /// Which of them it is.
    start: usize,
    t: f64,
    /// The next step.
    h: f64,
    /// Size of the Newton step that corrected the last prediction.
    error: f64,
    /// t and h of the step before.
    before: (f64, f64),
}

impl TrackedPath {
    fn new(start: usize) -> Self {
        TrackedPath { start, t: 0.0, h: FIRST_STEP, error: 0.0, before: (0.0, 0.0) }
    }

    /// Whether a second Newton step is as much smaller than the first as it must be.
    fn contracts(&self, size: f64, precision: f64) -> bool {
        size <= larger(0.1 * precision * larger(precision, self.error), CLOSE)
    }

    /// Goes on if the error of a prediction permits it, and sets the next step: errors grow with its fifth
    /// power.
    fn judge(&mut self, error: f64, precision: f64) -> bool {
        let good = error <= precision;
        let factor = 0.8 * (precision / error).powf(0.2);
        let factor = if factor.is_nan() { 0.25 } else { factor.clamp(0.25, 4.0) };
        if good {
            *self = TrackedPath {
                t: self.t + self.h,
                h: self.h * factor,
                error,
                before: (self.t, self.h),
                ..*self
            };
        } else {
            self.h *= smaller(factor, 0.5);
        }
        good
    }

    /// Whether it has been at the end for a step already.
    fn waits(&self) -> bool {
        self.t >= 1.0 && self.h == 0.0
    }

    /// Takes the last step back.
    fn back(&mut self) {
        let (t, h) = self.before;
        *self = TrackedPath { t, h: 0.25 * h, error: 0.0, before: (t, 0.25 * h), ..*self };
    }
}

impl<F: Family> HomotopyPath<F> {
    /// Follows the path from solutions at t = 0 by the classical Runge-Kutta method and Newton corrections.
    #[must_use]
    pub fn follow(&self, starts: &[Pose<C>]) -> Vec<PathEnd> {
        let mut ends = vec![PathEnd::Lost; starts.len()];
        let mut waiting = starts.iter().enumerate();
        let mut travellers: [Option<TrackedPath>; WIDTH] = [None; WIDTH];
        let (mut place, mut rate) = (ZERO, ZERO);
        let mut before = (place, rate);
        let mut at = Evaluated::default();
        loop {
            for (k, traveller) in
                travellers.iter_mut().enumerate().filter(|(_, traveller)| traveller.is_none())
            {
                if let Some((start, pose)) = waiting.next() {
                    *traveller = Some(TrackedPath::new(start));
                    self.unspun(PathPoint::of(pose)).put(&mut place, k);
                }
            }
            if travellers.iter().all(Option::is_none) {
                return ends;
            }
            // The second correction of the step before, and the rate for the next.
            self.evaluate(&place, &row(&travellers, |who| who.t), &mut at);
            rate.clone_from(&at.rate);
            for (k, traveller) in travellers.iter_mut().enumerate() {
                let Some(who) = traveller else { continue };
                let arrived = who.t >= 1.0 && at.size[k] <= CONVERGED && at.pivots[k] > FOLD_PIVOTS;
                if !arrived && who.waits() {
                    (ends[who.start], *traveller) = (self.end(who, &PathPoint::get(&place, k)), None);
                    continue;
                }
                if who.contracts(at.size[k], self.precision) {
                    add(&mut place, &at.correction, k);
                } else {
                    who.back();
                    copy(&before.0, &mut place, k);
                    copy(&before.1, &mut rate, k);
                }
                who.h = smaller(who.h, 1.0 - who.t);
                if arrived {
                    (ends[who.start], *traveller) =
                        (PathEnd::Regular(PathPoint::get(&place, k).pose()), None);
                }
            }
            before.0.clone_from(&place);
            before.1.clone_from(&rate);
            let (t, h) = (row(&travellers, |who| who.t), row(&travellers, |who| who.h));
            let mut next = self.predict(&place, &rate, &t, &h, &mut at);
            self.evaluate(&next, &later(&t, &h, 1.0), &mut at);
            add_all(&mut next, &at.correction, &ONE);
            for (k, traveller) in travellers.iter_mut().enumerate() {
                let Some(who) = traveller else { continue };
                if who.judge(at.size[k], self.precision) {
                    copy(&next, &mut place, k);
                }
                let here = PathPoint::get(&place, k);
                if self.family.spins() {
                    self.unspun(here).put(&mut place, k);
                }
                if !(here.size(self.family.mech()) < INFINITE) {
                    (ends[who.start], *traveller) = (PathEnd::Infinite, None);
                } else if who.t < 1.0 && who.h <= SMALLEST_STEP {
                    (ends[who.start], *traveller) = (self.end(who, &here), None);
                }
            }
        }
    }

    fn unspun(&self, place: PathPoint<C>) -> PathPoint<C> {
        if self.family.spins() { place.unspun(self.family.mech()) } else { place }
    }

    /// The classical Runge-Kutta step.
    fn predict(&self, place: &Block, rate: &Block, t: &Row, h: &Row, at: &mut Evaluated) -> Block {
        let middle = later(t, h, 0.5);
        let [half, sixth, third] = [2.0, 6.0, 3.0].map(|n| h.map(|h| h / n));
        let (mut sum, mut stage) = (*place, *place);
        add_all(&mut sum, rate, &sixth);
        add_all(&mut stage, rate, &half);
        for (share, next) in [(&third, &half), (&third, h)] {
            self.evaluate(&stage, &middle, at);
            add_all(&mut sum, &at.rate, share);
            stage = *place;
            add_all(&mut stage, &at.rate, next);
        }
        self.evaluate(&stage, &later(t, h, 1.0), at);
        add_all(&mut sum, &at.rate, &sixth);
        sum
    }

    /// End of a path that cannot be followed further, or of paths that seem to meet.
    fn end(&self, who: &TrackedPath, place: &PathPoint<C>) -> PathEnd {
        let mech = self.family.mech();
        let size = place.size(mech);
        if who.t < 1.0 - NEAR_END {
            return if size > FAR { PathEnd::Infinite } else { PathEnd::Lost };
        }
        let (mut place, mut last) = (*place, f64::NAN);
        for _ in 0..LAST_STEPS {
            let (System { residual, matrix }, _) = self.family.at(&place, 1.0);
            let step = solve(matrix, residual.map(|f| -f)).x;
            place = place + place.along(mech, &step);
            last = step_size(mech, &place, &step);
            if !(last > ROUNDING) {
                break;
            }
        }
        // Where paths meet, Newton steps may be small by chance: the matrix tells.
        let (System { residual, matrix }, _) = self.family.at(&place, 1.0);
        let determined = size > NEARBY || solve(matrix, residual).pivots > FOLD_PIVOTS;
        let regular = who.t >= 1.0 && last <= CONVERGED && determined;
        if regular { PathEnd::Regular(place.pose()) } else { PathEnd::Singular(place.pose()) }
    }

    /// Newton steps and rates at points.
    fn evaluate(&self, place: &Block, t: &Row, result: &mut Evaluated) {
        lanes::dispatch(Evaluation { family: &self.family, place, t, result });
    }
}

/// The size of a step (v/Λ, ω), relative to how far off o is.
#[inline(always)]
fn step_size<T: Ordered>(mech: &Mechanism, place: &PathPoint<Complex<T>>, x: &[Complex<T>; 6]) -> T {
    let mut sum = T::zero();
    for z in x {
        sum = sum + z.norm_sqr();
    }
    let far = place.o.x.norm_sqr() + place.o.y.norm_sqr() + place.o.z.norm_sqr();
    sum.sqrt() / (T::one() + far.sqrt().scale(1.0 / mech.characteristic_length))
}

const ZERO: Block = [[0.0; WIDTH]; 14];
const ONE: Row = [1.0; WIDTH];

fn row(travellers: &[Option<TrackedPath>; WIDTH], part: impl Fn(&TrackedPath) -> f64) -> Row {
    std::array::from_fn(|k| travellers[k].as_ref().map_or(0.0, &part))
}

fn later(t: &Row, h: &Row, share: f64) -> Row {
    std::array::from_fn(|k| t[k] + share * h[k])
}

fn add_all(place: &mut Block, step: &Block, share: &Row) {
    for (row, step) in place.iter_mut().zip(step) {
        for k in 0..WIDTH {
            row[k] += share[k] * step[k];
        }
    }
}

fn add(place: &mut Block, step: &Block, k: usize) {
    for (row, step) in place.iter_mut().zip(step) {
        row[k] += step[k];
    }
}

fn copy(from: &Block, to: &mut Block, k: usize) {
    for (to, from) in to.iter_mut().zip(from) {
        to[k] = from[k];
    }
}

/// Newton steps at points and their sizes, and the rates of the points along the path.
#[derive(Clone, Copy, Debug, Default)]
struct Evaluated {
    correction: Block,
    size: Row,
    pivots: Row,
    rate: Block,
}

struct Evaluation<'a, F> {
    family: &'a F,
    place: &'a Block,
    t: &'a Row,
    result: &'a mut Evaluated,
}

impl<F: Family> Task for Evaluation<'_, F> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mech = self.family.mech();
        let mut k = 0;
        while k < WIDTH {
            let place: PathPoint<Complex<V>> = load(self.place, k);
            let (System { mut residual, matrix }, rates) = self.family.at(&place, V::load(&self.t[k..]));
            for f in &mut residual {
                *f = -*f;
            }
            let Solved { x: [step, rate], pivots, .. } = solve_all(matrix, [residual, rates]);
            step_size(mech, &place, &step).store(&mut self.result.size[k..]);
            pivots.store(&mut self.result.pivots[k..]);
            store(&place.along(mech, &step), &mut self.result.correction, k);
            store(&place.along(mech, &rate), &mut self.result.rate, k);
            k += V::WIDTH;
        }
    }
}

/// A number at t, and its rate.
#[inline(always)]
fn between<V: Lanes>(from: C, to: C, t: V) -> (Complex<V>, Complex<V>) {
    let change = to - from;
    let at = Complex::new(
        V::lit(change.re).mul_add(t, V::lit(from.re)),
        V::lit(change.im).mul_add(t, V::lit(from.im)),
    );
    (at, Complex::new(V::lit(change.re), V::lit(change.im)))
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::common;
    use crate::forward_kinematics::path_point::tests::complex_places;
    use crate::number::lanes::tests::on_each_width;
    use crate::number::order::largest;
    use crate::numerics::random::Random;

    #[derive(Clone, Copy)]
    struct Each<'a> {
        family: &'a Lengths<'a>,
        place: &'a Block,
        t: &'a Row,
        results: &'a RefCell<Vec<(bool, Evaluated)>>,
    }

    impl Task for Each<'_> {
        #[inline(always)]
        fn run<V: Lanes>(self) {
            let mut result = Evaluated::default();
            Evaluation { family: self.family, place: self.place, t: self.t, result: &mut result }.run::<V>();
            self.results.borrow_mut().push((V::FUSED, result));
        }
    }

    #[test]
    fn paths_side_by_side_are_those_alone_bit_by_bit() {
        let mut draw = Random(5);
        for mech in common::mechanisms() {
            let [from, to] = [(); 2].map(|()| {
                std::array::from_fn(|_| LegTarget { place: draw.complex(), square: draw.complex() })
            });
            let family = Lengths { mech: &mech, from, to };
            let (places, mut block) = (complex_places(&mut draw), ZERO);
            for (k, place) in places.iter().enumerate() {
                place.put(&mut block, k);
            }
            let t: Row = std::array::from_fn(|_| draw.number());
            let results = RefCell::new(Vec::new());
            on_each_width(Each { family: &family, place: &block, t: &t, results: &results });
            let all = results.into_inner();
            let bits = |e: &Evaluated| {
                let blocks = [e.correction, e.rate].map(|b| b.map(|row| row.map(f64::to_bits)));
                (blocks, [e.size, e.pivots].map(|row| row.map(f64::to_bits)))
            };
            for (fused, result) in &all {
                let first = all.iter().find(|(f, _)| f == fused).expect("itself");
                assert_eq!(bits(result), bits(&first.1), "fused: {fused}");
            }
            let all: Vec<Evaluated> = all.into_iter().map(|(_, result)| result).collect();
            // Lane 3 is what the equations of that place alone say.
            let at = |a: C, b: C| a + (b - a).scale(t[3]);
            let asked = std::array::from_fn(|i| LegTarget {
                place: at(from[i].place, to[i].place),
                square: at(from[i].square, to[i].square),
            });
            let System { residual, matrix } = system(&mech, &places[3].pose(), &asked);
            let step = solve(matrix, residual.map(|f| -f)).x;
            let correction = places[3].along(&mech, &step);
            let found = PathPoint::get(&all[0].correction, 3);
            let error = largest(found.q.iter().zip(correction.q).map(|(&a, b)| (a - b).norm()));
            assert!(error < 1e-9 * correction.q.iter().map(|q| q.norm()).fold(1.0, larger), "{}", mech.name);
        }
    }
}
