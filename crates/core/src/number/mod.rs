pub mod complex;
pub mod lanes;
pub mod order;
pub mod real;
pub(crate) mod slices;
pub mod trig;
pub mod work;
