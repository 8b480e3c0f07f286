//! Vectors, rotations, poses, twists and wrenches, over any [`Real`](crate::number::real::Real).

pub mod distance;
pub mod motion;
pub mod packed_poses;
pub mod vector;

pub use motion::{Acceleration, Motion, Pose, Twist, Wrench};
pub use vector::{Mat3, Vec3};
