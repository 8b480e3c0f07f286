//! Blocks of states: an operation on one state, done on one in each lane \[T65\].
//!
//! Answers are written into rows, one number of each state side by side, and copied from there into arrays,
//! one state after the other. So the memory is that of input and output and of one block for each thread, and
//! no state allocates.

use std::mem::MaybeUninit;
use std::ops::Range;

use rayon::prelude::*;

use super::{Field, FieldId, Table};
use crate::model::status::Status;
use crate::number::lanes::{self, Lanes, Line, Task, WIDTH};
use crate::parallel::streaming_stores;
use crate::parallel::threads;

/// So many states at least are worth a thread of their own.
const GRAIN: usize = 2048;

/// Parts for each thread, so that one that is held up does not hold up all.
const PARTS: usize = 4;

/// A table of so many numbers, eight megabytes, is written past the caches.
const STREAMED: usize = 1 << 20;

/// An operation on states side by side, with `N` result arrays.
pub(super) trait Operation<const N: usize>: Sync {
    /// Writes the results of the states at an index; of states whose status does not stand they are not read.
    ///
    /// Must be `#[inline(always)]`, with all that it calls.
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, N>) -> Codes<V>;
}

/// An operation with a workspace that is allocated once for many blocks, so that no state allocates.
pub(super) trait Working<const N: usize>: Sync {
    type Room<V: Lanes>;

    fn room<V: Lanes>(&self) -> Self::Room<V>;

    /// See [`Operation::run`].
    fn run<V: Lanes>(&self, room: &mut Self::Room<V>, at: At, answers: &mut Answers<'_, N>) -> Codes<V>;
}

/// An operation needs none.
impl<O: Operation<N>, const N: usize> Working<N> for O {
    type Room<V: Lanes> = ();

    #[inline(always)]
    fn room<V: Lanes>(&self) {}

    #[inline(always)]
    fn run<V: Lanes>(&self, (): &mut (), at: At, answers: &mut Answers<'_, N>) -> Codes<V> {
        Operation::run(self, at, answers)
    }
}

/// The status of each lane, as its number: a negative one where numbers are answered though it does not
/// stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Codes<V>(V);

impl<V: Lanes> Codes<V> {
    #[inline(always)]
    pub(super) fn ok() -> Self {
        Codes(V::zero())
    }

    /// The given status where all was well so far and this does not hold.
    #[must_use]
    #[inline(always)]
    pub(super) fn unless(self, holds: V::Mask, status: Status) -> Self {
        self.or(holds, f64::from(status as u8))
    }

    /// Sets a status that keeps the numbers, where the condition fails.
    #[must_use]
    #[inline(always)]
    pub(super) fn but(self, holds: V::Mask, status: Status) -> Self {
        self.or(holds, -f64::from(status as u8))
    }

    #[inline(always)]
    fn or(self, holds: V::Mask, code: f64) -> Self {
        let first = V::select(self.0.abs().greater(V::zero()), self.0, V::lit(code));
        Codes(V::select(holds, self.0, first))
    }

    /// These codes, and the next ones where all was well so far.
    #[must_use]
    #[inline(always)]
    pub(super) fn then(self, next: Self) -> Self {
        Codes(V::select(self.are(Status::Ok), next.0, self.0))
    }

    /// Codes with the numbers kept.
    #[must_use]
    #[inline(always)]
    pub(super) fn answered(self) -> Self {
        Codes(-self.0.abs())
    }

    #[inline(always)]
    pub(super) fn store(self, to: &mut [f64]) {
        self.0.store(to);
    }

    /// Mask of the lanes with this status.
    #[inline(always)]
    pub(super) fn are(self, status: Status) -> V::Mask {
        (self.0.abs() - V::lit(f64::from(status as u8))).abs().at_most(V::zero())
    }
}

/// The status that a code is, and whether there are numbers with it.
pub(super) fn read(code: f64) -> (Status, bool) {
    let status = Status::ALL[code.abs() as usize];
    (status, code < 0.0 || status.stands())
}

impl Codes<f64> {
    pub(super) fn status(self) -> Status {
        read(self.0).0
    }
}

/// Indices of the lanes' states in the arrays. Lanes beyond the last state repeat it.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    first: usize,
    last: usize,
}

impl At {
    /// A single state.
    pub(super) fn one(i: usize) -> Self {
        At { first: i, last: i }
    }

    /// Numbers of the states, of which each has `N`.
    #[inline(always)]
    pub(super) fn read<V: Lanes, const N: usize>(self, values: &[f64]) -> [V; N] {
        if self.first + V::WIDTH <= self.last + 1 {
            return V::gather(&values[self.first * N..]);
        }
        let mut rows = [[0.0; WIDTH]; N];
        for lane in 0..V::WIDTH {
            let i = (self.first + lane).min(self.last);
            let values = &values[i * N..(i + 1) * N];
            for k in 0..N {
                rows[k][lane] = values[k];
            }
        }
        let mut read = [V::zero(); N];
        for k in 0..N {
            read[k] = V::load(&rows[k]);
        }
        read
    }

    /// Values of the states, zeros if the array is empty.
    #[inline(always)]
    pub(super) fn read_or_zero<V: Lanes, const N: usize>(self, values: &[f64]) -> [V; N] {
        if values.is_empty() { [V::zero(); N] } else { self.read(values) }
    }

    /// Numbers of which each state has one.
    #[inline(always)]
    pub(super) fn series<V: Lanes>(self, values: &[f64]) -> V {
        if self.first + V::WIDTH <= self.last + 1 {
            V::load(&values[self.first..])
        } else {
            self.read_one(values, 1, 0)
        }
    }

    /// One of the `width` numbers of each state.
    #[inline(always)]
    pub(super) fn read_one<V: Lanes>(self, values: &[f64], width: usize, number: usize) -> V {
        let mut row = [0.0; WIDTH];
        for lane in 0..V::WIDTH {
            row[lane] = values[(self.first + lane).min(self.last) * width + number];
        }
        V::load(&row)
    }
}

/// Room for what a block of states answers.
pub(super) struct Answers<'a, const N: usize> {
    rows: &'a mut [Line],
    /// The first row of each field.
    starts: &'a [usize; N],
    lane: usize,
}

impl<const N: usize> Answers<'_, N> {
    #[inline(always)]
    pub(super) fn fields() -> [FieldId; N] {
        fields()
    }

    /// Writes `values` as the `part`-th piece of that size in the field.
    #[inline(always)]
    pub(super) fn put<V: Lanes, const M: usize>(&mut self, field: FieldId, part: usize, values: [V; M]) {
        let start = self.starts[field.0] + part * M;
        let rows = &mut self.rows[start..start + M];
        for k in 0..M {
            values[k].store(&mut rows[k].0[self.lane..]);
        }
    }

    /// Keeps what has been written in the field where it is `known`: elsewhere it becomes NaN.
    #[inline(always)]
    pub(super) fn keep<V: Lanes>(&mut self, field: FieldId, known: V::Mask) {
        let end = self.starts.get(field.0 + 1).map_or(self.rows.len(), |&start| start);
        for row in &mut self.rows[self.starts[field.0]..end] {
            let numbers = &mut row.0[self.lane..];
            V::select(known, V::load(numbers), V::lit(f64::NAN)).store(numbers);
        }
    }
}

/// The answers for all states.
pub(super) fn table<const N: usize>(
    operation: &impl Working<N>,
    states: usize,
    fields: [(&'static str, Vec<usize>); N],
) -> Table {
    filled(states, fields, Pieces { least: GRAIN, unit: WIDTH }, &|part| {
        lanes::dispatch((operation, part));
    })
}

/// Partition of the states: pieces of at least this many, a multiple of the unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pieces {
    pub least: usize,
    pub unit: usize,
}

impl Pieces {
    /// Of states that take about a microsecond each.
    pub const QUICK: Self = Pieces { least: 256, unit: 1 };
    /// Of states that take many.
    pub const SLOW: Self = Pieces { least: 16, unit: 1 };
    /// All in one, for states that each need the one before.
    pub const WHOLE: Self = Pieces { least: usize::MAX, unit: 1 };
    /// Of states that take a millisecond.
    pub const EACH: Self = Pieces { least: 1, unit: 1 };
}

/// The answers for all states, by a function that puts those of one state and tells its status: for
/// operations that branch or allocate. What it does not put is NaN.
pub(super) fn one_by_one<const N: usize>(
    states: usize,
    fields: [(&'static str, Vec<usize>); N],
    pieces: Pieces,
    answer: impl Fn(&mut Rows<'_, N>, usize) -> Status + Sync,
) -> Table {
    in_pieces(states, fields, pieces, |rows, piece| {
        for i in piece {
            let status = answer(rows, i);
            rows.set_status(i, status);
        }
    })
}

/// Table of a function that works through a piece of the states, with its own workspace.
pub(super) fn in_pieces<const N: usize>(
    states: usize,
    fields: [(&'static str, Vec<usize>); N],
    pieces: Pieces,
    answer: impl Fn(&mut Rows<'_, N>, Range<usize>) + Sync,
) -> Table {
    filled(states, fields, pieces, &|part: Part<'_, N>| {
        let (first, count) = (part.first, part.status.len());
        let data = part.data.map(unknown);
        answer(&mut Rows { widths: part.widths, first, data, status: part.status }, first..first + count);
    })
}

/// Results of a function for each state, for operations that take about a millisecond each.
pub(super) fn each<R: Send>(states: usize, answer: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let mut found = Vec::new();
    if states > 1 && threads::count() > 1 {
        threads::install(|| found = (0..states).into_par_iter().map(&answer).collect());
    } else {
        found.extend((0..states).map(answer));
    }
    found
}

/// All NaN.
fn unknown(places: &mut [MaybeUninit<f64>]) -> &mut [f64] {
    places.fill(MaybeUninit::new(f64::NAN));
    // SAFETY: all are numbers now.
    unsafe { &mut *(std::ptr::from_mut(places) as *mut [f64]) }
}

/// Room for the answers of a piece of the states.
pub(super) struct Rows<'a, const N: usize> {
    widths: &'a [usize; N],
    first: usize,
    data: [&'a mut [f64]; N],
    status: &'a mut [Status],
}

impl<const N: usize> Rows<'_, N> {
    /// Writes `values` as the `part`-th piece of that size in the state's row.
    pub(super) fn set(&mut self, field: FieldId, state: usize, part: usize, values: &[f64]) {
        let start = (state - self.first) * self.widths[field.0] + part * values.len();
        self.data[field.0][start..start + values.len()].copy_from_slice(values);
    }

    pub(super) fn set_status(&mut self, state: usize, status: Status) {
        self.status[state - self.first] = status;
    }
}

/// The fields of a table, in order.
#[inline(always)]
pub(super) fn fields<const N: usize>() -> [FieldId; N] {
    let mut fields = [FieldId(0); N];
    for k in 0..N {
        fields[k] = FieldId(k);
    }
    fields
}

/// A table whose parts have each been worked on; work must write every number.
fn filled<const N: usize>(
    states: usize,
    fields: [(&'static str, Vec<usize>); N],
    pieces: Pieces,
    work: &(impl Fn(Part<'_, N>) + Sync),
) -> Table {
    let widths = fields.each_ref().map(|(_, shape)| shape.iter().product());
    let mut data = widths.map(|width: usize| Vec::with_capacity(states * width));
    let mut status = vec![Status::Ok; states];
    {
        let mut width = widths.iter();
        let places = data
            .each_mut()
            .map(|data: &mut Vec<f64>| &mut data.spare_capacity_mut()[..states * width.next().unwrap_or(&0)]);
        let part = Part { widths: &widths, first: 0, states, data: places, status: &mut status };
        let threads = if states / 2 >= pieces.least { threads::count() } else { 1 };
        if threads > 1 {
            let grain = (states / (PARTS * threads)).max(pieces.least);
            threads::install(|| part.share(grain, pieces.unit, work));
        } else {
            work(part);
        }
    }
    for (data, width) in data.iter_mut().zip(widths) {
        // SAFETY: the parts have written every number of every state.
        unsafe { data.set_len(states * width) };
    }
    let fields = fields.into_iter().zip(data).map(|((name, shape), data)| Field { name, shape, data });
    Table { fields: fields.collect(), status }
}

/// Some of the states, one after the other.
struct Part<'a, const N: usize> {
    widths: &'a [usize; N],
    /// The first of them, and the number of all states.
    first: usize,
    states: usize,
    data: [&'a mut [MaybeUninit<f64>]; N],
    status: &'a mut [Status],
}

impl<const N: usize> Part<'_, N> {
    /// Works through the states in pieces of at most `grain`, side by side.
    fn share(self, grain: usize, unit: usize, work: &(impl Fn(Part<'_, N>) + Sync)) {
        if self.status.len() <= grain {
            return work(self);
        }
        let Part { widths, first, states, data, status } = self;
        let half = (status.len() / 2).next_multiple_of(unit);
        let (status, other_status) = status.split_at_mut(half);
        let mut others: [&mut [MaybeUninit<f64>]; N] = std::array::from_fn(|_| Default::default());
        let mut at = widths.iter().zip(&mut others);
        let data = data.map(|data| {
            let Some((width, other)) = at.next() else { return data };
            let (data, rest) = data.split_at_mut(half * width);
            *other = rest;
            data
        });
        let one = Part { widths, first, states, data, status };
        let other = Part { widths, first: first + half, states, data: others, status: other_status };
        rayon::join(|| one.share(grain, unit, work), || other.share(grain, unit, work));
    }
}

/// An operation at some of the states, in blocks. A pair with the operation first, so that it is compiled
/// with that (see [`Task`]).
impl<O: Working<N>, const N: usize> Task for (&O, Part<'_, N>) {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let (operation, part) = self;
        let (mut count, mut starts) = (0, [0; N]);
        for k in 0..N {
            starts[k] = count;
            count += part.widths[k];
        }
        let (mut rows, mut room) = (vec![Line([0.0; WIDTH]); count], operation.room::<V>());
        let streamed = if part.states * count < STREAMED { 0 } else { count * WIDTH };
        let mut staged = vec![MaybeUninit::uninit(); streamed];
        for block in 0..part.status.len().div_ceil(WIDTH) {
            let first = block * WIDTH;
            let status = &mut part.status[first..];
            let held = status.len().min(WIDTH);
            let mut codes = [0.0; WIDTH];
            for lane in (0..held).step_by(V::WIDTH) {
                let at = At { first: part.first + first + lane, last: part.states - 1 };
                let mut answers = Answers { rows: &mut rows, starts: &starts, lane };
                operation.run(&mut room, at, &mut answers).0.store(&mut codes[lane..]);
            }
            let mut answered = [false; WIDTH];
            for lane in 0..held {
                (status[lane], answered[lane]) = read(codes[lane]);
            }
            for k in 0..N {
                let (width, start) = (part.widths[k], starts[k]);
                let places = &mut part.data[k][first * width..];
                copy::<V>(&rows[start..start + width], &answered[..held], &mut staged, places);
            }
        }
        streaming_stores::finish();
    }
}

/// From rows, states side by side, to states one after the other; NaN for those without an answer. Past the
/// caches if there is room to put them together first.
#[inline(always)]
fn copy<V: Lanes>(
    rows: &[Line],
    answered: &[bool],
    staged: &mut [MaybeUninit<f64>],
    to: &mut [MaybeUninit<f64>],
) {
    if *answered == [true; WIDTH] {
        let numbers = rows.len() * WIDTH;
        if staged.is_empty() || !streaming_stores::begins_line(to) {
            return V::scatter(rows, to);
        }
        V::scatter(rows, staged);
        return streaming_stores::copy(&staged[..numbers], &mut to[..numbers]);
    }
    for lane in 0..answered.len() {
        for k in 0..rows.len() {
            to[lane * rows.len() + k].write(if answered[lane] { rows[k].0[lane] } else { f64::NAN });
        }
    }
}
