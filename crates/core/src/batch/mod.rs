//! Many states at once: arrays in, a [`Table`] out, one status per state, NaN where there is no answer.

mod block;
mod checks;
mod coordinates;
mod derivatives;
mod dynamics;
mod forward;
mod forward_dynamics;
mod kinematics;
mod limits;
mod reactions;
mod singularity;

pub use checks::CONSTRAINT_TOLERANCE;
pub use coordinates::{Coordinates, coordinate_values, states};
pub use derivatives::{inverse_dynamics_derivatives, regressors};
pub use dynamics::{Loads, coupled_forces, inverse_dynamics, power};
pub use forward::{AllModes, assembly_modes, forward_kinematics};
pub use forward_dynamics::{Space, equations_of_motion, forward_dynamics};
pub use kinematics::{
    hessians, inverse_kinematics, jacobians, kinematics, platform_acceleration, platform_twist,
};
pub use singularity::{conditioning, determinants, nearest_singular, searched_coordinates, singularities};

pub use limits::limits;
pub use reactions::joint_reactions;

use crate::model::mechanism::Mechanism;
use crate::model::status::Status;
use crate::number::lanes::Lanes;
use crate::spatial::{Acceleration, Motion, Pose, Twist, Wrench};
use block::{At, Codes};
use checks::{any_pose, finite, with_legs, with_motion};

/// One output array: its row for a state has the given shape.
#[derive(Clone, Debug)]
pub struct Field {
    pub name: &'static str,
    pub shape: Vec<usize>,
    pub data: Vec<f64>,
}

/// The pose that sixteen numbers are, rows of the homogeneous matrix.
///
/// # Panics
/// If there are fewer.
#[must_use]
pub fn pose_of(matrix: &[f64]) -> Pose<f64> {
    checks::raw_pose(matrix, 0)
}

/// Named output arrays over the states; NaN where there is no answer.
#[derive(Clone, Debug)]
pub struct Table {
    pub fields: Vec<Field>,
    pub status: Vec<Status>,
}

/// The number of a field in its table.
#[derive(Clone, Copy, Debug)]
struct FieldId(usize);

/// Poses (16 numbers each, rows of the homogeneous matrix), twists and accelerations (6 each, or none at all
/// where everything is at rest) of the states.
#[derive(Clone, Copy, Debug)]
pub struct States<'a> {
    pub poses: &'a [f64],
    pub twists: &'a [f64],
    pub accelerations: &'a [f64],
}

impl States<'_> {
    #[must_use]
    pub fn len(&self) -> usize {
        self.poses.len() / 16
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// The states, and whether their poses are poses at all.
    #[inline(always)]
    fn platform<V: Lanes>(&self, at: At) -> (Motion<V>, Codes<V>) {
        let (pose, codes) = any_pose(self.poses, at);
        let twist = Twist::from_array(at.read_or_zero(self.twists));
        let acceleration = Acceleration::from_array(at.read_or_zero(self.accelerations));
        (Motion { pose, twist, acceleration }, codes)
    }

    /// The states, and whether they are ones that the mechanism can be in.
    #[inline(always)]
    fn at<V: Lanes>(&self, mech: &Mechanism, at: At) -> (Motion<V>, Codes<V>) {
        let (platform, codes) = self.platform(at);
        let codes = with_legs(mech, &platform.pose, codes);
        (platform, with_motion(mech, &platform, codes))
    }

    /// Motion of the states, with the load on the platform.
    #[inline(always)]
    fn loaded_at<V: Lanes>(
        &self,
        mech: &Mechanism,
        loads: &Loads,
        at: At,
    ) -> (Motion<V>, Wrench<V>, Codes<V>) {
        let (platform, codes) = self.at(mech, at);
        let load = loads.of(mech, &platform.pose, at);
        (platform, load, codes.unless(finite(&load.array()), Status::InvalidInput))
    }
}
