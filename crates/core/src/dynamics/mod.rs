pub mod base_parameters;
pub mod derivatives;
pub mod force_balance;
pub mod forward_dynamics;
pub mod inverse_dynamics;
pub mod joint_reactions;
pub mod regressor;
pub mod self_stress;
