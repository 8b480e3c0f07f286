//! Reproducible pseudo-random numbers, for generic points and directions.

use crate::number::complex::Complex;
use crate::spatial::Vec3;

/// The generator xorshift64*.
pub struct Random(pub u64);

impl Random {
    /// Uniform in (-1, 1).
    pub fn number(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = u32::try_from(self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32).unwrap_or(0);
        f64::from(bits) / f64::from(u32::MAX) * 2.0 - 1.0
    }

    pub fn complex(&mut self) -> Complex<f64> {
        Complex::new(self.number(), self.number())
    }

    /// Three numbers drawn one by one.
    pub fn vector<T>(&mut self, one: impl Fn(&mut Self) -> T) -> Vec3<T> {
        Vec3 { x: one(self), y: one(self), z: one(self) }
    }
}
