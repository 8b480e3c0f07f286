//! Several numbers side by side, one in each lane of a vector register.
//!
//! Every operation is that of the double, lane by lane; `mul_add` is fused where the processor has such an
//! instruction ([`Lanes::FUSED`]). So results are the same bits on all registers that fuse, and on all that
//! do not. [`dispatch`] picks the widest registers that the processor has when the program runs.

use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::number::real::Ordered;

#[cfg(target_arch = "aarch64")]
mod arm;
#[macro_use]
mod register;
#[cfg(target_arch = "x86_64")]
mod x86;

/// Numbers that go side by side, in as many registers as it takes.
pub const WIDTH: usize = 8;

/// One number of each.
pub type Row = [f64; WIDTH];

/// A row that lies in one line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Line(pub Row);

/// A register of numbers.
pub trait Lanes: Ordered {
    const WIDTH: usize;

    /// Whether `mul_add` rounds once.
    const FUSED: bool;

    /// The first [`Lanes::WIDTH`] numbers.
    fn load(from: &[f64]) -> Self;

    fn store(self, to: &mut [f64]);

    /// From states one after the other, of which each has `N` numbers, to numbers of [`Lanes::WIDTH`] states
    /// side by side.
    #[inline(always)]
    fn gather<const N: usize>(states: &[f64]) -> [Self; N] {
        let (states, mut rows) = (&states[..N * Self::WIDTH], [[0.0; WIDTH]; N]);
        for lane in 0..Self::WIDTH {
            for k in 0..N {
                rows[k][lane] = states[lane * N + k];
            }
        }
        let mut numbers = [Self::zero(); N];
        for k in 0..N {
            numbers[k] = Self::load(&rows[k]);
        }
        numbers
    }

    /// From rows of [`WIDTH`] states side by side to states one after the other, each with a number of every
    /// row.
    #[inline(always)]
    fn scatter(rows: &[Line], states: &mut [MaybeUninit<f64>]) {
        scatter_each(rows, states);
    }
}

/// See [`Lanes::scatter`]: one number after the other.
#[inline(always)]
fn scatter_each(rows: &[Line], states: &mut [MaybeUninit<f64>]) {
    let states = &mut states[..rows.len() * WIDTH];
    for lane in 0..WIDTH {
        for k in 0..rows.len() {
            states[lane * rows.len() + k].write(rows[k].0[lane]);
        }
    }
}

/// Whether it is more than zero in any lane.
#[inline(always)]
pub(crate) fn any<V: Lanes>(x: V) -> bool {
    let (mut row, mut sum) = ([0.0; WIDTH], 0.0);
    x.store(&mut row);
    for x in row {
        sum += x;
    }
    sum > 0.0
}

/// The register of a processor without vectors.
impl Lanes for f64 {
    const WIDTH: usize = 1;
    const FUSED: bool = false;
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }
}

/// Work to be compiled for registers of any width.
///
/// The functions for one instruction set are methods of the task, because the compiler puts a method into the
/// codegen unit of the type that has it: so the tasks of different modules, which are most of what there is
/// to compile, compile side by side.
pub trait Task: Sized {
    /// Must be `#[inline(always)]` with all that it calls, so that it is compiled for each instruction set.
    fn run<V: Lanes>(self);

    /// # Safety
    /// The processor must have AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn run_avx2(self) {
        self.run::<x86::F64x4>();
    }

    /// # Safety
    /// The processor must have AVX-512 (F and DQ) and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq,fma")]
    unsafe fn run_avx512(self) {
        self.run::<x86::F64x8>();
    }

    /// With the registers that every processor of its kind has.
    #[inline(never)]
    fn run_baseline(self) {
        #[cfg(target_arch = "x86_64")]
        self.run::<x86::F64x2>();
        #[cfg(target_arch = "aarch64")]
        self.run::<arm::F64x2>();
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        self.run::<f64>();
    }
}

/// Instruction sets of this kind of processor with the width of their registers, the narrowest first.
#[cfg(target_arch = "x86_64")]
const SETS: &[(&str, usize)] = &[("sse2", 2), ("avx2", 4), ("avx512", 8)];
#[cfg(target_arch = "aarch64")]
const SETS: &[(&str, usize)] = &[("neon", 2)];
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const SETS: &[(&str, usize)] = &[("scalar", 1)];

/// The widest registers to use.
static WIDEST: AtomicUsize = AtomicUsize::new(usize::MAX);

/// The instruction sets that this processor has, the narrowest first.
#[must_use]
pub fn instruction_sets() -> Vec<&'static str> {
    #[cfg(target_arch = "x86_64")]
    let widest = x86::widest();
    #[cfg(not(target_arch = "x86_64"))]
    let widest = usize::MAX;
    SETS.iter().filter(|(_, width)| *width <= widest).map(|(name, _)| *name).collect()
}

/// Lets tasks use no wider registers than those of this set; whether the processor has it.
pub fn use_instructions(name: &str) -> bool {
    let known = instruction_sets().contains(&name);
    if let (true, Some((_, width))) = (known, SETS.iter().find(|(set, _)| *set == name)) {
        WIDEST.store(*width, Ordering::Relaxed);
    }
    known
}

/// Runs a task on the widest registers there are, or the widest allowed.
#[inline]
pub fn dispatch(task: impl Task) {
    #[cfg(target_arch = "x86_64")]
    x86::dispatch(task);
    #[cfg(not(target_arch = "x86_64"))]
    task.run_baseline();
}

#[cfg(test)]
pub mod tests {
    use std::cell::RefCell;

    use super::*;

    /// Runs a task on one number at a time, and on registers of each width that this processor has.
    pub fn on_each_width(task: impl Task + Copy) {
        task.run::<f64>();
        dispatch(task);
        #[cfg(target_arch = "x86_64")]
        x86::tests::on_each_width(task);
    }

    /// Whether the register fuses, and the rows that operations give.
    type Found = (bool, [[f64; 8]; 14]);

    /// Every operation, on pairs of numbers.
    #[derive(Clone, Copy)]
    struct Operations<'a> {
        pairs: &'a [[f64; 8]; 2],
        results: &'a RefCell<Vec<Found>>,
    }

    impl Task for Operations<'_> {
        #[inline(always)]
        fn run<V: Lanes>(self) {
            let mut results = [[0.0; 8]; 14];
            for k in (0..8).step_by(V::WIDTH) {
                let (a, b) = (V::load(&self.pairs[0][k..]), V::load(&self.pairs[1][k..]));
                let chosen = V::select(a.greater(b), V::lit(2.5), b);
                let (sum, more) = (a.mul_add(b, a), a.scale(0.1));
                let numbers = [
                    a + b,
                    a - b,
                    a * b,
                    a / b,
                    -a,
                    a.abs(),
                    a.sqrt(),
                    a.signum(),
                    chosen,
                    a.least(b),
                    a.most(b),
                    sum,
                    more,
                    V::select(a.at_most(b), a, V::lit(2.5)),
                ];
                for (row, number) in results.iter_mut().zip(numbers) {
                    number.store(&mut row[k..]);
                }
            }
            self.results.borrow_mut().push((V::FUSED, results));
        }
    }

    #[test]
    fn lanes_are_doubles_bit_by_bit() {
        let (inf, nan) = (f64::INFINITY, f64::NAN);
        let a = [1.5, -2.0, 0.0, -0.0, 1e300, inf, nan, 0.1];
        let b = [0.3, -2.5, -0.0, 0.0, 1e300, -inf, 1.0, nan];
        let results = RefCell::new(Vec::new());
        on_each_width(Operations { pairs: &[a, b], results: &results });
        let (fused, mut all): (Vec<bool>, Vec<_>) = results.into_inner().into_iter().unzip();
        for (fused, results) in fused.into_iter().zip(&mut all) {
            for k in 0..8 {
                let sum = if fused { a[k].mul_add(b[k], a[k]) } else { a[k] * b[k] + a[k] };
                let found = std::mem::replace(&mut results[11][k], 0.0);
                assert!(found.to_bits() == sum.to_bits() || (found.is_nan() && sum.is_nan()), "{a:?} {b:?}");
            }
        }
        // Which NaN an invalid operation gives is left open, and with it the sign of a NaN.
        let bits = |row: [f64; 8]| row.map(|x| if x.is_nan() { 0 } else { x.to_bits() });
        let defined = |k: usize, x: u64| if k == 6 { 0 } else { x };
        for results in &all {
            for (i, (row, first)) in results.iter().zip(&all[0]).enumerate() {
                for (k, (x, known)) in bits(*row).into_iter().zip(bits(*first)).enumerate() {
                    assert_eq!(defined(k, x), defined(k, known), "operation {i}, lane {k}");
                }
            }
        }
        assert!(all.len() > 1);
        let value = |operation: usize, lane: usize| all[0][operation][lane];
        assert_eq!([value(3, 0), value(4, 0), value(7, 3)], [a[0] / b[0], -1.5, -1.0]);
        assert_eq!([value(8, 0), value(8, 3), value(9, 0), value(10, 0)], [2.5, 0.0, 0.3, 1.5]);
        assert!(
            value(9, 7) == 0.1 && value(10, 7) == 0.1,
            "a number that cannot be compared to another stays"
        );
    }

    /// States one after the other, each with as many numbers as there are rows, there and back.
    struct Turned<'a, const N: usize>(&'a [f64], &'a mut Vec<Vec<f64>>);

    impl<const N: usize> Task for Turned<'_, N> {
        #[inline(always)]
        fn run<V: Lanes>(self) {
            let Turned(states, found) = self;
            let mut rows = [Line([0.0; WIDTH]); N];
            for lane in (0..WIDTH).step_by(V::WIDTH) {
                let numbers = V::gather::<N>(&states[lane * N..]);
                for k in 0..N {
                    numbers[k].store(&mut rows[k].0[lane..]);
                }
            }
            let mut back = vec![MaybeUninit::new(0.0); states.len()];
            V::scatter(&rows, &mut back);
            found.push(rows.iter().flat_map(|row| row.0).collect());
            // SAFETY: made of numbers.
            found.push(back.iter().map(|x| unsafe { x.assume_init() }).collect());
        }
    }

    fn turns<const N: usize>() {
        // One number more than the states have: it is not to be touched.
        let states: Vec<f64> = (0..=N * WIDTH).map(|k| k as f64).collect();
        let mut found = Vec::new();
        Turned::<N>(&states, &mut found).run::<f64>();
        dispatch(Turned::<N>(&states, &mut found));
        for pair in found.chunks(2) {
            for (k, x) in pair[0].iter().enumerate() {
                assert_eq!(*x, ((k % WIDTH) * N + k / WIDTH) as f64, "{N} numbers");
            }
            assert_eq!(pair[1][..N * WIDTH], states[..N * WIDTH], "{N} numbers");
            assert_eq!(pair[1][N * WIDTH], 0.0, "{N} numbers");
        }
        assert_eq!(found.len(), 4);
    }

    #[test]
    fn states_are_turned_into_rows_and_back() {
        turns::<1>();
        turns::<3>();
        turns::<4>();
        turns::<5>();
        turns::<6>();
        turns::<8>();
        turns::<15>();
        turns::<16>();
    }
}
