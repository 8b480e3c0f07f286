//! Registers of x86-64: SSE2, AVX2, AVX-512.

#[allow(clippy::wildcard_imports)] // instructions
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use std::mem::MaybeUninit;
use std::sync::atomic::Ordering;

use super::{Lanes, Line, Task, WIDEST, scatter_each};
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

    #[inline(always)]
    fn gather<const N: usize>(states: &[f64]) -> [Self; N] {
        let (states, mut numbers) = (&states[..4 * N], [Self::lit(0.0); N]);
        if N < 4 {
            for k in 0..N {
                numbers[k] = Self::load(&[states[k], states[N + k], states[2 * N + k], states[3 * N + k]]);
            }
            return numbers;
        }
        for tile in 0..N.div_ceil(4) {
            // The last tile ends with the last number: it may hold some of the one before again.
            let start = (4 * tile).min(N - 4);
            let mut lanes = [Self::lit(0.0).0; 4];
            for lane in 0..4 {
                lanes[lane] = Self::load(&states[lane * N + start..]).0;
            }
            let columns = transposed_4(lanes);
            for k in 0..4 {
                numbers[start + k] = F64x4(columns[k]);
            }
        }
        numbers
    }

    #[inline(always)]
    fn scatter(rows: &[Line], states: &mut [MaybeUninit<f64>]) {
        let count = rows.len();
        if count < 4 {
            return scatter_each(rows, states);
        }
        assert!(states.len() >= 8 * count);
        for tile in 0..count.div_ceil(4) {
            let start = (4 * tile).min(count - 4);
            for first in [0, 4] {
                let mut numbers = [Self::lit(0.0).0; 4];
                for k in 0..4 {
                    numbers[k] = Self::load(&rows[start + k].0[first..]).0;
                }
                let lanes = transposed_4(numbers);
                for k in 0..4 {
                    // SAFETY: start + 4 ≤ count: all four are numbers of this state.
                    unsafe {
                        let to = states.as_mut_ptr().add((first + k) * count + start);
                        _mm256_storeu_pd(to.cast(), lanes[k]);
                    }
                }
            }
        }
    }
}

/// The rows of a 4×4 tile as its columns.
#[inline(always)]
fn transposed_4([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
    // SAFETY: called where `dispatch` has found the instructions.
    unsafe {
        let (even, odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (even2, odd2) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        [
            _mm256_permute2f128_pd::<0x20>(even, even2),
            _mm256_permute2f128_pd::<0x20>(odd, odd2),
            _mm256_permute2f128_pd::<0x31>(even, even2),
            _mm256_permute2f128_pd::<0x31>(odd, odd2),
        ]
    }
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
            let tile = transposed_8(tile);
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
            let (tile, mask) = (transposed_8(tile), first(count - start));
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
fn transposed_8(rows: [__m512d; 8]) -> [__m512d; 8] {
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
