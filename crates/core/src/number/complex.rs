//! Complex numbers over any [`Real`], for the equations of assembly modes.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::number::real::{Mask, Ordered, Real};

/// `re + im i`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Complex<T> {
    pub re: T,
    pub im: T,
}

impl<T: Real> Complex<T> {
    #[inline(always)]
    pub fn new(re: T, im: T) -> Self {
        Complex { re, im }
    }

    /// `|z|²`.
    #[inline(always)]
    pub fn norm_sqr(self) -> T {
        self.re.mul_add(self.re, self.im * self.im)
    }

    #[inline(always)]
    pub fn norm(self) -> T {
        self.norm_sqr().sqrt()
    }
}

impl<T: Real> Add for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Complex::new(self.re + b.re, self.im + b.im)
    }
}

impl<T: Real> Sub for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Complex::new(self.re - b.re, self.im - b.im)
    }
}

impl<T: Real> Mul for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Complex::new(self.re.mul_add(b.re, -(self.im * b.im)), self.re.mul_add(b.im, self.im * b.re))
    }
}

impl<T: Real> Div for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let inverse = T::one() / b.norm_sqr();
        self * Complex::new(b.re * inverse, -(b.im * inverse))
    }
}

impl<T: Real> Neg for Complex<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Complex::new(-self.re, -self.im)
    }
}

/// There is no order: `value` is a measure of size, the 1-norm, by which pivots are chosen.
impl<T: Ordered> Real for Complex<T> {
    type Value = T;
    #[inline(always)]
    fn lit(x: f64) -> Self {
        Complex::new(T::lit(x), T::zero())
    }
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        Complex::new(self.re.scale(x), self.im.scale(x))
    }
    #[inline(always)]
    fn value(self) -> T {
        self.re.abs() + self.im.abs()
    }
    /// The root with a real part that is not negative.
    #[inline(always)]
    fn sqrt(self) -> Self {
        // Of the two parts the one that is a sum without cancellation first, the other from 2 re im.
        let first = (self.norm() + self.re.abs()).scale(0.5).sqrt();
        let second = self.im.abs() / (first + first);
        let second = T::select(first.greater(T::zero()), second, T::zero());
        let left = T::zero().greater(self.re);
        let (re, im) = (T::select(left, second, first), T::select(left, first, second));
        Complex::new(re, im * self.im.signum())
    }
    #[inline(always)]
    fn select(choose: Mask<T>, a: Self, b: Self) -> Self {
        Complex::new(T::select(choose, a.re, b.re), T::select(choose, a.im, b.im))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_and_root() {
        let parts = [-3.0, -0.5, 0.0, 2.0];
        for (re, im) in parts.into_iter().flat_map(|a| parts.map(|b| (a, b))) {
            let z = Complex::new(re, im);
            let w = Complex::new(0.3, -1.7);
            assert!((z / w * w - z).norm() < 1e-15 && (z * w - w * z).norm() == 0.0);
            let root = z.sqrt();
            assert!((root * root - z).norm() < 1e-15 && root.re >= 0.0, "{z:?} {root:?}");
        }
        let i = Complex::new(0.0, 1.0);
        assert_eq!(i * i, Complex::lit(-1.0));
    }
}
