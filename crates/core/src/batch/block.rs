//! Many states in blocks: what an operation does with one state, it does with one in each lane \[T65\].
//!
//! Answers are written into rows, one number of each state side by side, and copied from there into arrays, one state
//! after the other. So the memory is that of input and output and of one block for each thread, and no state allocates.

use std::mem::MaybeUninit;

use super::{Field, FieldId, Table};
use crate::lanes::{self, Lanes, Row, Task, WIDTH};
use crate::status::Status;
use crate::threads;

/// So many states at least are worth a thread of their own.
const GRAIN: usize = 2048;

/// Parts for each thread, so that one that is held up does not hold up all.
const PARTS: usize = 4;

/// What is done with states side by side. `N` arrays are answered.
pub(super) trait Operation<const N: usize>: Sync {
    /// Puts the answers for the states at a place; of states whose status does not stand they are not read.
    ///
    /// Must be `#[inline(always)]`, with all that it calls.
    fn run<V: Lanes>(&self, at: At, answers: &mut Answers<'_, N>) -> Codes<V>;
}

/// The status of each lane, as its number: a negative one where numbers are answered though it does not stand.
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

    /// The same for a status with which the numbers are answered all the same.
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

    /// Where all was well so far.
    #[inline(always)]
    pub(super) fn well(self) -> V::Mask {
        self.0.abs().at_most(V::zero())
    }
}

/// The status that a code is, and whether there are numbers with it.
fn read(code: f64) -> (Status, bool) {
    let status = Status::ALL[code.abs() as usize];
    (status, code < 0.0 || status.stands())
}

impl Codes<f64> {
    pub(super) fn status(self) -> Status {
        read(self.0).0
    }
}

/// Where the states of the lanes are in the arrays. Lanes beyond the last state repeat it.
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
    rows: &'a mut [Row],
    /// The first row of each field.
    starts: &'a [usize; N],
    lane: usize,
}

impl<const N: usize> Answers<'_, N> {
    #[inline(always)]
    pub(super) fn fields() -> [FieldId; N] {
        std::array::from_fn(FieldId)
    }

    /// Writes `values` as the `part`-th piece of that size in the field.
    #[inline(always)]
    pub(super) fn put<V: Lanes, const M: usize>(&mut self, field: FieldId, part: usize, values: [V; M]) {
        let start = self.starts[field.0] + part * M;
        let rows = &mut self.rows[start..start + M];
        for k in 0..M {
            values[k].store(&mut rows[k][self.lane..]);
        }
    }
}

/// The answers for all states.
pub(super) fn table<const N: usize>(
    operation: &impl Operation<N>,
    states: usize,
    fields: [(&'static str, Vec<usize>); N],
) -> Table {
    let widths = fields.each_ref().map(|(_, shape)| shape.iter().product());
    let mut data = widths.map(|width: usize| Vec::with_capacity(states * width));
    let mut status = vec![Status::Ok; states];
    {
        let mut width = widths.iter();
        let places = data
            .each_mut()
            .map(|data: &mut Vec<f64>| &mut data.spare_capacity_mut()[..states * width.next().unwrap_or(&0)]);
        let part = Part { operation, widths: &widths, first: 0, states, data: places, status: &mut status };
        let threads = if states >= 2 * GRAIN { threads::count() } else { 1 };
        if threads > 1 {
            let grain = (states / (PARTS * threads)).max(GRAIN);
            threads::install(|| part.share(grain));
        } else {
            lanes::dispatch(part);
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
struct Part<'a, O, const N: usize> {
    operation: &'a O,
    widths: &'a [usize; N],
    /// The first of them, and the number of all states.
    first: usize,
    states: usize,
    data: [&'a mut [MaybeUninit<f64>]; N],
    status: &'a mut [Status],
}

impl<O: Operation<N>, const N: usize> Part<'_, O, N> {
    /// Works through the states in pieces of at most `grain`, side by side.
    fn share(self, grain: usize) {
        if self.status.len() <= grain {
            return lanes::dispatch(self);
        }
        let Part { operation, widths, first, states, data, status } = self;
        let half = (status.len() / 2).next_multiple_of(WIDTH);
        let (status, other_status) = status.split_at_mut(half);
        let mut others: [&mut [MaybeUninit<f64>]; N] = std::array::from_fn(|_| Default::default());
        let mut at = widths.iter().zip(&mut others);
        let data = data.map(|data| {
            let Some((width, other)) = at.next() else { return data };
            let (data, rest) = data.split_at_mut(half * width);
            *other = rest;
            data
        });
        let one = Part { operation, widths, first, states, data, status };
        let other =
            Part { operation, widths, first: first + half, states, data: others, status: other_status };
        rayon::join(|| one.share(grain), || other.share(grain));
    }
}

impl<O: Operation<N>, const N: usize> Task for Part<'_, O, N> {
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let mut count = 0;
        let starts = self.widths.map(|width| {
            count += width;
            count - width
        });
        let mut rows = vec![[0.0; WIDTH]; count];
        for block in 0..self.status.len().div_ceil(WIDTH) {
            let first = block * WIDTH;
            let status = &mut self.status[first..];
            let held = status.len().min(WIDTH);
            let mut codes = [0.0; WIDTH];
            for lane in (0..held).step_by(V::WIDTH) {
                let at = At { first: self.first + first + lane, last: self.states - 1 };
                let mut answers = Answers { rows: &mut rows, starts: &starts, lane };
                self.operation.run::<V>(at, &mut answers).0.store(&mut codes[lane..]);
            }
            let mut answered = [false; WIDTH];
            for lane in 0..held {
                (status[lane], answered[lane]) = read(codes[lane]);
            }
            for k in 0..N {
                let (width, start) = (self.widths[k], starts[k]);
                let places = &mut self.data[k][first * width..];
                copy::<V>(&rows[start..start + width], &answered[..held], places);
            }
        }
    }
}

/// From rows, states side by side, to states one after the other; NaN for those without an answer.
#[inline(always)]
fn copy<V: Lanes>(rows: &[Row], answered: &[bool], to: &mut [MaybeUninit<f64>]) {
    if *answered == [true; WIDTH] {
        return V::scatter(rows, to);
    }
    for (lane, (answered, places)) in answered.iter().zip(to.chunks_exact_mut(rows.len().max(1))).enumerate()
    {
        if *answered {
            for (place, row) in places.iter_mut().zip(rows) {
                place.write(row[lane]);
            }
        } else {
            for place in places {
                place.write(f64::NAN);
            }
        }
    }
}
