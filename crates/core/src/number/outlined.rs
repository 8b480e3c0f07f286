//! A dual-number type whose arithmetic is outlined (`#[inline(never)]`), to bound code size: for the
//! variation of a pose with its rates. Inlined into the maps of the coordinate sets it would be some hundred
//! thousand instructions for each kind of register.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::number::lanes::Lanes;
use crate::number::real::{Constant, Dual, Jet, Mask, Real, Trig};
use crate::number::work::Work;

/// The number that it is: rates and second rates along a motion, with a derivative of each.
type Parts<V> = Jet<Dual<V>>;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlined<V>(pub Parts<V>);

/// Functions of one or two numbers that are called.
macro_rules! called {
    ($($work:ident($a:ident, $b:ident) -> $result:ty: $value:expr;)*) => {$(
        struct $work<'a, V>(&'a Parts<V>, &'a Parts<V>);

        impl<V: Lanes> Work<V> for $work<'_, V> {
            type Result = $result;

            #[inline(always)]
            fn run(self) -> $result {
                let $work(&$a, &$b) = self;
                $value
            }
        }
    )*};
}
called! {
    Product(a, b) -> Parts<V>: a * b;
    Quotient(a, b) -> Parts<V>: a / b;
    Root(a, _b) -> Parts<V>: a.sqrt();
    SineAndCosine(a, _b) -> (Parts<V>, Parts<V>): a.sin_cos();
    ArcCosine(a, _b) -> Parts<V>: a.acos();
    Angle(y, x) -> Parts<V>: y.atan2(x);
}

impl<V: Lanes> Add for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Outlined(self.0 + b.0)
    }
}

impl<V: Lanes> Sub for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Outlined(self.0 - b.0)
    }
}

impl<V: Lanes> Mul for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Outlined(V::apart(Product(&self.0, &b.0)))
    }
}

impl<V: Lanes> Div for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Outlined(V::apart(Quotient(&self.0, &b.0)))
    }
}

impl<V: Lanes> Neg for Outlined<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Outlined(-self.0)
    }
}

impl<V: Lanes> Real for Outlined<V> {
    type Value = V;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Outlined(Jet::lit(x))
    }
    #[inline(always)]
    fn value(self) -> V {
        self.0.value()
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Outlined(V::apart(Root(&self.0, &self.0)))
    }
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        Outlined(self.0.scale(x))
    }
    #[inline(always)]
    fn select(choose: Mask<Self>, a: Self, b: Self) -> Self {
        Outlined(Jet::select(choose, a.0, b.0))
    }
}

impl<V: Lanes> Trig for Outlined<V> {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = V::apart(SineAndCosine(&self.0, &self.0));
        (Outlined(sine), Outlined(cosine))
    }
    #[inline(always)]
    fn acos(self) -> Self {
        Outlined(V::apart(ArcCosine(&self.0, &self.0)))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        Outlined(V::apart(Angle(&self.0, &x.0)))
    }
}

impl<V: Lanes> Constant<Outlined<V>> for Dual<f64> {
    #[inline(always)]
    fn lift(self) -> Outlined<V> {
        Outlined(self.lift())
    }
}
