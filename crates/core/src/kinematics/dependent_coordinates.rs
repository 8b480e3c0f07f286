//! Dependent coordinates: those that the set or the constraints determine, with their rates, from the given
//! ones.

use crate::kinematics::constraint;
use crate::kinematics::coordinate_sets::{MAX_COORDINATES, Plane, Set, Values, motion};
use crate::kinematics::singular::SINGULAR;
use crate::model::mechanism::{MAX_CONSTRAINTS, Mechanism};
use crate::model::status::Status;
use crate::number::lanes::{Lanes, any};
use crate::number::real::{Constant, Dual, Jet, Mask, Ordered, Real, Scalar, Trig};
use crate::numerics::gauss::solve;
use crate::spatial::{Motion, Pose, Vec3};

/// |cos γ| - 1 that is rounding of one.
const COSINE_ROUNDING: f64 = 1e-12;

/// Pivot ratio below which the dependent coordinates are not determined to working precision.
pub const DEPENDENT_PIVOTS: f64 = 1e-9;

/// Residual, as a pure number, that is rounding of zero.
const SOLVED: f64 = 1e-12;

/// Residual, as a pure number, that no step makes less: where solutions meet, steps go on without end.
const ROUNDED: f64 = 1e-15;

const NEWTON_STEPS: usize = 50;

/// A state of the platform with all numbers of its coordinate set.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateState {
    pub coordinates: Values<Jet<f64>>,
    pub platform: Motion<f64>,
    /// Which of several solutions the dependent coordinates are: the sign of sin γ, or of det ∂g/∂y \[T23\].
    pub branch: f64,
    pub status: Status,
}

/// Pose, twist and acceleration from the given coordinates and their rates; dependent ones are solved from
/// the constraints, starting at those of `guess`.
///
/// `given` marks the entries of `q` that are given. `branch` is the sign of sin γ for [Eq. 5], below
/// [`SINGULAR`] in size at a fold. `least` is the pivot ratio up to which a state of the other sets is one.
#[must_use]
#[allow(clippy::too_many_arguments)]
pub fn state(
    mech: &Mechanism,
    set: &Set,
    q: &Values<Jet<f64>>,
    given: &[bool],
    branch: f64,
    guess: &Pose<f64>,
    least: f64,
) -> CoordinateState {
    let mut q = *q;
    let finite =
        q.iter().zip(given).all(|(c, g)| !g || (c.x.is_finite() && c.d.is_finite() && c.dd.is_finite()));
    let failing = if finite { first(complete(mech, set, &mut q, branch)) } else { Status::InvalidInput };
    let dependent = Dependent::of(set, given);
    let (status, branch) = match (set, failing) {
        (Set::Paper(_), status) => (status, if finite { branch } else { f64::NAN }),
        (_, Status::Ok) if dependent.count == 0 => (Status::Ok, 1.0),
        (_, Status::Ok) => {
            let start = set.values(mech, guess);
            let (conditions, sign) = solve_dependent(mech, set, &mut q, &dependent, &start, true, least);
            let status = first(conditions);
            (status, if status == Status::Ok { sign } else { f64::NAN })
        }
        (_, status) => (status, f64::NAN),
    };
    CoordinateState { coordinates: q, platform: motion(&set.pose(mech, &q)), branch, status }
}

/// Conditions, each with the status where it fails; the first that fails counts.
pub type Conditions<V> = [(Mask<V>, Status); 2];

fn first(conditions: Conditions<f64>) -> Status {
    conditions.into_iter().find(|(holds, _)| !holds).map_or(Status::Ok, |(_, status)| status)
}

/// Puts what the set itself makes dependent, which is γ of [Eq. 5], and tells what must hold for a pose with
/// rates.
#[inline(always)]
pub fn complete<V: Ordered>(
    mech: &Mechanism,
    set: &Set,
    q: &mut Values<Jet<V>>,
    branch: f64,
) -> Conditions<V> {
    match set {
        Set::Paper(plane) => branch_of_gamma(plane, q, branch),
        Set::Tool => tool_turn(mech, q),
        _ => [(V::zero().at_most(V::zero()), Status::Ok); 2],
    }
}

/// Whether there is a shortest rotation from the tool axis at home: not to no direction, and not to the
/// opposite one.
#[inline(always)]
fn tool_turn<V: Ordered>(mech: &Mechanism, q: &Values<Jet<V>>) -> Conditions<V> {
    let axis = Vec3::new(q[3].x, q[4].x, q[5].x);
    let cosine = axis.dot(Vec3::lift(mech.home.rotation * mech.tool_axis)) / axis.norm();
    [
        (cosine.at_most(cosine), Status::InvalidInput),
        (V::lit(SINGULAR * SINGULAR).at_most(V::one() + cosine), Status::Fold),
    ]
}

/// γ from [Eq. 5]: `γ = ± arccos(...)`, the sign being the branch.
#[inline(always)]
fn branch_of_gamma<V: Ordered>(plane: &Plane, q: &mut Values<Jet<V>>, branch: f64) -> Conditions<V> {
    let cosine = plane.cosine(Vec3::new(q[0], q[1], q[2]), q[3]);
    let exists = cosine.x.abs().at_most(V::lit(1.0 + COSINE_ROUNDING));
    let regular = V::lit(SINGULAR * SINGULAR).at_most(V::one() - cosine.x * cosine.x);
    let inside = cosine.x.most(V::lit(-1.0)).least(V::one());
    let gamma =
        Jet::new(inside, cosine.d, cosine.dd).acos().scale(branch.signum()) - Jet::lit(plane.lever().1);
    let nan = V::lit(f64::NAN);
    q[5] = Jet::new(
        V::select(exists, gamma.x, nan),
        V::select(exists, V::select(regular, gamma.d, nan), nan),
        V::select(exists, V::select(regular, gamma.dd, nan), nan),
    );
    [(exists, Status::NoBranch), (regular, Status::Fold)]
}

pub(super) type System<T> = [T; MAX_CONSTRAINTS];

/// The numbers of a set that are not given.
#[derive(Clone, Copy, Debug)]
pub struct Dependent {
    indices: [usize; MAX_COORDINATES],
    pub count: usize,
}

impl Dependent {
    #[must_use]
    #[inline]
    pub fn of<S: Scalar>(set: &Set<S>, given: &[bool]) -> Self {
        let mut dependent = Dependent { indices: [0; MAX_COORDINATES], count: 0 };
        for i in (0..set.names().len()).filter(|&i| !given[i]) {
            dependent.indices[dependent.count] = i;
            dependent.count += 1;
        }
        dependent
    }

    #[inline(always)]
    pub(super) fn numbers(&self) -> &[usize] {
        &self.indices[..self.count]
    }
}

/// Newton on the independent constraints for the coordinates that are not given, from those of `start`, then
/// their rates and second rates from the same matrix: `G_y y' = -ġ(y' = 0)`, `G_y y'' = -g̈(y'' = 0)`
/// \[T23\]. Only where they are `wanted`, and regular above `least`; every lane goes its own way to its own
/// end. Returns the sign of det G_y too: it tells apart the solutions that meet in a fold.
#[inline(always)]
pub fn solve_dependent<V: Lanes>(
    mech: &Mechanism,
    set: &Set,
    q: &mut Values<Jet<V>>,
    dependent: &Dependent,
    start: &Values<f64>,
    wanted: Mask<V>,
    least: f64,
) -> (Conditions<V>, V) {
    let (zero, one, nan) = (V::zero(), V::one(), V::lit(f64::NAN));
    let (numbers, scale, unsolved) = (dependent.numbers(), mech.characteristic_length, *q);
    for &i in numbers {
        q[i] = Jet::lit(start[i]);
    }
    let mut g = residual(mech, &set.pose(mech, &values(q)));
    // One in lanes that are still under way, and in those that have arrived.
    let (mut active, mut converged) = (V::select(wanted, one, zero), zero);
    for _ in 0..NEWTON_STEPS {
        let mut rhs = g;
        for e in &mut rhs {
            *e = -*e;
        }
        let step = solve(gradient(mech, set, q, dependent), rhs).x;
        // No coordinate moves by more than half a radian or half the characteristic length at once.
        let mut largest = zero;
        for (k, &i) in numbers.iter().enumerate() {
            largest = largest.most(step[k].abs().scale(1.0 / reach(set, i, scale)));
        }
        // Else the coordinates do not determine the others; the guess may still be a solution.
        let finite = (size(&step) * zero).at_most(zero);
        let solved = V::select(size(&g).at_most(V::lit(SOLVED)), active, zero);
        converged = V::select(finite, converged, converged.most(solved));
        active = V::select(finite, active, zero);

        let (from, before) = (*q, size(&g));
        let (mut share, mut searching) = ((V::lit(0.5) / largest).least(one), active);
        for _ in 0..8 {
            let moving = searching.greater(zero);
            for (k, &i) in numbers.iter().enumerate() {
                q[i].x = V::select(moving, from[i].x + share * step[k], q[i].x);
            }
            let tried = residual(mech, &set.pose(mech, &values(q)));
            for k in 0..MAX_CONSTRAINTS {
                g[k] = V::select(moving, tried[k], g[k]);
            }
            searching = V::select(size(&g).at_most(before), zero, searching);
            if !any(searching) {
                break;
            }
            share = share.scale(0.5);
        }
        let exact = V::select(size(&g).at_most(zero), one, zero);
        let rounded = V::select(size(&g).at_most(V::lit(ROUNDED)), one, exact);
        let near = V::select(largest.at_most(V::lit(1e-10)), one, rounded);
        let there = V::select(largest.at_most(V::lit(1e-13)), one, exact);
        let under_way = active.greater(zero);
        converged = V::select(under_way, near, converged);
        active = V::select(there.greater(zero), zero, active);
        if !any(active) {
            break;
        }
    }
    let (pivots, sign) = follow(mech, set, q, dependent);
    let (arrived, regular) = (converged.greater(zero), pivots.greater(V::lit(least)));
    for &i in numbers {
        let Jet { x, d, dd } = q[i];
        let rates = [V::select(regular, d, nan), V::select(regular, dd, nan)];
        let found = Jet::select(arrived, Jet::new(x, rates[0], rates[1]), Jet::new(nan, nan, nan));
        q[i] = Jet::select(wanted, found, unsolved[i]);
    }
    ([(arrived, Status::NotConverged), (regular, Status::Fold)], sign)
}

/// The largest entry's size; NaN if one is.
#[inline(always)]
fn size<V: Ordered>(g: &System<V>) -> V {
    let mut size = V::zero();
    for e in g {
        size = V::select(e.at_most(*e), size.most(e.abs()), *e);
    }
    size
}

/// The numbers without their rates.
#[inline(always)]
fn values<T: Real>(q: &Values<Jet<T>>) -> Values<T> {
    let mut values = [T::zero(); MAX_COORDINATES];
    for k in 0..MAX_COORDINATES {
        values[k] = q[k].x;
    }
    values
}

/// Rates and second rates of the dependent coordinates at known values, from one matrix:
/// `G_y y' = -ġ(y' = 0)`, `G_y y'' = -g̈(y'' = 0)` \[T23\]. They must be zero before. With the pivot ratio
/// and the sign of det G_y.
#[inline(always)]
fn follow<T: Trig, S>(
    mech: &Mechanism<S>,
    set: &Set<S>,
    q: &mut Values<Jet<T>>,
    dependent: &Dependent,
) -> (T::Value, T::Value)
where
    S: Constant<Jet<T>> + Constant<Dual<T>>,
{
    let matrix = gradient(mech, set, q, dependent);
    let mut rhs = [T::zero(); MAX_CONSTRAINTS];
    let g = residual(mech, &set.pose(mech, q));
    for k in 0..MAX_CONSTRAINTS {
        rhs[k] = -g[k].d;
    }
    let first = solve(matrix, rhs);
    for (k, &i) in dependent.numbers().iter().enumerate() {
        q[i].d = first.x[k];
    }
    let g = residual(mech, &set.pose(mech, q));
    for k in 0..MAX_CONSTRAINTS {
        rhs[k] = -g[k].dd;
    }
    let second = solve(matrix, rhs);
    for (k, &i) in dependent.numbers().iter().enumerate() {
        q[i].dd = second.x[k];
    }
    (first.pivots, first.sign)
}

/// The values of the independent constraints in pure numbers; zero beyond their number.
#[inline(always)]
pub(super) fn residual<N: Real>(mech: &Mechanism<impl Constant<N>>, pose: &Pose<N>) -> System<N> {
    let mut values = [N::zero(); MAX_CONSTRAINTS];
    for k in 0..mech.independent.len() {
        let c = &mech.independent[k];
        values[k] = constraint::value(c, pose).scale(1.0 / constraint::unit(c, mech.characteristic_length));
    }
    values
}

/// Pivot ratio of ∂g/∂y at a pose, y being the numbers of the set that are not given, in m and rad: how well
/// the constraints determine them there. NaN where it is not known.
#[must_use]
pub fn dependent_pivots(mech: &Mechanism, set: &Set, pose: &Pose<f64>, given: &[bool]) -> f64 {
    let q = set.values(mech, pose).map(Jet::lit);
    solve(gradient(mech, set, &q, &Dependent::of(set, given)), [0.0; MAX_CONSTRAINTS]).pivots
}

/// Unit of a dependent coordinate's step: the characteristic length, or a radian.
#[inline(always)]
fn reach(set: &Set, index: usize, scale: f64) -> f64 {
    match set {
        Set::Pose if index < 3 => scale,
        _ => 1.0,
    }
}

/// ∂g/∂y by duals, unused rows and columns those of the identity.
#[inline(always)]
fn gradient<T: Trig, S: Constant<Dual<T>>>(
    mech: &Mechanism<S>,
    set: &Set<S>,
    q: &Values<Jet<T>>,
    dependent: &Dependent,
) -> [System<T>; MAX_CONSTRAINTS] {
    let mut matrix = [[T::zero(); MAX_CONSTRAINTS]; MAX_CONSTRAINTS];
    for k in 0..MAX_CONSTRAINTS {
        matrix[k][k] = T::one();
    }
    for (column, &i) in dependent.numbers().iter().enumerate() {
        let mut seeded = [Dual::lit(0.0); MAX_COORDINATES];
        for k in 0..MAX_COORDINATES {
            seeded[k].x = q[k].x;
        }
        seeded[i].d = T::one();
        let derivatives = residual(mech, &set.pose(mech, &seeded));
        for row in 0..mech.independent.len() {
            matrix[row][column] = derivatives[row].d;
        }
    }
    matrix
}
