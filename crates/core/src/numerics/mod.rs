pub mod gauss;
pub mod hermite_roots;
pub mod householder;
pub mod random;
pub mod svd;
