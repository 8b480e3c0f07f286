//! The equations of parallel manipulators on telescopic legs, generic over the number.
//!
//! Labels in brackets name their source: `[Eq. 26]` an equation of Lu, Liu, Zhang, Ye and Wang, "Dynamics analysis of
//! a novel 5-DoF parallel manipulator with couple-constrained wrench"; `[T6]` one of `docs/theory.md`.

#![cfg_attr(test, allow(dead_code))]

pub mod assembly;
pub mod base_parameters;
/// Left out of unit tests, as only it needs some of what is here: nothing takes as long to compile.
#[cfg(not(test))]
pub mod batch;
mod called;
pub mod chart;
pub mod clearance;
pub mod complex;
pub mod constraint;
pub mod coordinates;
pub mod derivatives;
mod draw;
pub mod dynamics;
pub mod forward;
pub mod forward_dynamics;
pub mod forward_lanes;
pub mod geometry;
pub mod idle;
pub mod inertial;
pub mod jacobian;
pub mod joints;
pub mod lanes;
pub mod lattice;
pub mod least;
pub mod leg;
pub mod limits;
pub mod linear;
pub mod mechanism;
pub mod mobility;
pub mod modes;
pub mod nearest;
mod orthogonal;
pub mod paths;
pub mod quadratic;
pub mod reach;
pub mod reactions;
pub mod real;
pub mod redundant;
pub mod roots;
pub mod screws;
mod self_stress;
pub mod singularity;
pub mod spatial;
pub mod spec;
pub mod status;
mod streaming;
mod study;
mod svd;
pub mod threads;
pub mod trig;
pub mod workspace;

// The tests of the modules use the mechanisms of the other tests.
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
#[cfg(test)]
extern crate self as polypod_core;
