pub mod degrees_of_freedom;
pub mod independent_coordinates;
pub mod screw_systems;
pub mod singularity;
pub mod singularity_distance;
pub mod sufficient_actuators;
