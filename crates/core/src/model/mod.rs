pub mod drive;
pub mod joint;
pub mod limit;
pub mod mechanism;
pub mod spec;
pub mod spec_checks;
pub mod status;
