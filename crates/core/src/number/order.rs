//! Which of several numbers is largest or least, where one may be no number (NaN). `f64::max` and `f64::min`
//! leave NaN out, and `f64::total_cmp` takes it for the largest: an unknown number would count as known.
//! `clippy.toml` refuses these three.

use std::cmp::Ordering;

/// The larger of two; NaN if either is.
#[inline]
#[must_use]
pub fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// The smaller of two; NaN if either is.
#[inline]
#[must_use]
pub fn smaller(a: f64, b: f64) -> f64 {
    if a <= b || a.is_nan() { a } else { b }
}

/// The largest of all and zero; NaN if one is.
#[must_use]
pub fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(0.0, larger)
}

/// Order by size with NaN below all numbers: it is never the largest of several.
#[inline]
#[must_use]
pub fn by_size(a: f64, b: f64) -> Ordering {
    a.partial_cmp(&b).unwrap_or_else(|| b.is_nan().cmp(&a.is_nan()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f64 = f64::NAN;

    #[test]
    fn no_number_is_neither_left_out_nor_the_largest() {
        for (a, b) in [(NAN, 1.0), (1.0, NAN), (NAN, NAN)] {
            assert!(larger(a, b).is_nan() && smaller(a, b).is_nan());
        }
        assert_eq!((larger(1.0, 2.0), larger(2.0, 1.0)), (2.0, 2.0));
        assert_eq!((smaller(1.0, 2.0), smaller(2.0, 1.0)), (1.0, 1.0));
        assert!(largest([1.0, NAN, 2.0]).is_nan());
        assert_eq!((largest([1.0, 3.0, 2.0]), largest([])), (3.0, 0.0));
        for numbers in [[NAN, 1.0, -2.0], [1.0, NAN, -2.0], [-2.0, 1.0, NAN]] {
            assert_eq!(numbers.into_iter().max_by(|&a, &b| by_size(a, b)), Some(1.0));
            let mut sorted = numbers;
            sorted.sort_by(|&a, &b| by_size(a, b));
            assert!(sorted[0].is_nan() && sorted[1..] == [-2.0, 1.0]);
        }
    }
}
