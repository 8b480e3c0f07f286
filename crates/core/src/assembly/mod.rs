pub mod build;
mod drives;
pub mod geometric_parameters;
pub mod universal_legs;
