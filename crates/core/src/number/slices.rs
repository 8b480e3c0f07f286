//! Copies, fills and pairs for kernels, as loops that are inlined.
//!
//! Functions of the standard library for slices are not all inlined across codegen units: they would be
//! called, and what they do to registers would be done in memory, without the instructions that the kernel is
//! compiled for.

/// Sets numbers to others, of which there must be as many.
#[inline(always)]
pub(crate) fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    assert_eq!(from.len(), to.len());
    #[allow(clippy::manual_memcpy)] // see above
    for k in 0..to.len() {
        to[k] = from[k];
    }
}

/// Sets all numbers to one.
#[inline(always)]
pub(crate) fn fill<T: Copy>(to: &mut [T], x: T) {
    for k in 0..to.len() {
        to[k] = x;
    }
}

/// One of each of two sequences at a time, until either ends.
#[inline(always)]
pub(crate) fn pairs<A: IntoIterator, B: IntoIterator>(a: A, b: B) -> Pairs<A::IntoIter, B::IntoIter> {
    Pairs(a.into_iter(), b.into_iter())
}

/// See [`pairs`].
pub(crate) struct Pairs<A, B>(A, B);

impl<A: Iterator, B: Iterator> Iterator for Pairs<A, B> {
    type Item = (A::Item, B::Item);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        match (self.0.next(), self.1.next()) {
            (Some(a), Some(b)) => Some((a, b)),
            _ => None,
        }
    }
}
