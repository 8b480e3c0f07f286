pub mod complex;
pub mod lanes;
pub mod outlined;
pub mod real;
pub(crate) mod slices;
pub mod trig;
pub mod work;
