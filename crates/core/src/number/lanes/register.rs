//! What all kinds of registers have in common: a type and its operations, by instructions.

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

        // SAFETY of all blocks below: a value of this type exists only where `dispatch` has found the
        // instructions.
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
            #[inline(always)]
            fn apart<W: $crate::number::work::Work<Self>>(work: W) -> W::Result {
                unsafe { work.$apart() }
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
            $($own)*
        }
    };
}
