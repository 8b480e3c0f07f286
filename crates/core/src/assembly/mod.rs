pub mod build;
pub mod geometric_parameters;
