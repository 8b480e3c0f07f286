pub mod base_parameters;
pub mod derivatives;
pub mod forward_dynamics;
pub mod inverse_dynamics;
pub mod joint_reactions;
pub mod redundant_actuation;
pub mod regressor;
pub mod self_stress;
