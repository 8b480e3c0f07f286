pub mod complex;
pub mod lanes;
pub mod real;
pub(crate) mod slices;
pub mod trig;
pub mod work;
