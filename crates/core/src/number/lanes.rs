//! Several numbers side by side, one in each lane of a vector register.
//!
//! Every operation is that of the double, lane by lane; `mul_add` is fused where the processor has such an instruction
//! ([`Lanes::FUSED`]). So results are the same bits on all registers that fuse, and on all that do not. [`dispatch`] picks
//! the widest registers that the processor has when the program runs.

use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::number::real::Ordered;

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

    /// Does a work in a function of its own, compiled for the register: what is long and called at several places.
    #[inline(always)]
    fn apart<W: Work<Self>>(work: W) -> W::Result {
        work.run()
    }

    /// From states one after the other, of which each has `N` numbers, to numbers of [`Lanes::WIDTH`] states side by side.
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

    /// From rows of [`WIDTH`] states side by side to states one after the other, each with a number of every row.
    #[inline(always)]
    fn scatter(rows: &[Line], states: &mut [MaybeUninit<f64>]) {
        let states = &mut states[..rows.len() * WIDTH];
        for lane in 0..WIDTH {
            for k in 0..rows.len() {
                states[lane * rows.len() + k].write(rows[k].0[lane]);
            }
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
/// The functions for one instruction set are methods of the task, because the compiler puts a method into the codegen unit of
/// the type that has it: so the tasks of different modules, which are most of what there is to compile, compile side by side.
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

/// What is to be done with registers of one kind; its functions of their own are methods for the reason of [`Task`]'s.
pub trait Work<V>: Sized {
    type Result;

    /// Must be `#[inline(always)]` with all that it calls.
    fn run(self) -> Self::Result;

    /// # Safety
    /// The processor must have AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[inline(never)]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn apart_avx2(self) -> Self::Result {
        self.run()
    }

    /// # Safety
    /// The processor must have AVX-512 (F and DQ) and FMA.
    #[cfg(target_arch = "x86_64")]
    #[inline(never)]
    #[target_feature(enable = "avx512f,avx512dq,fma")]
    unsafe fn apart_avx512(self) -> Self::Result {
        self.run()
    }

    /// With the instructions that every processor of its kind has.
    ///
    /// # Safety
    /// None is needed.
    #[inline(never)]
    unsafe fn apart_baseline(self) -> Self::Result {
        self.run()
    }
}

/// A work with its fields, its result and what it does: a function of its own for each kind of register.
///
/// Instructions of AVX are inlined only into functions that are compiled for AVX, so that in these all operands lie in memory
/// until then. The compiler's time to bring them into registers grows with the square of the function's length: long functions
/// are divided so.
macro_rules! work {
    (
        $(#[$doc:meta])*
        $name:ident<$($life:lifetime),+, $v:ident> { $($field:ident: $type:ty),+ $(,)? } -> $result:ty $body:block
    ) => {
        $(#[$doc])*
        struct $name<$($life),+, $v: $crate::number::lanes::Lanes> {
            $($field: $type),+
        }

        impl<$($life),+, $v: $crate::number::lanes::Lanes> $crate::number::lanes::Work<$v> for $name<$($life),+, $v> {
            type Result = $result;

            #[inline(always)]
            fn run(self) -> $result {
                let $name { $($field),+ } = self;
                $body
            }
        }
    };
}
pub(crate) use work;

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

/// The operations of a register by the instructions that make them.
macro_rules! register {
    (
        $(#[$doc:meta])* $name:ident($vector:ty), $width:literal, $mask:ty, $features:literal, fused $fused:literal, apart $apart:ident;
        $add:ident $sub:ident $mul:ident $div:ident $sqrt:ident $splat:ident $load:ident $store:ident;
        neg |$n:ident| $neg:expr;
        mul_add |$m:ident, $by:ident, $plus:ident| $mul_add:expr;
        abs |$p:ident| $abs:expr;
        signum |$s:ident| $signum:expr;
        greater |$a:ident, $b:ident| $greater:expr;
        at_most |$c:ident, $d:ident| $at_most:expr;
        select |$choose:ident, $first:ident, $second:ident| $select:expr;
        $($own:item)*
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        pub struct $name($vector);

        // SAFETY of all blocks below: a value of this type exists only where `dispatch` has found the instructions.
        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, b: Self) -> Self {
                unsafe { $name($add(self.0, b.0)) }
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, b: Self) -> Self {
                unsafe { $name($sub(self.0, b.0)) }
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, b: Self) -> Self {
                unsafe { $name($mul(self.0, b.0)) }
            }
        }
        impl Div for $name {
            type Output = Self;
            #[inline(always)]
            fn div(self, b: Self) -> Self {
                unsafe { $name($div(self.0, b.0)) }
            }
        }
        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                let $n = self.0;
                unsafe { $name($neg) }
            }
        }
        impl Real for $name {
            type Value = Self;
            #[inline(always)]
            fn lit(x: f64) -> Self {
                unsafe { $name($splat(x)) }
            }
            #[inline(always)]
            fn value(self) -> Self {
                self
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                unsafe { $name($sqrt(self.0)) }
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                let ($m, $by, $plus) = (self.0, a.0, b.0);
                unsafe { $name($mul_add) }
            }
            #[inline(always)]
            fn select(choose: $mask, a: Self, b: Self) -> Self {
                let ($choose, $first, $second) = (choose, a.0, b.0);
                unsafe { $name($select) }
            }
        }
        impl crate::number::real::Ordered for $name {
            type Mask = $mask;
            #[inline(always)]
            fn greater(self, than: Self) -> $mask {
                let ($a, $b) = (self.0, than.0);
                unsafe { $greater }
            }
            #[inline(always)]
            fn at_most(self, other: Self) -> $mask {
                let ($c, $d) = (self.0, other.0);
                unsafe { $at_most }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                let $p = self.0;
                unsafe { $name($abs) }
            }
            #[inline(always)]
            fn signum(self) -> Self {
                let $s = self.0;
                unsafe { $name($signum) }
            }
        }
        /// Not inlined: angles are rare, and long.
        impl crate::number::real::Trig for $name {
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                #[target_feature(enable = $features)]
                fn called(x: $name) -> ($name, $name) {
                    crate::number::trig::sin_cos(x)
                }
                unsafe { called(self) }
            }
            #[inline(always)]
            fn acos(self) -> Self {
                #[target_feature(enable = $features)]
                fn called(x: $name) -> $name {
                    crate::number::trig::acos(x)
                }
                unsafe { called(self) }
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                #[target_feature(enable = $features)]
                fn called(y: $name, x: $name) -> $name {
                    crate::number::trig::atan2(y, x)
                }
                unsafe { called(self, x) }
            }
        }
        impl Lanes for $name {
            const WIDTH: usize = $width;
            const FUSED: bool = $fused;
            #[inline(always)]
            fn load(from: &[f64]) -> Self {
                assert!(from.len() >= $width);
                unsafe { $name($load(from.as_ptr())) }
            }
            #[inline(always)]
            fn store(self, to: &mut [f64]) {
                assert!(to.len() >= $width);
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn apart<W: $crate::number::lanes::Work<Self>>(work: W) -> W::Result {
                unsafe { work.$apart() }
            }
            $($own)*
        }
    };
}
#[cfg(target_arch = "x86_64")]
mod x86 {
    #[allow(clippy::wildcard_imports)] // instructions
    use std::arch::x86_64::*;
    use std::ops::{Add, Div, Mul, Neg, Sub};

    use std::mem::MaybeUninit;
    use std::sync::atomic::Ordering;

    use super::{Lanes, Line, Task, WIDEST};
    use crate::number::real::Real;

    register! {
        /// SSE2, which every x86-64 has.
        F64x2(__m128d), 2, __m128d, "sse2", fused false, apart apart_baseline;
        _mm_add_pd _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_sqrt_pd _mm_set1_pd _mm_loadu_pd _mm_storeu_pd;
        neg |a| _mm_xor_pd(a, _mm_set1_pd(-0.0));
        mul_add |a, b, c| _mm_add_pd(_mm_mul_pd(a, b), c);
        abs |a| _mm_andnot_pd(_mm_set1_pd(-0.0), a);
        signum |a| _mm_or_pd(_mm_and_pd(a, _mm_set1_pd(-0.0)), _mm_set1_pd(1.0));
        greater |a, b| _mm_cmpgt_pd(a, b);
        at_most |a, b| _mm_cmple_pd(a, b);
        select |mask, a, b| _mm_or_pd(_mm_and_pd(mask, a), _mm_andnot_pd(mask, b));
    }

    register! {
        /// AVX2.
        F64x4(__m256d), 4, __m256d, "avx2,fma", fused true, apart apart_avx2;
        _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_sqrt_pd _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd;
        neg |a| _mm256_xor_pd(a, _mm256_set1_pd(-0.0));
        mul_add |a, b, c| _mm256_fmadd_pd(a, b, c);
        abs |a| _mm256_andnot_pd(_mm256_set1_pd(-0.0), a);
        signum |a| _mm256_or_pd(_mm256_and_pd(a, _mm256_set1_pd(-0.0)), _mm256_set1_pd(1.0));
        greater |a, b| _mm256_cmp_pd::<_CMP_GT_OQ>(a, b);
        at_most |a, b| _mm256_cmp_pd::<_CMP_LE_OQ>(a, b);
        select |mask, a, b| _mm256_blendv_pd(b, a, mask);
    }

    register! {
        /// AVX-512.
        F64x8(__m512d), 8, __mmask8, "avx512f,avx512dq,fma", fused true, apart apart_avx512;
        _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_div_pd _mm512_sqrt_pd _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd;
        neg |a| _mm512_xor_pd(a, _mm512_set1_pd(-0.0));
        mul_add |a, b, c| _mm512_fmadd_pd(a, b, c);
        abs |a| _mm512_abs_pd(a);
        signum |a| _mm512_or_pd(_mm512_and_pd(a, _mm512_set1_pd(-0.0)), _mm512_set1_pd(1.0));
        greater |a, b| _mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b);
        at_most |a, b| _mm512_cmp_pd_mask::<_CMP_LE_OQ>(a, b);
        select |mask, a, b| _mm512_mask_blend_pd(mask, b, a);

        #[inline(always)]
        fn gather<const N: usize>(states: &[f64]) -> [Self; N] {
            assert!(states.len() >= 8 * N);
            let mut numbers = [Self::lit(0.0); N];
            for start in (0..N).step_by(8) {
                let mask = first(N - start);
                let mut tile = [Self::lit(0.0).0; 8];
                for lane in 0..8 {
                    // SAFETY: no number beyond those of the state is read.
                    tile[lane] = unsafe { _mm512_maskz_loadu_pd(mask, states.as_ptr().add(lane * N + start)) };
                }
                let tile = transposed(tile);
                for k in start..N.min(start + 8) {
                    numbers[k] = F64x8(tile[k - start]);
                }
            }
            numbers
        }

        #[inline(always)]
        fn scatter(rows: &[Line], states: &mut [MaybeUninit<f64>]) {
            let count = rows.len();
            assert!(states.len() >= 8 * count);
            for start in (0..count).step_by(8) {
                let mut tile = [Self::lit(0.0).0; 8];
                for k in 0..8 {
                    // The last row again beyond it: no branch, and never stored.
                    tile[k] = Self::load(&rows[(start + k).min(count - 1)].0).0;
                }
                let (tile, mask) = (transposed(tile), first(count - start));
                for lane in 0..8 {
                    // SAFETY: no number beyond those of the state is written.
                    unsafe {
                        let to = states.as_mut_ptr().add(lane * count + start);
                        _mm512_mask_storeu_pd(to.cast(), mask, tile[lane]);
                    }
                }
            }
        }
    }

    /// The mask of the first numbers, at most eight.
    #[inline(always)]
    fn first(count: usize) -> __mmask8 {
        if count >= 8 { 0xff } else { (1 << count) - 1 }
    }

    /// The rows of an 8×8 tile as its columns.
    #[inline(always)]
    fn transposed(rows: [__m512d; 8]) -> [__m512d; 8] {
        let [a, b, c, d, e, f, g, h] = rows;
        // SAFETY: called where `dispatch` has found the instructions.
        unsafe {
            let even = [
                _mm512_unpacklo_pd(a, b),
                _mm512_unpacklo_pd(c, d),
                _mm512_unpacklo_pd(e, f),
                _mm512_unpacklo_pd(g, h),
            ];
            let odd = [
                _mm512_unpackhi_pd(a, b),
                _mm512_unpackhi_pd(c, d),
                _mm512_unpackhi_pd(e, f),
                _mm512_unpackhi_pd(g, h),
            ];
            let [r0, r2, r4, r6] = quarters(even);
            let [r1, r3, r5, r7] = quarters(odd);
            [r0, r1, r2, r3, r4, r5, r6, r7]
        }
    }

    /// The k-th quarters of all four together, for each k.
    #[inline(always)]
    unsafe fn quarters([a, b, c, d]: [__m512d; 4]) -> [__m512d; 4] {
        unsafe {
            let (even, odd) = (_mm512_shuffle_f64x2::<0x88>(a, b), _mm512_shuffle_f64x2::<0xdd>(a, b));
            let (even2, odd2) = (_mm512_shuffle_f64x2::<0x88>(c, d), _mm512_shuffle_f64x2::<0xdd>(c, d));
            [
                _mm512_shuffle_f64x2::<0x88>(even, even2),
                _mm512_shuffle_f64x2::<0x88>(odd, odd2),
                _mm512_shuffle_f64x2::<0xdd>(even, even2),
                _mm512_shuffle_f64x2::<0xdd>(odd, odd2),
            ]
        }
    }

    #[inline]
    pub fn dispatch(task: impl Task) {
        // SAFETY: of both: the processor has the instructions.
        match widest().min(WIDEST.load(Ordering::Relaxed)) {
            8.. => unsafe { task.run_avx512() },
            4..8 => unsafe { task.run_avx2() },
            _ => task.run_baseline(),
        }
    }

    /// The width of the widest registers that this processor has.
    #[inline]
    pub fn widest() -> usize {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
            8
        } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            4
        } else {
            2
        }
    }

    #[cfg(test)]
    pub mod tests {
        use super::*;

        pub fn on_each_width(task: impl Task + Copy) {
            task.run::<F64x2>();
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                unsafe { task.run_avx2() }
            }
        }
    }
}

#[cfg(target_arch = "aarch64")]
mod arm {
    #[allow(clippy::wildcard_imports)] // instructions
    use std::arch::aarch64::*;
    use std::ops::{Add, Div, Mul, Neg, Sub};

    use super::Lanes;
    use crate::number::real::Real;

    register! {
        /// NEON, which every aarch64 has.
        F64x2(float64x2_t), 2, uint64x2_t, "neon", fused true, apart apart_baseline;
        vaddq_f64 vsubq_f64 vmulq_f64 vdivq_f64 vsqrtq_f64 vdupq_n_f64 vld1q_f64 vst1q_f64;
        neg |a| vnegq_f64(a);
        mul_add |a, b, c| vfmaq_f64(c, a, b);
        abs |a| vabsq_f64(a);
        signum |a| vbslq_f64(vdupq_n_u64(1 << 63), a, vdupq_n_f64(1.0));
        greater |a, b| vcgtq_f64(a, b);
        at_most |a, b| vcleq_f64(a, b);
        select |mask, a, b| vbslq_f64(mask, a, b);
    }
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
        turns::<6>();
        turns::<8>();
        turns::<15>();
        turns::<16>();
    }
}
