pub mod assembly_modes;
pub mod gauss_newton;
pub mod homotopy;
pub mod newton;
pub mod newton_lanes;
pub mod path_point;
pub mod start_system;
