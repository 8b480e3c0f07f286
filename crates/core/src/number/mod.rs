pub mod complex;
pub mod lanes;
pub mod outlined;
pub mod real;
pub mod trig;
