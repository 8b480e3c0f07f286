//! Non-temporal (streaming) stores, past the caches. An array that is too long to stay in them would be read
//! before it is written, line by line, and evicted again: half of the memory traffic.

use std::mem::MaybeUninit;

/// Bytes of a line of the caches.
const LINE: usize = 64;

/// Whether an address is aligned to a cache line: a streaming store writes whole lines.
#[inline(always)]
pub(crate) fn begins_line(places: &[MaybeUninit<f64>]) -> bool {
    places.as_ptr().addr().is_multiple_of(LINE)
}

/// Copies whole lines to a place where a line begins; [`finish`] lets other threads see them.
///
/// # Panics
/// If they are no whole lines, are not as many as there is room for, or no line begins there.
#[inline(always)]
pub(crate) fn copy(numbers: &[MaybeUninit<f64>], places: &mut [MaybeUninit<f64>]) {
    assert!(
        numbers.len() == places.len() && size_of_val(numbers).is_multiple_of(LINE) && begins_line(places)
    );
    #[cfg(target_arch = "x86_64")]
    x86::copy(numbers, places);
    #[cfg(not(target_arch = "x86_64"))]
    places.copy_from_slice(numbers);
}

/// Lets other threads see what was copied.
#[inline(always)]
pub(crate) fn finish() {
    #[cfg(target_arch = "x86_64")]
    x86::finish();
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{_mm_loadu_pd, _mm_sfence, _mm_stream_pd};
    use std::mem::MaybeUninit;

    #[inline(always)]
    pub(super) fn copy(numbers: &[MaybeUninit<f64>], places: &mut [MaybeUninit<f64>]) {
        // Of the 64 bytes of a line each store writes 16.
        let (from, to) = (numbers.as_ptr().cast::<f64>(), places.as_mut_ptr().cast::<f64>());
        for line in 0..numbers.len() / 8 {
            for k in [0, 2, 4, 6] {
                let at = 8 * line + k;
                // SAFETY: both have so many numbers, all written, `to` begins a line, and every processor of
                // this kind has the instructions.
                unsafe { _mm_stream_pd(to.add(at), _mm_loadu_pd(from.add(at))) };
            }
        }
    }

    #[inline(always)]
    pub(super) fn finish() {
        // SAFETY: every processor of this kind has the instruction.
        unsafe { _mm_sfence() };
    }
}
