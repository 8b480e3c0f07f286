//! Derivatives of inverse dynamics, and the regressor, of many states.

use super::block::{self, Answers, At, Codes, Working};
use super::checks::{solved, within_limits};
use super::{FieldId, Loads, States, Table};
use crate::assembly::geometric_parameters;
use crate::dynamics::derivatives::{
    ByGeometry, ByMotion, DIRECTIONS, SolvedDynamics, Varied, VariedCoordinates,
};
use crate::dynamics::force_balance::UnitForceResponse;
use crate::dynamics::inverse_dynamics::resultant;
use crate::dynamics::regressor::{self, Regressor};
use crate::kinematics::coordinate_sets::{MAX_COORDINATES, Set};
use crate::kinematics::leg;
use crate::kinematics::rows::RowNumbers;
use crate::kinematics::singular::SINGULAR;
use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::number::real::Dual;
use crate::number::slices;
use crate::number::work::work;
use crate::spatial::{Motion, Wrench};
use std::ops::Range;

/// A field for the forces of all legs and one for the multipliers.
type Pair = [FieldId; 2];

/// Derivatives of active forces and multipliers by pose, twist and acceleration, by the `given` coordinates
/// of a set with their rates and second rates, by the numbers of the bodies and by those of the geometry,
/// this for lengths too \[T56\] \[T57\].
#[must_use]
pub fn inverse_dynamics_derivatives(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    set: &Set,
    given: &[bool],
) -> Table {
    let given: [bool; MAX_COORDINATES] =
        std::array::from_fn(|k| k >= set.names().len() || given.get(k).copied().unwrap_or(false));
    let chosen = (0..set.names().len()).filter(|&k| given[k]).count();
    let (forces, multipliers) = (mech.legs.len(), mech.independent.len());
    let bodies = regressor::parameters(mech).len();
    let geometry = geometric_parameters::parameters(mech);
    let fields = [
        ("forces_by_pose", vec![forces, 6]),
        ("constraint_by_pose", vec![multipliers, 6]),
        ("forces_by_twist", vec![forces, 6]),
        ("constraint_by_twist", vec![multipliers, 6]),
        ("forces_by_acceleration", vec![forces, 6]),
        ("constraint_by_acceleration", vec![multipliers, 6]),
        ("forces_by_coordinates", vec![forces, chosen]),
        ("constraint_by_coordinates", vec![multipliers, chosen]),
        ("forces_by_rates", vec![forces, chosen]),
        ("constraint_by_rates", vec![multipliers, chosen]),
        ("forces_by_second_rates", vec![forces, chosen]),
        ("constraint_by_second_rates", vec![multipliers, chosen]),
        ("forces_by_bodies", vec![forces, bodies]),
        ("constraint_by_bodies", vec![multipliers, bodies]),
        ("forces_by_geometry", vec![forces, geometry.len()]),
        ("constraint_by_geometry", vec![multipliers, geometry.len()]),
        ("lengths_by_geometry", vec![forces, geometry.len()]),
    ];
    let varied = geometry.iter().map(|parameter| Varied::new(mech, parameter, set));
    let operation = Derivatives {
        mech,
        states,
        loads,
        set,
        given: &given,
        numbers: (0..set.names().len()).filter(|&k| given[k]).collect(),
        still: Varied::none(mech, set),
        varied: varied.collect::<Option<Vec<_>>>(),
        parameters: geometry.len(),
        regressor: Regressor::new(mech),
        rows: ColumnRows::of(mech),
    };
    block::table(&operation, states.len(), fields)
}

struct Derivatives<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
    set: &'a Set,
    given: &'a [bool; MAX_COORDINATES],
    /// Numbers of the given coordinates.
    numbers: Vec<usize>,
    /// The mechanism as it varies with none of its numbers, and with each of the geometry; none if the set is
    /// none of it then.
    still: Varied,
    varied: Option<Vec<Varied>>,
    parameters: usize,
    regressor: Regressor,
    rows: ColumnRows,
}

/// Forces and their response at a block of states, columns of derivatives, and the legs' states, places and
/// lengths.
struct Room<V> {
    response: UnitForceResponse<V>,
    forces: Vec<V>,
    legs: Vec<leg::LegState<V>>,
    places: Vec<leg::LegPlacement<Dual<V>>>,
    by_motion: Vec<V>,
    by_bodies: Vec<V>,
    column: Vec<V>,
    /// Numbers of the rows of J where actuators are redundant, else none.
    off: Vec<V>,
    lengths: Vec<V>,
}

impl<V: Lanes> Room<V> {
    fn new(mech: &Mechanism, parameters: usize) -> Self {
        let (rows, zeros) = (mech.rows(), |count: usize| vec![V::zero(); count]);
        Room {
            response: UnitForceResponse::new(mech),
            forces: zeros(rows),
            legs: Vec::with_capacity(mech.legs.len()),
            places: Vec::with_capacity(mech.legs.len()),
            by_motion: zeros(DIRECTIONS * rows),
            by_bodies: zeros(parameters * rows),
            column: zeros(rows),
            off: zeros(if mech.is_redundant() { rows } else { 0 }),
            lengths: zeros(mech.legs.len()),
        }
    }
}

impl Working<17> for Derivatives<'_> {
    type Room<V: Lanes> = Room<V>;

    fn room<V: Lanes>(&self) -> Room<V> {
        Room::new(self.mech, self.regressor.parameters.len())
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut Room<V>, at: At, answers: &mut Answers<'_, 17>) -> Codes<V> {
        let (mech, ids) = (self.mech, Answers::<17>::fields());
        let Room { response, forces, legs, places, by_motion, by_bodies, column, off, lengths } = room;
        let (state, codes) = solve(mech, self.states, self.loads, at, response, forces);
        V::apart(ByMotion { mech, at: &state, off, places, columns: by_motion });
        for (k, column) in by_motion.chunks_exact(state.forces.len()).enumerate() {
            self.rows.put(answers, pair(&ids, k / 6), 6, k % 6, column);
        }
        self.put_by_bodies(&state, legs, by_bodies, column, pair(&ids, 6), answers);

        let by = VariedCoordinates::at(mech, self.set, &self.still, self.given, &state.platform);
        let determined = by.following.pivots.greater(V::lit(SINGULAR));
        let mut sum = V::zero();
        for (k, &number) in self.numbers.iter().enumerate() {
            let varied = by.varied(&self.still, number);
            for order in 0..3 {
                by.put_derivative(by_motion, &varied, order, column);
                sum = add(sum, column);
                self.rows.put(answers, pair(&ids, 3 + order), self.numbers.len(), k, column);
            }
        }
        let codes = keep(answers, &ids[6..12], determined, sum, codes);

        let mut sum = V::zero();
        for k in 0..self.parameters {
            match &self.varied {
                Some(varied) => {
                    let (varied, at, coordinates) = (&varied[k], &state, &by);
                    V::apart(ByGeometry { varied, at, coordinates, by_motion, off, column, lengths });
                }
                None => slices::fill(column, V::lit(f64::NAN)),
            }
            sum = add(add(sum, column), lengths);
            self.rows.put(answers, pair(&ids, 7), self.parameters, k, column);
            for leg in 0..mech.legs.len() {
                answers.put(ids[16], leg * self.parameters + k, [lengths[leg]]);
            }
        }
        let codes = keep(answers, &ids[14..17], determined, sum, codes);
        within_limits(mech, &state.platform.pose, codes)
    }
}

/// Leaves numbers only where the coordinates determine the motion, and all are finite, as their `sum` then
/// is.
#[inline(always)]
fn keep<V: Lanes>(
    answers: &mut Answers<'_, 17>,
    fields: &[FieldId],
    determined: V::Mask,
    sum: V,
    codes: Codes<V>,
) -> Codes<V> {
    let known = V::select(determined, sum, V::lit(f64::NAN)).at_most(V::zero());
    for &field in fields {
        answers.keep::<V>(field, known);
    }
    codes.but(known, Status::Fold)
}

impl Derivatives<'_> {
    #[inline(always)]
    fn put_by_bodies<V: Lanes>(
        &self,
        state: &SolvedDynamics<V>,
        legs: &mut Vec<leg::LegState<V>>,
        columns: &mut [V],
        column: &mut [V],
        fields: Pair,
        answers: &mut Answers<'_, 17>,
    ) {
        let (mech, count) = (self.mech, self.regressor.parameters.len());
        set_legs(mech, state, legs);
        for (k, unit) in columns.chunks_exact_mut(column.len()).enumerate() {
            V::apart(UnitColumn { regressor: &self.regressor, mech, state, legs, k, column: unit });
        }
        for k in 0..count {
            self.regressor.put_by_bodies(columns, k, column);
            self.rows.put(answers, fields, count, k, column);
        }
    }
}

/// Adds nothing to a sum if the numbers are all finite, else NaN.
#[inline(always)]
fn add<V: Lanes>(mut sum: V, numbers: &[V]) -> V {
    for x in numbers {
        sum = sum + *x * V::zero();
    }
    sum
}

fn pair(ids: &[FieldId; 17], k: usize) -> Pair {
    [ids[2 * k], ids[2 * k + 1]]
}

/// The coefficients of the inertial parameters in active forces and multipliers, and what load and damping
/// add \[T57\].
#[must_use]
pub fn regressors(mech: &Mechanism, states: &States, loads: &Loads) -> Table {
    let width = regressor::parameters(mech).len();
    let (forces, multipliers) = (mech.legs.len(), mech.independent.len());
    let fields = [
        ("forces", vec![forces, width]),
        ("constraint", vec![multipliers, width]),
        ("forces_offset", vec![forces]),
        ("constraint_offset", vec![multipliers]),
    ];
    let (regressor, rows) = (Regressor::new(mech), ColumnRows::of(mech));
    let operation = Regressors { mech, states, loads, regressor, rows };
    block::table(&operation, states.len(), fields)
}

struct Regressors<'a> {
    mech: &'a Mechanism,
    states: &'a States<'a>,
    loads: &'a Loads<'a>,
    regressor: Regressor,
    rows: ColumnRows,
}

impl Working<4> for Regressors<'_> {
    type Room<V: Lanes> = Room<V>;

    fn room<V: Lanes>(&self) -> Room<V> {
        Room::new(self.mech, 0)
    }

    #[inline(always)]
    fn run<V: Lanes>(&self, room: &mut Room<V>, at: At, answers: &mut Answers<'_, 4>) -> Codes<V> {
        let (mech, [y, y_constraint, offset, offset_constraint]) = (self.mech, Answers::fields());
        let Room { response, forces, legs, column, .. } = room;
        let (state, codes) = solve(mech, self.states, self.loads, at, response, forces);
        set_legs(mech, &state, legs);
        let (platform, width) = (&state.platform, self.regressor.parameters.len());
        for k in 0..width {
            V::apart(UnitColumn { regressor: &self.regressor, mech, state: &state, legs, k, column });
            self.rows.put(answers, [y, y_constraint], width, k, column);
        }
        let load = self.loads.of(mech, &platform.pose, at);
        state.response.put(Regressor::rest(mech, &platform.twist, load), &[], column);
        self.rows.put(answers, [offset, offset_constraint], 1, 0, column);
        within_limits(mech, &platform.pose, codes)
    }
}

/// Inverse dynamics at the states, and whether it has an answer there.
#[inline(always)]
fn solve<'a, V: Lanes>(
    mech: &Mechanism,
    states: &States,
    loads: &Loads,
    at: At,
    response: &'a mut UnitForceResponse<V>,
    forces: &'a mut [V],
) -> (SolvedDynamics<'a, V>, Codes<V>) {
    let (platform, load, codes) = states.loaded_at(mech, loads, at);
    response.set(mech, &platform.pose);
    let motion = response.balance(V::apart(Resultant { mech, platform: &platform, load }), forces);
    let codes = solved(mech, &platform.pose, forces, response.regular, codes);
    let (load, numbers) = (loads.given(mech, at), RowNumbers::of(mech));
    (SolvedDynamics { platform, load, numbers, forces, motion, response }, codes)
}

#[inline(always)]
fn set_legs<V: Lanes>(mech: &Mechanism, state: &SolvedDynamics<V>, legs: &mut Vec<leg::LegState<V>>) {
    V::apart(SetLegs { mech, platform: &state.platform, legs });
}

work! {
    SetLegs<'a, V: Lanes> {
        mech: &'a Mechanism,
        platform: &'a Motion<V>,
        legs: &'a mut Vec<leg::LegState<V>>,
    } -> () {
        legs.clear();
        for leg in &mech.legs {
            legs.push(leg::state(leg, platform));
        }
    }
}

work! {
    Resultant<'a, V: Lanes> { mech: &'a Mechanism, platform: &'a Motion<V>, load: Wrench<V> } -> Wrench<V> {
        resultant(mech, platform, load)
    }
}

work! {
    /// Forces and multipliers for a unit of the k-th parameter.
    UnitColumn<'a, 'b, V: Lanes> {
        regressor: &'a Regressor,
        mech: &'a Mechanism,
        state: &'a SolvedDynamics<'b, V>,
        legs: &'a [leg::LegState<V>],
        k: usize,
        column: &'a mut [V],
    } -> () {
        state.response.put(regressor.wrench(mech, &state.platform, legs, k), &[], column);
    }
}

/// Where a column of active forces and multipliers goes: the row of J of each leg, none of a passive one, and
/// the rows of the constraints.
struct ColumnRows {
    legs: Vec<Option<usize>>,
    constraints: Range<usize>,
}

impl ColumnRows {
    fn of(mech: &Mechanism) -> Self {
        let mut rows = 0..;
        let legs = mech.legs.iter().map(|leg| if leg.actuated { rows.next() } else { None });
        ColumnRows { legs: legs.collect(), constraints: RowNumbers::of(mech).constraints() }
    }

    /// Puts the k-th of `width` columns: forces of all legs, zero of passive ones, and multipliers.
    #[inline(always)]
    fn put<V: Lanes, const N: usize>(
        &self,
        answers: &mut Answers<'_, N>,
        [forces, multipliers]: Pair,
        width: usize,
        k: usize,
        column: &[V],
    ) {
        let mut part = k;
        for row in &self.legs {
            answers.put(forces, part, [row.map_or_else(V::zero, |row| column[row])]);
            part += width;
        }
        let mut part = k;
        for x in &column[self.constraints.clone()] {
            answers.put(multipliers, part, [*x]);
            part += width;
        }
    }
}
