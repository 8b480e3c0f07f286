//! Parts of a computation that are functions of their own, compiled for each kind of register.
//!
//! Instructions of AVX are inlined only into functions that are compiled for AVX, so that in these all
//! operands lie in memory until then. The compiler's time to bring them into registers grows with the square
//! of the function's length: long functions are divided into works. Numbers that are no registers do a work
//! where they stand.

/// What is to be done with numbers of one kind; its functions of their own are methods for the reason of
/// [`Task`](crate::number::lanes::Task)'s.
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

/// A work with its fields, its result and what it does, which
/// [`Real::apart`](crate::number::real::Real::apart) calls.
macro_rules! work {
    (
        $(#[$doc:meta])*
        $visible:vis $name:ident<$($life:lifetime),+, $v:ident: $bound:ident> { $($field:ident: $type:ty),+ $(,)? } -> $result:ty $body:block
    ) => {
        $(#[$doc])*
        $visible struct $name<$($life),+, $v: $bound> {
            $($visible $field: $type),+
        }

        impl<$($life),+, $v: $bound> $crate::number::work::Work<$v> for $name<$($life),+, $v> {
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
