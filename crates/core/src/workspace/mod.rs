pub mod fit_orientation;
pub mod flood_fill;
pub mod lattice_poses;
pub mod lattice_steps;
pub mod length_lattice;
pub mod pose_bounds;
